"""What the selected sample converges to, and how fast: exact laws of Y, for one input and for many.  [GRIS 4.4, 5.2]"""

from collections.abc import Sequence
from dataclasses import replace
from itertools import product
from math import factorial, prod

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from scipy.integrate import quad

from figures.claims import criteria
from figures.experiments.exact import integral
from figures.gris import gris_a2
from restir_ref.batch import Array, ratio
from restir_ref.chance import Chance
from restir_ref.integrals import Pixels, Reservoirs, pdf
from restir_ref.mis import WEIGHTS, Weights
from restir_ref.oracle.bounds import limit_variance
from restir_ref.oracle.cells import Frame, cells
from restir_ref.oracle.laws import expected_weight
from restir_ref.oracle.moments import copies, drawn, mapped, resampled, reused, variance
from restir_ref.oracle.scenes import Loop, Scene, paired, reference_scene, spatial_loop, three_pixel_scene
from restir_ref.oracle.selected import (
    contribution_variance,
    l1_distance,
    mean_square_distance,
    probability,
    selected,
    share,
)
from restir_ref.resampling import Candidate, Input, gris, select
from restir_ref.restir import initial, shade
from tests.core.stubs import live
from tests.oracle.strategies import TRACTABLE, scenes
from toy1d import overlapping_supports, quotient

ROBUST = {name: WEIGHTS[name] for name in ("talbot", "pairwise", "defensive")}
every_robust_weight = pytest.mark.parametrize("mis", ROBUST.values(), ids=ROBUST)

INPUTS = st.sampled_from([(1, 0), (3, 0), (1, 1), (2, 1), (1, 3), (2, 2)])
"""Samples per pixel."""


def one_pass(frame: Frame, pixel: int, n: Sequence[int], mis: Weights) -> Loop:
    """A pass of one pixel over n[i] samples of every pixel i."""

    def loop(index: Array, chance: Chance) -> Reservoirs:
        at = [Pixels(frame, np.full(len(index), i)) for i in range(frame.n)]
        inputs = [Input(initial(at[i], chance), at[i]) for i in range(frame.n) for _ in range(n[i])]
        return gris(inputs, at[pixel], mis, chance)

    return loop


def by_transform(frame: Frame, pixel: int, n: Sequence[int], mis: Weights) -> Array:
    """P(Y = y) of the same pass from Laplace transforms, (K,)."""
    p, v, counts = frame.cells.pdf[0], frame.cells.v, np.array(n)
    return probability(reused(frame, pixel, counts, mis), p * v, gris_a2.inverse(p), np.maximum(counts, 1))


# ---------------------------------------------------------------- what a contribution weight is


def weighted(p: Array, W: Array):
    """A sample X ~ p and one of two W given X, W (2, K), evenly."""

    def program(index: Array, chance: Chance) -> Reservoirs:
        x = chance.choose(np.repeat(p[:, None], len(index), axis=1))
        return Reservoirs(x, W[chance.choose(np.ones((2, len(index)))), x], np.ones(len(index)))

    return program


def faults(p: Array, W: Array, v: Array) -> tuple[float, float]:
    """How far W is from Def. 4.1 for the indicators, hence for all f, and from E[W | X] = 1 / p_X with p_X = p / v."""
    E = expected_weight(weighted(p, W), v[None])[0]
    given_X = W.mean(axis=0)
    return float(abs(E - v).max()), float(abs(given_X * p / v - 1).max())


positive = st.lists(st.sampled_from([0.25, 1.0, 2.0, 5.0]), min_size=3, max_size=3).map(np.array)
real = st.lists(st.sampled_from([-3.0, -0.5, 0.0, 1.0, 4.0]), min_size=6, max_size=6).map(
    lambda w: np.reshape(w, (2, 3))
)


@pytest.mark.claims("GRIS-TA1")
@given(weights=positive, v=positive, W=real)
def test_a_weight_unbiased_for_every_f_has_the_conditional_mean_1_over_p_and_conversely(weights, v, W) -> None:
    p, mean = weights / weights.sum(), W.mean(axis=0)
    E = expected_weight(weighted(p, W + (mean == 0)), v[None])[0]
    unbiased = (W + (mean == 0)) * v / E  # scaled until Def. 4.1 holds
    centred = W - mean + v / p  # moved until the conditional mean is right
    for made in (unbiased, centred):
        assert max(faults(p, made, v)) < 1e-10


@pytest.mark.claims("GRIS-TA1")
@given(weights=positive, v=positive)
def test_a_weight_that_is_unbiased_for_one_f_only_fails_both(weights, v) -> None:
    """Right for f = 1: what one cell has too much another has too little."""
    p = weights / weights.sum()
    wrong = v / p + np.array([0.1, -0.1, 0]) / p * v.min()
    assert (p * wrong).sum() == pytest.approx(v.sum())
    assert min(faults(p, np.stack([wrong, wrong]), v)) > 0.001


@pytest.mark.claims("GRIS-E09")
@every_robust_weight
@given(scene=scenes(), n=INPUTS)
def test_the_conditional_mean_of_W_Y_is_1_over_the_density_of_Y(mis, scene, n) -> None:
    """The density from transforms, which know no Y and no W_Y; cells that are never sampled have neither."""
    Y, p_Y = selected(one_pass(scene.now, 0, n, mis), scene.v[:1]), by_transform(scene.now, 0, n, mis) / scene.v[0]
    assert ratio(Y.W, Y.P)[0] * p_Y == pytest.approx((p_Y > 0).astype(float), rel=1e-10, abs=1e-13)


@pytest.mark.claims("GRIS-E09")
def test_for_few_inputs_it_is_not_1_over_the_target_density() -> None:
    scene = three_pixel_scene()
    Y = selected(spatial_loop(scene, WEIGHTS["talbot"], 0), scene.v)
    assert abs(ratio(Y.W, Y.P) * share(scene.p_hat, scene.v) / scene.v - scene.support).max() > 0.5


# ---------------------------------------------------------------- the density of Y


@pytest.mark.claims("GRIS-E23")
@every_robust_weight
@given(scene=scenes(), n=INPUTS)
def test_the_density_of_Y_from_transforms_is_the_enumerated_one(mis, scene, n) -> None:
    Y = selected(one_pass(scene.now, 0, n, mis), scene.v[:1])
    assert by_transform(scene.now, 0, n, mis) == pytest.approx(Y.P[0], abs=1e-12)


def test_expected_weights_over_their_expected_sum_are_not_the_density_of_Y() -> None:
    """A mistake: E[w_i] / E[sum w] is the limit."""
    frame = three_pixel_scene().now
    Y = selected(one_pass(frame, 0, (1, 1, 1), WEIGHTS["talbot"]), frame.cells.v[:1])
    assert abs(share(frame.cells.p_hat, frame.cells.v)[0] - Y.P[0]).max() > 0.05


def merged_candidates(frame: Frame, pixel: int, M: int) -> Loop:
    """RIS with M candidates, of which only the number in every cell is drawn: M = 12 has few outcomes."""
    K = frame.cells.v.shape[-1]
    counts = np.array([k for k in product(range(M + 1), repeat=K) if sum(k) == M])
    p = frame.cells.pdf[0, frame.t * frame.n + pixel]
    P = np.array([factorial(M) / prod(map(factorial, k)) for k in counts.tolist()])
    P *= ((p * frame.cells.v[frame.t * frame.n + pixel]) ** counts).prod(axis=-1)

    def loop(index: Array, chance: Chance) -> Reservoirs:
        here = Pixels(frame, np.full(len(index), pixel))
        found = counts[chance.choose(np.repeat(P[:, None], len(index), axis=1))]
        cells = [np.full(len(index), x) for x in range(K)]
        mW = [found[:, x] / (M * p[x]) if p[x] > 0 else np.zeros(len(index)) for x in range(K)]
        offered = [Candidate(x, frame.target(here.index, x), w) for x, w in zip(cells, mW, strict=True)]
        return select(offered, chance, np.ones(len(index)))

    return loop


def row(frame: Frame, pixel: int) -> tuple[Array, Array]:
    """p_hat and v of one pixel, (1, K) each."""
    i = frame.ids(np.array([pixel]))
    return frame.cells.p_hat[i], frame.cells.v[i]


@pytest.mark.claims("GRIS-TA2")
@pytest.mark.parametrize("t", [0, 1])
def test_the_density_of_Y_approaches_the_target_like_1_over_M_and_its_square_like_1_over_M_squared(t) -> None:
    """At the pixels of the reference scene whose candidates are never null."""
    frame, M = reference_scene().frames[t], np.array([1, 2, 3, 4, 6, 8, 12])
    p_hat, v = row(frame, 1)
    P = np.array([selected(merged_candidates(frame, 1, m), v).P[0] for m in M])
    l1, mean_square = l1_distance(P, p_hat, v), mean_square_distance(P, p_hat, v)
    worst = abs(ratio(P, share(p_hat, v)) - (p_hat > 0)).max(axis=-1)
    assert (np.diff([l1, mean_square, worst]) < 0).all()
    assert criteria.slope(M[1:], l1[1:]) == pytest.approx(-1, abs=0.2)
    assert criteria.slope(M[1:], mean_square[1:]) == pytest.approx(-2, abs=0.3)
    assert worst[-1] < 0.2
    figure = [gris_a2.distances(frame, 1, int(m)) for m in M]
    assert figure == pytest.approx(np.stack([l1, mean_square, worst], axis=-1), abs=1e-12)


@pytest.mark.claims("GRIS-TA2")
def test_where_all_candidates_may_be_null_the_density_of_Y_given_a_sample_approaches_the_target() -> None:
    frame = reference_scene().frames[0]
    l1 = [gris_a2.distances(frame, 0, M)[0] for M in (1, 2, 3, 4, 6, 8, 12, 100, 200)]
    assert gris_a2.null(frame, 0) > 0.3
    assert (np.diff(l1) < 0).all()
    assert l1[-1] / l1[-2] == pytest.approx(0.5, abs=0.01)


@pytest.mark.claims("GRIS-TA2")
def test_its_L1_distance_can_rise_before_it_falls_if_the_null_is_not_taken_off() -> None:
    frame = reference_scene().frames[0]
    one, two, many = (float(l1_distance(gris_a2.law(frame, 0, M), *row(frame, 0)).item()) for M in (1, 2, 100))
    assert two > one > many


@pytest.mark.claims("GRIS-TA2")
def test_candidates_that_are_all_the_same_do_not_approach_the_target() -> None:
    """Var[sum w] does not vanish."""
    frame = reference_scene().frames[1]

    def loop(index: Array, chance: Chance) -> Reservoirs:
        here = Pixels(frame, np.full(len(index), 1))
        return gris([Input(initial(here, chance), here)] * 12, here, WEIGHTS["talbot"], chance)

    p_hat, v = row(frame, 1)
    assert l1_distance(selected(loop, v).P, p_hat, v) == pytest.approx(gris_a2.distances(frame, 1, 1)[0])


# ---------------------------------------------------------------- means and variances


@pytest.mark.claims("GRIS-E23")
@every_robust_weight
@given(scene=scenes(), passes=st.integers(0, 1))
def test_the_sum_of_weights_has_the_mean_of_the_targets_integral(mis, scene, passes) -> None:
    Y = selected(spatial_loop(scene, mis, passes), scene.v)
    assert (scene.p_hat * Y.W).sum(axis=-1) == pytest.approx((scene.p_hat * scene.v).sum(axis=-1))


def seven_domains(mis: str, n: int) -> tuple[float, float]:
    """L1 distance and relative Var[sum w] of the centre pixel, n samples per pixel."""
    frame = quotient(overlapping_supports(), 42)
    return gris_a2.centre(frame, drawn(frame), WEIGHTS[mis], n)[:2]


@pytest.mark.claims("GRIS-E23")
@pytest.mark.claims("GRIS-TA3", part="the variance for p_hat = f")
@pytest.mark.claims("GRIS-E36", "GRIS-E37", "GRIS-E38", part="slope on T7")
@pytest.mark.parametrize("name", ROBUST)
def test_with_samples_of_other_domains_the_density_converges_and_the_variance_is_exactly_1_over_n(name) -> None:
    l1, V = np.transpose([seven_domains(name, 4**k) for k in range(6)])
    assert (np.diff(l1) < 0).all()
    assert l1[0] / l1[3] > 8
    assert V[0] / V == pytest.approx(4.0 ** np.arange(6), rel=1e-6)


@pytest.mark.claims("GRIS-E23")
def test_with_1_over_Z_weights_neither_converges() -> None:
    (l1, _), (late, _) = (seven_domains("1/Z", n) for n in (1, 1024))
    assert late > 0.5 * l1


# ---------------------------------------------------------------- known densities instead of targets


def moments_of_the_estimate(mis: Weights, n: int) -> tuple[float, float]:
    """(E, Var) of f(Y) W_Y of T7's centre pixel relative to the integral, exactly: n raw samples per pixel."""
    frame, counts = quotient(overlapping_supports(), 168), np.full(7, n)
    f = frame.cells.f[gris_a2.CENTRE]
    samples = copies(drawn(frame), np.repeat(counts, len(f)))
    Y = mapped(resampled(samples, [reused(frame, gris_a2.CENTRE, counts, mis)]), f[None])
    truth = float(f @ frame.cells.v[gris_a2.CENTRE])
    return float(Y.mean[0]) / truth, float(variance(Y)[0]) / truth**2


N_EACH = 2 ** np.arange(9)


@pytest.mark.claims("GRIS-A20")
@pytest.mark.parametrize("name", ["talbot", "pairwise", "defensive"])
def test_with_known_densities_in_the_weights_seven_domains_are_unbiased_and_the_variance_falls_like_1_over_n(name):
    mean, V = np.transpose([moments_of_the_estimate(TRACTABLE[name], int(n)) for n in N_EACH])
    assert mean == pytest.approx(1, abs=1e-12)
    assert criteria.slope_within(N_EACH, V, -1, 0.1).passed


@pytest.mark.claims("GRIS-A20")
def test_with_known_densities_constant_weights_do_not_converge_or_are_biased() -> None:
    of_one_over_Z = [moments_of_the_estimate(TRACTABLE["1/Z"], int(n))[1] for n in N_EACH]
    assert criteria.slope(N_EACH, of_one_over_Z) > -0.35
    assert moments_of_the_estimate(replace(WEIGHTS["constant"], proxy=pdf), 1)[0] < 0.95


def raw_pass(mis: Weights, n: int, columns: int, chance: Chance) -> Array:
    """f(Y) W_Y of T7's centre pixel from n raw samples per pixel, by the pass itself; (columns,)."""
    line = overlapping_supports()
    at = [Pixels(line, np.full(columns, pixel)) for pixel in range(line.n)]
    here, inputs = at[gris_a2.CENTRE], []
    for each in at * n:
        ((x, W),) = line.candidates(each.index, chance)
        inputs.append(Input(Reservoirs(x, W, np.ones(columns)), each))
    return shade(gris(inputs, here, mis, chance), here)[0]


@pytest.mark.claims("GRIS-A20", part="bias of sampled passes")
@pytest.mark.parametrize("name", ["talbot", "pairwise", "defensive"])
def test_with_known_densities_in_the_weights_sampled_passes_are_unbiased_to_half_a_per_cent(name) -> None:
    truth = integral(overlapping_supports(), gris_a2.CENTRE)
    found = raw_pass(TRACTABLE[name], 2, 64 * 500, live())
    assert criteria.unbiased(found.reshape(64, -1).mean(axis=1), truth).passed


@pytest.mark.claims("GRIS-A20", part="bias of sampled passes")
def test_with_known_densities_constant_weights_are_seen_to_be_biased() -> None:
    truth = integral(overlapping_supports(), gris_a2.CENTRE)
    found = raw_pass(replace(WEIGHTS["constant"], proxy=pdf), 2, 64 * 500, live())
    assert criteria.biased(found.reshape(64, -1).mean(axis=1), truth, -1, -0.01).passed


# ---------------------------------------------------------------- a target that does not fit


def mismatched_wave() -> tuple[float, float]:
    """The limit and the first variance of the figure's mismatched target, by quadrature."""

    def f(x: float) -> float:
        return 1 + 0.9 * np.sin(2 * np.pi * x)

    def p_hat(x: float) -> float:
        return f(x) * (1 + 0.5 * np.sin(2 * np.pi * x))

    norm, over, mean, square = (
        quad(g, 0, 1, epsabs=1e-12)[0] for g in (p_hat, lambda x: f(x) ** 2 / p_hat(x), f, lambda x: f(x) ** 2)
    )
    return norm * over - mean**2, square - mean**2


@pytest.mark.claims("GRIS-E28", "GRIS-C02")
def test_a_target_that_does_not_fit_leaves_the_variance_of_f_over_its_density() -> None:
    a = gris_a2.mismatch({"wave_cells": 64, "M_wave": [1, 2048, 4096]})
    limit, first = mismatched_wave()
    assert (a["limit"], a["wave"][0]) == pytest.approx((limit, first), rel=1e-9)
    assert a["wave"][2] / limit == pytest.approx(1, abs=0.05)
    assert 0 < 1 - a["wave"][2] / a["wave"][1] < 0.03


def large_and_even() -> Scene:
    """The largest integral that is drawn, of which candidates have no variance."""
    one = np.ones((1, 3))
    return Scene([Frame(cells(2 * one, 3 * one, one[None] / 6, paired(1, 3, {})), 1, 0)])


@pytest.mark.claims("GRIS-E28")
@given(scene=scenes(n=1), M=st.integers(1, 4))
@example(scene=large_and_even(), M=4)
def test_a_target_that_fits_leaves_nothing(scene, M) -> None:
    """A variance is a difference of squares, whose rounding it keeps."""
    tables = scene.now.cells
    assert limit_variance(3 * tables.p_hat, tables.p_hat, tables.v) == pytest.approx([0], abs=1e-12)
    V = contribution_variance(selected(candidates(scene.now, M), scene.v), tables.p_hat)
    alone = contribution_variance(selected(candidates(scene.now, 1), scene.v), tables.p_hat)
    square = float(alone[0] + (tables.p_hat * tables.v).sum() ** 2)
    assert pytest.approx(alone / M, abs=1e-13 * square) == V


def candidates(frame: Frame, M: int) -> Loop:
    return lambda index, chance: initial(Pixels(frame, index), chance, M)
