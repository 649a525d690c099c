"""What the exact bias asks of a program: lanes that know nothing of one another."""

from dataclasses import replace

import numpy as np
import pytest

from restir_ref.integrals import Reservoirs
from restir_ref.mis import WEIGHTS
from restir_ref.oracle import enumeration
from restir_ref.oracle.laws import bias_of, expected_sum
from restir_ref.oracle.scenes import spatial_loop, three_pixel_scene

SCENE = three_pixel_scene()
RIGHT = spatial_loop(SCENE, WEIGHTS["talbot"], 1)

LEAKS = {
    "the mean over all columns": lambda X: replace(X, W=X.W.mean() + 0 * X.W),
    "the lane before": lambda X: replace(X, W=np.roll(X.W, 3)),
    "a pixel instead of a column": lambda X: replace(X, x=X.x[np.arange(len(X.x)) % 3]),
    "a sum of all": lambda X: replace(X, W=X.W * (1 + 1e-6 * X.W.sum())),
}


@pytest.mark.parametrize("leak", LEAKS.values(), ids=LEAKS)
def test_a_lane_that_knows_of_others_is_refused_by_the_exact_bias(leak):
    with pytest.raises(ValueError, match=r"^a lane alone gives samples .* beside other lanes: columns are independent"):
        bias_of(lambda index, chance: leak(RIGHT(index, chance)), SCENE.v, SCENE.support)


def test_lanes_on_their_own_are_not():
    assert abs(bias_of(RIGHT, SCENE.v, SCENE.support)).max() < 1e-13
    within = bias_of(lambda index, chance: halved(RIGHT(index, chance)), SCENE.v, SCENE.support)
    assert within.min() < -0.1


def halved(X):
    """A bias that no leak explains: the first pixel's weights are halved."""
    return replace(X, W=np.where(np.arange(len(X.W)) % 3 == 0, X.W / 2, X.W))


def test_too_long_an_enumeration_is_refused_with_an_estimate_by_the_exact_bias_too():
    def thirty_tosses(index, chance):
        return Reservoirs(chance.choose(np.ones((2, len(index)))), np.ones(len(index)), np.ones(len(index)))

    with pytest.raises(ValueError, match=r"at least 1.073742e\+09 leaves, .* probably about 1.1e\+09 in all"):
        bias_of(thirty_tosses, np.ones((30, 2)), np.ones((30, 2)))


def number(index, chance):
    """0, 1, 2 or 3, as likely as 1 : 1 : 1 : 3."""
    return chance.choose(np.array([[1.0], [1.0], [1.0], [3.0]]) * np.ones(len(index)))[None]


def test_an_expected_sum_is_one_over_all_outcomes_and_no_more_than_are_allowed(monkeypatch):
    monkeypatch.setattr(enumeration, "LANES_AT_ONCE", 1)
    assert expected_sum(number, 1)[0] == pytest.approx([2.0])
    assert expected_sum(number, 1, most_leaves=4)[0] == pytest.approx([2.0])
    with pytest.raises(ValueError, match="more than the limit of 3"):
        expected_sum(number, 1, most_leaves=3)
