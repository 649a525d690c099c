"""What code says, whatever the words around it and wherever it stands: the basis of all digests of code.

Comments, docstrings and layout do not count, nor do the folder of a module of ours and the order of its statements: a
module that only moves has the digest it had.
"""

import ast
import hashlib
from collections.abc import Iterable
from pathlib import Path

Documented = ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef


def total(parts: Iterable[bytes]) -> str:
    """SHA-256, shortened, over a set of digests in no order."""
    return hashlib.sha256(b"".join(sorted(set(parts)))).hexdigest()[:16]


def statements(path: Path, root: Path) -> frozenset[bytes]:
    """The digests of a module's statements; packages below `root` are ours."""
    return frozenset(statement(node) for node in placeless(path, root).body)


def statement(node: ast.stmt) -> bytes:
    """The digest of one statement."""
    return hashlib.sha256(ast.dump(node).encode()).digest()


def numbers(path: Path) -> frozenset[bytes]:
    """The digest of what a module keeps in a file of its own name, such as reference images; none if it keeps none."""
    beside = path.with_suffix(".npz")
    return frozenset([hashlib.sha256(beside.read_bytes()).digest()]) if beside.exists() else frozenset()


def placeless(path: Path, root: Path) -> ast.Module:
    """A module without docstrings, and without the folders of what it imports from packages below `root`."""
    tree = ast.parse(path.read_bytes())
    for node in ast.walk(tree):
        if isinstance(node, Documented) and ast.get_docstring(node) is not None:
            node.body = node.body[1:]
    _Placeless(root).visit(tree)
    return tree


class _Placeless(ast.NodeTransformer):
    """`from ours.folder.module import x, y` becomes two imports, from `module`, and from nothing where it is a folder.

    Hazard: of two modules of one name, it is not seen which one is meant.
    """

    def __init__(self, root: Path) -> None:
        self._root = root

    def visit_ImportFrom(self, node: ast.ImportFrom) -> list[ast.ImportFrom]:
        """One import per name."""
        folders = (node.module or "").split(".")
        if node.level or not (self._root / folders[0]).is_dir():
            return [node]
        module = "" if self._root.joinpath(*folders).is_dir() else folders[-1]
        return [ast.ImportFrom(module, [name], 0) for name in node.names]
