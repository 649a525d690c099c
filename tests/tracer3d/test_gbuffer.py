"""Neighbours chosen by G-buffer: like sees like, without a table of all pairs, and no mean changes."""

import tracemalloc

import numpy as np
import pytest

from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.images import alike_among, random_in_disk, spread_in_disk
from restir_ref.integrals import NOWHERE, Pixels
from restir_ref.restir import initial, shade, spatial
from restir_ref.transport.restir_pt import PathIntegrals
from tests.tracer3d.views import HYBRID, tracer
from tracer3d import SCENES
from tracer3d.gbuffer import GBuffer, alike, gbuffer

every_scene = pytest.mark.parametrize("scene", SCENES)


def turned_by(degrees: float, distance: float = 1.0, met: bool = True) -> GBuffer:  # noqa: FBT001, FBT002
    """Two pixels whose normals differ by an angle; the second one's surface is so many times as far away."""
    a = np.radians([40, 40 + degrees])
    n = np.stack([np.cos(a), 0 * a, np.sin(a)])
    return GBuffer(np.zeros((3, 2)), n, np.array([2.0, 2.0 * distance]), np.zeros(2, dtype=int), np.array([True, met]))


def both_ways(g: GBuffer) -> list[bool]:
    """Whether pixel 1 sees like 0, and 0 like 1."""
    return alike(g)(np.array([0, 1]), np.array([1, 0])).tolist()


@pytest.mark.parametrize(("degrees", "found"), [(0, True), (24.9, True), (-24.9, True), (25.1, False), (-25.1, False)])
def test_alike_are_normals_within_25_degrees(degrees, found):
    assert both_ways(turned_by(degrees)) == [found, found]


@pytest.mark.parametrize(("distance", "there", "back"), [(1.09, 1, 1), (1.105, 0, 1), (1.12, 0, 0), (0.91, 1, 1)])
def test_alike_are_distances_within_a_tenth_of_one_s_own(distance, there, back):
    assert both_ways(turned_by(0, distance)) == [there, back]


def test_nothing_is_alike_to_nothing():
    assert both_ways(turned_by(0, met=False)) == [False, False]


@every_scene
def test_neighbours_that_see_alike_are_near_and_alike_or_there_are_none(scene):
    setting = SCENES[scene]()
    sensor = setting.view(48, 27)
    g = gbuffer(setting.scene, sensor)
    of, pixel = type("Image", (), {"n": sensor.n})(), np.arange(sensor.n)
    for around in (random_in_disk(sensor.shape), spread_in_disk(sensor.shape)):
        for near in alike_among(alike(g), around)(of, pixel, 3, 6, Live(np.random.default_rng(1))):
            found = near.index != NOWHERE
            assert found.mean() > 0.3
            assert (near.index != pixel).all()
            assert alike(g)(pixel, near.index)[found].all()
            assert np.hypot(near.index % 48 - pixel % 48, near.index // 48 - pixel // 48)[found].max() <= 6


def test_the_choice_needs_memory_for_its_columns_not_for_all_pairs():
    setting = SCENES["cornell"]()
    sensor = setting.view(128, 128)
    g = gbuffer(setting.scene, sensor)
    of, pixel = type("Image", (), {"n": sensor.n})(), np.arange(sensor.n)
    tracemalloc.start()
    alike_among(alike(g), random_in_disk(sensor.shape))(of, pixel, 3, 10, Live(np.random.default_rng(1)))
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < sensor.n**2 / 10


def change_of_the_mean(choice) -> tuple[float, float]:
    """z of the change by one pass with chosen neighbours, and its standard error relative to the image."""
    t = tracer("glossy_cornell", HYBRID, 12)
    of, chance = PathIntegrals(t), Live(np.random.default_rng(2))
    here = Pixels(of, np.arange(128 * of.n))
    X = initial(here, chance)
    near = choice(t, X)(of, here.index, 2, 5, chance)
    d = (shade(spatial(X, here, near, chance), here) - shade(X, here)).mean(axis=0).reshape(128, -1).mean(axis=1)
    error = d.std(ddof=1) / np.sqrt(128)
    return float(d.mean() / error), float(error / shade(X, here).mean())


def by_g_buffer(t, X):
    """As it should be."""
    return alike_among(alike(gbuffer(t.scene, t.sensor)), random_in_disk(t.sensor.shape))


def by_sample(t, X):
    """A mistake: alike is what has more light."""
    light: Array = (X.x.F.mean(axis=0) * X.W).reshape(128, -1)

    def brighter(of, index, count, radius, chance):
        left, right = random_in_disk(t.sensor.shape)(of, index, 2, radius, chance)
        better = light.reshape(-1)[left.index] > light.reshape(-1)[right.index]
        return [Pixels(of, np.where(better, left.index, right.index))]

    return brighter


def test_choosing_by_g_buffer_changes_no_mean():
    z, error = change_of_the_mean(by_g_buffer)
    assert error < 0.01
    assert abs(z) < 4


def test_choosing_by_sample_does():
    assert change_of_the_mean(by_sample)[0] > 8
