"""Stubs of the later systems run through the same passes, and are exactly unbiased."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from restir_ref.batch import Array, ratio
from restir_ref.chance import Chance
from restir_ref.decorrelation import mutate
from restir_ref.gradient import Based, Pairs
from restir_ref.integrals import Pixels, Reservoirs, Shifted, target
from restir_ref.mis import WEIGHTS
from restir_ref.oracle.cells import Frame, cells
from restir_ref.oracle.laws import bias_of, bias_per_cell, expected_sum, expected_weight
from restir_ref.oracle.scenes import (
    Scene,
    normalised,
    offset,
    paired,
    reference_scene,
    spatial_loop,
    two_frame_loop,
)
from restir_ref.resampling import Input, gris
from restir_ref.restir import initial, resample, shade, spatial, temporal
from tests.oracle.strategies import scenes

each_sign = pytest.mark.parametrize("s", [0, 1], ids=["positive", "negative"])

TALBOT = WEIGHTS["talbot"]
ENDS = np.array([[0, 1], [1, 2]])  # two pairs of three pixels
ONE_PAIR = ENDS[:, :1]


def labelled(X: Reservoirs, K: int) -> Reservoirs:
    """Samples of the paired domain as one cell number k K + x."""
    return replace(X, x=X.x.k * K + X.x.x)


def paired_domain(pairs: Pairs, v: Array) -> tuple[Array, Array]:
    """Volumes and support of the paired domain, (E, 2 K)."""
    E, K = pairs.ends.shape[-1], v.shape[-1]
    cell = np.arange(2 * K)
    support = [pairs.target(np.full(2 * K, e), Based(cell % K, cell // K)) > 0 for e in range(E)]
    return np.concatenate([v[pairs.ends[0]], v[pairs.ends[1]]], axis=-1), np.stack(support)


def both_signs(frame: Frame, ends: Array) -> tuple[Pairs, Pairs]:
    return Pairs(frame, ends, 1), Pairs(frame, ends, -1)


def shared(signs: tuple[Pairs, Pairs], index: Array, chance: Chance) -> list[Reservoirs]:
    """One set of candidates, drawn once, feeds the reservoirs of both signs."""
    drawn = list(signs[0].candidates(index, chance))
    return [resample(drawn, Pixels(sign, index), chance) for sign in signs]


def largest_bias(loop, pairs: Pairs, scene: Scene) -> float:
    volumes, support = paired_domain(pairs, scene.v)
    return float(abs(bias_per_cell(expected_weight(loop, volumes), volumes, support)).max())


@pytest.mark.claims("GPT-E24", "GPT-E14")
@each_sign
@given(scene=scenes(n=3, K=2))
def test_both_signs_of_paired_pixels_are_unbiased_after_spatial_reuse_of_shared_candidates(s, scene) -> None:
    signs = both_signs(scene.now, ENDS)

    def loop(index, chance):
        here = Pixels(signs[s], index)
        X = shared(signs, index, chance)[s]
        neighbour = Pixels(signs[s], index - index % 2 + (index + 1) % 2)
        return labelled(spatial(X, here, [neighbour], chance), 2)

    assert largest_bias(loop, signs[s], scene) < 1e-13


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


@pytest.mark.claims("GPT-E23")
@given(scenes(n=2, K=3))
def test_the_two_signs_add_up_to_the_difference_of_the_pixels(scene) -> None:
    signs = both_signs(scene.now, ONE_PAIR)

    def estimate(index, chance):
        X = shared(signs, index, chance)
        return sum(shade(Y, Pixels(sign, index)) for Y, sign in zip(X, signs, strict=True))

    means = (scene.now.cells.f * scene.v).sum(axis=-1)
    assert expected_sum(estimate, 1) == pytest.approx(means[0] - means[1], abs=1e-12)


@dataclass(frozen=True, eq=False)
class InnerJacobianInShift(Pairs):
    """A mistake: the offset path's Jacobian multiplied into the outer shift."""

    def shift(self, x: Based, index: Array, to: Pixels) -> Shifted:
        y = super().shift(x, index, to)
        inner = self.of.shift(x.x, self.end(index, x.k), Pixels(self.of, self.end(index, 1 - x.k)))
        return Shifted(y.x, y.J * np.where(inner.J > 0, inner.J, 1))


def falling_scene() -> Scene:
    """f falls from pixel to pixel, so that both pairs are positive and reuse each other's samples."""
    v = np.array([[1.0, 0.5], [0.5, 1.0], [1.0, 2.0]])
    f = np.array([[4.0, 3.0], [2.0, 1.0], [0.5, 0.25]])
    here = {(0, 1): (0, 1), (0, 2): (0, 1), (1, 2): (0, 1)}
    return Scene([Frame(cells(v, f, normalised([[1, 1]] * 3, v.tolist()), paired(3, 2, here)), 3)])


@pytest.mark.claims("GPT-E22")
def test_an_inner_jacobian_in_the_outer_shift_is_caught() -> None:
    scene = falling_scene()
    biases = []
    for kind in (Pairs, InnerJacobianInShift):
        pairs = kind(scene.now, ENDS, 1)

        def loop(index, chance, pairs=pairs):
            here = Pixels(pairs, index)
            neighbour = Pixels(pairs, index - index % 2 + (index + 1) % 2)
            return labelled(spatial(initial(here, chance), here, [neighbour], chance), 2)

        biases.append(largest_bias(loop, pairs, scene))
    assert biases[0] < 1e-13
    assert biases[1] > 0.01


@pytest.mark.claims("MCMC-E03", "MCMC-E06")
@given(scene=scenes(n=1, K=3), steps=st.integers(1, 3))
def test_metropolis_hastings_steps_keep_weights_unbiased(scene, steps) -> None:
    def loop(index, chance):
        here = Pixels(scene.now, index)
        X = initial(here, chance)
        for _ in range(steps):
            X = mutate(X, here, chance)
        return X

    assert abs(bias_of(loop, scene.v, scene.support)).max() < 1e-13


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


def mutate_with_inverted_update(X: Reservoirs, here: Pixels, chance: Chance) -> Reservoirs:
    """A mistake of print: W times mutated over base target."""
    Y = mutate(X, here, chance)
    right = ratio(target(here, X.x), target(here, Y.x))
    return replace(Y, W=X.W * ratio(np.ones(len(right)), right))


@pytest.mark.claims("MCMC-E06")
def test_the_inverted_weight_update_of_a_mutation_is_caught() -> None:
    scene = reference_scene()

    def loop(index, chance):
        here = Pixels(scene.now, index)
        return mutate_with_inverted_update(initial(here, chance), here, chance)

    assert abs(bias_of(loop, scene.v, scene.support)).max() > 0.5


@pytest.mark.parametrize("loop", [two_frame_loop, lambda scene: spatial_loop(scene, TALBOT, 2)])
def test_the_reference_scene_is_unbiased_before_anything_is_planted(loop) -> None:
    scene = reference_scene()
    assert abs(bias_of(loop(scene), scene.v, scene.support)).max() < 1e-13
