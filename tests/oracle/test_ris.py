"""RIS in one domain, and the identity behind all of GRIS; each with the mistakes it must catch.  [GRIS 2, 4]"""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from restir_ref.batch import Array, ratio
from restir_ref.chance import Live
from restir_ref.integrals import Pixels, Reservoirs, pdf, target
from restir_ref.oracle.laws import bias_of, expected_sum
from restir_ref.oracle.scenes import Scene, reference_scene
from restir_ref.resampling import Candidate, select, select_any
from restir_ref.restir import initial
from tests.oracle.strategies import scenes

M_VALUES = st.integers(1, 4)


def largest_bias(loop, scene: Scene) -> float:
    return float(abs(bias_of(loop, scene.v, scene.support)).max())


@pytest.mark.claims("GRIS-E01", "GRIS-E02", "GRIS-E03")
@pytest.mark.claims("GRIS-E08", "GRIS-E09", part="finite cells, initial samples")
@given(scene=scenes(n=1, K=3), M=M_VALUES)
def test_RIS_over_M_candidates_is_unbiased_for_all_f_at_once(scene, M) -> None:
    assert largest_bias(lambda index, chance: initial(Pixels(scene.now, index), chance, M), scene) < 1e-13


def without_1_over_M(X: Reservoirs, here: Pixels, M: int) -> Array:
    return X.W * M


def divided_by_M_again(X: Reservoirs, here: Pixels, M: int) -> Array:
    return X.W / M


def one_over_p(X: Reservoirs, here: Pixels, M: int) -> Array:
    return np.where(X.W > 0, ratio(np.ones(len(X.W)), pdf(here, X.x)), 0)


@pytest.mark.claims("GRIS-E01", "GRIS-E02", "GRIS-E03")
@pytest.mark.parametrize("mistake", [without_1_over_M, divided_by_M_again, one_over_p])
def test_RIS_with_a_wrong_weight_is_caught(mistake) -> None:
    scene = reference_scene()

    def loop(index, chance):
        here = Pixels(scene.now, index)
        X = initial(here, chance, 2)
        return replace(X, W=mistake(X, here, 2))

    assert largest_bias(loop, scene) > 0.05


@pytest.mark.claims("GRIS-E10")
@given(scene=scenes(n=1, K=3), data=st.data())
def test_any_positive_weights_keep_sums_of_integrals(scene, data) -> None:
    """E[g_s(X_s) W_s / p_s(s)] = sum_i of the integral of g_i over supp X_i."""
    numbers = st.lists(st.sampled_from([0.1, 1.0, 2.5, 7.0]), min_size=6, max_size=6)
    w_table, g_table = (np.array(data.draw(numbers)).reshape(2, 3) for _ in range(2))

    def estimate(index, chance):
        drawn = [x for _ in range(2) for x in scene.now.candidates(index, chance)]
        w = [row[x] for row, (x, _) in zip(w_table, drawn, strict=True)]
        gW = [row[x] * W for row, (x, W) in zip(g_table, drawn, strict=True)]
        return select_any([x for x, _ in drawn], gW, w, chance, np.ones(len(index))).W[None]

    covered = scene.now.cells.pdf[0, 0] > 0
    truth = (g_table * scene.v[0] * covered).sum()
    assert expected_sum(estimate, 1)[0, 0] == pytest.approx(truth, rel=1e-12)


@pytest.mark.claims("GRIS-E11")
@given(scene=scenes(n=1, K=3), M=M_VALUES, data=st.data())
def test_in_one_domain_any_weights_over_w_s_are_unbiased(scene, M, data) -> None:
    """W_Y = (1/M) (sum_j w_j / w_s) W_s."""
    table = np.array(data.draw(st.lists(st.sampled_from([0.2, 1.0, 5.0]), min_size=3, max_size=3)))

    def loop(index, chance):
        drawn = [x for _ in range(M) for x in scene.now.candidates(index, chance)]
        w = [table[x] for x, _ in drawn]
        return select_any([x for x, _ in drawn], [W / M for _, W in drawn], w, chance, np.ones(len(index)))

    assert abs(bias_of(loop, scene.v, scene.now.cells.pdf[0] > 0)).max() < 1e-12


@pytest.mark.claims("GRIS-E11")
def test_in_one_domain_the_general_weight_is_that_of_RIS_for_its_own_weights() -> None:
    rng = np.random.default_rng(5)
    scene = reference_scene()
    here = Pixels(scene.now, np.arange(2000))
    x, W = rng.integers(0, 2, (4, 2000)), rng.random((4, 2000))
    p_hat = [target(here, each) for each in x]
    c = np.ones(2000)
    candidates = [Candidate(each, p, w / 4) for each, p, w in zip(x, p_hat, W, strict=True)]
    by_eq_2 = select(candidates, Live(np.random.default_rng(7)), c)
    by_eq_11 = select_any(
        list(x),
        [w / 4 for w in W],
        [p * w / 4 for p, w in zip(p_hat, W, strict=True)],
        Live(np.random.default_rng(7)),
        c,
    )
    assert (by_eq_2.x == by_eq_11.x).all()
    assert pytest.approx(by_eq_2.W, rel=1e-12) == by_eq_11.W
