"""The resampler knows no dimension: no constant or branch of one in its source, and points of any d pass through."""

import ast
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from restir_ref.integrals import Pixels, Shifted
from restir_ref.oracle.scenes import offset
from restir_ref.restir import initial, spatial, temporal
from tests.checkout import ROOT, modules, plant
from tests.core.stubs import Wrapped, live
from toy1d import overlapping_supports

DIMENSIONS = {"d", "dim", "dims", "dimension", "dimensions"}


def names(node: ast.AST) -> str:
    """The last word of a name, or nothing."""
    return getattr(node, "attr", getattr(node, "id", getattr(node, "name", getattr(node, "arg", ""))) or "") or ""


def asks_for_a_dimension(node: ast.AST) -> bool:
    sides = [node.left, *node.comparators] if isinstance(node, ast.Compare) else []
    return any(names(side) in DIMENSIONS for side in sides)


def names_a_dimension(node: ast.AST) -> bool:
    return names(node) == "pi" or any(mark in names(node).lower() for mark in ("2d", "3d", "flatland"))


def dimensions_mentioned(root: Path) -> Iterator[str]:
    """Comparisons with a dimension, pi, and names of worlds or dimensions, in restir_ref outside transport/."""
    for module in modules(root, ["restir_ref"]):
        if not module.name.startswith("restir_ref.transport"):
            for node in ast.walk(module.tree):
                if asks_for_a_dimension(node) or names_a_dimension(node):
                    yield f"{module.name}:{getattr(node, 'lineno', 0)}"


@pytest.mark.claims("COM-A06")
def test_the_resampler_mentions_no_dimension():
    assert list(dimensions_mentioned(ROOT)) == []


@pytest.mark.parametrize("line", ["y = 1 if d == 2 else 3", "z = w.dim > 2", "u = 2 * np.pi", "def cross_3d(): ..."])
def test_a_dimension_in_the_resampler_is_noticed(tmp_path, line):
    assert len(list(dimensions_mentioned(plant(tmp_path, "restir_ref/mis.py", line)))) == 1
    plant(tmp_path, "restir_ref/mis.py", "x = values.ndim == 0")
    assert list(dimensions_mentioned(plant(tmp_path, "restir_ref/transport/a.py", line))) == []


class Diagonal(Wrapped):
    """Integrals over a line, whose samples are points (d, N) on the diagonal of d-space."""

    d = 0

    def candidates(self, index, chance):
        yield from ((np.stack([x] * self.d), mW) for x, mW in self.of.candidates(index, chance))

    def target(self, index, x):
        return self.of.target(index, x[0])

    def shift(self, x, index, to):
        y = super().shift(x[0], index, to)
        return Shifted(np.stack([y.x] * self.d), y.J)


def two_frames(of):
    here, chance = Pixels(of, np.arange(70)), live()
    Y, X = initial(here, chance), initial(here, chance)
    X = temporal(X, here, Y, [offset(of, here.index, 1)], chance)
    return spatial(X, here, [offset(of, here.index, -1)], chance)


@pytest.mark.claims("COM-A06")
@pytest.mark.parametrize("d", [1, 2, 3, 4])
def test_points_of_any_dimension_are_resampled_like_numbers(d):
    diagonal = type("Points", (Diagonal,), {"d": d})(overlapping_supports())
    X, Y = two_frames(diagonal.of), two_frames(diagonal)
    assert (Y.x == np.stack([X.x] * d)).all()
    assert (Y.W == X.W).all()
