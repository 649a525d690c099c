"""All mutants of a module: its source with one small change at one place of its syntax tree.

Types, imports, decorators of classes, words (docstrings and messages) and the looks of pictures are left alone.
"""

import ast
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

from changes import changes
from groups import LOOKS, OWN_MISTAKES

KEPT = 60
"""Characters shown on either side of a change."""
TYPES = ("Callable[", "tuple[", "Array | ")
"""What a value begins with that is the name of a type."""
UNCHANGED = ("annotation", "returns", "type_comment", "ctx", "decorator_list")


@dataclass(frozen=True)
class Mutant:
    """A module's source with one change, which its name shows within its line as {before => after}."""

    module: str
    line: int
    name: str
    source: str

    @property
    def place(self) -> str:
        """The file and the line."""
        return f"{self.module.replace('.', '/')}.py:{self.line}"

    @property
    def scope(self) -> str:
        """The full name of the function around it, of the class or the module if there is none."""
        return ".".join(filter(None, (self.module, self.name.partition(": ")[0].partition(".")[2])))


@dataclass(frozen=True)
class Place:
    """A node of a tree, how to replace it, the functions around it, and the types of their parameters."""

    node: ast.AST
    put: Callable[[ast.AST], None]
    scope: str
    types: Mapping[str, str]

    @property
    def alike(self) -> list[str]:
        """Other parameters of the same type, where the node is the name of one."""
        if not (isinstance(self.node, ast.Name) and isinstance(self.node.ctx, ast.Load)):
            return []
        kind = self.types.get(self.node.id)
        return [name for name, other in self.types.items() if other == kind and name != self.node.id]


def mutants(file: str, source: str) -> Iterator[Mutant]:
    """Every distinct change of a module."""
    module = file.removesuffix(".py").replace("/", ".")
    tree = ast.parse(source)
    before = ast.unparse(tree)
    seen = {before}
    for place in places(tree, module.rpartition(".")[2], {}):
        for node in changes(place.node, place.alike):
            place.put(ast.copy_location(node, place.node))
            after = ast.unparse(tree)
            place.put(place.node)
            if after not in seen:
                seen.add(after)
                yield Mutant(module, line(place.node), f"{place.scope}: {shown(before, after)}", after)


def shown(before: str, after: str) -> str:
    """What stays on the left, {before => after}, what stays on the right: of the lines that differ."""
    old, new = before.splitlines(), after.splitlines()
    same = shared(old, new)
    old, new = old[same:], new[same:]
    same = shared(old[::-1], new[::-1])
    a, b = ("; ".join(each.strip() for each in lines[: len(lines) - same]) for lines in (old, new))
    words = [re.findall(r"\w+|\W", each) for each in (a, b)]
    left = shared(*words)
    right = shared(*(each[left:][::-1] for each in words))
    was, now = ("".join(each[left : len(each) - right]) for each in words)
    stays = "".join(words[0][:left]), "".join(words[0][len(words[0]) - right :])
    return f"{stays[0][-KEPT:]}{{{was} => {now}}}{stays[1][:KEPT]}"


def shared(a: list[str], b: list[str]) -> int:
    """How many items two lists share at the front."""
    return next((k for k, (x, y) in enumerate(zip(a, b, strict=False)) if x != y), min(len(a), len(b)))


def line(node: ast.AST) -> int:
    """The line of a node, or of its first part that has one."""
    return next(int(each.lineno) for each in ast.walk(node) if hasattr(each, "lineno"))


# ---------------------------------------------------------------- places


def places(node: ast.AST, scope: str, types: Mapping[str, str]) -> Iterator[Place]:
    """Every node below a node that may be changed."""
    for field, value in ast.iter_fields(node):
        if field in UNCHANGED:
            continue
        for child, put in slots(node, field, value):
            if not is_left_alone(child):
                inner, known = within(child, scope, types)
                yield Place(child, put, inner, known)
                yield from places(child, inner, known)


def slots(node: ast.AST, field: str, value: Any) -> Iterator[tuple[ast.AST, Callable[[ast.AST], None]]]:
    """The children in one field, each with how to replace it."""
    if isinstance(value, ast.AST):
        yield value, partial(setattr, node, field)
    elif isinstance(value, list):
        children = ((k, child) for k, child in enumerate(value) if isinstance(child, ast.AST))
        yield from ((child, partial(value.__setitem__, k)) for k, child in children)


def is_left_alone(node: ast.AST) -> bool:
    """Imports, messages, docstrings, names for types, what is exported, and how pictures look."""
    match node:
        case ast.Import() | ast.ImportFrom() | ast.JoinedStr() | ast.Raise() | ast.Expr(value=ast.Constant()):
            return True
        case ast.Assign(targets=[ast.Name(id="__all__")]) | ast.If(test=ast.Name(id="TYPE_CHECKING")):
            return True
        case ast.ClassDef(bases=[ast.Name(id="Protocol")]):
            return True
        case ast.keyword(arg=word):
            return word in LOOKS | OWN_MISTAKES
    return isinstance(node, ast.Assign) and ast.unparse(node.value).startswith(TYPES)


def within(node: ast.AST, scope: str, types: Mapping[str, str]) -> tuple[str, Mapping[str, str]]:
    """The scope inside a node, and the types of all parameters there."""
    if isinstance(node, ast.FunctionDef):
        typed = {each.arg: ast.unparse(each.annotation) for each in node.args.args if each.annotation}
        return f"{scope}.{node.name}", {**types, **typed}
    return (f"{scope}.{node.name}", {}) if isinstance(node, ast.ClassDef) else (scope, types)
