"""All small changes of one expression or statement: what somebody could get wrong there.

`changes` takes a node of a syntax tree and yields the nodes that may stand in its place.
"""

import ast
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any

from groups import FOR_TYPES, LOOKS, OWN_MISTAKES

OPERATORS: Mapping[type, type[ast.operator]] = {
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
    ast.Pow: ast.Mult,
    ast.Mod: ast.Mult,
    ast.FloorDiv: ast.Mult,
}
COMPARISONS: Mapping[type, tuple[type[ast.cmpop], ...]] = {
    ast.Lt: (ast.LtE, ast.GtE),
    ast.LtE: (ast.Lt, ast.Gt),
    ast.Gt: (ast.GtE, ast.LtE),
    ast.GtE: (ast.Gt, ast.Lt),
    ast.Eq: (ast.NotEq,),
    ast.NotEq: (ast.Eq,),
    ast.Is: (ast.IsNot,),
    ast.IsNot: (ast.Is,),
    ast.In: (ast.NotIn,),
    ast.NotIn: (ast.In,),
}


def both_ways(*pairs: tuple[str, str]) -> dict[str, str]:
    """Each word for the other."""
    return {a: b for pair in pairs for a, b in (pair, pair[::-1])}


# Words of NumPy and of this package that people mistake for one another.
FUNCTIONS = both_ways(("minimum", "maximum"), ("min", "max"), ("any", "all"), ("ones", "zeros")) | {"sum": "max"}
ATTRIBUTES = both_ways(("W", "c"), ("C_R", "C_N"), ("p_hat", "mW"), ("others", "canonical"))
ATTRIBUTES |= {"C": "C_N", "m": "c", "kept": "w_sum"}
NAMES = {
    **both_ways(("ANY", "CANONICAL_COVERS"), ("pairwise", "defensive"), ("constant", "one_over_z")),
    "ALL_CANONICAL": "ANY",
    "talbot": "pairwise",
    "target": "(lambda at, x: np.ones(len(at.index)))",
    "total": "(lambda terms: terms[0])",
    "ratio": "np.divide",
}
KEYS = both_ways(("talbot", "defensive"), ("pairwise", "1/Z")) | {"constant": "talbot"}
COMMUTATIVE = ("minimum", "maximum", "min", "max")
"""Functions whose arguments may stand in any order."""
OF_ALIKE = ("ratio", "minimum", "maximum", "where")
"""Functions any of whose arguments may stand in for the result."""


def changes(node: ast.AST, alike: Iterable[str]) -> Iterator[ast.AST]:
    """What may stand in the place of a node; `alike` are the names that could be mistaken for it."""
    yield from (ast.Name(each, ast.Load()) for each in alike)
    if type(node) in CHANGES:
        yield from CHANGES[type(node)](node)


def operation(node: ast.BinOp) -> Iterator[ast.AST]:
    """Another operator; either side alone."""
    if type(node.op) in OPERATORS:
        yield ast.BinOp(node.left, OPERATORS[type(node.op)](), node.right)
    yield from (node.left, node.right)


def sign(node: ast.UnaryOp) -> Iterator[ast.AST]:
    """No sign, no negation."""
    yield node.operand


def comparison(node: ast.Compare) -> Iterator[ast.AST]:
    """With the border, without it, the other way round."""
    yield from (ast.Compare(node.left, [op()], node.comparators) for op in COMPARISONS[type(node.ops[0])])


def logic(node: ast.BoolOp) -> Iterator[ast.AST]:
    """and for or; one of the conditions left out."""
    yield ast.BoolOp(ast.Or() if isinstance(node.op, ast.And) else ast.And(), node.values)
    yield from (ast.BoolOp(node.op, rest) if rest[1:] else rest[0] for rest in shorter(node.values))


def number(node: ast.Constant) -> Iterator[ast.AST]:
    """One more, one less; not."""
    if isinstance(node.value, bool):
        yield ast.Constant(not node.value)
    elif isinstance(node.value, int | float):
        yield from (ast.Constant(node.value + by) for by in (1, -1))


def branch(node: ast.IfExp) -> Iterator[ast.AST]:
    """Branches swapped; one of them always."""
    yield ast.IfExp(node.test, node.orelse, node.body)
    yield from (node.body, node.orelse)


def guard(node: ast.If) -> Iterator[ast.AST]:
    """Condition negated; always; never."""
    yield ast.If(ast.UnaryOp(ast.Not(), node.test), node.body, node.orelse)
    yield from (ast.If(ast.Constant(always), node.body, node.orelse) for always in (True, False))


def call(node: ast.Call) -> Iterator[ast.AST]:
    """Arguments swapped or left out, another function, or no function at all."""
    arguments = [each for each in node.args if not isinstance(each, ast.Starred)]
    if name(node.func) not in COMMUTATIVE:
        yield from (ast.Call(node.func, args, node.keywords) for args in swapped(node.args))
    matter = [each for each in node.keywords if each.arg not in LOOKS | OWN_MISTAKES]
    for left_out in matter:
        yield ast.Call(node.func, node.args, [each for each in node.keywords if each is not left_out])
    if len(node.args) > 1:
        yield ast.Call(node.func, node.args[:-1], node.keywords)
    if not name(node.func)[:1].isupper() and name(node.func) not in FOR_TYPES:
        yield from arguments if name(node.func) in OF_ALIKE else arguments[:1]
    if isinstance(node.func, ast.Attribute) and not arguments:
        yield node.func.value
    if name(node.func) in FUNCTIONS:
        yield ast.Call(renamed(node.func, FUNCTIONS[name(node.func)]), node.args, node.keywords)
    if name(node.func) == "range":
        yield ast.Call(node.func, [ast.Constant(1), *node.args][-2:], [])


def attribute(node: ast.Attribute) -> Iterator[ast.AST]:
    """Another field."""
    if isinstance(node.ctx, ast.Load) and node.attr in ATTRIBUTES:
        yield renamed(node, ATTRIBUTES[node.attr])


def variable(node: ast.Name) -> Iterator[ast.AST]:
    """Another member of the family."""
    if isinstance(node.ctx, ast.Load) and node.id in NAMES:
        yield ast.parse(NAMES[node.id], mode="eval").body


def item(node: ast.Subscript) -> Iterator[ast.AST]:
    """Another key."""
    if isinstance(node.slice, ast.Constant) and node.slice.value in KEYS:
        yield ast.Subscript(node.value, ast.Constant(KEYS[node.slice.value]), node.ctx)


def display(node: ast.List | ast.Tuple) -> Iterator[ast.AST]:
    """Neighbours swapped; one element of a list left out."""
    if isinstance(node.ctx, ast.Load):
        is_list = isinstance(node, ast.List) or all(isinstance(each, ast.Tuple) for each in node.elts)
        fewer = shorter(node.elts) if is_list else []
        yield from (type(node)(elements, node.ctx) for elements in (*fewer, *swapped(node.elts)))


def dictionary(node: ast.Dict) -> Iterator[ast.AST]:
    """One entry left out."""
    yield from (ast.Dict(keys, values) for keys, values in zip(shorter(node.keys), shorter(node.values), strict=True))


def filters(node: ast.comprehension) -> Iterator[ast.AST]:
    """No condition."""
    yield from (ast.comprehension(node.target, node.iter, rest, node.is_async) for rest in shorter(node.ifs))


def removed(node: ast.stmt) -> Iterator[ast.AST]:
    """No statement."""
    yield ast.Pass()


def updated(node: ast.Assign) -> Iterator[ast.AST]:
    """No assignment, where the name has a value already."""
    if any(name(each) == name(node.targets[0]) for each in ast.walk(node.value)):
        yield ast.Pass()


def function(node: ast.FunctionDef) -> Iterator[ast.AST]:
    """One decorator left out."""
    for rest in shorter(node.decorator_list):
        yield ast.FunctionDef(node.name, node.args, node.body, rest, node.returns)


CHANGES: Mapping[type[ast.AST], Callable[[Any], Iterator[ast.AST]]] = {
    ast.BinOp: operation,
    ast.UnaryOp: sign,
    ast.Compare: comparison,
    ast.BoolOp: logic,
    ast.Constant: number,
    ast.IfExp: branch,
    ast.If: guard,
    ast.Call: call,
    ast.Attribute: attribute,
    ast.Name: variable,
    ast.Subscript: item,
    ast.List: display,
    ast.Tuple: display,
    ast.Dict: dictionary,
    ast.comprehension: filters,
    ast.Expr: removed,
    ast.For: removed,
    ast.AugAssign: removed,
    ast.Assign: updated,
    ast.FunctionDef: function,
}


def shorter(items: list[Any]) -> list[list[Any]]:
    """All lists with one item left out."""
    return [items[:k] + items[k + 1 :] for k in range(len(items))]


def swapped(items: list[Any]) -> list[list[Any]]:
    """All lists with two neighbours swapped that are not both prose."""
    places = (k for k in range(len(items) - 1) if not (is_prose(items[k]) and is_prose(items[k + 1])))
    return [[*items[:k], items[k + 1], items[k], *items[k + 2 :]] for k in places]


def is_prose(node: ast.AST) -> bool:
    """Whether a node is a text of several words."""
    return isinstance(node, ast.Constant) and " " in str(node.value)


def name(node: ast.AST) -> str:
    """The last word of a name."""
    return str(getattr(node, "attr", getattr(node, "id", "")))


def renamed(node: ast.AST, to: str) -> ast.expr:
    """The name with another last word."""
    return ast.Attribute(node.value, to, node.ctx) if isinstance(node, ast.Attribute) else ast.Name(to, ast.Load())
