"""Light from all surfaces, a cache's, by resampling: the same image as secondary queries by quadrature, in flatland.

The cache is a smooth field in closed form, so that all that is tested is how it is sampled.
"""

from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from figures.claims.criteria import all_unbiased, biased, mean_and_blocks
from flatland2d import PLANE, SCENES, Pinhole
from flatland2d.scenes import LAMP, chain, matte
from restir_ref.batch import Array, ratio, take
from restir_ref.chance import Live
from restir_ref.integrals import Pixels, Reservoirs
from restir_ref.loop import random_in_row
from restir_ref.mis import WEIGHTS
from restir_ref.restir import shade, spatial, temporal
from restir_ref.transport.cache import integrals as module
from restir_ref.transport.cache.integrals import (
    LIGHTS,
    CacheIntegrals,
    Second,
    asked,
    connection,
    kept,
    lit,
    radiance,
    unseen,
)
from restir_ref.transport.cache.leaving import Cache, gloss, never_lost
from restir_ref.transport.cache.queries import QUERIES, counted
from restir_ref.transport.cache.shading import bounded, plain, residual
from restir_ref.transport.counting import CLOSEST, SHADOW
from restir_ref.transport.materials import Layer, Material
from restir_ref.transport.paths import RECONNECTION, Tracer
from restir_ref.transport.scene import scene as compiled
from tests.flatland.cached import PIXELS, agrees, lighted, replicated, row, truth
from tests.transport.cache.fields import Beam, Smooth
from tests.transport.cache.gathered import Drawn, at_centres, drawn, gathered, reused, shown, unchanged

Frame = Callable[[Pixels, Live], Drawn]


def image(here: Pixels, frame: Frame, seed: int = 1) -> Array:
    chance = Live(np.random.default_rng(seed))
    return replicated(shown(here, frame(here, chance), chance))


# ---------------------------------------------------------------- one frame


@pytest.mark.claims("DDGIR-A02", part="to 2 %")
@pytest.mark.claims("DDGIR-F02", part="the candidate serves as residual sample, to 2 %")
@pytest.mark.parametrize("G_max", [np.inf, 4.0])
@pytest.mark.parametrize("scene", ["crease", "ajar", "glossy_cornell"])
def test_candidates_alone_are_secondary_queries_in_expectation(scene, G_max) -> None:
    assert agrees(scene, image(lighted(scene, 640, G_max), drawn))


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
    here = lighted(scene, 640, 4.0)
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
    here = lighted("glossy_cornell", 640, 4.0, value=value)
    assert agrees("glossy_cornell", image(here, lambda *given: reused(*given, 3)))
    assert not np.array_equal(images_of(kept, "glossy_cornell"), images_of(asked, "glossy_cornell"))


# ---------------------------------------------------------------- what may not be done with kept values


def shiny(replicas: int) -> Pixels:
    """A matte floor between glossy walls, and a field that is bright from one side: values depend on who asks."""
    walls = Material([Layer("lambert", (0.2,), weight=0.2), Layer("ggx", (0.6,), 0.4, weight=0.6)])
    facets = [*chain([(0, 0), (1, 0)], 1), *chain([(1, 0), (1, 1), (0, 1), (0, 0)], 0), *chain(LAMP, 0, 1.0)]
    t = Tracer(
        compiled(PLANE, [walls, matte(0.7)], facets),
        Pinhole((0.5, 0.7), (0.45, 0.0), PIXELS, film=PIXELS),
        1,
        RECONNECTION,
    )
    return at_centres(t, Cache(t.scene, Beam(2)), replicas)


@cache
def shiny_truth() -> Array:
    return gathered(shiny(1).of, 2048, 16)[0]


def known(of: CacheIntegrals, index: Array, x: Second) -> Array:
    return radiance(of.cache, x, connection(of, index, x), never_lost).mean(axis=0)


def asked_again(here: Pixels, X: Reservoirs, chance: Live) -> Reservoirs:
    """A mistake: a renderer keeps the sum of weights, and divides by a target that this x_1 looks up."""
    return replace(X, W=X.W * ratio(X.x.L.mean(axis=0), known(here.of, here.index, X.x)))


def redrawn(here: Pixels, X: Reservoirs, chance: Live) -> Reservoirs:
    """A mistake: the same, and the glossy sample of the target is drawn anew."""
    u = chance.uniform(X.x.u.shape)
    return replace(X, W=X.W * ratio(X.x.L.mean(axis=0), known(here.of, here.index, replace(X.x, u=u))))


def shiny_image(replicas: int, after=unchanged) -> Array:
    here, chance = shiny(replicas), Live(np.random.default_rng(1))
    return replicated(shown(here, reused(here, chance, 3, after=after), chance))


def test_where_values_depend_on_who_asks_kept_ones_are_unbiased() -> None:
    blocks = mean_and_blocks(shiny_truth(), 4)
    assert all_unbiased(mean_and_blocks(shiny_image(768), 4), blocks, eps=0.02).passed


@pytest.mark.claims("DDGIR-A08", part="control")
def test_dividing_by_a_value_that_this_pixel_looks_up_is_biased() -> None:
    """Upwards, E[1 / X] being more than 1 / E[X]: +29 %."""
    assert biased(shiny_image(512, asked_again).mean(axis=1), shiny_truth().mean(), 0.1, 1).passed


@pytest.mark.claims("DDGIR-A08", part="control")
def test_dividing_by_a_redrawn_value_is_biased() -> None:
    """+8 % if it happens once, in the end; after every pass the mean is without meaning, and the median 6 times off."""
    here, chance = shiny(512), Live(np.random.default_rng(1))
    frame = reused(here, chance, 1)
    found = replicated(shown(here, replace(frame, X=redrawn(here, frame.X, chance)), chance)).mean(axis=1)
    assert biased(found, shiny_truth().mean(), 0.01, 1).passed
    assert np.median(shiny_image(128, redrawn).mean(axis=1)) > 3 * shiny_truth().mean()


def by_contributions(here: Pixels, chance: Live) -> Array:
    """The image by `shade` alone: bounded light by f W (L_e + L+), the rest by the ray."""
    frame = reused(here, chance, 3)
    return replicated(shade(frame.X, here) + residual(here.of, here.index, frame.found, plain, chance))


def test_contributions_ask_for_this_pixel_and_are_unbiased() -> None:
    blocks, here = mean_and_blocks(shiny_truth(), 4), shiny(768)
    found = by_contributions(here, Live(np.random.default_rng(1)))
    assert all_unbiased(mean_and_blocks(found, 4), blocks, eps=0.02).passed


@pytest.mark.claims("DDGIR-C03", part="control")
def test_contributions_by_the_kept_value_are_biased(monkeypatch) -> None:
    """The last block, which looks at the walls' bright side, gets 5 % too much; both ways see the same samples."""
    here, right = shiny(768), mean_and_blocks(shiny_truth(), 4)[-1]
    own = by_contributions(here, Live(np.random.default_rng(1)))
    monkeypatch.setattr(CacheIntegrals, "contribution", lambda of, index, x: x.f * x.L)
    off = by_contributions(here, Live(np.random.default_rng(1))) - own
    assert biased(mean_and_blocks(off, 4)[:, -1] + right, right, 0.02, 1).passed


@pytest.mark.parametrize("sampled", [gloss, never_lost])
def test_a_lost_glossy_sample_steers_the_selection_and_carries_nothing(sampled) -> None:
    """Where gloss is lost, `never_lost` asks along the mirror's direction: for targets, not for contributions."""
    here, chance = shiny(64), Live(np.random.default_rng(1))
    x = drawn(here, chance).X.x
    at = connection(here.of, here.index, x)
    asked_for = x.f * radiance(here.of.cache, x, at, sampled)
    same = (here.of.contribution(here.index, x) == asked_for).all()
    assert same == (sampled is gloss)
    assert (x.f * asked(here.of, x, at) >= asked_for - 1e-12).all()


def test_a_target_is_the_product_of_two_means_over_channels() -> None:
    """Red light on a blue surface: no product is positive, and the target is; else weights would see the value."""
    here = lighted("crease", 1)
    x = drawn(here, Live(np.random.default_rng(1))).X.x
    f, L = (np.repeat(np.eye(3)[:, k : k + 1], len(here.index), axis=1) for k in (0, 2))
    found = here.of.target(here.index, replace(x, f=f, L=3 * L))
    np.testing.assert_allclose(found, 1 / 3)
    assert (f * L == 0).all()


# ---------------------------------------------------------------- what it costs


def floor_of_a_furnace(asked: Counter[str], **other) -> Pixels:
    """A convex room whose walls all emit: every point that was found sends light to every x_1 of the row."""
    setting = SCENES["furnace"]()
    t = Tracer(setting.scene, Pinhole((0.4, 0.6), (0.5, 0.0), PIXELS, film=PIXELS, half=0.2), 1, RECONNECTION)
    here = at_centres(t, counted(Cache(t.scene, Smooth(2)), asked), 8)
    assert (here.of.v.prim == here.of.v.prim[0]).all()
    asked.clear()
    return Pixels(replace(here.of, **other), here.index)


def queries_in_reuse(value) -> float:
    """Queries per pixel while one temporal and three spatial candidates are resampled, no weights asking more."""
    count = Counter[str]()
    here, chance = floor_of_a_furnace(count, value=value, sight=unseen), Live(np.random.default_rng(1))
    X, Y = drawn(here, chance).X, drawn(here, chance).X
    count.clear()
    previous = Pixels(here.of, here.index)  # of an own frame, which is shifted to this one
    X = temporal(X, here, Y, [previous], chance, mis=WEIGHTS["constant"])
    spatial(X, here, random_in_row(here.of, here.index, 3, 10, chance), chance, mis=WEIGHTS["constant"])
    return count[QUERIES] / len(here.index)


@pytest.mark.claims("DDGIR-A09")
def test_kept_values_save_one_query_per_candidate_of_reuse() -> None:
    assert queries_in_reuse(asked) == 1 + 3
    assert queries_in_reuse(kept) == 0


@pytest.mark.claims("DDGIR-A09", part="shading")
def test_shading_asks_once() -> None:
    count = Counter[str]()
    here, chance = floor_of_a_furnace(count), Live(np.random.default_rng(1))
    X = drawn(here, chance).X
    assert (X.W > 0).all()
    count.clear()
    bounded(X, here, plain, chance)
    assert count[QUERIES] == len(here.index)


@pytest.mark.claims("DDGIR-A04", "DDGIR-F02")
@pytest.mark.parametrize("scene", ["occluders", "crease"])
def test_a_frame_that_looks_in_the_end_traces_one_ray_and_at_most_one_shadow_ray(scene) -> None:
    count, t = Counter[str](), row(scene)
    here = at_centres(t, counted(Cache(t.scene, Smooth(2)), count), 16)
    here, chance = Pixels(replace(here.of, sight=unseen), here.index), Live(np.random.default_rng(1))
    count.clear()
    frame = drawn(here, chance)
    assert (count[CLOSEST], count[SHADOW]) == (len(here.index), 0)
    on_light = (frame.X.x.y != frame.found.x.y).any(axis=0) & (frame.X.W > 0)
    X = lit(frame.X, here)
    assert count[SHADOW] == on_light.sum()
    assert (X.W[~on_light] == frame.X.W[~on_light]).all()
    shown(here, Drawn(X, frame.found), chance)
    assert count[CLOSEST] == len(here.index)


def test_a_frame_that_looks_at_once_asks_for_every_candidate_that_would_send_light() -> None:
    count, t = Counter[str](), row("occluders")
    here = at_centres(t, counted(Cache(t.scene, Smooth(2)), count), 16)
    count.clear()
    drawn(here, Live(np.random.default_rng(1)))
    assert count[CLOSEST] == len(here.index)
    assert LIGHTS / 2 * len(here.index) < count[SHADOW] <= LIGHTS * len(here.index)


@pytest.mark.claims("DDGIR-F02", part="one ray for both")
@pytest.mark.parametrize("scene", ["crease", "glossy_cornell"])
def test_the_residual_reuses_the_ray_among_the_candidates_weighed_by_all_lobes(scene) -> None:
    here, chance = lighted(scene, 16, 1.0), Live(np.random.default_rng(1))
    frame = drawn(here, chance)
    np.testing.assert_array_equal(frame.found.x.y, frame.found.ray.z.x)
    at = connection(here.of, here.index, frame.found.x)
    over = frame.found.rest.any(axis=0)
    np.testing.assert_array_equal(over, (at.G > 1) & (frame.found.mW > 0))
    expected = at.f / at.p * (1 - 1 / at.G)
    np.testing.assert_allclose(frame.found.rest[:, over], expected[:, over], rtol=1e-9)


@pytest.mark.parametrize("scene", ["crease", "glossy_cornell"])
def test_a_point_sends_from_its_own_side_by_the_cosines_of_both_ends_over_the_distance(scene) -> None:
    """G = |cos_1| |cos_y| / r^(d-1), without which the bound would be another's; seen from behind, nothing."""
    here = lighted(scene, 16)
    x, v = drawn(here, Live(np.random.default_rng(1))).found.x, take(here.of.v, here.index)
    at, behind = (connection(here.of, here.index, each) for each in (x, replace(x, n=-x.n)))
    to = x.y - v.x
    r = np.sqrt((to**2).sum(axis=0))
    cos_1, cos_y = abs((v.n * to).sum(axis=0)) / r, -(x.n * to).sum(axis=0) / r
    sent = at.f.any(axis=0)
    assert sent.mean() > 0.5
    np.testing.assert_allclose(at.G[sent], (cos_1 * cos_y / r)[sent], rtol=1e-9)
    assert not behind.f[:, sent].any()
    assert not behind.G[sent].any()


def test_a_frame_is_as_bright_as_the_throughput_that_arrives_at_x_1() -> None:
    """Of one x_1 all candidates scale alike, so that the same are selected."""
    here = lighted("crease", 16, 4.0)
    T = np.random.default_rng(2).uniform(0.25, 4, here.of.T.shape)
    there = Pixels(replace(here.of, T=T * here.of.T), here.index)
    frames = [drawn(each, Live(np.random.default_rng(1))) for each in (here, there)]
    one, other = (
        shown(h, frame, Live(np.random.default_rng(3))) for h, frame in zip((here, there), frames, strict=True)
    )
    np.testing.assert_allclose(other, T * one, rtol=1e-9)
    np.testing.assert_allclose(frames[1].found.rest, T * frames[0].found.rest, rtol=1e-9)
    assert ((frames[0].X.W > 0) & (one > 0).any(axis=0)).mean() > 0.5


# ---------------------------------------------------------------- bad input


@pytest.mark.parametrize(
    ("wrong", "words"), [({"G_max": 0.0}, "G_max .* 0.0"), ({"G_max": -1.0}, "G_max"), ({"lights": 0}, "lights")]
)
def test_bad_input_is_named(wrong, words) -> None:
    with pytest.raises(ValueError, match=words):
        lighted("crease", 1, **wrong)
