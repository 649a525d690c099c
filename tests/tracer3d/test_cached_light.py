"""Light from all surfaces, a cache's, by resampling: the same image as secondary queries by quadrature, in space."""

from functools import cache

import numpy as np
import pytest

from figures.claims.criteria import all_unbiased, biased, unbiased
from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.integrals import Pixels
from restir_ref.restir import initial, shade, spatial
from restir_ref.transport.cache.leaving import Cache
from restir_ref.transport.paths import RECONNECTION, Tracer
from tests.transport.cache.fields import Smooth
from tests.transport.cache.gathered import Drawn, at_centres, drawn, gathered, shown
from tracer3d import SCENES

SIDE, REPLICAS = 4, 512


def crop(scene: str, replicas: int, G_max: float = np.inf) -> Pixels:
    """Coarse pixels of the whole view."""
    setting = SCENES[scene]()
    t = Tracer(setting.scene, setting.view(SIDE, SIDE), 1, RECONNECTION)
    return at_centres(t, Cache(t.scene, Smooth(3, 3)), replicas, G_max)


@cache
def truth(scene: str) -> Array:
    """By quadrature, (C, n); half as many cells along an angle change the mean by less than a quarter of eps."""
    of = crop(scene, 1).of
    fine, coarse = (gathered(of, cells) for cells in (72, 36))
    assert abs(fine.mean() - coarse.mean()) < 0.005 * fine.mean()
    return fine


def by_channel(image: Array) -> Array:
    """(C, N) -> replicas' means of each channel, (replicas, C)."""
    return image.reshape(3, -1, SIDE**2).mean(axis=2).T


def next_pixel(here: Pixels) -> list[Pixels]:
    n = SIDE**2
    return [Pixels(here.of, here.index - here.index % n + (here.index + by) % n) for by in (1, 4)]


def reused(here: Pixels, chance: Live) -> Drawn:
    frame = drawn(here, chance)
    return Drawn(spatial(frame.X, here, next_pixel(here), chance), frame.found)


@pytest.mark.claims("DDGIR-E09", part="to 2 %")
@pytest.mark.parametrize("G_max", [np.inf, 4.0])
@pytest.mark.parametrize("scene", ["crease", "cornell"])
def test_reuse_that_sees_obstacles_is_secondary_queries_in_expectation(scene, G_max) -> None:
    here, chance = crop(scene, REPLICAS, G_max), Live(np.random.default_rng(1))
    found = shown(here, reused(here, chance), chance)
    assert all_unbiased(by_channel(found), truth(scene).mean(axis=1), eps=0.02).passed


@pytest.mark.claims("DDGIR-E09", part="control")
def test_without_the_residual_the_image_is_too_dark() -> None:
    here, chance = crop("crease", 256, 1.0), Live(np.random.default_rng(2))
    found = by_channel(shade(initial(here, chance), here)).mean(axis=1)
    assert biased(found, truth("crease").mean(), -0.9, -0.01).passed
    assert not unbiased(found, truth("crease").mean(), eps=0.05).passed
