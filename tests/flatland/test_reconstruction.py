"""Reconstruction of the occluder row (FS5) from its own differences, whose sign decides."""

import numpy as np
import pytest

from figures.experiments.references import reference
from flatland2d import SCENES
from restir_ref.batch import Array
from restir_ref.poisson import by_transform, forward, l2, right_side
from restir_ref.transport.paths import RECONNECTION, Tracer, radiance, trace


def occluders() -> tuple[Array, Array]:
    """The reference row, and Delta_i,i+1 = I_i - I_(i+1)."""
    I = reference("occluders").mean
    return I, I[:-1] - I[1:]


def traced(trees: int) -> Array:
    """The same row by so many path trees per pixel."""
    setting = SCENES["occluders"]()
    n = len(occluders()[0])
    t = Tracer(setting.scene, setting.pinhole(n), setting.depth, RECONNECTION)
    u = np.random.default_rng(1).random((t.D, trees * n))
    return np.asarray(radiance(trace(t, u, np.arange(trees * n) % n)).mean(axis=0).reshape(trees, n).mean(axis=0))


def errors(primal: Array) -> tuple[float, float, float]:
    """Mean square errors of the primal row, of what is reconstructed with the right sign, and with the other one."""
    I, delta = occluders()
    wrong = by_transform(I.shape)(right_side(primal, delta))
    return tuple(float(((row - I) ** 2).mean()) for row in (primal, l2(primal, *forward(delta)), wrong))


@pytest.mark.claims("GPT-E01")
def test_differences_of_the_reference_turned_round_give_the_reference():
    I, delta = occluders()
    assert l2(I, *forward(delta)) == pytest.approx(I, rel=1e-12)


@pytest.mark.claims("GPT-E01")
def test_differences_of_the_other_sign_are_worse_than_path_tracing():
    primal, right, wrong = errors(traced(16))
    assert right < 0.1 * primal
    assert wrong > 2 * primal


def test_of_a_single_tree_per_pixel_even_the_wrong_sign_smooths_more_than_it_spoils():
    primal, right, wrong = errors(traced(1))
    assert right < wrong < primal
