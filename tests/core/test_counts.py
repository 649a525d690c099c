"""Laws of cost: how many shifts a pass takes, counted by the integrals themselves."""

import numpy as np
import pytest

from restir_ref.counting import Counting
from restir_ref.integrals import Pixels
from restir_ref.mis import WEIGHTS, Weights, pairwise
from restir_ref.oracle.scenes import offset
from restir_ref.resampling import Input, gris
from restir_ref.restir import initial, reuse_all, spatial
from tests.core.stubs import live
from toy1d import overlapping_supports

pytestmark = pytest.mark.kernel

COLUMNS = 14
SHIFTS = {
    "talbot": lambda M: M * (M - 1),
    "pairwise": lambda M: 2 * (M - 1),
    "defensive": lambda M: 2 * (M - 1),
    "1/Z": lambda M: M * (M - 1),
    "constant": lambda M: M - 1,
}
"""Shifts per column of a pass over M inputs, one of them canonical."""
TARGETS = {
    "talbot": lambda M: M * M,
    "pairwise": lambda M: 3 * M - 2,
    "defensive": lambda M: 3 * M - 2,
    "1/Z": lambda M: M * M,
    "constant": lambda M: M,
}
"""Evaluations of targets per column: each sample where it lands, and the densities that its weight compares."""

every_weight = pytest.mark.parametrize("name", WEIGHTS)


def spatial_pass(X, here, neighbours, mis):
    spatial(X, here, neighbours, live(), mis=mis)


def gris_pass(X, here, neighbours, mis):
    """The same, with the canonical input last."""
    gris([*(Input(X, near) for near in neighbours), Input(X, here)], here, mis, live())


def sum_of_all(X, here, neighbours, mis):
    reuse_all(X, here, neighbours, mis=mis)


def per_column(what, a_pass, mis, M) -> float:
    """How often a pass over M inputs asks for a shift or a target."""
    toy = Counting(overlapping_supports())
    here = Pixels(toy, np.arange(COLUMNS))
    X = initial(here, live())
    before = toy.asked[what]
    a_pass(X, here, [offset(toy, here.index, by) for by in range(1, M)], mis)
    return (toy.asked[what] - before) / COLUMNS


@pytest.mark.claims("GRIS-F07c")
@every_weight
@pytest.mark.parametrize("M", range(2, 10))
@pytest.mark.parametrize("a_pass", [spatial_pass, gris_pass, sum_of_all])
def test_a_pass_takes_as_many_shifts_as_its_weights_need(a_pass, M, name):
    assert per_column("shift", a_pass, WEIGHTS[name], M) == SHIFTS[name](M)
    assert per_column("target", spatial_pass, WEIGHTS[name], M) == TARGETS[name](M)


@pytest.mark.claims("GRIS-F07c")
def test_at_49_inputs_talbot_takes_24_times_the_shifts_of_pairwise():
    counts = {name: per_column("shift", spatial_pass, WEIGHTS[name], 49) for name in ("talbot", "pairwise")}
    assert counts == {"talbot": 2352, "pairwise": 96}


def inquisitive(i, q, c):
    """A mistake: asks for every density, whether it is needed or not."""
    return [q(j) for j in range(len(c))] and pairwise(i, q, c)


def forgetful(i, q, c):
    """A mistake: asks past the cache of densities, once more for each input."""
    return q.__wrapped__(c.others[0]) * 0 + pairwise(i, q, c)


@pytest.mark.parametrize("mis", [inquisitive, forgetful])
def test_shifts_beyond_need_are_noticed(mis):
    assert per_column("shift", spatial_pass, Weights(mis), 5) > SHIFTS["pairwise"](5)


@every_weight
def test_canonical_inputs_take_no_shift(name):
    def pass_over_itself(X, here, neighbours, mis):
        spatial(X, here, [here] * len(neighbours), live(), mis=mis)

    assert per_column("shift", pass_over_itself, WEIGHTS[name], 5) == 0


def test_counting_changes_no_result():
    """An image and the one that counts for it, after the same draws."""
    plain = overlapping_supports()
    found = []
    for toy in (plain, Counting(plain)):
        here = Pixels(toy, np.arange(COLUMNS))
        X = spatial(initial(here, live()), here, [offset(toy, here.index, 1)], live(2))
        found.append([X.x, X.W, X.c, toy.target(here.index, X.x), *toy.contribution(here.index, X.x)])
    assert np.array_equal(*found)
    assert Counting(plain).n == plain.n
