"""Light from all surfaces, a cache's, by resampling: the same image as secondary queries by quadrature, in flatland.

The cache is a smooth field in closed form, so that all that is tested is how it is sampled.
"""

from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from figures.claims.criteria import all_unbiased, biased, mean_and_blocks, unbiased
from flatland2d import SCENES
from restir_ref.batch import Array, ratio
from restir_ref.chance import Live
from restir_ref.integrals import Pixels, Reservoirs
from restir_ref.mis import WEIGHTS
from restir_ref.restir import shade
from restir_ref.transport.cache import integrals as module
from restir_ref.transport.cache.integrals import (
    LIGHTS,
    CacheIntegrals,
    Second,
    asked,
    by_ray,
    connection,
    kept,
    lit,
    radiance,
    unseen,
)
from restir_ref.transport.cache.leaving import Cache, never_lost
from restir_ref.transport.cache.queries import QUERIES, counted
from restir_ref.transport.cache.shading import plain, residual
from restir_ref.transport.counting import CLOSEST, SHADOW
from restir_ref.transport.paths import RECONNECTION, Tracer
from tests.transport.cache.fields import Smooth
from tests.transport.cache.gathered import Drawn, at_centres, drawn, gathered, reused, shown

PIXELS, REPLICAS = 32, 256
CROPS = {"matte_cornell": 240, "crease": 128, "ajar": 224, "glossy_cornell": 240, "occluders": 96}
"""First pixels, on a film of 480, of rows that show what the scenes are for."""


def row(scene: str) -> Tracer:
    setting = SCENES[scene]()
    return Tracer(setting.scene, replace(setting.pinhole(PIXELS, 0), film=480, first=CROPS[scene]), 1, RECONNECTION)


def lighted(scene: str, replicas: int = REPLICAS, G_max: float = np.inf, **other) -> Pixels:
    """Replicas of the row; `other` fields of the integrals."""
    t = row(scene)
    here = at_centres(t, Cache(t.scene, Smooth(2)), replicas, G_max)
    return Pixels(replace(here.of, **other), here.index)


@cache
def truth(scene: str) -> Array:
    """By quadrature; halving the cells changes the mean by less than a tenth of eps = 2 %."""
    of = lighted(scene, 1).of
    fine, coarse = (gathered(of, cells)[0] for cells in (4096, 2048))
    assert abs(fine.mean() - coarse.mean()) < 0.002 * fine.mean()
    return fine


def replicated(image: Array) -> Array:
    """(C, N) -> the first channel, (replicas, pixels)."""
    return image[0].reshape(-1, PIXELS)


Frame = Callable[[Pixels, Live], Drawn]


def image(here: Pixels, frame: Frame, seed: int = 1) -> Array:
    chance = Live(np.random.default_rng(seed))
    return replicated(shown(here, frame(here, chance), chance))


def agrees(scene: str, found: Array, eps: float = 0.02) -> bool:
    return all_unbiased(mean_and_blocks(found, 4), mean_and_blocks(truth(scene), 4), eps).passed


# ---------------------------------------------------------------- one frame


@pytest.mark.claims("DDGIR-A02", part="to 2 %")
@pytest.mark.claims("DDGIR-F02", part="the candidate serves as residual sample, to 2 %")
@pytest.mark.parametrize("G_max", [np.inf, 4.0])
@pytest.mark.parametrize("scene", ["crease", "ajar", "glossy_cornell"])
def test_candidates_alone_are_secondary_queries_in_expectation(scene, G_max) -> None:
    assert agrees(scene, image(lighted(scene, 1024, G_max), drawn))


@pytest.mark.claims("DDGIR-A02", part="control")
def test_a_density_that_is_not_converted_to_area_is_noticed(monkeypatch) -> None:
    right = module.connection
    monkeypatch.setattr(module, "connection", lambda *given: replace(right(*given), p=right(*given).p_w))
    assert not agrees("crease", image(lighted("crease", 1024), drawn))


# ---------------------------------------------------------------- reuse, with visibility and without


@pytest.mark.claims("DDGIR-A03", part="with visibility, to 2 %")
@pytest.mark.claims("COM-B10", part="the same in expectation, to 2 %")
@pytest.mark.parametrize("scene", ["crease", "glossy_cornell", "occluders"])
@pytest.mark.parametrize("mis", ["talbot", "defensive"])
def test_reuse_that_sees_obstacles_is_secondary_queries_in_expectation(scene, mis) -> None:
    here = lighted(scene, 1024, 4.0)
    assert agrees(scene, image(here, lambda here, chance: reused(here, chance, 3, WEIGHTS[mis])))


def blind(here: Pixels, chance: Live) -> Drawn:
    """Visibility in the end only, one ray."""
    found = reused(here, chance, 3)
    return replace(found, X=lit(found.X, here))


@pytest.mark.claims("DDGIR-A03", part="without visibility")
def test_reuse_that_looks_in_the_end_only_is_too_dark_behind_posts() -> None:
    found = image(lighted("occluders", 1024, sight=unseen), blind)
    assert biased(found.mean(axis=1), truth("occluders").mean(), -0.1, -0.01).passed


# ---------------------------------------------------------------- the bound, and what it leaves to the ray


@pytest.mark.claims("DDGIR-E09", part="to 2 %")
@pytest.mark.parametrize("G_max", [1.0, 4.0, 16.0])
def test_with_the_residual_the_bound_changes_no_mean(G_max) -> None:
    assert agrees("crease", image(lighted("crease", 512, G_max), lambda *given: reused(*given, 2)))


@pytest.mark.claims("DDGIR-E09", part="control")
def test_without_the_residual_the_image_is_too_dark(monkeypatch) -> None:
    here, chance = lighted("crease", 256, 4.0), Live(np.random.default_rng(2))
    found = replicated(shade(reused(here, chance, 2).X, here))
    assert biased(found.mean(axis=1), truth("crease").mean(), -0.9, -0.01).passed


def test_delta_lobes_of_x_1_are_left_to_the_ray() -> None:
    """Glass sends all its light by the residual, whatever the bound."""
    setting = SCENES["glass_disc"]()
    t = Tracer(setting.scene, setting.pinhole(8, setting.crop - 100), 1, RECONNECTION)
    here = at_centres(t, Cache(t.scene, Smooth(2)), 64)
    glass = here.of.v.prim == t.scene.S
    frame, chance = drawn(here, Live(np.random.default_rng(3))), Live(np.random.default_rng(4))
    assert glass.any()
    assert (frame.X.W[glass] == 0).all()
    assert (residual(here.of, here.index, frame.found, plain, chance)[0, glass] > 0).all()


# ---------------------------------------------------------------- kept values


def images_of(value, scene: str, **other) -> Array:
    here, chance = lighted(scene, 128, 4.0, value=value, **other), Live(np.random.default_rng(5))
    return replicated(shown(here, reused(here, chance, 2), chance))


@pytest.mark.claims("DDGIR-A08", part="Lambert")
@pytest.mark.parametrize("scene", ["matte_cornell", "ajar"])
def test_on_lambert_surfaces_kept_values_are_the_values_asked_again(scene) -> None:
    np.testing.assert_allclose(images_of(kept, scene), images_of(asked, scene), rtol=1e-12)


@pytest.mark.claims("DDGIR-A08", part="glossy, to 2 %")
@pytest.mark.claims("DDGIR-C03", part="to 2 %")
@pytest.mark.parametrize("value", [kept, asked])
def test_on_glossy_surfaces_neither_is_biased(value) -> None:
    here = lighted("glossy_cornell", 1024, 4.0, value=value)
    assert agrees("glossy_cornell", image(here, lambda *given: reused(*given, 3)))
    assert not np.array_equal(images_of(kept, "glossy_cornell"), images_of(asked, "glossy_cornell"))
