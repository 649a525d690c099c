"""Fluence maps are images of rows and columns: neighbours in a disk change no mean, tiles hold squares of them."""

import numpy as np
import pytest

from flatland2d import SCENES
from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.images import random_in_disk, spread_in_disk, tiles
from restir_ref.integrals import Pixels
from restir_ref.restir import initial, shade, spatial
from restir_ref.transport.baselines.path_reuse import path_reuse
from restir_ref.transport.paths import RECONNECTION, Tracer, radiance, trace
from restir_ref.transport.restir_pt import PathIntegrals

REPLICAS = 64


def fluence_map(scene: str) -> Tracer:
    """Eight by twelve places of the scene."""
    setting = SCENES[scene]()
    return Tracer(setting.scene, setting.fluence(12, 8), setting.depth, RECONNECTION)


def change(around, wrong: float = 1.0) -> tuple[float, float]:
    """z of the change of the mean by one pass, and its standard error relative to the image; W times `wrong`."""
    of, chance = PathIntegrals(fluence_map("crease")), Live(np.random.default_rng(1))
    here = Pixels(of, np.arange(REPLICAS * of.n))
    X = initial(here, chance)
    Y = spatial(X, here, around(of.tracer.sensor.shape)(of, here.index, 3, 3, chance), chance)
    d = (wrong * shade(Y, here) - shade(X, here)).reshape(REPLICAS, -1).mean(axis=1)
    error = d.std(ddof=1) / np.sqrt(REPLICAS)
    return float(d.mean() / error), float(error / shade(X, here).mean())


@pytest.mark.parametrize("around", [random_in_disk, spread_in_disk])
def test_neighbours_in_a_disk_change_no_mean_of_a_map(around):
    z, error = change(around)
    assert error < 0.01
    assert abs(z) < 4


def test_a_change_by_a_tenth_is_noticed():
    assert change(random_in_disk, 1.1)[0] > 8


def sums_over_squares(t: Tracer, order: Array) -> tuple[Array, Array]:
    """Sums over squares of 4 x 4 pixels by path reuse in groups of 16 of this order, and of the same trees without."""
    pixel, found = np.tile(order, 20), []
    for L in (
        path_reuse(t, pixel, Live(np.random.default_rng(2))),
        radiance(trace(t, np.random.default_rng(2).random((t.D, len(pixel))), pixel)),
    ):
        image = np.empty((20, t.sensor.n))
        image[:, order] = L[0].reshape(20, -1)
        found.append(image.reshape(20, 2, 4, 3, 4).sum(axis=(2, 4)))
    return found[0], found[1]


@pytest.mark.claims("COM-B02", part="tiles of 4 x 4 places")
def test_path_reuse_by_tiles_moves_light_inside_squares_of_a_map_only():
    """Crease is Lambert of one albedo, so that samples are handed out whole."""
    reused, alone = sums_over_squares(fluence_map("crease"), tiles((8, 12)))
    assert abs(reused - alone).max() < 1e-12 * alone.mean()


def test_groups_that_are_no_squares_move_light_out_of_them():
    reused, alone = sums_over_squares(fluence_map("crease"), np.arange(96))
    assert abs(reused - alone).max() > 0.01 * alone.mean()
