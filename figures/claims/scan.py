"""Which tests demonstrate which claims: the `claims` marks of test files, read without importing them.

Understood are `@pytest.mark.claims("ID", ...)` on functions and classes, `pytestmark` of a module or a class,
`pytest.param(..., marks=...)`, and a module-level name that holds any of these.  Two keywords say more: `part="..."`
where the test shows a part of the row only, and `world="..."` where the folder does not tell the world.

A benchmark's row with a requirement, `Row(..., claims="ID")`, is found in the same way.
"""

import ast
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from figures.claims.errors import FigureError

WORLDS = {
    **dict.fromkeys(("toy1d", "core", "oracle"), "toy1d"),
    **dict.fromkeys(("flatland", "transport"), "flatland2d"),
    "tracer3d": "tracer3d",
}
"""What the folders of tests are about; all others are units, such as the engine."""

Definition = ast.FunctionDef | ast.AsyncFunctionDef


@dataclass(frozen=True)
class Mark:
    """One claim id, the test that demonstrates it (`path::name`), the line of the mark, its world, and which part."""

    claim: str
    test: str
    line: int
    world: str
    part: str


@dataclass(frozen=True)
class _Scope:
    """What applies to the tests of a module or class: its node name, inherited marks, module-level names."""

    node: str
    inherited: tuple[ast.expr, ...]
    names: Mapping[str, ast.expr]


def marks(folder: Path) -> Iterator[Mark]:
    """All marks under `folder`; paths start with the folder's own name."""
    for path in sorted(folder.rglob("*.py")):
        yield from _marks_of(path, path.relative_to(folder.parent).as_posix())


def marks_by_claim(folder: Path, known: Iterable[str]) -> dict[str, list[Mark]]:
    """Claim id -> its marks, each test once; an unknown id is an error that names it and where it stands."""
    found: dict[str, list[Mark]] = {id_: [] for id_ in known}
    for mark in marks(folder):
        if mark.claim not in found:
            path = mark.test.partition("::")[0]
            raise FigureError(f"{path}:{mark.line}: {mark.test} is marked with unknown claim {mark.claim!r}")
        if mark not in found[mark.claim]:
            found[mark.claim].append(mark)
    return found


def benchmarks_by_claim(folder: Path) -> dict[str, list[str]]:
    """Claim id -> the scripts with a row that names it."""
    found: dict[str, list[str]] = {}
    for path in sorted(folder.glob("bench_*.py")):
        for call in (node for node in ast.walk(ast.parse(path.read_bytes())) if isinstance(node, ast.Call)):
            for text in (k.value for k in call.keywords if k.arg == "claims" and isinstance(k.value, ast.Constant)):
                for id_ in str(text.value).split(", "):
                    found.setdefault(id_, []).append(f"{folder.name}/{path.name}")
    return {id_: list(dict.fromkeys(paths)) for id_, paths in found.items()}


def _marks_of(path: Path, name: str) -> Iterator[Mark]:
    try:
        tree = ast.parse(path.read_text(encoding="utf-8"))
    except (OSError, SyntaxError, ValueError) as error:
        raise FigureError(f"cannot read the marks of {name}: {error}") from error
    names = dict(_assigned(tree.body))
    yield from _walk(tree.body, _Scope(name, (), names))


def _walk(body: list[ast.stmt], outer: _Scope) -> Iterator[Mark]:
    own = [value for name, value in _assigned(body) if name == "pytestmark"]
    scope = _Scope(outer.node, (*outer.inherited, *own), outer.names)
    for node in body:
        if isinstance(node, Definition) and node.name.startswith("test"):
            yield from _collect(f"{scope.node}::{node.name}", [*scope.inherited, *node.decorator_list], scope)
        elif isinstance(node, ast.ClassDef):
            marked = (*scope.inherited, *node.decorator_list)
            yield from _walk(node.body, _Scope(f"{scope.node}::{node.name}", marked, scope.names))


def _assigned(body: list[ast.stmt]) -> Iterator[tuple[str, ast.expr]]:
    for node in body:
        targets = node.targets if isinstance(node, ast.Assign) else []
        targets = [node.target] if isinstance(node, ast.AnnAssign) else targets
        value = getattr(node, "value", None)
        for target in targets:
            if isinstance(target, ast.Name) and value is not None:
                yield target.id, value


def _collect(test: str, expressions: list[ast.expr], scope: _Scope) -> Iterator[Mark]:
    path = test.partition("::")[0]
    for call in _calls(expressions, scope.names, frozenset()):
        said = {keyword.arg: keyword.value for keyword in call.keywords}
        if not set(said) <= {"part", "world"} or not all(_is_text(value) for value in [*call.args, *said.values()]):
            raise FigureError(
                f"{path}:{call.lineno}: the claims of {test} must be plain string literals, "
                "with part= and world= at most"
            )
        ids, texts = map(ast.literal_eval, call.args), {key: ast.literal_eval(value) for key, value in said.items()}
        for id_ in ids:
            yield Mark(id_, test, call.lineno, texts.get("world") or _world(path), texts.get("part", ""))


def _is_text(node: ast.expr) -> bool:
    return isinstance(node, ast.Constant) and isinstance(node.value, str)


def _world(path: str) -> str:
    """The world of a test by the folder it stands in."""
    folders = path.split("/")
    return WORLDS.get(folders[1], "unit") if len(folders) > 2 else "unit"


def _calls(expressions: Iterable[ast.expr], names: Mapping[str, ast.expr], seen: frozenset[str]) -> Iterator[ast.Call]:
    """The `claims(...)` calls in the expressions and in the module-level names they use."""
    for node in (node for expression in expressions for node in ast.walk(expression)):
        if isinstance(node, ast.Call) and _is_mark(node.func, names):
            yield node
        elif isinstance(node, ast.Name) and node.id in names and node.id not in seen:
            yield from _calls([names[node.id]], names, seen | {node.id})


def _is_mark(function: ast.expr, names: Mapping[str, ast.expr]) -> bool:
    if isinstance(function, ast.Name):
        function = names.get(function.id, function)
    return ast.unparse(function).endswith("mark.claims")
