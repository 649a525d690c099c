"""Who covers what: supports, canonical inputs, visibility, and contribution weights over realisable inputs only."""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given

from figures.experiments.random_frames import random_frame
from figures.gris import gris_a2, gris_c15
from restir_ref.batch import Array, ratio
from restir_ref.chance import Chance
from restir_ref.integrals import Pixels, Reservoirs
from restir_ref.mis import ALL_CANONICAL, ANY, WEIGHTS, Confidences, Density, Weights, one_over_z, talbot
from restir_ref.oracle.bounds import largest
from restir_ref.oracle.cells import Cells, Frame, cells
from restir_ref.oracle.laws import bias_of
from restir_ref.oracle.moments import drawn
from restir_ref.oracle.scenes import Loop, Scene, normalised, offset, paired, spatial_loop, three_pixel_scene
from restir_ref.oracle.selected import selected
from restir_ref.resampling import Input, contribution_weight, gris, weigh
from restir_ref.restir import initial, spatial
from tests.core.lines import LINES, Slack, integral, made
from tests.oracle.strategies import scenes
from toy1d import Line, overlapping_supports, quotient

PROMISING = {name: mis for name, mis in WEIGHTS.items() if mis.unbiased_for != ALL_CANONICAL}
NEEDING_NOBODY = {name: mis for name, mis in WEIGHTS.items() if mis.unbiased_for == ANY}
TALBOT, CONSTANT = WEIGHTS["talbot"], WEIGHTS["constant"]
CENTRE, OTHERS = 3, (0, 1, 2, 4, 5, 6)

every_promising_weight = pytest.mark.parametrize("mis", PROMISING.values(), ids=PROMISING)

# ---------------------------------------------------------------- contribution functions


def integrals_of_g(line: Line, mis: Weights, order: int = 32) -> float:
    """sum_i int c_i(T_i x) f(T_i x) |dT_i/dx| dx for the centre pixel, over seven domains, by Gauss-Legendre in z."""
    pixel = np.arange(line.n)
    ends = np.concatenate([line.chart.to(pixel, line.low), line.chart.to(pixel, line.high)])
    edges = np.unique(np.concatenate([ends, 0.5 + 0.02 * np.arange(-6, 7)]).round(12))
    u, weight = np.polynomial.legendre.leggauss(order)
    half = np.diff(edges)[:, None] / 2
    z, dz = ((edges[:-1, None] + half) + half * u).ravel(), (half * weight).ravel()
    at = [Pixels(line, np.full(len(z), i)) for i in (CENTRE, *pixel[pixel != CENTRE])]
    x = [line.chart.back(each.index, z) for each in at]
    one = np.ones(len(z))
    inputs = [Input(Reservoirs(x_i, one, one), each) for x_i, each in zip(x, at, strict=True)]
    total = 0.0
    for y, x_i, each in zip(weigh(inputs, at[0], mis), x, at, strict=True):
        dx = dz / line.chart.slope(each.index, x_i) * (line.target(each.index, x_i) > 0)
        total += float((y.p_hat * contribution_weight(y)) @ dx)
    return total


@pytest.mark.claims("GRIS-E13")
@pytest.mark.parametrize("name", ["overlapping_supports", "bent"])
@every_promising_weight
def test_contribution_functions_of_overlapping_images_together_integrate_to_the_integral(name, mis) -> None:
    assert integrals_of_g(LINES[name](), mis) == pytest.approx(integral(name, CENTRE), rel=1e-8)


@pytest.mark.claims("GRIS-E13")
def test_a_missing_jacobian_or_weights_over_unrealisable_inputs_change_the_integral() -> None:
    truth = integral("bent", CENTRE)
    assert abs(integrals_of_g(made(Slack, LINES["bent"]()), TALBOT) / truth - 1) > 0.01
    assert abs(integrals_of_g(LINES["bent"](), CONSTANT) / truth - 1) > 0.01


# ---------------------------------------------------------------- where Y can be


def from_others(frame: Frame, mis: Weights) -> Loop:
    """A pass of pixel 0 over samples of the other pixels only."""

    def loop(index: Array, chance: Chance) -> Reservoirs:
        at = [Pixels(frame, np.full(len(index), i)) for i in range(frame.n)]
        return gris([Input(initial(each, chance), each) for each in at[1:]], at[0], mis, chance)

    return loop


def reached(tables: Cells) -> Array:
    """supp p_hat of pixel 0 intersected with the union of T_i(supp X_i) of all others, (1, K)."""
    found = np.zeros(tables.v.shape[-1], dtype=bool)
    for i in range(1, len(tables.v)):
        images = tables.shifts[i, 0, tables.p_hat[i] > 0]
        found[images[images >= 0]] = True
    return (found & (tables.p_hat[0] > 0))[None]


@pytest.mark.claims("GRIS-E15", "GRIS-A19")
@pytest.mark.parametrize("mis", NEEDING_NOBODY.values(), ids=NEEDING_NOBODY)
@given(scene=scenes(n=3))
def test_without_a_canonical_input_Y_integrates_over_what_shifts_reach_and_loses_exactly_the_rest(mis, scene) -> None:
    tables = scene.now.cells
    bias = bias_of(from_others(scene.now, mis), scene.v[:1], reached(tables))
    assert abs(bias).max() < 1e-12


@pytest.mark.claims("GRIS-E15")
def test_a_gap_that_no_shift_reaches_is_missing_from_the_integral() -> None:
    f, v = np.array([[1.0, 2.0, 3.0], [2.0, 1.0, 1.0]]), np.array([[1.0, 0.5, 0.25], [0.5, 1.0, 1.0]])
    frame = Frame(cells(v, f, normalised(np.ones((2, 3)), v), paired(2, 3, {(0, 1): (1, 0, -1)})), 2)
    Y = selected(from_others(frame, TALBOT), v[:1])
    assert (f[:1] * Y.W).sum() == pytest.approx((f * v)[0].sum() - (f * v)[0, 2])
    assert Y.P[0, 2] == 0


def expected_at_centre(frame: Frame, pixels: Iterable[int]) -> Array:
    """E[f(Y) W_Y 1{Y=y}] of the centre pixel, (K,), from one sample of each of the pixels."""
    W, x = drawn(frame).mean.reshape(7, -1), np.arange(frame.cells.v.shape[-1])
    at, E = [Pixels(frame, np.full(len(x), i)) for i in range(7)], np.zeros(len(x))
    inputs = [Input(Reservoirs(x, W[i], np.ones(len(x))), at[i]) for i in pixels]
    for y in weigh(inputs, at[CENTRE], TALBOT):
        np.add.at(E, y.x, y.mW)
    return frame.cells.f[CENTRE] * E


@pytest.mark.claims("GRIS-A19")
def test_without_its_own_sample_the_centre_of_seven_pixels_loses_exactly_its_exclusive_part() -> None:
    frame = quotient(overlapping_supports(), 42)
    f, v = frame.cells.f, frame.cells.v
    alone = (f[CENTRE] > 0) & ((f > 0).sum(axis=0) == 1)
    truth = f[CENTRE] * v[CENTRE]
    assert expected_at_centre(frame, range(7)) == pytest.approx(truth, rel=1e-12)
    assert expected_at_centre(frame, OTHERS) == pytest.approx(np.where(alone, 0, truth), rel=1e-12)
    assert truth[alone].sum() > 0.01 * truth.sum()


@pytest.mark.claims("GRIS-A19")
@pytest.mark.parametrize("name", [name for name in PROMISING if name not in NEEDING_NOBODY])
def test_weights_that_need_a_canonical_input_say_so(name) -> None:
    with pytest.raises(ValueError, match="canonical"):
        selected(from_others(three_pixel_scene().now, WEIGHTS[name]), np.ones((1, 3)))


# ---------------------------------------------------------------- visibility


def occluded(seen: int) -> Scene:
    """Two pixels of three cells; pixel 1 does not see its cell 1, and its target says so if `seen` is 0."""
    v = np.array([[1.0, 1.0, 0.5], [0.5, 1.0, 1.0]])
    f = np.array([[1.0, 2.0, 1.0], [1.0, 0.0, 2.0]])
    tables = cells(v, f, normalised([[1, 1, 2], [1, 0, 1]], v.tolist()), paired(2, 3, {(0, 1): (0, 1, 2)}))
    without = f.copy()
    without[1, 1] = 2.0 * seen
    return Scene([Frame(replace(tables, p_hat=without), 2)])


@pytest.mark.claims("GRIS-A15")
def test_a_target_with_visibility_is_unbiased_and_one_without_it_is_dark_where_the_neighbour_sees_nothing() -> None:
    light = np.array([[True, True, True], [True, False, True]])
    right, wrong = (bias_of(spatial_loop(occluded(seen), TALBOT, 1), occluded(0).v, light) for seen in (0, 1))
    assert abs(right).max() < 1e-13
    assert wrong[0] == pytest.approx([0, -0.5, 0])


@pytest.mark.claims("GRIS-A15")
def test_a_target_that_its_sampler_never_reaches_keeps_its_distance_from_it() -> None:
    near, far = ([gris_a2.distances(occluded(seen).now, 1, M)[0] for M in (1, 1000)] for seen in (0, 1))
    assert near[1] < 0.01 * near[0]
    assert far[1] > 0.5 * far[0]


def blind_to_ends() -> Frame:
    """T7, but targets and shifts of the others ignore where their domains end, beyond which no sample lands."""
    line, frame = overlapping_supports(), quotient(overlapping_supports(), 42)
    edges = np.linspace(line.low.min(), line.high.max(), 43)
    p_hat = line.f(np.arange(7)[:, None], (edges[1:] + edges[:-1]) / 2)
    p_hat[CENTRE] = frame.cells.p_hat[CENTRE]
    return Frame(replace(frame.cells, p_hat=p_hat, shifts=np.broadcast_to(np.arange(42), (7, 7, 42))), 7)


@pytest.mark.claims("GRIS-A15")
def test_neighbours_whose_targets_ignore_the_ends_of_their_domains_make_the_centre_of_seven_pixels_dark() -> None:
    frames = (quotient(overlapping_supports(), 42), blind_to_ends())
    right, wrong = (expected_at_centre(frame, range(7)) for frame in frames)
    cells = quotient(overlapping_supports(), 42).cells
    truth = (cells.f * cells.v)[CENTRE]
    assert right == pytest.approx(truth, rel=1e-12)
    assert (wrong <= truth * (1 + 1e-12)).all()
    assert wrong.sum() < 0.9 * truth.sum()


# ---------------------------------------------------------------- contribution weights


def one_negative(i: int, q: Density, c: Confidences) -> Array:
    """c_0 = 3/2 and c_1 = -1/2 where both inputs can realise y, 1 where only one can."""
    both = (q(0) > 0) & (q(1) > 0)
    return np.where(both, (1.5, -0.5)[i], one_over_z(i, q, c))


def over_everybody(i: int, q: Density, c: Confidences) -> Array:
    """A mistake: c_i = 1/M, which sums to 1 over all inputs instead of those that can realise y."""
    return ratio(c[i], c.C)


NEGATIVE, EVERYBODY = Weights(talbot, one_negative), Weights(talbot, over_everybody)


@pytest.mark.claims("GRIS-E17")
@given(scene=scenes())
def test_contribution_weights_need_only_sum_to_one_over_realisable_inputs_and_may_be_negative(scene) -> None:
    assert abs(bias_of(spatial_loop(scene, NEGATIVE, 1), scene.v, scene.support)).max() < 1e-12


@pytest.mark.claims("GRIS-E17")
def test_contribution_weights_that_sum_to_one_over_all_inputs_are_biased() -> None:
    scene = three_pixel_scene()
    bias = bias_of(spatial_loop(scene, EVERYBODY, 1), scene.v, scene.support)
    assert bias.min() < -0.3
    assert bias.max() < 1e-13


@pytest.mark.claims("GRIS-E17")
def test_negative_contribution_weights_give_negative_W_which_cannot_be_chained() -> None:
    frame = three_pixel_scene().now

    def once(index: Array, chance: Chance) -> Reservoirs:
        here = Pixels(frame, index)
        return spatial(initial(here, chance), here, [offset(frame, index, 1)], chance, mis=NEGATIVE)

    def twice(index: Array, chance: Chance) -> Reservoirs:
        return spatial(once(index, chance), Pixels(frame, index), [offset(frame, index, 1)], chance)

    assert largest(lambda index, chance: -once(index, chance).W[None], 3).min() > 0
    with pytest.raises(ValueError, match="the weight W of input"):
        selected(twice, frame.cells.v)


# ---------------------------------------------------------------- several shifts of one sample


@pytest.mark.claims("GRIS-C15")
@every_promising_weight
@given(scene=scenes(n=3))
def test_one_sample_through_two_shift_maps_is_unbiased(mis, scene) -> None:
    frame = gris_c15.two_maps(scene.now)
    for _, c in gris_c15.WAYS[2:]:
        bias = bias_of(gris_c15.merge(frame, (1, 2), c, mis), frame.cells.v[:1], frame.cells.p_hat[:1] > 0)
        assert abs(bias).max() < 1e-12


@pytest.mark.claims("GRIS-C15")
@pytest.mark.parametrize("name", gris_c15.LINEAR)
@given(scene=scenes(n=3))
def test_pairwise_weights_of_two_maps_that_share_a_confidence_are_the_average_of_the_single_maps(name, scene) -> None:
    """So the variance of sum w is at most the larger of the two, by convexity."""
    frame = gris_c15.two_maps(scene.now)
    for x in range(3):
        for x_j in range(3):
            one, other, both = (sum_of_weights(frame, maps, c, x, x_j, name) for maps, c in gris_c15.WAYS[:3])
            assert both == pytest.approx((one + other) / 2, abs=1e-12)


def sum_of_weights(frame: Frame, maps: tuple[int, ...], c: float, x: int, x_j: int, name: str) -> float:
    """sum w with the own sample in cell x and the neighbour's in x_j, W = 1."""
    at = [Pixels(frame, np.array([i])) for i in range(3)]
    one = np.ones(1)
    through = [Input(Reservoirs(np.array([x_j]), one, c * one), at[i]) for i in maps]
    inputs = [Input(Reservoirs(np.array([x]), one, one), at[0]), *through]
    return float(sum((y.p_hat * y.mW).item() for y in weigh(inputs, at[0], WEIGHTS[name])))


def test_talbot_weights_of_two_maps_are_no_average() -> None:
    frame = gris_c15.two_maps(random_frame(3, 3, np.random.default_rng(3)))
    one, other, both = (sum_of_weights(frame, maps, c, 0, 0, "talbot") for maps, c in gris_c15.WAYS[:3])
    assert abs(both - (one + other) / 2) > 1e-3
