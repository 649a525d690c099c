"""The paired domain, outer shifts, signs, and the exact variances they lead to.  [GPT 4.2-4.4]"""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from figures.gradient.gpt_f03 import Exact
from restir_ref.batch import Array, ratio
from restir_ref.gradient import (
    MAGNITUDE,
    NEGATIVE,
    POSITIVE,
    SIGNS,
    Paired,
    Pairs,
    Part,
    TossedPairs,
    gradient_after,
)
from restir_ref.integrals import Pixels, Reservoirs, Shifted, target
from restir_ref.mis import WEIGHTS
from restir_ref.oracle.cells import Frame, cells
from restir_ref.oracle.laws import expected_sum
from restir_ref.oracle.scenes import Scene, normalised, offset, paired
from restir_ref.resampling import Input, gris
from restir_ref.restir import initial, resample, shade, spatial
from tests.oracle.pairs import ENDS, ONE_PAIR, both_signs, delta, labelled, largest_bias, nodes, true_means
from tests.oracle.strategies import scenes
from toy1d import Line, bare_peaks, partial_shift, quotient, shared_peak, two_pairs

TOYS = {"shared_peak": shared_peak, "bare_peaks": bare_peaks}
TALBOT = WEIGHTS["talbot"]

each_part = pytest.mark.parametrize("part", [POSITIVE, NEGATIVE, MAGNITUDE])
finite_pair = given(scene=scenes(n=2, K=3))


# ---------------------------------------------------------------- the paired domain


@pytest.mark.claims("GPT-E15", "GPT-E16")
@given(scene=scenes(n=2, K=3))
def test_differences_on_the_paired_domain_are_the_integrand_of_the_symmetric_form_with_its_signs(scene) -> None:
    tables, K = scene.now.cells, 3
    expected = np.zeros((2, K))
    for i, sign in ((0, 1), (1, -1)):
        for x in range(K):
            y, f = tables.shifts[i, 1 - i, x], tables.f
            there = f[1 - i, y] * tables.v[1 - i, y] / tables.v[i, x] if y >= 0 else 0.0
            expected[i, x] = sign * f[i, x] * (f[i, x] - there) / ((f[i, x] + there) or 1)
    pairs, column = Pairs(scene.now, ONE_PAIR, MAGNITUDE), np.zeros(2 * K, dtype=int)
    at = pairs.paired(column, np.tile(np.arange(K), 2), np.repeat([0, 1], K))
    assert pairs.difference(column, at)[0] == pytest.approx(expected.ravel(), rel=1e-12, abs=1e-15)


class Forgetful(TossedPairs):
    """A mistake: the probability 1/2 of the side is left out of W."""

    def candidates(self, index, chance):
        return ((x, mW / 2) for x, mW in TossedPairs.candidates(self, index, chance))


def initial_pair(pairs: Pairs, M: int, K: int):
    return lambda index, chance: labelled(initial(Pixels(pairs, index), chance, M), K)


@pytest.mark.claims("GPT-E14", "GPT-E17")
@each_part
@given(scene=scenes(n=2, K=3))
def test_tossing_for_the_side_of_the_pair_is_unbiased_in_every_cell(part, scene) -> None:
    pairs = TossedPairs(scene.now, ONE_PAIR, part)
    assert largest_bias(initial_pair(pairs, 2, 3), pairs, scene) < 1e-13


def mean_difference(pairs: Pairs, M: int) -> float:
    """E[w* G(Y) W_Y] of M candidates, enumerated."""

    def program(index, chance) -> Array:
        here = Pixels(pairs, index)
        return shade(initial(here, chance, M), here)

    return float(expected_sum(program, 1)[0, 0])


@pytest.mark.claims("GPT-E14", "GPT-E17")
@pytest.mark.parametrize("kind", [Pairs, TossedPairs])
@pytest.mark.parametrize("toy", TOYS)
def test_one_reservoir_for_both_signs_estimates_the_difference_of_the_toys(toy, kind) -> None:
    frame = quotient(TOYS[toy](), 12)
    means = (frame.cells.f * frame.cells.v).sum(axis=-1)
    assert mean_difference(kind(frame, ONE_PAIR, MAGNITUDE), 2) == pytest.approx(means[0] - means[1], rel=1e-10)


@pytest.mark.claims("GPT-E14")
def test_forgetting_the_probability_of_the_side_halves_the_difference() -> None:
    frame = quotient(shared_peak(), 12)
    right, wrong = (mean_difference(kind(frame, ONE_PAIR, MAGNITUDE), 2) for kind in (TossedPairs, Forgetful))
    assert wrong / right == pytest.approx(0.5, rel=1e-12)


# ---------------------------------------------------------------- outer shifts


def second_pair_of(line: Line, kind: type[Pairs] = Pairs) -> tuple[Pairs, Input, Pixels]:
    """Quadrature nodes of the pair (0, 1), to be reused by the pair (2, 3)."""
    pairs = kind(line, np.array([[0, 2], [1, 3]]), MAGNITUDE)
    (X, _), (Y, _) = nodes(line, 0), nodes(line, 1)
    column, side = np.zeros(120, dtype=int), np.repeat([0, 1], 60)
    x = pairs.paired(column, np.concatenate([X.x, Y.x]), side)
    W = np.concatenate([X.W, Y.W])
    return pairs, Input(Reservoirs(x, W, np.ones(120)), Pixels(pairs, column)), Pixels(pairs, column + 1)


def reused(kind: type[Pairs] = Pairs) -> float:
    """E[w* G(Y) W_Y] in the pair (2, 3), all samples coming from (0, 1)."""
    _, source, here = second_pair_of(two_pairs(), kind)
    return float(shade(gris([source], here, TALBOT, FIRST), here).sum())


class First:
    """There is one input to choose from."""

    def choose(self, weights):
        return np.zeros(weights.shape[-1], dtype=int)


FIRST = First()


def literally_reused() -> float:
    """A mistake: W = sum w / p_hat(T* y), with y = T* x already shifted."""
    pairs, source, here = second_pair_of(two_pairs())
    Y = gris([source], here, TALBOT, FIRST)
    again = pairs.shift(Y.x, source.at.index, here).x
    W = Y.W * ratio(target(here, Y.x), target(here, again))
    return float(shade(replace(Y, W=W), here).sum())


@pytest.mark.claims("GPT-E18")
def test_samples_of_a_pair_linked_by_x_squared_are_unbiased_for_the_other_pair() -> None:
    assert reused() == pytest.approx(delta(two_pairs(), 2, 3), rel=1e-10)


@pytest.mark.claims("GPT-E18")
def test_shifting_a_shifted_sample_once_more_inside_the_target_is_noticed() -> None:
    assert abs(literally_reused() / delta(two_pairs(), 2, 3) - 1) > 0.01


@dataclass(frozen=True, eq=False)
class InnerJacobianInShift(Pairs):
    """A mistake: the offset path's Jacobian multiplied into the outer shift."""

    def shift(self, x: Paired, index: Array, to: Pixels) -> Shifted:
        y = super().shift(x, index, to)
        return replace(y, J=y.J * np.where(x.offset.J > 0, x.offset.J, 1))


def falling_scene() -> Scene:
    """f falls from pixel to pixel, so that both pairs are positive and reuse each other's samples."""
    v = np.array([[1.0, 0.5], [0.5, 1.0], [1.0, 2.0]])
    f = np.array([[4.0, 3.0], [2.0, 1.0], [0.5, 0.25]])
    here = {(0, 1): (0, 1), (0, 2): (0, 1), (1, 2): (0, 1)}
    return Scene([Frame(cells(v, f, normalised([[1, 1]] * 3, v.tolist()), paired(3, 2, here)), 3)])


def reuse_bias(kind: type[Pairs]) -> float:
    """Largest bias per cell of two pairs that reuse each other's samples."""
    scene = falling_scene()
    pairs = kind(scene.now, ENDS, POSITIVE)

    def loop(index, chance):
        here = Pixels(pairs, index)
        return labelled(spatial(initial(here, chance), here, [offset(pairs, index, 1)], chance), 2)

    return largest_bias(loop, pairs, scene)


@pytest.mark.claims("GPT-E22")
def test_the_jacobian_of_the_outer_shift_is_the_derivative_of_the_base_path_alone() -> None:
    pairs, source, here = second_pair_of(two_pairs())
    x, at, h = source.X.x, source.at.index, 1e-6
    inside = (x.x > 0.21) & (x.x < 0.99)
    above, below = (pairs.shift(replace(x, x=x.x + by), at, here).x.x for by in (h, -h))
    J = pairs.shift(x, at, here).J
    assert ((above - below) / (2 * h))[inside] == pytest.approx(J[inside], rel=1e-5)
    assert reuse_bias(Pairs) < 1e-13


@pytest.mark.claims("GPT-E22")
def test_an_inner_jacobian_in_the_outer_shift_is_noticed() -> None:
    assert reuse_bias(InnerJacobianInShift) > 0.01
    assert abs(reused(InnerJacobianInShift) / delta(two_pairs(), 2, 3) - 1) > 0.01


# ---------------------------------------------------------------- signs


@pytest.mark.claims("GPT-E23")
@given(st.lists(st.floats(allow_nan=False, allow_infinity=False), min_size=1))
def test_the_parts_of_a_signed_integrand_are_disjoint_and_give_it_back(values) -> None:
    f = np.array([values])
    assert set(SIGNS.values()) == {POSITIVE, NEGATIVE}
    assert np.array_equal(POSITIVE.target(f) - NEGATIVE.target(f), f[0])
    assert not (POSITIVE.target(f) * (NEGATIVE.target(f) > 0)).any()


def sums_of_weights(signs: list[Pairs], index, chance, M: int) -> tuple[Array, Array, Array]:
    """sum w_+, sum w_-, and the shading of both signs, from the same candidates."""
    offered = [(x, mW / M) for _ in range(M) for x, mW in signs[0].candidates(index, chance)]
    here = [Pixels(sign, index) for sign in signs]
    plus, minus = (sum(target(at, x) * mW for x, mW in offered) for at in here)
    return plus, minus, sum(shade(resample(offered, at, chance), at)[0] for at in here)


@pytest.mark.claims("GPT-E24")
@finite_pair
def test_the_two_signs_add_up_to_the_difference_of_the_pixels(scene) -> None:
    signs = both_signs(scene.now, ONE_PAIR)

    def estimate(index, chance):
        plus, minus, both = sums_of_weights(signs, index, chance, 1)
        assert both == pytest.approx(plus - minus, rel=1e-12, abs=1e-12)
        return np.stack([both, plus + minus])

    I, (difference, _) = true_means(scene), expected_sum(estimate, 1)[:, 0]
    assert difference == pytest.approx(I[0] - I[1], abs=1e-12)


@pytest.mark.claims("GPT-E24")
@pytest.mark.parametrize("toy", TOYS)
def test_adding_the_negative_part_is_noticed_in_the_toys(toy) -> None:
    frame = quotient(TOYS[toy](), 12)
    signs = both_signs(frame, ONE_PAIR, TossedPairs)

    def estimate(index, chance):
        plus, minus, both = sums_of_weights(signs, index, chance, 1)
        return np.stack([both, plus + minus])

    right, added = expected_sum(estimate, 1)[:, 0]
    assert right == pytest.approx(Exact.of(frame).delta.sum(), rel=1e-10)
    assert added > 1.5 * right


@pytest.mark.claims("GPT-C01")
def test_a_signed_target_is_refused() -> None:
    pairs = Pairs(quotient(shared_peak(), 12), ONE_PAIR, Part(lambda d: d[0], np.ones_like))
    with pytest.raises(ValueError, match="the target p_hat must be finite and non-negative"):
        mean_difference(pairs, 1)


# ---------------------------------------------------------------- exact variances


def enumerated_variance(estimate, n: int) -> float:
    """Var of the first column's estimate, over all outcomes."""

    def moments(index, chance) -> Array:
        found = estimate(index, chance)
        return np.stack([found, found**2])

    mean, square = expected_sum(moments, n)[:, 0]
    return float(square - mean**2)


@pytest.mark.claims("GPT-P01")
@pytest.mark.parametrize("M", [1, 2, 3])
def test_variances_with_one_reservoir_and_with_two_have_their_closed_forms(M) -> None:
    frame = quotient(shared_peak(), 6)
    pairs, exact = TossedPairs(frame, ONE_PAIR, MAGNITUDE), Exact.of(frame)

    def single(index, chance) -> Array:
        here = Pixels(pairs, index)
        return shade(initial(here, chance, M), here)[0]

    def positivized(index, chance) -> Array:
        return sums_of_weights(both_signs(frame, ONE_PAIR, TossedPairs), index, chance, M)[2]

    assert enumerated_variance(single, 1) == pytest.approx(exact.single(M), rel=1e-10)
    assert enumerated_variance(positivized, 1) == pytest.approx(exact.positivized(M), rel=1e-10)
    assert exact.single(M) - exact.positivized(M) == pytest.approx(exact.floor_single * (1 - 1 / M), rel=1e-10)


@pytest.mark.claims("GPT-P02")
@pytest.mark.parametrize("M", [1, 2])
@pytest.mark.parametrize("toy", [shared_peak, partial_shift])
def test_the_variance_of_gradients_after_resampling_has_its_closed_form(toy, M) -> None:
    frame = quotient(toy(), 7)

    def after(index, chance) -> Array:
        here = Pixels(frame, index)
        return gradient_after(initial(here, chance, M), here, offset(frame, index, 1))

    assert enumerated_variance(after, 2) == pytest.approx(Exact.of(frame).after(M), rel=1e-10)
