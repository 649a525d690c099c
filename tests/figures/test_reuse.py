"""Laws of when reuse pays: V(M) = S + Q / M exactly, measured passes as predicted, and what neighbours are."""

from collections import Counter

import numpy as np
import pytest

from figures.experiments import reuse
from figures.experiments.views import HYBRID, at_random, view
from figures.trust.pays_1d import exact_split
from restir_ref.chance import Live
from restir_ref.integrals import Pixels
from restir_ref.loop import random_in_row
from restir_ref.oracle.enumeration import outcomes
from restir_ref.oracle.scenes import offset
from restir_ref.restir import initial, shade, spatial
from toy1d import image_of_64, quotient, two_pixels

NEAR = [np.array([1, 0])]


def exactly(frame) -> reuse.Split:
    """S and Q of two pixels that reuse from each other, as sums over cells."""
    c, x = frame.cells, np.arange(frame.cells.v.shape[-1])
    return reuse.exact(frame, NEAR, x, lambda index, x: c.pdf[0, index, x], lambda index, x: c.v[index, x])


def enumerated(frame, M: int, passes: int) -> np.ndarray:
    """Variance of the shaded pixels over all outcomes, (n,)."""

    def program(index, chance):
        here = Pixels(frame, index)
        X = initial(here, chance, M)
        for _ in range(passes):
            X = spatial(X, here, [offset(frame, index, 1)], chance, mis=reuse.ACROSS)
        return shade(X, here)[0]

    first, second = np.zeros(frame.n), np.zeros(frame.n)
    for each in outcomes(program, frame.n):
        L = each.result.reshape(-1, frame.n)
        first += each.probability @ L
        second += each.probability @ L**2
    return second - first**2


@pytest.mark.parametrize("M", [1, 2, 3])
def test_the_variance_of_a_pass_is_S_plus_Q_over_M(M) -> None:
    frame = quotient(two_pixels(), 3)
    found = exactly(frame)
    assert enumerated(frame, M, 0) == pytest.approx(found.without(M), rel=1e-12)
    assert enumerated(frame, M, 1) == pytest.approx(found.with_reuse(M), rel=1e-12)


def test_without_the_noise_of_choosing_the_variance_is_wrong() -> None:
    frame = quotient(two_pixels(), 3)
    found = exactly(frame)
    assert np.all(enumerated(frame, 3, 1) > 1.02 * found.Q / 3)


def test_reuse_pays_below_the_break_even_and_costs_above_it() -> None:
    found = exact_split(image_of_64(), reuse.distinct(image_of_64(), random_in_row, 15, Live(np.random.default_rng(3))))
    less, more = np.floor(found.break_even), np.ceil(found.break_even) + 1
    assert np.all(found.with_reuse(less) < found.without(less))
    assert np.all(found.with_reuse(more) > found.without(more))


def test_without_noise_of_choosing_reuse_always_pays() -> None:
    same = reuse.Split(np.ones(2), np.array([0.0, 0.5]), np.zeros(2))
    assert same.break_even.tolist() == [np.inf, 2]


@pytest.mark.parametrize("radius", [6, 15])
def test_passes_over_four_samples_predict_the_gain_with_thirty_two(radius) -> None:
    line, rng = image_of_64(), np.random.default_rng(5)
    near = reuse.distinct(line, random_in_row, radius, Live(rng))
    found = reuse.split(line, near, 4, 2000, Live(rng))
    without, once = (each.var(axis=0).sum() for each in reuse.images(line, near, 32, 2000, Live(rng)))
    predicted = found.without(32).sum() / found.with_reuse(32).sum()
    assert without / once == pytest.approx(predicted, rel=0.05)
    right = exact_split(line, near)
    assert found.S.sum() == pytest.approx(right.S.sum(), rel=0.05)
    assert found.Q.sum() == pytest.approx(right.Q.sum(), rel=0.05)


def test_more_rounds_at_the_papers_radius_make_a_matte_box_worse_and_a_slit_better() -> None:
    gains = {}
    for scene in ("cornell", "ajar"):
        of, rng = view(scene, HYBRID, Counter()), np.random.default_rng(7)
        near = reuse.distinct(of, at_random, 10, Live(rng))
        without, once, _, thrice = (each.var(axis=0).sum() for each in reuse.images(of, near, 32, 48, Live(rng), 3))
        gains[scene] = without / once, without / thrice
    assert gains["cornell"][1] < gains["cornell"][0] < 0.9
    assert gains["ajar"][1] > 1.5 * gains["ajar"][0] > 3


def test_neighbours_differ_from_each_other_and_from_the_pixel() -> None:
    of = view("cornell", HYBRID, Counter())
    table = np.stack([np.arange(of.n), *reuse.distinct(of, at_random, 10, Live(np.random.default_rng(1)))])
    assert all(len(set(column)) == 7 for column in table.T)
    assert np.abs(table - table[0]).max() <= 10


def test_too_many_neighbours_for_a_radius_are_refused() -> None:
    with pytest.raises(ValueError, match="6 different neighbours were not found within 2 pixels"):
        reuse.distinct(image_of_64(), random_in_row, 2, Live(np.random.default_rng(1)))
