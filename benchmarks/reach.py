"""Which tests reach which functions, and how long they take: measured once per file of tests, then kept.

A mutant then meets only tests that call what it changes: those that have killed before come first, then those
that call it themselves, of these the files named after its module, and then the quickest, while time lasts.
"""

import json
import sys
from collections.abc import Iterable, Mapping
from hashlib import sha256
from pathlib import Path
from time import process_time
from types import CodeType, FrameType
from typing import Any, NamedTuple

OURS = ("restir_ref", "toy1d", "flatland2d", "tracer3d")


class Reached(NamedTuple):
    """A test: its id, its CPU time, the functions it calls, and those that the tests of its file call."""

    test: str
    seconds: float
    itself: frozenset[str]
    file: frozenset[str]


class Watcher:
    """A pytest plugin that sends (test, seconds, functions) for every passed test; imports come first, as test ''."""

    def __init__(self, send: Any) -> None:
        self.send = send
        self.codes: dict[int, CodeType] = {}
        self.start, self.passed = process_time(), True
        sys.settrace(self.trace)

    def trace(self, frame: FrameType, event: str, arg: object) -> None:
        """Called for every call of a Python function."""
        self.codes[id(frame.f_code)] = frame.f_code

    def pytest_runtest_logstart(self, nodeid: str) -> None:
        """Called before a test."""
        if self.start:
            self.tell("")
        self.codes, self.start, self.passed = {}, process_time(), True
        sys.settrace(self.trace)

    def pytest_runtest_logreport(self, report: Any) -> None:
        """Called for each phase of a test."""
        self.passed &= report.passed

    def pytest_runtest_logfinish(self, nodeid: str) -> None:
        """Called after a test."""
        if self.passed:
            self.tell(nodeid)
        self.start = 0.0

    def tell(self, test: str) -> None:
        """Send what was reached."""
        sys.settrace(None)
        root = f"{Path.cwd()}/"
        ours = (code for code in self.codes.values() if code.co_filename.removeprefix(root).partition("/")[0] in OURS)
        scopes = sorted({scope(code.co_filename.removeprefix(root), code.co_qualname) for code in ours})
        self.send((test, process_time() - self.start, scopes))


def scope(path: str, name: str) -> str:
    """A function's full name; what is inside a lambda or a comprehension belongs to the function around it."""
    outer = name.replace(".<locals>", "").partition("<")[0].rstrip(".")
    return ".".join(filter(None, (path.removesuffix(".py").replace("/", "."), outer)))


def together(told: Iterable[tuple[str, float, list[str]]]) -> list[Reached]:
    """All tests of one file."""
    told = list(told)
    file = frozenset(name for _, _, names in told for name in names)
    return [Reached(test, seconds, frozenset(names), file) for test, seconds, names in told if test]


def suite(module: str, scope: str, kills: Mapping[str, int], tests: Iterable[Reached], budget: float) -> list[str]:
    """Tests that reach a scope, the likeliest killer first, as many as are quick enough together, at least one."""
    word = module.rpartition(".")[2]

    def rank(each: Reached) -> tuple[Any, ...]:
        elsewhere = word not in each.test.partition("::")[0]
        return -kills.get(each.test, 0), not touches(scope, each.itself), elsewhere, each.seconds

    spent, chosen = 0.0, list[str]()
    for each in sorted((each for each in tests if touches(scope, each.file)), key=rank):
        spent += each.seconds
        if not chosen or spent < budget:
            chosen.append(each.test)
    return chosen


def touches(scope: str, names: frozenset[str]) -> bool:
    """Whether a scope, or something inside it, is among the names."""
    return scope in names or any(name.startswith(f"{scope}.") for name in names)


# ---------------------------------------------------------------- kept


class Kept:
    """A file of lines of JSON: the newest value of every key; only what is asked for again is used."""

    def __init__(self, path: Path) -> None:
        self.path = path
        path.parent.mkdir(parents=True, exist_ok=True)
        lines = path.read_text("utf-8").splitlines() if path.exists() else []
        self.values: dict[str, Any] = dict(map(json.loads, lines))

    def __setitem__(self, key: str, value: Any) -> None:
        self.values[key] = value
        with self.path.open("a", encoding="utf-8") as to:
            to.write(json.dumps([key, value]) + "\n")

    def get(self, key: str) -> Any:
        """The value, or None."""
        return self.values.get(key)


def digest(name: str, *files: str) -> str:
    """A name and the text of files, in few letters."""
    texts = (Path(file).read_bytes() for file in files)
    return sha256(b"\0".join([name.encode(), *texts])).hexdigest()[:20]
