"""What the page reads from the sources: which code says which equation, and what every scene is."""

import ast
import re
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from figures.claims.figure import Entry
from figures.report.markup import sentences

PACKAGES = ("restir_ref", "toy1d", "flatland2d", "tracer3d")
CITED = re.compile(r"\[([A-Z]{3,}) ([^\]]*)\]")
NUMBER = re.compile(r"(Eqs?\.|Def\.|Thm\.|Theorem|Fig\.|Sec\.)? ?(\d+(?:\.\d+)*|A\.\d)(?:[-–](\d+))?")
SCENE = re.compile(r"(FS\d+|T\d+|T[A-Z]|[A-Z]\w*3(?:-\w+)?): (.*)", re.DOTALL)
OF_ONE_KIND = {"Eqs.": "Eq.", "Theorem": "Thm.", "": "Sec."}


@dataclass(frozen=True)
class Place:
    """A function, class or module by its file in the checkout, its line, and its name."""

    path: str
    line: int
    name: str


def about(entry: Entry) -> str:
    """What the docstring of a figure's module says."""
    return sys.modules[entry.module].__doc__ or ""


@cache
def cited(root: Path) -> Mapping[tuple[str, str], tuple[Place, ...]]:
    """(paper, "Eq. 36") -> the functions and classes whose docstrings cite it."""
    found: dict[tuple[str, str], list[Place]] = {}
    for place, text in _docstrings(root):
        for paper, inside in CITED.findall(text):
            for name in dict.fromkeys(numbers(inside)):
                found.setdefault((paper, name), []).append(place)
    return {key: tuple(places) for key, places in found.items()}


def numbers(text: str) -> Iterator[str]:
    """The numbers in "Eq. 17, 36-38": Eq. 17, Eq. 36, Eq. 37, Eq. 38; numbers without a kind are sections."""
    kind = ""
    for found, first, last in NUMBER.findall(text):
        kind = found or kind
        of = OF_ONE_KIND.get(kind, kind)
        yield f"{of} {first}"
        if last and first.isdigit():
            yield from (f"{of} {number}" for number in range(int(first) + 1, int(last) + 1))


@cache
def scenes(root: Path) -> Mapping[str, str]:
    """Scene -> what its function's docstring says of it, in one sentence."""
    found = (SCENE.match(text) for _, text in _docstrings(root))
    said = {match[1]: sentences(match[2].partition("\n\n")[0])[0] for match in found if match}
    return {name: text[:1].upper() + text[1:] for name, text in said.items()}


def _docstrings(root: Path) -> Iterator[tuple[Place, str]]:
    for path in (path for package in PACKAGES for path in sorted((root / package).rglob("*.py"))):
        tree, name = ast.parse(path.read_bytes()), path.relative_to(root).as_posix()
        for node in ast.walk(tree):
            if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef):
                line, called = getattr(node, "lineno", 1), getattr(node, "name", path.stem)
                yield Place(name, line, called), ast.get_docstring(node) or ""
