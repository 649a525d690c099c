"""Sphinx's settings: what is documented how, and nothing that a reader's browser would have to fetch."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sphinx.application import Sphinx

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import sphinx.ext.autodoc  # noqa: F401  before names of its modules are replaced below
import sphinx.util.typing as typing_of_sphinx

from docs.site import api, layout, mathml, words
from restir_ref.batch import Array

project = "restir-ref"
author = "the restir-ref authors"
copyright = "the restir-ref authors, BSD-3-Clause"  # noqa: A001  (Sphinx calls it so)

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.autosummary", "sphinx.ext.linkcode"]
root_doc = "index"

myst_enable_extensions = ["dollarmath", "deflist", "attrs_inline"]
myst_heading_anchors = 4
myst_all_links_external = False

autosummary_generate = False
autodoc_default_options = {"members": True, "member-order": "bysource", "undoc-members": True, "no-value": True}
autodoc_preserve_defaults = True
autodoc_typehints = "signature"
autodoc_typehints_format = "short"
python_maximum_signature_line_length = 100
python_use_unqualified_type_names = True
toc_object_entries = False

html_theme = "furo"
html_title = "restir-ref"
html_static_path = [str(Path(__file__).parent / "static")]
html_css_files = ["site.css"]
html_math_renderer = "mathml"
html_copy_source = False
html_show_sourcelink = False
html_show_sphinx = False
html_theme_options: dict[str, Any] = {"footer_icons": [], "navigation_with_keys": False}
SIDEBAR = ("brand", "search", "scroll-start", "navigation", "scroll-end")
html_sidebars = {"**": [f"sidebar/{part}.html" for part in SIDEBAR]}
html_search_language = "en"


def arrays(annotation: Any, /, *args: Any, **options: Any) -> str:
    """A type in words; arrays of anything are called Array, as in the code."""
    return "Array" if annotation == Array else in_words(annotation, *args, **options)


in_words = typing_of_sphinx.stringify_annotation
for each in [module for name, module in sys.modules.items() if name.startswith("sphinx.")]:
    if vars(each).get("stringify_annotation") is in_words:
        each.stringify_annotation = arrays  # type: ignore[attr-defined]


def docstring(app: Sphinx, what: str, name: str, obj: Any, options: Any, lines: list[str]) -> None:
    """A docstring as this project writes it, in reStructuredText; that of a module stands on its page already."""
    module = api.owner(name)
    found = [] if what == "module" else words.rst("\n".join(lines), layout.module_place(module), api.resolver(module))
    lines[:] = found


def unsaid(app: Sphinx, what: str, name: str, obj: Any, skip: bool, options: Any) -> bool | None:  # noqa: FBT001
    """Names of a module that have no docstring and are no constants are types of its own: left out."""
    said = getattr(obj, "__doc__", "") or name.isupper()
    return True if what == "module" and not said else None


def linkcode_resolve(domain: str, info: dict[str, str]) -> str | None:
    """From an entry to its line in the code, as seen from a page of the reference."""
    module = layout.modules().get(info["module"])
    full = f"{info['module']}.{info['fullname']}"
    line = next((each.line for each in module.holds if each.name == full), 0) if module else 0
    return layout.way(api.INDEX, layout.code_place(module.path, line)) if module and line else None


def setup(app: Sphinx) -> None:
    """What this site adds to Sphinx."""
    app.add_html_math_renderer("mathml", (mathml.inline, None), (mathml.block, None))
    app.connect("autodoc-process-docstring", docstring)
    app.connect("autodoc-skip-member", unsaid)
