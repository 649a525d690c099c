"""Paths that go on by glossy lobes until they have spread: where they end, what they cost, and that they do not err."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from figures.claims.criteria import unbiased
from flatland2d.scenes import cornell
from restir_ref.batch import Array, take
from restir_ref.chance import Live
from restir_ref.integrals import Pixels
from restir_ref.transport import materials as mat
from restir_ref.transport.cache import shading as module
from restir_ref.transport.cache.footprint import as_wide_as_in_space
from restir_ref.transport.cache.integrals import by_ray
from restir_ref.transport.cache.leaving import Cache, diffuse
from restir_ref.transport.cache.queries import QUERIES, counted
from restir_ref.transport.cache.shading import Arrival, Shading, bounded, plain, recursive, residual, sent
from restir_ref.transport.counting import CLOSEST, rays
from restir_ref.transport.materials import Layer, Material
from restir_ref.transport.paths import RECONNECTION, Tracer
from restir_ref.transport.scene import scene
from restir_ref.transport.space import Space
from tests.transport.cache.fields import Smooth, Uniform, asking
from tests.transport.cache.gathered import at_centres, drawn
from tests.transport.rooms import walls
from tests.transport.spaces import SEEING, SPACES

GLOSS, MATTE = Layer("ggx", (0.6,), 0.4, weight=0.6), Layer("lambert", (0.3,), weight=0.3)


def arriving(space: Space, layers: Sequence[Layer], n: int, asked: Counter[str]) -> tuple[Cache, Arrival]:
    """n equal second vertices, by a narrow lobe from nearby: the path has hardly spread."""
    c, v = asking(space, layers, Smooth(space.d), 0.6, n)
    one = np.ones(n)
    return counted(c, asked), Arrival(v, 0.1 * one, 50 * one, 0.2 * one, one > 0)


def followed(space: str, layers: Sequence[Layer], shading: Shading, n: int = 1000) -> tuple[Array, Counter[str]]:
    """L+ of all, and what it cost."""
    asked = Counter[str]()
    c, at = arriving(SPACES[space], layers, n, asked)
    return shading(c, at, Live(np.random.default_rng(1)))[0], asked


@pytest.mark.claims("DDGIR-A06")
@pytest.mark.parametrize("space", SEEING)
def test_a_path_that_chooses_the_diffuse_lobe_ends_there(space) -> None:
    L, asked = followed(space, [MATTE], recursive(0.2))
    c, at = arriving(SPACES[space], [MATTE], 1000, Counter())
    np.testing.assert_array_equal(L, diffuse(c, at.z, at.r)[0])
    assert (asked[CLOSEST], asked[QUERIES]) == (0, 1000)


@pytest.mark.claims("DDGIR-A06", part="glossy lobes")
@pytest.mark.parametrize("most", [1, 2, 4])
@pytest.mark.parametrize("space", SEEING)
def test_a_path_that_chooses_a_glossy_lobe_goes_on_until_it_has_spread(space, most) -> None:
    """Never, by an infinite threshold: one ray less than vertices, and one query in the end."""
    _, asked = followed(space, [Layer("mirror", (0.6,))], recursive(np.inf, most))
    assert (asked[CLOSEST], asked[QUERIES]) == (1000 * (most - 1), 1000)


@pytest.mark.claims("DDGIR-A06", part="both lobes")
@pytest.mark.parametrize("space", SEEING)
def test_of_both_lobes_the_choice_decides_whether_a_path_goes_on(space) -> None:
    _, asked = followed(space, [MATTE, GLOSS], recursive(np.inf, 2), 4000)
    assert asked[CLOSEST] / 4000 == pytest.approx(2 / 3, abs=0.03)
    assert asked[QUERIES] <= 4000


@pytest.mark.claims("DDGIR-E08", part="c towards 0")
@pytest.mark.parametrize("space", SEEING)
def test_with_a_small_threshold_every_path_ends_at_x_2(space) -> None:
    L, asked = followed(space, [GLOSS], recursive(1e-6))
    assert asked[CLOSEST] == 0
    assert L.mean() == pytest.approx(followed(space, [GLOSS], plain)[0].mean(), rel=0.1)


@pytest.mark.claims("DDGIR-E08", part="in footprints of its own pixel")
@pytest.mark.parametrize("space", SEEING)
def test_a_path_has_spread_in_footprints_of_its_own_pixel(space) -> None:
    """One threshold: behind small pixels no path goes on, behind large ones nearly all do."""
    asked = Counter[str]()
    c, at = arriving(SPACES[space], [GLOSS], 1000, asked)
    small = np.arange(1000) % 4 == 0
    recursive(1.0, 2)(c, replace(at, a0=np.where(small, 1e-9, 1e9)), Live(np.random.default_rng(1)))
    assert 600 < asked[CLOSEST] <= 750
    asked.clear()
    recursive(1.0, 2)(c, replace(at, a0=np.full(1000, 1e-9)), Live(np.random.default_rng(1)))
    assert asked[CLOSEST] == 0


@pytest.mark.parametrize(("threshold", "segments"), [(0.5, 0), (1.5, 1), (2.5, 2), (3.5, 3)])
def test_lengths_of_segments_add(monkeypatch, threshold, segments) -> None:
    """Each widens the path by a length of 1: it ends behind the first sum above the threshold."""
    monkeypatch.setattr(module, "widening", lambda r, p, cos, d: np.ones(len(r)))
    asked = Counter[str]()
    c, at = arriving(SPACES["plane"], [Layer("mirror", (0.6,))], 10, asked)
    recursive(threshold)(c, replace(at, a0=np.ones(10)), Live(np.random.default_rng(1)))
    assert asked[CLOSEST] == 10 * segments


def test_an_arrival_is_that_of_its_own_columns_in_directions() -> None:
    """The footprint of each column's pixel, and for a selected point the density of its direction, of all lobes."""
    place, seen = cornell(0.3), []
    t = Tracer(place.scene, replace(place.pinhole(32, 0), film=32), 1, RECONNECTION)
    here, chance = at_centres(t, Cache(t.scene, Smooth(2)), 8), Live(np.random.default_rng(3))
    some = np.random.default_rng(4).permutation(len(here.index))[:50]
    X = drawn(here, chance).X
    bounded(take(X, some), Pixels(here.of, some), lambda c, at, chance: seen.append(at) or at.r[None], chance)
    v, to = take(here.of.v, some), X.x.y[:, some] - here.of.v.x[:, some]
    w = to / np.sqrt((to**2).sum(axis=0))
    s = place.scene
    _, p = mat.evaluate_all(s.materials, s.space, v, mat.lobe_shares(s.materials, v), s.space.to_local(v.n, w))
    np.testing.assert_allclose(seen[0].p, p, rtol=1e-12)
    np.testing.assert_allclose(seen[0].a0, here.of.r[some] / (2 * np.pi * v.o[-1]), rtol=1e-12)


@pytest.mark.parametrize("space", SEEING)
def test_a_path_that_goes_on_and_meets_nothing_brings_nothing(space) -> None:
    """One wall that mirrors and shines, and no room around it."""
    c, at = arriving(SPACES[space], [Layer("mirror", (0.6,))], 100, Counter())
    alone = scene(SPACES[space], [Material([Layer("mirror", (0.6,))])], list(walls(SPACES[space].d, 0, (1.0,)))[:1])
    chance = Live(np.random.default_rng(1))
    assert (recursive(np.inf, 3)(c, at, chance) > 0).all()
    assert (recursive(np.inf, 3)(replace(c, scene=alone), at, chance) == 0).all()


def test_a_cache_that_counts_elsewhere_counts_no_longer_where_it_did() -> None:
    before, now = Counter[str](), Counter[str]()
    c, at = arriving(SPACES["plane"], [MATTE], 5, before)
    sent(counted(c, now), at, plain, Live(np.random.default_rng(1)))
    assert now[QUERIES] == 5
    assert not before


@pytest.mark.claims("DDGIR-A05", part="without bias where the cache has none")
@pytest.mark.parametrize("threshold", [1e-6, 1.0, np.inf])
@pytest.mark.parametrize("space", SPACES)
def test_where_the_cache_is_right_recursion_changes_no_mean(space, threshold) -> None:
    """A room that emits 1 - rho - m, whose surfaces scatter rho and mirror m: radiance 1 from everywhere."""
    where, albedo = SPACES[space], 0.3 + 0.4
    layers = [replace(MATTE, weight=0.5), Layer("mirror", (0.4,), weight=0.5)]
    c, v = asking(where, layers, Uniform(where.d), 0.6, 6400)
    s = scene(where, [Material(layers)], walls(where.d, 0, (1 - albedo,)))
    one = np.ones(6400)
    at = Arrival(v, 0.1 * one, 50 * one, 0.2 * one, one > 0)
    L = sent(replace(c, scene=s), at, recursive(threshold), Live(np.random.default_rng(2)))[0]
    assert unbiased(L.reshape(64, -1).mean(axis=1), 1.0, eps=0.02).passed


def test_nothing_is_asked_for_what_nobody_wants() -> None:
    for shading in (plain, recursive(0.2)):
        asked = Counter[str]()
        c, at = arriving(SPACES["plane"], [MATTE, GLOSS], 8, asked)
        assert (sent(c, replace(at, wanted=at.wanted & False), shading, Live(np.random.default_rng(1))) == 0).all()
        assert rays(asked) == asked[QUERIES] == 0


def rays_of_recursion(roughness: float, c: float) -> float:
    """Rays per pixel behind x_2 in the Cornell room with boxes this rough; an infinitesimal bound asks for all x_2."""
    asked, place = Counter[str](), cornell(roughness)
    t = Tracer(place.scene, replace(place.pinhole(32, 0), film=32), 1, RECONNECTION)
    here, chance = at_centres(t, counted(Cache(t.scene, Smooth(2)), asked), 64, 1e-9), Live(np.random.default_rng(3))
    found = by_ray(here.of, here.index, chance)
    asked.clear()
    residual(here.of, here.index, found, recursive(c), chance)
    return asked[CLOSEST] / len(here.index)


@pytest.mark.claims("DDGIR-E08", part="depth over roughness and threshold")
def test_paths_go_on_less_the_rougher_surfaces_are_and_the_smaller_the_threshold() -> None:
    over_roughness = [rays_of_recursion(r, as_wide_as_in_space(2)) for r in (0.05, 0.1, 0.2, 0.4, 0.8)]
    over_threshold = [rays_of_recursion(0.15, c) for c in (0.01, 0.1, 0.45, 0.8, 3.0)]
    assert (np.diff(over_roughness) < 0).all()
    assert (np.diff(over_threshold) > 0).all()
    assert over_threshold[0] < 0.05


@pytest.mark.parametrize(("given", "words"), [((0.0,), "threshold c .* 0.0"), ((0.2, 0), "number of vertices")])
def test_bad_input_of_a_recursion_is_named(given, words) -> None:
    with pytest.raises(ValueError, match=words):
        recursive(*given)
