"""Every bound of [GRIS 5] against exact values over random scenes, and beside it what breaks it."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from figures.gris.gris_e41 import sticky_share
from restir_ref.batch import Array, ratio, total, where
from restir_ref.chance import Chance, Live
from restir_ref.integrals import Image, Pixels, Reservoirs, target
from restir_ref.mis import ALL_CANONICAL, WEIGHTS, Weights
from restir_ref.oracle import bounds
from restir_ref.oracle.cells import Frame, cells
from restir_ref.oracle.enumeration import Program
from restir_ref.oracle.laws import expected_sum
from restir_ref.oracle.scenes import Loop, Scene, offset, paired, spatial_loop, three_pixel_scene
from restir_ref.oracle.selected import Selected, contribution_variance, selected, share, total_variance
from restir_ref.resampling import Input, gris, select, weigh
from restir_ref.restir import around, capped, initial, shade
from tests.oracle.strategies import TARGETS, scenes, table
from toy1d import overlapping_supports, two_pixels

ROBUST = {name: WEIGHTS[name] for name in ("talbot", "pairwise", "defensive")}
PROMISING = {name: mis for name, mis in WEIGHTS.items() if mis.unbiased_for != ALL_CANONICAL}
UNWEIGHTED = Weights(lambda i, q, c: np.ones(1))

every_robust_weight = pytest.mark.parametrize("mis", ROBUST.values(), ids=ROBUST)
every_promising_weight = pytest.mark.parametrize("mis", PROMISING.values(), ids=PROMISING)

confidences = st.lists(st.sampled_from([0.25, 1.0, 4.0]), min_size=2, max_size=2).map(np.array)


@st.composite
def mismatched(draw: st.DrawFn, n: int = 2) -> Scene:
    """A scene whose target is not proportional to f, though f = 0 where p_hat = 0."""
    tables = draw(scenes(n=n)).now.cells
    return Scene([Frame(replace(tables, f=tables.p_hat * table(draw, tables.f.shape, TARGETS)), n)])


def trusting(c: Array):
    """Gives pixel i the confidence c_i after every step."""

    def edit(X: Reservoirs, here: Pixels) -> Reservoirs:
        return replace(X, c=c[here.index % len(c)])

    return edit


def excess_and_V(scene: Scene, loop: Loop) -> tuple[Array, Array]:
    """Var[f(Y) W_Y] above its limit, and Var[sum w]; (n,) each."""
    Y, tables = selected(loop, scene.v), scene.now.cells
    excess = contribution_variance(Y, tables.f) - bounds.limit_variance(tables.f, tables.p_hat, tables.v)
    return excess, np.maximum(contribution_variance(Y, tables.p_hat), 0)


def bounds_of(scene: Scene, V: Array) -> list[Array]:
    """Bounds on the excess: ours, the paper's with factor 1, the paper's."""
    f, p_hat, v = scene.now.cells.f, scene.now.cells.p_hat, scene.now.cells.v
    C_f, norm = bounds.reasonable(f, p_hat), (p_hat * v).sum(axis=-1)
    looser = [bounds.excess_bound(C_f, V, norm, constant) for constant in (bounds.SHARPER, bounds.PRINTED)]
    return [bounds.sharpest_excess_bound(C_f, V, norm), *looser]


# ---------------------------------------------------------------- Theorem 1


@pytest.mark.claims("GRIS-T1")
@every_robust_weight
@given(scene=mismatched(), c=confidences, passes=st.integers(1, 2))
def test_the_variance_exceeds_its_limit_by_at_most_theorem_1_with_factor_2_or_1(mis, scene, c, passes) -> None:
    excess, V = excess_and_V(scene, spatial_loop(scene, mis, passes, trusting(c)))
    sharpest, sharper, _ = bounds_of(scene, V)
    assert (excess <= sharpest + 1e-12 * (1 + V)).all()
    assert (sharpest <= sharper + 1e-12).all()


@pytest.mark.claims("GRIS-T1")
def test_a_W_Y_without_MIS_weights_violates_theorem_1_whose_V_is_that_of_the_right_weights() -> None:
    scene = three_pixel_scene()
    right, V = excess_and_V(scene, spatial_loop(scene, WEIGHTS["talbot"], 1))
    wrong, _ = excess_and_V(scene, spatial_loop(scene, UNWEIGHTED, 1))
    assert (right <= bounds_of(scene, V)[0]).all()
    assert (wrong > bounds_of(scene, V)[-1]).all()


def test_where_a_target_misses_light_the_limit_variance_is_infinite_as_C_f_is() -> None:
    v = np.array([0.5, 0.5])
    f = np.array([[1.0, 3.0], [1.0, 0.0], [1.0, 3.0]])
    p_hat = np.array([[2.0, 0.0], [2.0, 0.0], [0.0, 0.0]])
    assert bounds.limit_variance(f, p_hat, v).tolist() == [np.inf, 0.0, np.inf]
    assert np.isinf(bounds.reasonable(f, p_hat)).tolist() == [True, False, True]


def test_the_formula_alone_would_call_it_negative() -> None:
    """||p_hat|| int f^2 / p_hat over supp p_hat - (int f)^2 of the first case."""
    assert 1 * 0.25 - (0.5 + 1.5) ** 2 < 0
    assert bounds.limit_variance(np.array([1.0, 3.0]), np.array([2.0, 1e-3]), np.array([0.5, 0.5])) > 1000


# ---------------------------------------------------------------- variance, two other ways


def split_at(Y: Selected, f: Array, centre: Array) -> Array:
    """Var[f(Y) c(Y)] + E[f(Y)^2 E[(W_Y - c(Y))^2 | Y]] for the conditional mean c of Eq. 31, or another."""
    between = (f**2 * centre**2 * Y.P).sum(axis=-1) - (f * centre * Y.P).sum(axis=-1) ** 2
    within = (f**2 * (Y.WW - 2 * centre * Y.W + centre**2 * Y.P)).sum(axis=-1)
    return between + within


@pytest.mark.claims("GRIS-E31")
@every_promising_weight
@given(scene=mismatched(), passes=st.integers(1, 2))
def test_the_variance_is_that_of_f_over_p_Y_plus_the_mean_variance_of_W_Y_given_Y(mis, scene, passes) -> None:
    Y, f = selected(spatial_loop(scene, mis, passes), scene.v), scene.now.cells.f
    centre = ratio(scene.v, Y.P)
    between = (f**2 * centre**2 * Y.P).sum(axis=-1) - (f * scene.v).sum(axis=-1) ** 2
    assert split_at(Y, f, centre) == pytest.approx(contribution_variance(Y, f), rel=1e-9, abs=1e-12)
    parts = total_variance(Y, f)
    assert parts[0] == pytest.approx(between, rel=1e-9, abs=1e-12)
    assert parts[0] + parts[1] == pytest.approx(contribution_variance(Y, f), rel=1e-9, abs=1e-12)


@pytest.mark.claims("GRIS-E31")
def test_the_split_fails_with_the_reciprocal_target_density_for_the_conditional_mean() -> None:
    """As [GRIS 5.3] has it in words: 1 / p_bar(Y) is the limit, not the mean."""
    scene = three_pixel_scene()
    Y, f = selected(spatial_loop(scene, WEIGHTS["talbot"], 1), scene.v), scene.now.cells.f
    p_bar = share(scene.p_hat, scene.v) / scene.v
    assert abs(split_at(Y, f, ratio(np.ones(p_bar.shape), p_bar)) / contribution_variance(Y, f) - 1).max() > 0.01


def frames_of(line: Image, chance: Chance, mis: Weights, frames: int):
    """Frames of temporal and spatial reuse: here, X, and sum w of every pass."""
    here = Pixels(line, np.arange(line.n * 50))
    history = None
    for _ in range(frames):
        X = initial(here, chance)
        past = [] if history is None else [Input(capped(history, 5), Pixels(line, here.index))]
        for inputs in ([Input(X, here), *past], around(X, [offset(line, here.index, by) for by in (1, 2)])):
            offered = list(weigh([Input(X, here), *[each for each in inputs if each.at is not here]], here, mis))
            X = select(offered, chance, X.c + 1)
            yield here, X, total([each.p_hat * each.mW for each in offered])
        history = X


def spread_of_scalar_identity(mis: Weights) -> float:
    """Largest |f(Y) W_Y - C_f sum w| relative to f(Y) W_Y, where f = C_f p_hat; every pixel of every frame."""
    errors = []
    for make in (two_pixels, overlapping_supports):
        line = replace(make(), chroma=lambda i, x: np.full((1, *x.shape), 3.0))
        for here, X, sums in frames_of(line, Live(np.random.default_rng(7)), mis, 4):
            f_W = shade(X, here)[0]
            errors.append(abs(f_W - bounds.proportional(3.0, sums)).max() / f_W.max())
    return max(errors)


@pytest.mark.claims("GRIS-E32", "GPT-E10")
@every_robust_weight
def test_an_integrand_proportional_to_the_target_is_estimated_by_the_sum_of_weights_alone(mis) -> None:
    assert spread_of_scalar_identity(mis) < 1e-13


@pytest.mark.claims("GRIS-E32")
def test_contribution_weights_of_their_own_break_the_scalar_identity() -> None:
    assert spread_of_scalar_identity(WEIGHTS["1/Z"]) > 0.1


# ---------------------------------------------------------------- bounded weights


def over_bounds(scene: Scene, c: Array, mis: Weights, passes: int) -> Program[Array]:
    """Every w_i of the last pass over its bound with the realised C_i = p_hat_i(X_i) W_i, and their sum over theirs."""

    def program(index: Array, chance: Chance) -> Array:
        here = Pixels(scene.now, index)
        X = spatial_loop(scene, mis, passes - 1, trusting(c))(index, chance)
        inputs = [Input(X, here), *around(X, [offset(scene.now, index, 1)])]
        offered = list(weigh(inputs, here, mis))
        Y = select(offered, chance, X.c)
        C = np.stack([target(each.at, each.X.x) * each.X.W for each in inputs])
        given_c = np.stack([each.X.c for each in inputs])
        w = np.stack([each.p_hat * each.mW for each in offered])
        each = ratio(w, bounds.weight_bound(C, given_c, X.c))
        return np.stack([*each, ratio(target(here, Y.x) * Y.W, bounds.sum_bound(C, given_c, X.c))])

    return program


@pytest.mark.claims("GRIS-TA4", "GRIS-E40", part="random finite cells")
@every_robust_weight
@given(scene=scenes(), c=confidences, passes=st.integers(1, 3))
def test_no_weight_and_no_sum_of_weights_exceeds_its_bound_after_any_pass(mis, scene, c, passes) -> None:
    assert bounds.largest(over_bounds(scene, c, mis, passes), 2).max() <= 1 + 1e-12


@pytest.mark.claims("GRIS-E40", part="finite cells, control")
@pytest.mark.parametrize("name", [name for name in WEIGHTS if name not in ROBUST])
def test_weights_without_a_bound_exceed_the_realised_one_of_the_sum(name) -> None:
    exceeded = [
        bounds.largest(over_bounds(three_pixel_scene(), np.ones(3), WEIGHTS[name], k), 3)[-1] for k in (1, 2, 3)
    ]
    assert np.max(exceeded, axis=-1).min() > 1.1


@pytest.mark.claims("GRIS-E26", part="the bounded case")
@every_robust_weight
@given(scene=mismatched(), c=confidences)
def test_contributions_stay_below_C_f_times_the_bound_of_the_sum(mis, scene, c) -> None:
    tables = scene.now.cells
    C = ratio(tables.p_hat, tables.pdf[0]).max(axis=-1)

    def contribution(index: Array, chance: Chance) -> Array:
        return shade(spatial_loop(scene, mis, 1, trusting(c))(index, chance), Pixels(scene.now, index))

    bound = bounds.reasonable(tables.f, tables.p_hat) * bounds.sum_bound(C[:, None], c[:, None], c)
    assert (bounds.largest(contribution, 2)[0] <= bound * (1 + 1e-12)).all()


@pytest.mark.claims("GRIS-E26", part="the constant C_f")
def test_a_target_that_vanishes_where_f_does_not_is_not_reasonable() -> None:
    f, p_hat = np.array([[1.0, 2.0], [1.0, 2.0], [0.0, 0.0]]), np.array([[1.0, 4.0], [0.0, 4.0], [0.0, 1.0]])
    assert bounds.reasonable(f, p_hat).tolist() == [1.0, np.inf, 0.0]


# ---------------------------------------------------------------- variance of the sum


def weight_sums(frame: Frame, M: int, hold: float) -> Program[Array]:
    """sum w and its square over M canonical inputs: X_(k+1) = X_k with probability `hold`, else new."""

    def program(index: Array, chance: Chance) -> Array:
        here = Pixels(frame, index)
        links = [initial(here, chance)]
        for _ in range(M - 1):
            held = chance.choose(np.repeat([[1 - hold], [hold]], len(index), axis=1)) == 1
            links.append(where(held, links[-1], initial(here, chance)))
        S = total([y.p_hat * y.mW for y in weigh([Input(X, here) for X in links], here, WEIGHTS["talbot"])])
        return np.stack([S, S**2])

    return program


def variance_of_sum(frame: Frame, M: int, hold: float) -> Array:
    """Var[sum w], enumerated; (n,)."""
    mean, square = expected_sum(weight_sums(frame, M, hold), frame.n)
    return np.asarray(square - mean**2)


def coin(n: int = 1) -> Frame:
    """p_hat is 2 or 0 with equal chance, so that p_hat W = C or 0: the worst case of Popoviciu's inequality, C = 2."""
    f = np.repeat([[2.0, 0.0]], n, axis=0)
    return Frame(cells(np.full((n, 2), 0.5), f, np.ones((1, n, 2)), paired(n, 2, {})), n)


@pytest.mark.claims("GRIS-E41", part="the bound")
@given(scene=scenes(n=1), M=st.integers(1, 4))
def test_the_variance_of_independent_weights_is_below_popoviciu(scene, M) -> None:
    tables = scene.now.cells
    C = ratio(tables.p_hat, tables.pdf[0]).max(axis=-1)
    bound = bounds.popoviciu(np.full((M, 1), bounds.weight_bound(C, 1, M)))
    assert variance_of_sum(scene.now, M, 0) <= bound * (1 + 1e-12)
    assert bound == pytest.approx(bounds.equal_popoviciu(C, M, M))


@pytest.mark.claims("GRIS-E41", part="a case that attains the bound")
@pytest.mark.parametrize("M", [1, 2, 5])
def test_a_coin_attains_popoviciu(M) -> None:
    assert variance_of_sum(coin(), M, 0)[0] == pytest.approx(float(bounds.equal_popoviciu(2.0, M, M)))


@pytest.mark.claims("GRIS-E42", part="the bound, up to 4 inputs")
@given(scene=scenes(n=1), M=st.integers(1, 4), hold=st.sampled_from([0.5, 0.9, 1.0]))
def test_a_sticky_chain_has_the_variance_the_figure_takes_and_stays_below_its_bound(scene, M, hold) -> None:
    tables = scene.now.cells
    C, alone = ratio(tables.p_hat, tables.pdf[0]).max(), variance_of_sum(scene.now, 1, 0)
    sticky = variance_of_sum(scene.now, M, hold)
    assert sticky == pytest.approx(alone * sticky_share(hold, M), rel=1e-10, abs=1e-13 * C**2)
    assert sticky <= bounds.dependent_bound(C, M, hold ** np.arange(1, M + 1)) * (1 + 1e-12)


@pytest.mark.claims("GRIS-E42", "GRIS-C05", part="dependent inputs")
def test_dependent_weights_exceed_the_bound_of_independent_ones() -> None:
    assert variance_of_sum(coin(), 4, 0.9) > 3 * bounds.equal_popoviciu(2.0, 4, 4)


@pytest.mark.claims("GRIS-C05")
@every_robust_weight
@given(scene=scenes(n=2), k=st.integers(2, 6))
def test_duplicated_inputs_bring_no_variance_reduction(mis, scene, k) -> None:
    """The pixel's own sample and its neighbour's, k times each."""

    def times(k: int) -> Loop:
        def loop(index: Array, chance: Chance) -> Reservoirs:
            here = Pixels(scene.now, index)
            X = initial(here, chance)
            inputs = [Input(X, here), *around(X, [offset(scene.now, index, 1)])]
            return gris(inputs * k, here, mis, chance)

        return loop

    once, often = (contribution_variance(selected(times(m), scene.v), scene.p_hat) for m in (1, k))
    assert often == pytest.approx(once, rel=1e-10, abs=1e-12)


def test_independent_inputs_do_bring_variance_reduction() -> None:
    assert variance_of_sum(coin(), 4, 0) == pytest.approx(variance_of_sum(coin(), 4, 1) / 4)
