"""The checkout as data for the laws about it: its files, its modules, and offenders planted in a copy."""

import ast
import os
import re
from collections.abc import Iterable, Iterator
from pathlib import Path
from textwrap import dedent
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[1]
WORLDS = ("toy1d", "flatland2d", "tracer3d")
MADE = re.compile(r"\.(?!ci$|github$)|__pycache__$|build$|dist$|out$|out-|.*\.egg-info$")


class Module(NamedTuple):
    """A parsed file of one of our packages."""

    name: str
    path: Path
    tree: ast.Module


def files(root: Path) -> Iterator[Path]:
    """Every file of a checkout but results, caches and environments."""
    for folder, folders, names in os.walk(root):
        folders[:] = sorted(name for name in folders if not MADE.match(name))
        yield from (Path(folder, name) for name in sorted(names))


def modules(root: Path, packages: Iterable[str]) -> Iterator[Module]:
    """The parsed files of top-level packages, where they exist."""
    for package in packages:
        for path in sorted((root / package).rglob("*.py")):
            name = ".".join(path.relative_to(root).with_suffix("").parts).removesuffix(".__init__")
            yield Module(name, path, ast.parse(path.read_text(encoding="utf-8")))


def plant(root: Path, path: str, text: str) -> Path:
    """Write an offender below root; returns root."""
    (root / path).parent.mkdir(parents=True, exist_ok=True)
    (root / path).write_text(dedent(text), encoding="utf-8")
    return root
