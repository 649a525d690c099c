"""Mutation testing plants what it says: every module in a group, small changes of code, and none of words."""

import ast
from pathlib import Path

import pytest

from benchmarks.groups import GROUPS, OMITTED
from tests.checkout import ROOT, plant

PACKAGES = ("restir_ref", "toy1d", "flatland2d", "tracer3d")


@pytest.fixture(autouse=True)
def in_the_checkout(monkeypatch):
    monkeypatch.chdir(ROOT)
    monkeypatch.syspath_prepend(str(ROOT / "benchmarks"))


def ungrouped(root: Path) -> list[str]:
    """Modules that are in no group, or in two."""
    found = [file for group in GROUPS.values() for file in group.files()]
    modules = (path.relative_to(root) for name in PACKAGES for path in (root / name).rglob("*.py"))
    return sorted(str(path) for path in modules if path.name not in OMITTED and found.count(str(path)) != 1)


def test_every_module_is_in_one_group_and_every_group_has_modules_and_tests() -> None:
    assert ungrouped(ROOT) == []
    assert all([*group.files()] and group.tests() for group in GROUPS.values())


def test_a_module_without_a_group_is_noticed(tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(plant(tmp_path, "restir_ref/stray.py", "x = 1\n"))
    assert ungrouped(tmp_path) == ["restir_ref/stray.py"]


def planted(text: str) -> set[str]:
    """The changed line of every mutant of a module of one line."""
    from mutations import mutants  # noqa: PLC0415  (found by the fixture)

    return {mutant.source for mutant in mutants("restir_ref/x.py", text)}


def test_a_sum_meets_a_difference_either_side_alone_and_other_numbers() -> None:
    assert planted("y = x + 2") == {"y = x - 2", "y = x", "y = 2", "y = x + 3", "y = x + 1"}


@pytest.mark.parametrize(
    "text",
    [
        "import numpy as np",
        "raise ValueError(f'{x + 1} is wrong')",
        "__all__ = ['a', 'b']",
        "Numbers = Array | float",
        "y = np.asarray(x)",
        "y = Bug('a loop', 'a symptom')",
        "draw(lw=2)",
        "y = zip(a, strict=True)",
    ],
)
def test_words_types_and_looks_are_left_alone(text) -> None:
    changed = {ast.unparse(ast.parse(each)) for each in planted(text)}
    assert changed <= {"pass", "y = a", "y = zip(strict=True)", "y = Bug('a loop')", "y = np.asarray()"}
