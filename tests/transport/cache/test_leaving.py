"""L+ of a surface: a furnace, in which only one constant is right, and one sample of what a surface mirrors."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from figures.claims.criteria import unbiased, within
from restir_ref.batch import Array, take
from restir_ref.transport import materials as mat
from restir_ref.transport.cache import leaving as module
from restir_ref.transport.cache.biases import self_shadow
from restir_ref.transport.cache.leaving import Cache, gloss, leaving, never_lost
from restir_ref.transport.lobes import refract
from restir_ref.transport.materials import Layer, Vertex
from restir_ref.transport.space import Space, ball_volume
from tests.transport.cache.fields import Smooth, Uniform, asking
from tests.transport.lobe_cases import CASES, grid, integral
from tests.transport.spaces import SEEING, SPACES

ROUGH = (0.15, 0.4, 1.0)
GLOSSY = [(space, name) for space, name in CASES if name != "lambert"]
CELLS, MIDPOINTS = {2: 2000, 3: 150}, {2: 1500, 3: 360}
"""Cells per primary number, and midpoints per angle, by dimension."""


def material(name: str, roughness: float, rho: float = 0.3) -> list[Layer]:
    return [Layer("lambert", (rho,), weight=rho), Layer(name, (0.6,), roughness, weight=0.6)]


def mean_over_numbers(space: Space, layers: list[Layer], cos: float, cells: int, field: Uniform | None = None) -> float:
    """int L+ du over the numbers of the glossy sample, by midpoints."""
    direction = grid(space.d - 1, cells)
    c, v = asking(space, layers, field or Uniform(space.d), cos, direction.shape[-1])
    u = np.concatenate([np.full((1, direction.shape[-1]), 0.5), direction])
    return float(leaving(c, v, np.ones(direction.shape[-1]), u).mean())


def repeated(v: Vertex, i: Array) -> Vertex:
    """One vertex beside every direction."""
    return take(v, np.zeros(i.shape[-1], dtype=int))


def peak(layer: Layer, v: Vertex) -> Array:
    """Where a smooth surface would send what comes from o, (d, 1)."""
    up = np.zeros_like(v.o)
    up[-1] = 1
    through = layer.kind.endswith("transmission")
    return refract(v.o, up, np.array([1.5])) if through else np.concatenate([-v.o[:-1], v.o[-1:]])


@cache
def albedo(space: Space, layers: tuple[Layer, ...], cos: float) -> float:
    """int f_g |cos_i| dw_i of the last layer, over all directions."""
    c, v = asking(space, layers, Uniform(space.d), cos, 1)
    s, last = c.scene, np.array([len(layers) - 1])

    def value(i: Array) -> Array:
        return mat.evaluate_lobe(s.materials, s.space, repeated(v, i), np.repeat(last, i.shape[-1]), i)[0][0]

    return integral(space, value, peak(layers[-1], v), MIDPOINTS[space.d])


def furnace(space: Space, name: str, roughness: float, cos: float = 0.7) -> float:
    """L+ over rho + albedo_g where radiance 1 comes from everywhere."""
    layers = material(name, roughness)
    return mean_over_numbers(space, layers, cos, CELLS[space.d]) / (0.3 + albedo(space, tuple(layers), cos))


@pytest.mark.claims("DDGIR-E06", part="every lobe, by quadrature")
@pytest.mark.claims("DDGIR-E06", part="every lobe, by quadrature", world="tracer3d")
@pytest.mark.parametrize("roughness", ROUGH)
@pytest.mark.parametrize(("space", "name"), GLOSSY)
def test_in_a_furnace_a_surface_sends_its_albedo(space, name, roughness) -> None:
    assert within(furnace(SPACES[space], name, roughness), 1, 0.005).passed


@pytest.mark.claims("DDGIR-E06", part="delta lobes")
@pytest.mark.claims("DDGIR-E06", part="delta lobes", world="tracer3d")
@pytest.mark.parametrize("space", SPACES)
def test_in_a_furnace_mirrors_and_glass_send_all_their_colour(space) -> None:
    glass = [Layer("glass reflection", (1.0,)), Layer("glass transmission", (1.0,))]
    for layers, sent in (([Layer("mirror", (0.9,))], 0.9), (glass, 1.0), ([Layer("lambert", (0.7,))], 0.7)):
        c, v = asking(SPACES[space], layers, Uniform(SPACES[space].d), 0.4, 64)
        u = np.random.default_rng(1).random((c.scene.space.d, 64))
        np.testing.assert_allclose(leaving(c, v, np.ones(64), u), sent, rtol=1e-12)


CONSTANTS = {
    "1 / (2 pi)": 1 / (2 * np.pi),
    "2 pi": 2 * np.pi,
    "1 / pi in flatland, 1 / 2 in space": 0.0,
}


@pytest.mark.claims("DDGIR-E06", part="controls")
@pytest.mark.claims("DDGIR-E06", part="controls", world="tracer3d")
@pytest.mark.parametrize("K", CONSTANTS)
@pytest.mark.parametrize("space", SEEING)
def test_another_constant_of_the_glossy_term_is_noticed(space, K, monkeypatch) -> None:
    d, right = SPACES[space].d, module.mirrored
    value = CONSTANTS[K] or {2: 1 / np.pi, 3: 1 / 2}[d]
    monkeypatch.setattr(module, "mirrored", lambda *given: value * ball_volume(d) * right(*given))
    layers = material("ggx", 0.4)
    g = albedo(SPACES[space], tuple(layers), 0.7)
    found = furnace(SPACES[space], "ggx", 0.4)
    assert not within(found, 1, 0.05).passed
    assert found == pytest.approx((0.3 + value * ball_volume(d) * g) / (0.3 + g), rel=0.005)


def test_the_printed_constants_miss_by_the_factors_that_they_should() -> None:
    """1 / (2 pi) is half in space and 1 / pi of it in flatland; 2 pi is 2 pi^2 times too large, and 4 pi."""
    assert [ball_volume(d) / (2 * np.pi) for d in (3, 2)] == pytest.approx([1 / 2, 1 / np.pi])
    assert [ball_volume(d) * 2 * np.pi for d in (3, 2)] == pytest.approx([2 * np.pi**2, 4 * np.pi])


def expected(space: Space, layers: list[Layer], cos: float) -> float:
    """rho E(n) / C_d + int E(w) f_g cos dw / C_d by directions."""
    field = Smooth(space.d)
    c, v = asking(space, layers, field, cos, 1)
    s, rho = c.scene, layers[0].colour[0]

    def value(i: Array) -> Array:
        at = repeated(v, i)
        f, _ = mat.evaluate_lobe(s.materials, s.space, at, np.ones(i.shape[-1], dtype=int), i)
        side = np.where(i[-1] < 0, -at.n, at.n)
        return (f * field.irradiance(at.x, side, space.to_world(at.n, i), 0 * at.x))[0]

    diffuse = rho * field.irradiance(v.x, v.n, v.n, 0 * v.x)[0, 0]
    glossy = integral(space, value, peak(layers[-1], v), MIDPOINTS[space.d])
    return (diffuse + glossy) / ball_volume(space.d)


def sampled(c: Cache, v: Vertex, seed: int) -> Array:
    N = v.x.shape[-1]
    return leaving(c, v, np.ones(N), np.random.default_rng(seed).random((c.scene.space.d, N)))[0]


@pytest.mark.claims("DDGIR-E06m")
@pytest.mark.claims("DDGIR-E06m", world="tracer3d")
@pytest.mark.parametrize(("space", "name"), GLOSSY)
def test_one_sample_of_the_glossy_lobes_is_right_in_the_mean(space, name) -> None:
    layers = material(name, 0.5)
    c, v = asking(SPACES[space], layers, Smooth(SPACES[space].d), 0.6, 64 * 800)
    found = sampled(c, v, 2).reshape(64, -1).mean(axis=1)
    assert unbiased(found, expected(SPACES[space], layers, 0.6)).passed


@pytest.mark.parametrize("space", SEEING)
def test_asking_about_the_normal_for_the_glossy_term_is_noticed(space, monkeypatch) -> None:
    """A mistake: what a surface mirrors comes from about w_i, not from about n."""
    monkeypatch.setattr(module, "gloss", lambda c, v, u: replace(gloss(c, v, u), w=v.n))
    layers = material("ggx", 0.3)
    c, v = asking(SPACES[space], layers, Smooth(SPACES[space].d), 0.4, 64 * 500)
    u = np.random.default_rng(3).random((c.scene.space.d, 64 * 500))
    found = leaving(c, v, np.ones(64 * 500), u, module.gloss)[0].reshape(64, -1).mean(axis=1)
    assert not unbiased(found, expected(SPACES[space], layers, 0.4)).passed


def test_several_glossy_lobes_share_one_sample() -> None:
    """Each colour apart, they add up; a Lambert lobe alone asks for no sample."""
    space = SPACES["plane"]
    both = [Layer("lambert", (0.2,), weight=0.2), Layer("ggx", (0.3,), 0.3, 0.5), Layer("mirror", (0.4,), weight=0.3)]
    c, v = asking(space, both, Smooth(2), 0.6, 64 * 4000)
    parts = 0.0
    for k, layer in enumerate(both):
        alone, at = asking(space, [layer], Smooth(2), 0.6, 64 * 1000)
        parts += sampled(alone, at, k + 10).mean()
    assert unbiased(sampled(c, v, 4).reshape(64, -1).mean(axis=1), parts).passed


@pytest.mark.parametrize("space", SEEING)
def test_what_selection_asks_is_what_shading_asks_unless_a_lobe_has_no_direction(space) -> None:
    layers = [Layer("ggx", (0.8,), 0.9)]
    c, v = asking(SPACES[space], layers, Smooth(SPACES[space].d), 0.2, 4000)
    u = np.random.default_rng(5).random((c.scene.space.d, 4000))
    L, guess = (leaving(c, v, np.ones(4000), u, by) for by in (gloss, never_lost))
    lost = gloss(c, v, u).lost
    assert 100 < lost.sum() < 2000
    np.testing.assert_array_equal(L[:, ~lost], guess[:, ~lost])
    assert (L[:, lost] == 0).all()
    assert (guess > 0).all()
    o = c.scene.space.to_world(v.n, v.o)
    by_mirror = 2 * (v.n * o).sum(axis=0) * v.n - o
    np.testing.assert_allclose(never_lost(c, v, u).w[:, lost], by_mirror[:, lost], atol=1e-12)


def test_queries_are_displaced_and_what_is_transmitted_is_asked_on_the_other_side() -> None:
    space, asked = SPACES["plane"], []

    class Noting(Uniform):
        def irradiance(self, x, n, w, b):
            asked.append((n, w, b))
            return super().irradiance(x, n, w, b)

    layers = [Layer("lambert", (0.1,)), Layer("glass transmission", (0.5,))]
    c, v = asking(space, layers, Noting(2), 0.6, 3)
    c = Cache(c.scene, c.field, lambda n, o, r: self_shadow(n, o, c.field.spacing))
    leaving(c, v, np.ones(3), np.full((2, 3), 0.5))
    (n, w, b), (other, into, behind) = asked
    np.testing.assert_array_equal(n, w)
    np.testing.assert_array_equal(other, -n)
    assert ((into * n).sum(axis=0) < 0).all()
    np.testing.assert_allclose((behind * n).sum(axis=0), -(b * n).sum(axis=0))
    np.testing.assert_allclose((b * n).sum(axis=0), 0.075 * (0.2 + 0.8 * 0.6))
