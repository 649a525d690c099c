"""Streaming gives exactly the distribution of selecting from all candidates at once."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from restir_ref.batch import pick, ratio, where
from restir_ref.integrals import Pixels, Reservoirs
from restir_ref.mis import WEIGHTS
from restir_ref.oracle.enumeration import outcomes
from restir_ref.oracle.laws import bias_of
from restir_ref.oracle.scenes import offset, three_pixel_scene
from restir_ref.resampling import Candidate, Input, contribution_weight, select, select_any, weigh
from restir_ref.restir import around, initial
from restir_ref.streaming import Stream, select_streaming
from tests.oracle.strategies import TRACTABLE, scenes

pytestmark = pytest.mark.kernel

WEIGHT_LISTS = st.lists(st.sampled_from([0.0, 0.25, 1.0, 3.0]), min_size=2, max_size=6)


def distribution(selector, w, order) -> dict[tuple[int, float], float]:
    """Probability of every outcome (Y, W)."""
    found: dict[tuple[int, float], float] = {}
    for outcome in outcomes(
        lambda index, chance: selector(lanes(w, order, len(index)), chance, np.ones(len(index))), 1
    ):
        for y, W, p in zip(outcome.result.x, outcome.result.W, outcome.probability, strict=True):
            key = (int(y) if W > 0 else -1, round(float(W), 12))
            found[key] = found.get(key, 0.0) + float(p)
    return found


def lanes(w, order, n) -> list[Candidate]:
    """Candidate k has p_hat = k + 1 and resampling weight w_k, in n lanes."""
    return [Candidate(np.full(n, k), np.full(n, k + 1.0), np.full(n, w[k] / (k + 1))) for k in order]


def select_against_the_old_sum(candidates, chance, c) -> Reservoirs:
    """A mistake: the test uses w_sum before the new weight is added."""
    stream = None
    for new in candidates:
        if stream is None:
            stream = Stream(new, new.p_hat * new.mW)
            continue
        w = new.p_hat * new.mW
        p = np.where(stream.w_sum > 0, np.minimum(w / np.where(stream.w_sum > 0, stream.w_sum, 1), 1), 1.0 * (w > 0))
        replaced = chance.choose(np.stack([1 - p, p])) == 1
        stream = Stream(where(replaced, new, stream.kept), stream.w_sum + w)
    return replace(select_streaming([stream.kept], chance, c), W=stream.w_sum / stream.kept.p_hat)


@pytest.mark.claims("GRIS-A01", "MCMC-A01")
@given(w=WEIGHT_LISTS, data=st.data())
def test_streaming_in_any_order_has_the_distribution_of_selecting_at_once(w, data) -> None:
    order = data.draw(st.permutations(range(len(w))))
    at_once, streamed = distribution(select, w, range(len(w))), distribution(select_streaming, w, order)
    assert streamed == pytest.approx(at_once, abs=1e-13)


@pytest.mark.claims("GRIS-A01", "MCMC-A01")
def test_comparing_with_the_old_sum_of_weights_is_caught() -> None:
    w = [1.0, 2.0, 3.0]
    right, wrong = (distribution(f, w, range(3)) for f in (select, select_against_the_old_sum))
    assert right == pytest.approx({(0, 6.0): 1 / 6, (1, 3.0): 1 / 3, (2, 2.0): 1 / 2})
    assert wrong != pytest.approx(right, abs=0.05)


@pytest.mark.claims("GRIS-E16")
@given(scene=scenes(n=2), raw=st.lists(st.sampled_from([0.1, 1.0, 7.0]), min_size=6, max_size=6))
def test_any_positive_resampling_weights_are_unbiased_with_proper_contribution_weights(scene, raw) -> None:
    """w_i is a number per input and cell that has nothing to do with p_hat."""
    table = np.array(raw).reshape(2, 3)

    def loop(index, chance):
        here = Pixels(scene.now, index)
        X = initial(here, chance)
        ys = list(weigh([Input(X, here), *around(X, [offset(scene.now, index, 1)])], here, WEIGHTS["talbot"]))
        cW = [contribution_weight(y) for y in ys]
        w = [np.where(y.p_hat * y.mW > 0, row[y.x], 0) for row, y in zip(table, ys, strict=True)]
        return select_any([y.x for y in ys], cW, w, chance, X.c)

    assert abs(bias_of(loop, scene.v, scene.support)).max() < 1e-13


@pytest.mark.claims("GRIS-A20", part="bias on finite cells")
@pytest.mark.parametrize("mis", TRACTABLE.values(), ids=TRACTABLE)
@given(scene=scenes(n=3))
def test_known_densities_may_replace_targets_in_the_weights_of_raw_candidates(mis, scene) -> None:
    """The inputs are samples from p_i itself, not resampled ones."""

    def loop(index, chance):
        here = Pixels(scene.now, index)
        ((x, W),) = scene.now.candidates(index, chance)
        X = Reservoirs(x, W, np.ones(len(index)))
        ys = weigh([Input(X, here), *around(X, [offset(scene.now, index, by) for by in (1, 2)])], here, mis)
        return select(ys, chance, X.c)

    assert abs(bias_of(loop, scene.v, scene.support)).max() < 1e-13


# ---------------------------------------------------------------- candidates with and without c/m

SELECTORS = {"select": select, "select_streaming": select_streaming}


def mixture(scene, selector, order):
    """Both pixels' samples twice: a third by Talbot weights, which are their own c_i, and two thirds by 1/Z."""

    def loop(index, chance):
        here = Pixels(scene.now, index)
        X = initial(here, chance)
        inputs = [Input(X, here), *around(X, [offset(scene.now, index, 1)])]
        third, rest = (
            [replace(y, mW=y.mW * share) for y in weigh(inputs, here, WEIGHTS[name])]
            for name, share in (("talbot", 1 / 3), ("1/Z", 2 / 3))
        )
        return selector([[*third, *rest][k] for k in order], chance, X.c)

    return loop


@pytest.mark.parametrize("selector", SELECTORS.values(), ids=SELECTORS)
@given(scene=scenes(n=2), order=st.permutations(range(4)))
def test_candidates_with_corrections_of_their_own_beside_others_are_unbiased(selector, order, scene) -> None:
    assert abs(bias_of(mixture(scene, selector, order), scene.v, scene.support)).max() < 1e-13


def corrected_by_place(candidates, chance, c) -> Reservoirs:
    """A mistake: the c/m of those that have one, numbered anew."""
    offered = list(candidates)
    w = np.stack([each.p_hat * each.mW for each in offered])
    s = chance.choose(w)
    W = ratio(w.sum(axis=0), pick([each.p_hat for each in offered], s))
    listed = [each.c_over_m for each in offered if each.c_over_m is not None]
    anew = np.where(s < len(listed), s, 0)
    return Reservoirs(pick([each.x for each in offered], s), W * pick(listed, anew), c)


@pytest.mark.parametrize("order", [(0, 1, 2, 3), (0, 2, 1, 3)])
def test_corrections_of_the_wrong_candidate_are_biased(order) -> None:
    scene = three_pixel_scene()
    bias, right = (
        abs(bias_of(mixture(scene, selector, order), scene.v, scene.support)).max()
        for selector in (corrected_by_place, select)
    )
    assert bias > 0.05
    assert right < 1e-13
