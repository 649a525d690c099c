"""Definition 4.1 for all f at once, over random scenes and every weight that promises it.  [GRIS 4, 5]"""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from restir_ref.batch import Array
from restir_ref.integrals import Pixels
from restir_ref.mis import ALL_CANONICAL, WEIGHTS
from restir_ref.oracle.cells import Frame, cells
from restir_ref.oracle.laws import bias_of, expected_sum
from restir_ref.oracle.scenes import Loop, Scene, offset, paired, spatial_loop, two_frame_loop
from restir_ref.restir import initial, reuse_all, spatial
from tests.oracle.strategies import exactly, fractions, scenes

pytestmark = pytest.mark.kernel

PROMISING = {name: mis for name, mis in WEIGHTS.items() if mis.unbiased_for != ALL_CANONICAL}
CAPS = st.sampled_from([0.5, 1, 2, np.inf])

every_promising_weight = pytest.mark.parametrize("mis", PROMISING.values(), ids=PROMISING)


def largest_bias(loop: Loop, scene: Scene) -> float:
    return float(abs(bias_of(loop, scene.v, scene.support)).max())


@pytest.mark.claims("GRIS-E08", "GRIS-E09", "GRIS-TA1", part="finite cells, initial samples")
@given(scenes(n=1, K=4))
def test_an_initial_sample_is_unbiased(scene: Scene) -> None:
    assert largest_bias(spatial_loop(scene, WEIGHTS["talbot"], 0), scene) < 1e-13


@pytest.mark.claims("GRIS-E05", part="finite cells")
@given(scenes(n=1, K=4, techniques=3))
def test_candidates_of_techniques_that_do_not_all_cover_are_unbiased(scene: Scene) -> None:
    assert largest_bias(spatial_loop(scene, WEIGHTS["talbot"], 0), scene) < 1e-13


@pytest.mark.claims("GRIS-E07", "GRIS-E08", "GRIS-E16", "GRIS-E21", part="finite cells, one spatial pass")
@pytest.mark.claims("GRIS-E36", "GRIS-E37", "GRIS-E38", part="finite cells, one spatial pass")
@every_promising_weight
@given(scene=scenes(n=3), passes=st.just(1))
def test_one_spatial_pass_is_unbiased(mis, scene, passes) -> None:
    assert largest_bias(spatial_loop(scene, mis, passes), scene) < 1e-13


@every_promising_weight
@given(scene=scenes(n=2), passes=st.integers(2, 3))
def test_chained_spatial_passes_are_unbiased(mis, scene, passes) -> None:
    assert largest_bias(spatial_loop(scene, mis, passes), scene) < 1e-13


@every_promising_weight
@given(scene=scenes(n=2, techniques=2))
def test_spatial_reuse_of_two_technique_samples_is_unbiased(mis, scene) -> None:
    assert largest_bias(spatial_loop(scene, mis, 1), scene) < 1e-13


@pytest.mark.claims("GRIS-A05", "GRIS-A18", part="finite cells, two frames")
@every_promising_weight
@given(scene=scenes(n=2, frames=2), cap=CAPS, data=st.data())
def test_two_frames_with_holes_and_capped_confidences_are_unbiased(mis, scene, cap, data) -> None:
    across = data.draw(st.sampled_from(list(PROMISING.values())))
    assert largest_bias(two_frame_loop(scene, mis, across, cap), scene) < 1e-13


@given(scene=scenes(n=2, frames=2), cap=st.sampled_from([1, 2]))
def test_the_oracle_says_exactly_one_in_rational_numbers(scene, cap) -> None:
    exact = exactly(scene)

    def rational(X, here):
        return replace(X, c=fractions(X.c))

    loop = two_frame_loop(exact, cap=Fraction(cap), edit=rational)
    bias = bias_of(loop, exact.v, exact.support)
    assert (bias == 0).all()


@pytest.mark.claims("GRIS-C03", "MCMC-C10", part="bias of 1/M")
@given(scenes(n=2, K=4))
def test_constant_weights_over_unequal_supports_are_biased_by_exactly_Z_over_M(scene: Scene) -> None:
    bias = bias_of(spatial_loop(scene, WEIGHTS["constant"], 1), scene.v, scene.support)
    assert bias == pytest.approx(np.where(scene.support, realising(scene) / 2 - 1, 0), abs=1e-13)


def realising(scene: Scene) -> Array:
    """Z(y): how many pixels can produce y, (n, K)."""
    frame, K = scene.now, scene.v.shape[1]
    Z = np.zeros(scene.v.shape)
    for j in range(frame.n):
        x = np.flatnonzero(frame.cells.p_hat[j] > 0)
        for i in range(frame.n):
            y = frame.cells.shifts[j, i, x]
            Z[i] += np.bincount(y[y >= 0], minlength=K)
    return Z


@pytest.mark.claims("GRIS-C03", "MCMC-C10", part="canonical inputs are unbiased")
@given(st.data())
def test_constant_weights_are_unbiased_where_all_inputs_are_canonical(data) -> None:
    """Same domain, identity shift and full coverage: every input can realise every y."""
    scene = data.draw(scenes(n=2))
    old = scene.now.cells
    v = np.broadcast_to(old.v[:1], old.v.shape)
    everywhere = np.broadcast_to(1 / v.sum(axis=-1, keepdims=True), v.shape)[None]
    f = np.broadcast_to(old.f[:1], old.f.shape)
    tables = cells(v, f, everywhere, paired(2, 3, {(0, 1): (0, 1, 2)}))
    canonical = Scene([Frame(tables, 2)])
    assert largest_bias(spatial_loop(canonical, WEIGHTS["constant"], 2), canonical) < 1e-13


@pytest.mark.claims("GRIS-E15", part="nothing beyond the support")
@given(scenes(n=2))
def test_nothing_is_ever_selected_outside_the_support_of_the_target(scene: Scene) -> None:
    bias = bias_of(spatial_loop(scene, WEIGHTS["talbot"], 1), scene.v, scene.support)
    assert (bias[~scene.support] == 0).all()


@every_promising_weight
@given(scene=scenes(n=3))
def test_summing_all_shifted_samples_is_unbiased(mis, scene) -> None:
    """Bekaert's path reuse: no selection, f = one indicator per cell would do; here f itself."""

    def estimate(index, chance):
        here = Pixels(scene.now, index)
        neighbours = [offset(scene.now, index, by) for by in (1, 2)]
        return reuse_all(initial(here, chance), here, neighbours, mis=mis)

    tables = scene.now.cells
    truth = np.where(scene.support, tables.f * tables.v, 0).sum(axis=-1)
    assert expected_sum(estimate, 3)[0] == pytest.approx(truth, abs=1e-12)


@given(scenes(n=3))
def test_random_neighbours_that_ignore_the_samples_are_unbiased(scene: Scene) -> None:
    def loop(index, chance):
        here = Pixels(scene.now, index)
        X = initial(here, chance)
        step = 1 + chance.choose(np.ones((2, len(index))))
        neighbour = Pixels(scene.now, index - index % 3 + (index + step) % 3)
        return spatial(X, here, [neighbour], chance)

    assert largest_bias(loop, scene) < 1e-13
