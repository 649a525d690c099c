"""A digest of the code that a figure's chunks depend on, so that results of older code are computed again.

It covers the theory, the figure's world, and the figure's module with the figure modules that it imports, each with the
numbers in an `.npz` of its name.  Comments and layout do not count.
"""

import ast
import hashlib
from collections.abc import Iterator
from functools import cache
from importlib.util import find_spec
from pathlib import Path

ENGINE = frozenset({"figures.criteria", "figures.figure", "figures.style"})  # they judge and draw, after the chunks


def digest(module: str, world: str) -> str:
    """SHA-256, shortened, over the syntax trees of everything that computes the chunks of `module`."""
    total = hashlib.sha256()
    for path in [*_package("restir_ref"), *_package(world), *_figure_files(module)]:
        total.update(_syntax(path))
        total.update(_data(path.with_suffix(".npz")))
    return total.hexdigest()[:16]


@cache
def _syntax(path: Path) -> bytes:
    return hashlib.sha256(ast.dump(ast.parse(path.read_bytes())).encode()).digest()


def _data(path: Path) -> bytes:
    """Numbers that a module keeps in a file of its own name, such as reference images."""
    return hashlib.sha256(path.read_bytes()).digest() if path.exists() else b""


@cache
def _package(name: str) -> tuple[Path, ...]:
    """The source files of a package; none for a world that is no package."""
    spec = find_spec(name)
    folders = (spec.submodule_search_locations if spec else None) or []
    return tuple(path for folder in folders for path in sorted(Path(folder).rglob("*.py")))


def _figure_files(module: str) -> Iterator[Path]:
    """The module's file and those of the figure modules that it imports, each once."""
    seen, to_read = {module}, [module]
    while to_read:
        spec = find_spec(to_read.pop())
        if spec is None or spec.origin is None:
            continue
        path = Path(spec.origin)
        yield path
        new = sorted(_imported(path) - seen - ENGINE)
        seen.update(new)
        to_read += new


def _imported(path: Path) -> set[str]:
    """Modules below `figures` that a file imports by `from figures.x import y` or `from figures import x`."""
    nodes = [node for node in ast.walk(ast.parse(path.read_bytes())) if isinstance(node, ast.ImportFrom)]
    names = {node.module for node in nodes if node.module and node.module.startswith("figures.")}
    return names | {f"figures.{alias.name}" for node in nodes if node.module == "figures" for alias in node.names}
