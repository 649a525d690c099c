"""A digest of the code that a figure's chunks depend on, so that results of older code are computed again.

It covers the theory, the figure's world, and of the figure modules what `chunks` and `compute` reach, name by name,
with the numbers in an `.npz` beside a module.  What runs after the chunks does not count, nor does where code stands
(`figures.engine.syntax`).
"""

import ast
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec
from pathlib import Path

from figures.engine import syntax

COMPUTING = frozenset({"chunks", "compute"})
JUDGING = COMPUTING | {"combine", "check"}
WHOLE = "*"
"""Stands for every name of a module."""

Place = tuple[str, str]  # module, name


@dataclass(frozen=True)
class Source:
    """A figure module: its file, the statements that bind each of its names, and what it imports from others."""

    path: Path
    binding: Mapping[str, list[ast.stmt]]
    imported: Mapping[str, Place]


def digest(module: str, world: str) -> str:
    """SHA-256, shortened, over the syntax trees of everything that computes the chunks of `module`."""
    files = [path for name in ("restir_ref", world) for path in _package(name)]
    theory = {part for path in files for part in _syntax(path) | syntax.numbers(path)}
    return syntax.total(theory | _reached(module, COMPUTING))


def own(module: str) -> str:
    """The same over figure modules alone, with what judges: on what a verdict depends besides theory and world."""
    return syntax.total(_reached(module, JUDGING))


@cache
def _syntax(path: Path) -> frozenset[bytes]:
    return syntax.statements(path, _root(path))


def _root(path: Path) -> Path:
    """The folder in which the module's outermost package stands."""
    return next(folder for folder in path.parents if not (folder / "__init__.py").exists())


@cache
def _package(name: str) -> tuple[Path, ...]:
    """The source files of a package; none for a world that is no package."""
    spec = find_spec(name)
    folders = (spec.submodule_search_locations if spec else None) or []
    return tuple(path for folder in folders for path in sorted(Path(folder).rglob("*.py")))


# ---------------------------------------------------------------- what a figure uses


def _reached(module: str, roots: frozenset[str]) -> frozenset[bytes]:
    """The statements that the named functions of a figure use, and the numbers beside the modules they stand in."""
    places = _closure(list(_called(module, roots)))
    used = {part for where, name in places for part in map(syntax.statement, _source(where).binding.get(name, []))}
    return frozenset(used).union(*(syntax.numbers(_source(where).path) for where, _ in places))


def _called(module: str, roots: frozenset[str]) -> Iterator[Place]:
    """What the roots' arguments of `FIGURE = Figure(...)` name; everything where it is made in another way."""
    for statement in _source(module).binding.get("FIGURE", []):
        call = getattr(statement, "value", None)
        arguments = {each.arg: each.value for each in call.keywords} if isinstance(call, ast.Call) else {}
        if roots <= set(arguments):
            yield from (place for root in roots for place in _named(module, arguments[root]))
            return
    yield module, WHOLE


def _closure(places: list[Place]) -> set[Place]:
    """The places and all that they use, directly or not."""
    seen: set[Place] = set()
    while places:
        place = places.pop()
        if place not in seen:
            seen.add(place)
            places += _used(*place)
    return seen


def _used(module: str, name: str) -> Iterator[Place]:
    """What one name of a module uses."""
    source = _source(module)
    if name == WHOLE:
        yield from ((module, each) for each in [*source.binding, *source.imported])
    if name in source.imported:
        yield source.imported[name]
    for node in source.binding.get(name, []):
        yield from _named(module, node)


def _named(module: str, node: ast.AST) -> Iterator[Place]:
    """What an expression or statement of a module names: names beside it, and names of other figure modules."""
    source = _source(module)
    for name, attribute in _names(node):
        there, what = source.imported.get(name, (module, name))
        if what == WHOLE and attribute:
            yield there, attribute
        elif name in source.imported or name in source.binding:
            yield module, name


def _names(node: ast.AST) -> Iterator[tuple[str, str]]:
    """Names in an expression or statement, each with the attribute asked of it, if there is one."""
    if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
        yield node.value.id, node.attr
        return
    if isinstance(node, ast.Name):
        yield node.id, ""
    for child in ast.iter_child_nodes(node):
        yield from _names(child)


@cache
def _source(module: str) -> Source:
    """A figure module, read."""
    spec = find_spec(module)
    path = Path(spec.origin or "") if spec else Path()
    binding: dict[str, list[ast.stmt]] = {}
    imported: dict[str, Place] = {}
    for node in syntax.placeless(path, _root(path)).body:
        for name in _bound(node):
            binding.setdefault(name, []).append(node)
    for node in ast.parse(path.read_bytes()).body:
        if isinstance(node, ast.ImportFrom) and (node.module or "").partition(".")[0] == "figures":
            imported |= {alias.asname or alias.name: _place(node.module or "", alias.name) for alias in node.names}
    return Source(path, binding, imported)


def _place(module: str, name: str) -> Place:
    """`from figures.wing import x` is all of figures.wing.x, `from figures.wing.x import y` one name of it."""
    spec = find_spec(module)
    is_package = spec is not None and spec.submodule_search_locations is not None
    return (f"{module}.{name}", WHOLE) if is_package else (module, name)


def _bound(node: ast.stmt) -> Iterator[str]:
    """The names that a statement of a module binds, imports aside."""
    if isinstance(node, ast.FunctionDef | ast.ClassDef):
        yield node.name
    targets = node.targets if isinstance(node, ast.Assign) else [node.target] if isinstance(node, ast.AnnAssign) else []
    yield from (each.id for target in targets for each in ast.walk(target) if isinstance(each, ast.Name))
