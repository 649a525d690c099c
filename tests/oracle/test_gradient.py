"""Differences of pixels from their own samples: pair weights, and gradients after resampling.  [GPT 3.1, 4.1]"""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given

from restir_ref.batch import Array, ratio
from restir_ref.gradient import (
    MAGNITUDE,
    Pairs,
    gap,
    gradient_after,
    omega,
    one_sided,
)
from restir_ref.integrals import Pixels, Reservoirs, Shifted, pdf, target
from restir_ref.mis import WEIGHTS
from restir_ref.oracle.cells import Frame
from restir_ref.oracle.laws import expected_sum
from restir_ref.oracle.moments import Moments, Source, drawn, independent, mapped, operator, resampled
from restir_ref.oracle.scenes import Scene, offset, reference_scene, two_frame_loop
from tests.oracle.pairs import delta, nodes, true_means
from tests.oracle.strategies import scenes
from toy1d import Line, partial_shift, quotient, shared_peak, two_pairs

PROXIES = {"sampling density": pdf, "target": target}
TALBOT, DEFENSIVE = WEIGHTS["talbot"], WEIGHTS["defensive"]

every_proxy = pytest.mark.parametrize("proxy", PROXIES.values(), ids=PROXIES)
finite_pair = given(scene=scenes(n=2, K=3))


def one_by_one(frame: Frame) -> tuple[Array, Pixels, Pixels]:
    """All cells, as samples of pixel 0 and with pixel 1 beside them."""
    x = np.arange(frame.cells.v.shape[-1])
    return x, Pixels(frame, np.zeros(len(x), dtype=int)), Pixels(frame, np.ones(len(x), dtype=int))


# ---------------------------------------------------------------- pair weights


def partition_error(x: Array, i: Pixels, j: Pixels, weight) -> float:
    """Largest |w_ij(x) + w_ji(T x) - 1| where some weight is positive; without a shift w_ij(x) is 1 itself."""
    y = i.of.shift(x, i.index, j)
    back = Shifted(x, ratio(np.ones(len(y.J)), y.J))
    there, here = weight(x, i, y, j), weight(y.x, j, back, i)
    total = there + np.where(y.J > 0, here, 0)
    return float(abs(total - 1)[total != 0].max(initial=0))


def inverted_jacobian(x, base, y, offset) -> Array:
    """w with 1/J for J."""
    return omega(x, base, replace(y, J=ratio(np.ones(len(y.J)), y.J)), offset, pdf)


def inverted_on_one_side(x, base, y, offset) -> Array:
    """A mistake: 1/J for J, in the weights of pixel 0 only."""
    weight = inverted_jacobian if base.index[0] == 0 else omega
    return weight(x, base, y, offset)


@pytest.mark.claims("GPT-E04", "GPT-E13")
@every_proxy
@finite_pair
def test_pair_weights_of_a_sample_and_its_shift_add_up_to_one(proxy, scene) -> None:
    assert partition_error(*one_by_one(scene.now), lambda *at: omega(*at, proxy)) < 1e-12


@pytest.mark.claims("GPT-E04", "GPT-E13", "GPT-E16")
@every_proxy
def test_pair_weights_add_up_to_one_on_the_line_before_and_after_an_outer_shift(proxy) -> None:
    for line, i, j in ((partial_shift(), 0, 1), (two_pairs(), 0, 1)):
        X, here = nodes(line, i)
        assert partition_error(X.x, here, nodes(line, j)[1], lambda *at: omega(*at, proxy)) < 1e-12
    pairs, column = Pairs(line, np.array([[0, 2], [1, 3]]), MAGNITUDE), np.zeros(60, dtype=int)
    moved = pairs.shift(pairs.paired(column, X.x, column), column, Pixels(pairs, column + 1)).x
    at = pairs.end(column + 1, moved.k), pairs.end(column + 1, 1 - moved.k)
    assert np.array_equal(line.shift(moved.x, at[0].index, at[1]).x, moved.offset.x)
    assert partition_error(moved.x, *at, lambda *a: omega(*a, proxy)) < 1e-12


@pytest.mark.claims("GPT-E04")
def test_pair_weights_of_primary_samples_are_one_over_one_plus_the_jacobian() -> None:
    line = partial_shift()
    X, here = nodes(line, 0, 0.4)
    y = line.shift(X.x, here.index, Pixels(line, here.index + 1))
    w = omega(X.x, here, y, Pixels(line, here.index + 1), lambda at, x: np.ones(len(at.index)))
    assert w == pytest.approx(1 / (1 + y.J), rel=1e-12)


@pytest.mark.claims("GPT-E04")
def test_one_over_the_jacobian_on_one_side_is_noticed() -> None:
    line = partial_shift()
    X, here = nodes(line, 0, 0.4)
    assert partition_error(X.x, here, Pixels(line, here.index + 1), inverted_on_one_side) > 0.1


def test_one_over_the_jacobian_on_both_sides_is_another_partition_of_unity() -> None:
    """q J / (q J + q') and q' / (q' + q J): a mistake made everywhere alike is none that biases."""
    line = partial_shift()
    X, here = nodes(line, 0, 0.4)
    assert partition_error(X.x, here, Pixels(line, here.index + 1), inverted_jacobian) < 1e-12


# ---------------------------------------------------------------- two pixels' own samples


def halves(X: Reservoirs, base: Pixels, other: Pixels) -> Array:
    """A mistake: w = 1/2 everywhere, also where the shift is undefined."""
    y = base.of.shift(X.x, base.index, other)
    return gap(X.x, base, y, other) * X.W / 2


def over_both(line: Line, term, cuts=((0.4,), (1,))) -> float:
    """The expectation of term_ij - term_ji over raw candidates, by quadrature."""
    (X, i), (Y, j) = (nodes(line, k, *cuts[k]) for k in (0, 1))
    to_j, to_i = Pixels(line, np.full(len(X.x), 1)), Pixels(line, np.full(len(Y.x), 0))
    return float(term(X, i, to_j).sum() - term(Y, j, to_i).sum())


@pytest.mark.claims("GPT-E03", "GPT-E13")
@every_proxy
def test_differences_with_a_partial_shift_of_jacobian_2x_are_unbiased(proxy) -> None:
    line = partial_shift()
    found = over_both(line, lambda X, base, other: one_sided(X, base, other, proxy))
    assert found == pytest.approx(delta(line), rel=1e-10)


@pytest.mark.claims("GPT-E03")
def test_weights_of_one_half_where_the_shift_is_undefined_are_noticed() -> None:
    assert abs(over_both(partial_shift(), halves) / delta(partial_shift()) - 1) > 0.01


@pytest.mark.claims("GPT-E02")
def test_one_integral_is_enough_for_a_full_bijection_only() -> None:
    def single(line: Line, *cuts: float) -> float:
        X, i = nodes(line, 0, *cuts)
        j = Pixels(line, i.index + 1)
        return float((gap(X.x, i, line.shift(X.x, i.index, j), j) * X.W).sum())

    assert single(two_pairs()) == pytest.approx(delta(two_pairs()), rel=1e-10)
    assert abs(single(partial_shift(), 0.4) / delta(partial_shift()) - 1) > 0.01


def half_dark() -> Line:
    """`partial_shift` with f_0 = 1 - 2 x, and nothing at all above x = 1/2."""
    bright = partial_shift()
    return replace(bright, f=lambda i, x: np.where(i == 0, np.maximum(1 - 2 * x, 0), bright.f(i, x)))


@pytest.mark.claims("GPT-E04z")
def test_dark_base_paths_may_be_dropped_with_weights_of_targets_only() -> None:
    def dropped(X, base, other, proxy) -> Array:
        return one_sided(replace(X, W=np.where(target(base, X.x) > 0, X.W, 0)), base, other, proxy)

    line, cuts = half_dark(), ((0.4, 0.5), (0.25, 1))
    truth = delta(line)
    assert over_both(line, lambda *at: one_sided(*at, pdf), cuts) == pytest.approx(truth, rel=1e-10)
    assert over_both(line, lambda *at: dropped(*at, target), cuts) == pytest.approx(truth, rel=1e-10)
    assert abs(over_both(line, lambda *at: dropped(*at, pdf), cuts) / truth - 1) > 0.01


def after_two_frames(scene: Scene, estimate) -> Array:
    """The expectation of estimate(X, i, j) for both orders of the pixels, enumerated."""
    loop = two_frame_loop(scene)

    def program(index, chance) -> Array:
        i = Pixels(scene.now, index)
        return estimate(loop(index, chance), i, offset(scene.now, index, 1))[None]

    return expected_sum(program, 2)[0]


@pytest.mark.claims("GPT-E11", "GPT-E13")
@given(scene=scenes(n=2, K=2, frames=2))
def test_gradients_of_final_samples_are_unbiased_after_two_frames(scene) -> None:
    I = true_means(scene)
    assert after_two_frames(scene, gradient_after) == pytest.approx([I[0] - I[1], I[1] - I[0]], abs=1e-12)


@pytest.mark.claims("GPT-E11")
def test_one_side_alone_is_noticed() -> None:
    scene, I = reference_scene(), true_means(reference_scene())
    assert after_two_frames(scene, gradient_after)[0] == pytest.approx(I[0] - I[1], abs=1e-12)
    assert abs(after_two_frames(scene, one_sided)[0] - (I[0] - I[1])) > 0.01 * I[0]


def chained(frame: Frame, frames: int) -> Moments:
    """Z after so many frames of temporal reuse of confidence 2 and defensive reuse from the other pixel."""
    K = frame.cells.v.shape[-1]
    in_time = [
        operator([Source(2 * K + i * K, frame, i, 1), Source(i * K, frame, i, 2)], 4 * K, TALBOT) for i in (0, 1)
    ]
    across = [
        operator([Source(i * K, frame, i, 3), Source((1 - i) * K, frame, 1 - i, 3)], 2 * K, DEFENSIVE) for i in (0, 1)
    ]
    Z = drawn(frame)
    for _ in range(frames):
        Z = resampled(resampled(independent([Z, drawn(frame)]), in_time), across)
    return Z


@pytest.mark.claims("GPT-E11")
def test_gradients_of_final_samples_are_unbiased_after_ten_frames() -> None:
    """On 63 cells of the toy, where the estimate is a linear map of the moments."""
    frame = quotient(shared_peak(), 63)
    x, i, j = one_by_one(frame)
    unit = Reservoirs(x, np.ones(len(x)), np.ones(len(x)))
    G = np.concatenate([one_sided(unit, i, j), -one_sided(unit, j, i)], axis=-1)
    estimate = mapped(chained(frame, 10), G)
    means = (frame.cells.f * frame.cells.v).sum(axis=-1)
    assert estimate.mean[0] == pytest.approx(means[0] - means[1], rel=1e-10)
    assert estimate.second[0, 0] > estimate.mean[0] ** 2
