"""Where everything is on the site: a file of the checkout, a module or a figure, and its page.

A place is a path below the site's root, `api/restir_ref.mis.html`; `way` leads from one place to another.
"""

import ast
import posixpath
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from figures.engine import registry
from figures.project import Project

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("restir_ref", "toy1d", "flatland2d", "tracer3d")
FOLDERS = (*PACKAGES, "figures", "notebooks", "docs", "benchmarks", "tests")
TEXTS = {".py", ".md", ".toml", ".json", ".css", ".txt", ".cff", ".hlsl", ".ipynb", ".html", ".js", ""}
LARGEST = 400_000
"""Bytes of the largest file that gets a page of code."""

ALONE = {
    "README.md": "readme",
    "CONTRIBUTING.md": "contributing",
    "CHANGELOG.md": "changelog",
    "docs/site/index.md": "index",
}


@cache
def files() -> tuple[str, ...]:
    """The files of the checkout that a page can be about, by their paths below its root."""
    found = [path for path in ROOT.iterdir() if path.is_file()]
    found += [path for folder in FOLDERS for path in (ROOT / folder).rglob("*") if path.is_file()]
    names = (path.relative_to(ROOT).as_posix() for path in sorted(found))
    return tuple(name for name in names if "__pycache__" not in name and not name.startswith(".git"))


@cache
def pages() -> Mapping[str, str]:
    """Markdown file of the checkout -> its page's name, without an ending."""
    return {name: place for name in files() if name.endswith(".md") and (place := _page(name))}


def _page(name: str) -> str:
    if name in ALONE:
        return ALONE[name]
    if not name.startswith("docs/"):
        return ""
    return re.sub(r"(^|/)README$", r"\1index", name.removeprefix("docs/").removesuffix(".md"))


@cache
def figures() -> Mapping[str, str]:
    """File of a figure's module -> the figure's id."""
    entries = registry.load(Project().modules)
    return {entry.module.replace(".", "/") + ".py": id_ for id_, entry in entries.items()}


@dataclass(frozen=True)
class Named:
    """A public function, class or method: its full name, its kind, its line, and its docstring."""

    name: str
    kind: str
    line: int
    doc: str


@dataclass(frozen=True)
class Module:
    """A module with a page of its own: dotted name, file, docstring, and what is public in it, in order."""

    name: str
    path: str
    doc: str
    holds: tuple[Named, ...]


@cache
def modules() -> Mapping[str, Module]:
    """The modules of the packages by dotted name, those that are commands and nothing else left out."""
    paths = (path for package in PACKAGES for path in sorted((ROOT / package).rglob("*.py")))
    found = (_module(path) for path in paths if path.stem != "__main__" and "__pycache__" not in path.parts)
    return {module.name: module for module in found}


def _module(path: Path) -> Module:
    name = path.relative_to(ROOT).with_suffix("").as_posix().replace("/", ".").removesuffix(".__init__")
    tree = ast.parse(path.read_bytes())
    held = tuple(_held(tree, name)) if path.stem != "__init__" else ()
    return Module(name, path.relative_to(ROOT).as_posix(), ast.get_docstring(tree) or "", held)


def _held(node: ast.Module | ast.ClassDef, prefix: str) -> Iterator[Named]:
    for each in node.body:
        if isinstance(each, ast.FunctionDef | ast.ClassDef) and not each.name.startswith("_"):
            kind = "class" if isinstance(each, ast.ClassDef) else "function"
            yield Named(f"{prefix}.{each.name}", kind, each.lineno, ast.get_docstring(each) or "")
            if isinstance(each, ast.ClassDef):
                yield from _held(each, f"{prefix}.{each.name}")


def module_place(name: str) -> str:
    """The page of a module."""
    return f"api/{name}.html"


def place(path: str) -> str:
    """The page of a file or folder of the checkout; empty where there is none."""
    path = path.strip("/")
    dotted = path.removesuffix(".py").removesuffix("/__init__").replace("/", ".")
    if path in pages():
        return f"{pages()[path]}.html"
    if dotted in modules():
        return module_place(dotted)
    if path in figures():
        return f"figures/{figures()[path]}.html"
    if path in files():
        return f"code/{path}.html" if listed(path) else ""
    return _folder(path)


def _folder(path: str) -> str:
    if path in ("figures", "notebooks"):
        return f"{path}/index.html"
    inside = any(name.startswith(f"{path}/") for name in files())
    return f"code/index.html#{path}" if path and inside else ""


def listed(path: str) -> bool:
    """Whether a file has a page that shows its text."""
    whole = ROOT / path
    return whole.suffix in TEXTS and whole.stat().st_size <= LARGEST


def code_place(path: str, line: int = 0) -> str:
    """The page that shows a file's text, at a line."""
    return f"code/{path}.html" + (f"#L-{line}" if line else "")


def way(here: str, there: str) -> str:
    """The link from one place to another."""
    page, mark, anchor = there.partition("#")
    return posixpath.relpath(page, posixpath.dirname(here) or ".") + mark + anchor
