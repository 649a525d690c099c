"""What DDGI resampling is compared with, on a cache in closed form: each is what its equation says."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from figures.claims.criteria import all_unbiased, mean_and_blocks
from flatland2d import SCENES
from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.integrals import Pixels
from restir_ref.loop import REAL_TIME, random_in_row
from restir_ref.restir import shade
from restir_ref.transport.baselines.probes import direct, primary, secondary
from restir_ref.transport.baselines.restir_di import DEBIASED, direct_light
from restir_ref.transport.cache.frame import frame, image
from restir_ref.transport.cache.integrals import unseen
from restir_ref.transport.cache.leaving import Cache, diffuse
from restir_ref.transport.cache.queries import QUERIES, counted
from restir_ref.transport.cache.shading import own_light, plain
from restir_ref.transport.counting import CLOSEST, SHADOW, rays
from restir_ref.transport.materials import Layer, Material, table
from restir_ref.transport.paths import RECONNECTION, Tracer
from tests.flatland.cached import PIXELS, lighted, replicated, row, truth
from tests.transport.cache.fields import Smooth
from tests.transport.cache.gathered import at_centres


def by_restir_di(here: Pixels, chance: Live) -> Array:
    """Direct light of x_1, its own emission left out."""
    lights = Pixels(direct(here.of), here.index)
    return shade(
        direct_light(lights, random_in_row(lights.of, here.index, 3, 10, chance), DEBIASED["talbot"], chance), lights
    )


@pytest.mark.claims("DDGIR-A10", part="secondary, to 2 %")
@pytest.mark.claims("COM-B10", part="to 2 %")
@pytest.mark.parametrize("scene", ["crease", "glossy_cornell"])
def test_secondary_queries_and_restir_di_are_what_a_cache_sends_to_x_1(scene) -> None:
    here, chance = lighted(scene, 1024), Live(np.random.default_rng(1))
    found = replicated(by_restir_di(here, chance) + secondary(here.of, here.index, plain, chance))
    assert all_unbiased(mean_and_blocks(found, 4), mean_and_blocks(truth(scene), 4), eps=0.02).passed


@pytest.mark.claims("DDGIR-A10", part="ours equals secondary, to 2 %")
@pytest.mark.parametrize("scene", ["crease", "glossy_cornell", "occluders"])
def test_frames_of_ddgi_resampling_are_secondary_queries_in_expectation(scene) -> None:
    """Three frames of the real-time preset; nothing of the row emits."""
    here, chance, now = lighted(scene, 640, 4.0), Live(np.random.default_rng(2)), None
    preset = replace(REAL_TIME, radius=10)
    for _ in range(3):
        now = frame(here, chance, preset, random_in_row, now.X if now else None, [here])
    assert (own_light(here.of, here.index) == 0).all()
    found = replicated(image(now, here, plain, chance))
    assert all_unbiased(mean_and_blocks(found, 4), mean_and_blocks(truth(scene), 4), eps=0.02).passed


@pytest.mark.claims("DDGIR-A10", part="primary")
@pytest.mark.claims("COM-B09", part="Lambert")
def test_on_lambert_surfaces_primary_queries_are_one_query_and_have_no_noise() -> None:
    here = lighted("matte_cornell", 2)
    asked = Counter[str]()
    original = counted(Cache(here.of.scene, Smooth(2)), asked)
    found = primary(here.of, original, here.index, plain, Live(np.random.default_rng(1)))
    np.testing.assert_array_equal(found, diffuse(here.of.cache, here.of.v, here.of.r))
    assert (rays(asked), asked[QUERIES]) == (0, len(here.index))


@pytest.mark.claims("DDGIR-A10", part="primary, glossy paths")
def test_on_glossy_surfaces_primary_and_secondary_queries_are_the_same_ray() -> None:
    setting = SCENES["matte_cornell"]()
    shiny = replace(setting.scene, materials=table([Material([Layer("ggx", (0.7,), 0.4)])] * 2, 1))
    t = Tracer(shiny, setting.pinhole(PIXELS), 1, RECONNECTION)
    here = at_centres(t, Cache(shiny, Smooth(2)), 64)
    by_primary, by_secondary = (
        act(here.of, *given, here.index, plain, Live(np.random.default_rng(3)))
        for act, given in ((primary, [here.of.cache]), (secondary, []))
    )
    assert (by_primary.reshape(64, -1).sum(axis=0) > 0).all()
    np.testing.assert_allclose(by_primary, by_secondary, rtol=1e-9)


def cost(method) -> Counter[str]:
    """Rays and queries per pixel of one frame without history, on the row before posts."""
    asked, t = Counter[str](), row("occluders")
    here = at_centres(t, counted(Cache(t.scene, Smooth(2)), asked), 8, 4.0)
    asked.clear()
    method(here, Live(np.random.default_rng(1)))
    return Counter({name: count / len(here.index) for name, count in asked.items()})


def by_secondary(here: Pixels, chance: Live) -> Array:
    return secondary(here.of, here.index, plain, chance)


def paper_like(here: Pixels, chance: Live) -> Array:
    here = Pixels(replace(here.of, sight=unseen), here.index)
    return image(frame(here, chance, replace(REAL_TIME, radius=10), random_in_row), here, plain, chance)


def looking_at_once(here: Pixels, chance: Live) -> Array:
    return image(frame(here, chance, replace(REAL_TIME, radius=10), random_in_row), here, plain, chance)


@pytest.mark.claims("DDGIR-T2", part="rays per pixel")
def test_resampling_adds_no_closest_hits_and_without_visibility_at_most_one_shadow_ray() -> None:
    assert cost(by_secondary)[CLOSEST] == cost(paper_like)[CLOSEST] == cost(looking_at_once)[CLOSEST] == 1
    assert cost(by_secondary)[SHADOW] == 0
    assert 0 < cost(paper_like)[SHADOW] <= 1
    assert cost(looking_at_once)[SHADOW] > 4


def test_one_frame_asks_for_every_candidate_once_and_to_shade() -> None:
    """4 light points and the ray, kept; then the selected point and the residual's; a Lambert surface is 1 query."""
    assert 4 < cost(paper_like)[QUERIES] <= 4 + 1 + 2
    assert cost(by_secondary)[QUERIES] == 1
