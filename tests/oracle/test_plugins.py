"""Stubs of the later systems run through the same passes, and are exactly unbiased."""

import pytest
from hypothesis import given

from restir_ref.decorrelation import mutate
from restir_ref.integrals import Pixels
from restir_ref.mis import WEIGHTS
from restir_ref.oracle.laws import bias_of
from restir_ref.oracle.scenes import offset, reference_scene, spatial_loop, two_frame_loop
from restir_ref.resampling import Input, gris
from restir_ref.restir import initial, spatial, temporal
from tests.oracle.pairs import ENDS, ONE_PAIR, both_signs, labelled, largest_bias, shared
from tests.oracle.strategies import scenes

each_sign = pytest.mark.parametrize("s", [0, 1], ids=["positive", "negative"])

TALBOT = WEIGHTS["talbot"]


@pytest.mark.claims("GPT-E24", "GPT-A09")
@each_sign
@given(scene=scenes(n=3, K=2))
def test_both_signs_of_paired_pixels_are_unbiased_after_spatial_reuse_of_shared_candidates(s, scene) -> None:
    signs = both_signs(scene.now, ENDS)

    def loop(index, chance):
        here = Pixels(signs[s], index)
        X = shared(signs, index, chance)[s]
        return labelled(spatial(X, here, [offset(signs[s], index, 1)], chance), 2)

    assert largest_bias(loop, signs[s], scene) < 1e-13


@pytest.mark.claims("GPT-A09")
@each_sign
@given(scene=scenes(n=2, K=3, frames=2))
def test_positivized_pairs_are_unbiased_over_two_frames_of_shared_candidates(s, scene) -> None:
    """Same-sign and cross-sign history together: three inputs of different integrals."""
    before, now = (both_signs(frame, ONE_PAIR) for frame in scene.frames)

    def loop(index, chance):
        history = shared(before, index, chance)
        here = Pixels(now[s], index)
        X = shared(now, index, chance)[s]
        past = [Input(Y, Pixels(sign, index)) for Y, sign in zip(history, before, strict=True)]
        return labelled(gris([Input(X, here), *past], here, TALBOT, chance), 3)

    assert largest_bias(loop, now[s], scene) < 1e-13


@pytest.mark.claims("MCMC-A02")
@given(scene=scenes(n=2, K=2, frames=2))
def test_mutation_between_temporal_and_spatial_reuse_is_unbiased(scene) -> None:
    before, now = scene.frames

    def loop(index, chance):
        there, here = Pixels(before, index), Pixels(now, index)
        Y, X = initial(there, chance), initial(here, chance)
        X = mutate(temporal(X, here, Y, [offset(before, index, 1)], chance), here, chance)
        return spatial(X, here, [offset(now, index, 1)], chance)

    assert abs(bias_of(loop, scene.v, scene.support)).max() < 1e-13


@pytest.mark.parametrize("loop", [two_frame_loop, lambda scene: spatial_loop(scene, TALBOT, 2)])
def test_the_reference_scene_is_unbiased_before_anything_is_planted(loop) -> None:
    scene = reference_scene()
    assert abs(bias_of(loop(scene), scene.v, scene.support)).max() < 1e-13
