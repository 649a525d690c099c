"""Neighbours chosen by G-buffer: like sees like, nearby, and nobody looks at samples."""

import numpy as np
import pytest

from flatland2d import SCENES
from flatland2d.gbuffer import GBuffer, alike, gbuffer
from restir_ref.chance import Live
from restir_ref.integrals import NOWHERE, Pixels
from restir_ref.loop import alike_in_row, random_in_row
from restir_ref.restir import initial, shade, spatial
from restir_ref.transport.paths import RECONNECTION, Tracer
from restir_ref.transport.restir_pt import PathIntegrals

N = 256
every_scene = pytest.mark.parametrize("scene", SCENES)


def seen(scene: str):
    """The G-buffer of the middle of the film."""
    setting = SCENES[scene]()
    return gbuffer(setting.scene, setting.pinhole(N, 832))


def steps(around, radius: float = 20) -> tuple[np.ndarray, np.ndarray]:
    """Pixels (100 N,) and their chosen neighbours."""
    index = np.arange(100 * N)
    of = type("Row", (), {"n": N})()
    found: list[Pixels] = around(of, index, 1, radius, Live(np.random.default_rng(1)))
    near = found[0].index
    return index % N, np.where(near == NOWHERE, NOWHERE, near % N)


@every_scene
def test_pixels_that_see_alike_have_like_normals_and_distances(scene) -> None:
    g = seen(scene)
    i, j = np.nonzero(alike(g))
    assert np.einsum("dk,dk->k", g.n[:, i], g.n[:, j]).min() > np.cos(np.radians(25.1))
    assert (np.abs(g.t[i] - g.t[j]) <= 0.1 * g.t[i]).all()
    assert alike(g).diagonal().all()


def turned_by(degrees: float, distance: float = 1.0) -> GBuffer:
    """Two pixels whose normals differ by an angle; the second one's surface is so many times as far away."""
    a, t = np.radians([40, 40 + degrees]), np.array([2.0, 2.0 * distance])
    return GBuffer(np.zeros((2, 2)), np.stack([np.cos(a), np.sin(a)]), t, np.zeros(2, dtype=int))


@pytest.mark.parametrize(("degrees", "found"), [(0, True), (24.9, True), (-24.9, True), (25.1, False), (-25.1, False)])
def test_alike_are_normals_within_25_degrees(degrees, found) -> None:
    assert alike(turned_by(degrees)).tolist() == [[True, found], [found, True]]


@pytest.mark.parametrize(("distance", "there", "back"), [(1.09, 1, 1), (1.105, 0, 1), (1.12, 0, 0), (0.91, 1, 1)])
def test_alike_are_distances_within_a_tenth_of_one_s_own(distance, there, back) -> None:
    assert alike(turned_by(0, distance)).tolist() == [[True, there], [back, True]]


@every_scene
def test_neighbours_that_see_alike_are_near_and_alike_or_there_are_none(scene) -> None:
    like = alike(seen(scene))
    pixel, near = steps(alike_in_row(like))
    found = near != NOWHERE
    assert like[pixel, near][found].all()
    assert np.abs(pixel - near)[found].max() <= 20
    assert (near != pixel).all()
    alone = (like & (np.abs(np.subtract.outer(np.arange(N), np.arange(N))) <= 20)).sum(axis=1) == 1
    assert (found == ~alone[pixel]).all()


def test_all_that_see_alike_are_equally_likely() -> None:
    like = np.ones((N, N), dtype=bool)
    pixel, near = steps(alike_in_row(like))
    counts = np.bincount((near - pixel)[(pixel > 20) & (pixel < N - 20)] + 20, minlength=41)
    assert counts[20] == 0
    expected = counts.sum() / 40
    assert np.abs(counts[np.arange(41) != 20] / expected - 1).max() < 5 / np.sqrt(expected)


def test_random_neighbours_do_not_see_alike() -> None:
    pixel, near = steps(random_in_row)
    assert not alike(seen("rack"))[pixel, near].all()


def test_choosing_by_g_buffer_changes_no_mean() -> None:
    setting = SCENES["crease"]()
    of = PathIntegrals(Tracer(setting.scene, setting.pinhole(), setting.depth, RECONNECTION))
    here, chance = Pixels(of, np.arange(256 * of.n)), Live(np.random.default_rng(2))
    X = initial(here, chance)
    near = alike_in_row(alike(gbuffer(setting.scene, setting.pinhole())))(of, here.index, 3, 20, chance)
    d = (shade(spatial(X, here, near, chance), here) - shade(X, here)).reshape(256, -1).mean(axis=1)
    error = d.std(ddof=1) / 16
    assert error < 0.005 * shade(X, here).mean()
    assert abs(d.mean()) < 4 * error
