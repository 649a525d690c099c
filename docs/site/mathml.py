"""Formulas as MathML, written into the page when it is built: nothing runs or is fetched when it is read."""

import re
from html import escape

from docutils import nodes
from latex2mathml.converter import convert
from sphinx.writers.html5 import HTML5Translator

TAG = re.compile(r"\\tag\{([^}]*)\}")
SIZES = re.compile(r"\\(?:[bB]ig+[lrm]?)(?=[^a-zA-Z])")
"""Sizes of delimiters, which MathML finds by itself."""


def inline(self: HTML5Translator, node: nodes.math) -> None:
    """A formula in a line."""
    self.body.append(written(node.astext(), "inline"))
    raise nodes.SkipNode


def block(self: HTML5Translator, node: nodes.math_block) -> None:
    """A formula of its own, its number at the right."""
    text = node.astext()
    number = "".join(f'<span class="eqno">({escape(tag)})</span>' for tag in TAG.findall(text))
    self.body.append(f'<div class="math">{number}{written(TAG.sub("", text), "block")}</div>\n')
    raise nodes.SkipNode


def written(latex: str, display: str) -> str:
    """LaTeX as MathML.  Raises ValueError for a command that is not known and would be shown as its name."""
    found: str = convert(SIZES.sub("", latex.strip()), display=display)
    unknown = re.findall(r"\\[a-zA-Z]+", re.sub(r"<annotation.*?</annotation>", "", found, flags=re.DOTALL))
    if unknown:
        raise ValueError(f"the formula {latex!r} has {unknown}, which MathML is not made of: write it otherwise.")
    return found
