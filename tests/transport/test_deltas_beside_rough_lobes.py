"""Walls that scatter and mirror at once: a delta lobe has no density, and light sampling never stands for it."""

import numpy as np
import pytest

from flatland2d import PLANE, Pinhole
from flatland2d.scenes import room
from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.transport.baselines.path_reuse import path_reuse
from restir_ref.transport.materials import Layer, Material
from restir_ref.transport.paths import RECONNECTION, Tracer, leaves, radiance, trace
from restir_ref.transport.proofs.reading import contribution, density, extended_path, factors
from restir_ref.transport.scene import scene

FURNACE = 1 + 0.5 + 0.5**2 + 0.5**3
"""Radiance in a closed room that emits 1 and has albedo .5, after three scattering events."""


def furnace() -> Tracer:
    """One tile of such a room, whose albedo is .3 by Lambert and .2 by a mirror."""
    walls = Material([Layer("lambert", (0.3,), weight=0.5), Layer("mirror", (0.2,), weight=0.5)])
    s = scene(PLANE, [walls], room(0, emission=1.0))
    return Tracer(s, Pinhole((0.4, 0.6), (0.5, 0.0), 16, film=16), 3, RECONNECTION)


def by_trees(t: Tracer, pixel: Array, rng: np.random.Generator) -> Array:
    return radiance(trace(t, rng.random((t.D, len(pixel))), pixel))


def by_path_reuse(t: Tracer, pixel: Array, rng: np.random.Generator) -> Array:
    return path_reuse(t, pixel, Live(rng))


def z_of_furnace(estimate) -> float:
    """|z| of 2500 images of the furnace; their standard error must be below .2 %."""
    means = estimate(furnace(), np.arange(40_000) % 16, np.random.default_rng(1))[0].reshape(-1, 16).mean(axis=1)
    error = means.std(ddof=1) / np.sqrt(len(means))
    assert error < 0.002 * FURNACE
    return float(abs(means.mean() - FURNACE) / error)


@pytest.mark.parametrize("estimate", [by_trees, by_path_reuse])
def test_a_furnace_whose_walls_scatter_and_mirror_has_its_closed_form(estimate) -> None:
    assert z_of_furnace(estimate) < 4


def without_mirrors(t: Tracer, pixel: Array, rng: np.random.Generator) -> Array:
    """A mistake: what a mirror shows of a light is left to light sampling."""
    tree = trace(t, rng.random((t.D, len(pixel))), pixel)
    return radiance(tree) - sum(F * (tree.at[k - 1].p == 0) for k, nee, F in leaves(tree) if k and not nee)


def test_mirrors_whose_light_is_left_to_light_sampling_are_noticed() -> None:
    assert z_of_furnace(without_mirrors) > 20


def test_readings_of_leaves_that_scatter_beside_a_mirror_are_what_the_tree_recorded() -> None:
    t, pixel = furnace(), np.arange(3200) % 16
    u = np.random.default_rng(2).random((t.D, 3200))
    for k, nee, F in leaves(trace(t, u, pixel)):
        x = extended_path(t, u, pixel, np.full(3200, k), np.full(3200, nee))
        of = factors(t, x)
        p = density(of)
        some = p > 0
        assert some.mean() > 0.1
        assert contribution(x, of)[:, some] / p[some] == pytest.approx(F[:, some], rel=1e-9)
