"""Which tests demonstrate which claims: the `claims` marks of test files, read without importing them.

Understood are `@pytest.mark.claims("ID", ...)` on functions and classes, `pytestmark` of a module or a class,
`pytest.param(..., marks=...)`, and a module-level name that holds any of these.
"""

import ast
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from figures.errors import FigureError

Definition = ast.FunctionDef | ast.AsyncFunctionDef


@dataclass(frozen=True)
class Mark:
    """One claim id, the test that demonstrates it (`path::name`), and the line of the mark."""

    claim: str
    test: str
    line: int


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


def tests_by_claim(folder: Path, known: Iterable[str]) -> dict[str, list[str]]:
    """Claim id -> its tests; an unknown id is an error that names it and where it stands."""
    tests: dict[str, list[str]] = {id_: [] for id_ in known}
    for mark in marks(folder):
        if mark.claim not in tests:
            path = mark.test.partition("::")[0]
            raise FigureError(f"{path}:{mark.line}: {mark.test} is marked with unknown claim {mark.claim!r}")
        if mark.test not in tests[mark.claim]:
            tests[mark.claim].append(mark.test)
    return tests


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
    for call in _calls(expressions, scope.names, frozenset()):
        for argument in call.args:
            if not (isinstance(argument, ast.Constant) and isinstance(argument.value, str)):
                path = test.partition("::")[0]
                raise FigureError(f"{path}:{call.lineno}: the claims of {test} must be plain string literals")
            yield Mark(argument.value, test, call.lineno)


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
