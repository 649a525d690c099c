"""Light sampling and BSDF samples, alone and together, against references that are not sampled.

Radiosity is exact where its form factors are used once; over two lobes the reference is a quadrature over film,
directions and the lamp in which all lobes are evaluated and none is chosen.
"""

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest

from flatland2d import SCENES, Pinhole
from flatland2d.radiosity import render
from flatland2d.scenes import FURNACE_ALBEDO
from restir_ref.batch import Array
from restir_ref.transport import materials as mat
from restir_ref.transport import paths
from restir_ref.transport.materials import Vertex
from restir_ref.transport.paths import RECONNECTION, Tracer, Tree, radiance, trace
from restir_ref.transport.rays import arrive, emitted, sample_light
from restir_ref.transport.scene import Scene
from restir_ref.transport.vectors import dot, norm

Estimator = Callable[[Tree], Array]
AT_ONCE = 2**13


def by_bsdf(tree: Tree) -> Array:
    """BSDF samples alone: what they meet counts in full."""
    return tree.T[0] * tree.seen.bare + sum(T * hit.bare for T, hit in zip(tree.T[1:], tree.hits, strict=True))


def by_light(tree: Tree) -> Array:
    """Light sampling alone, if its MIS weights are 1 (see `unweighted`)."""
    lit = sum(T * light.end for T, (light, _) in zip(tree.T[:-1], tree.lights, strict=True))
    return tree.T[0] * tree.seen.bare + lit


ESTIMATORS: dict[str, Estimator] = {"both": radiance, "BSDF": by_bsdf, "light": by_light}


def unweighted(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without MIS: all omega are 1, of light sampling as of BSDF samples."""
    right = paths.ratio
    monkeypatch.setattr(paths, "ratio", lambda a, b: np.ones_like(right(a, b)))


def samples(t: Tracer, estimate: Estimator, batches: int, seed: int) -> Array:
    """Estimates of the image's mean, one per path."""
    rng, pixel = np.random.default_rng(seed), np.arange(AT_ONCE) % t.sensor.n
    return np.concatenate([estimate(trace(t, rng.random((t.D, AT_ONCE)), pixel))[0] for _ in range(batches)])


def z_score(L: Array, truth: float, eps: float) -> float:
    """(mean - truth) / SE, with a power clause: SE <= eps truth."""
    error = L.std() / np.sqrt(len(L))
    assert error <= eps * truth
    return float((L.mean() - truth) / error)


# ---------------------------------------------------------------- Lambert: radiosity

PANELS = {("checker", 3): 28, ("matte_cornell", 2): 48, ("crease", 2): 48}
"""Panels per segment, by scene and depth: .05% here; a third scattering event needs far more of them."""

BATCHES = {"both": 8, "BSDF": 88, "light": 16}
PIXELS, FIRST = 4, 700


def matte(scene: str, depth: int) -> Tracer:
    setting = SCENES[scene]()
    return Tracer(setting.scene, setting.pinhole(PIXELS, FIRST), depth, RECONNECTION)


@cache
def truth(scene: str, depth: int) -> float:
    t = matte(scene, depth)
    return float(render(t.scene, t.sensor, depth, PANELS.get((scene, depth), 48), film=4).mean())


@cache
def estimates(scene: str, depth: int, technique: str) -> Array:
    """As many estimates as a standard error of .3% takes."""
    return samples(matte(scene, depth), ESTIMATORS[technique], BATCHES[technique], seed=51)


@pytest.mark.claims("GRIS-E49", part="all-Lambert scenes against radiosity")
@pytest.mark.claims("COM-B01")
@pytest.mark.parametrize("technique", ["both", "BSDF"])
@pytest.mark.parametrize(("scene", "depth"), PANELS)
def test_with_and_without_light_sampling_path_tracing_is_radiosity(scene, depth, technique) -> None:
    assert abs(z_score(estimates(scene, depth, technique), truth(scene, depth), 0.003)) < 4


@pytest.mark.claims("GRIS-E49", part="all-Lambert scenes, technique against technique")
@pytest.mark.parametrize(("scene", "depth"), PANELS)
def test_with_and_without_light_sampling_agree(scene, depth) -> None:
    both, bsdf = estimates(scene, depth, "both"), estimates(scene, depth, "BSDF")
    assert abs(z_score(bsdf, both.mean(), 0.003)) < 4


@pytest.mark.claims("GRIS-E49", part="furnace")
def test_in_a_furnace_every_single_path_of_bsdf_samples_is_exact() -> None:
    t, N = matte("furnace", 8), 500
    L = by_bsdf(trace(t, np.random.default_rng(52).random((t.D, N)), np.arange(N) % PIXELS))
    assert np.abs(L - (1 - FURNACE_ALBEDO**9) / (1 - FURNACE_ALBEDO)).max() < 1e-12


@pytest.mark.claims("GRIS-E49", part="control without MIS")
@pytest.mark.parametrize("scene", ["checker", "matte_cornell"])
def test_without_mis_weights_direct_light_is_counted_twice(scene, monkeypatch) -> None:
    direct = truth(scene, 1)
    unweighted(monkeypatch)
    doubled = samples(matte(scene, 1), radiance, 16, seed=53)
    assert z_score(doubled, direct, 0.02) > 8
    assert doubled.mean() / direct == pytest.approx(2, abs=0.05)


@pytest.mark.claims("GRIS-E49", part="light sampling alone")
def test_each_technique_alone_is_unbiased_without_weights(monkeypatch) -> None:
    unweighted(monkeypatch)
    L = samples(matte("matte_cornell", 2), by_light, BATCHES["light"], seed=54)
    assert abs(z_score(L, truth("matte_cornell", 2), 0.003)) < 4


# ---------------------------------------------------------------- two lobes: quadrature


def midpoints(n: int) -> Array:
    return (np.arange(n) + 0.5) / n


def direct(s: Scene, v: Vertex, lamp: int) -> Array:
    """int over the lamp of f |cos| L_e cos / r, all lobes evaluated; (N,)."""
    t, N = s.materials, len(v.prim)
    P, total = mat.lobe_shares(t, v), np.zeros(N)
    for number in midpoints(lamp):
        light = sample_light(s, np.full(N, 0.5), np.full((1, N), number))
        to = light.y - v.x
        r = norm(to)
        f, _ = mat.evaluate_all(t, s.space, v, P, s.space.to_local(v.n, to / r))
        share = f[0] * light.emission[0] * np.maximum(-dot(light.n, to / r), 0) / (r * light.pdf_area) / lamp
        lit = np.flatnonzero(share)
        share[lit] *= s.visible(v.x.take(lit, axis=-1), light.y.take(lit, axis=-1))
        total += share
    return total


def once_more(s: Scene, v: Vertex, turns: int, lamp: int) -> Array:
    """int over directions of f |cos| times `direct` at what they meet, dense about the mirror direction; (N,)."""
    t, total = s.materials, np.zeros(len(v.prim))
    P, mirror = mat.lobe_shares(t, v), np.arctan2(-v.o[0], v.o[1])
    for number in midpoints(turns):
        for end in (-np.pi / 2, np.pi / 2):
            angle, width = mirror + (end - mirror) * number**3, np.abs(end - mirror) * 3 * number**2 / turns
            local = np.stack([np.sin(angle), np.cos(angle)])
            f, _ = mat.evaluate_all(t, s.space, v, P, local)
            to, _, _ = arrive(s, v.x, s.space.to_world(v.n, local))
            total += f[0] * width * direct(s, to, lamp)
    return total


def coated() -> Tracer:
    """The whole view of the clear coat scene in 8 pixels, light that scatters at most twice."""
    setting = SCENES["clear_coat"]()
    view = Pinhole(setting.eye, setting.towards, 8, setting.half, 0, 8)
    return Tracer(setting.scene, view, 2, RECONNECTION)


@cache
def by_quadrature(film: int, turns: int, lamp: int) -> tuple[float, float]:
    """Mean radiance over the view after one and after at most two scattering events."""
    t = coated()
    x, w, _ = t.sensor.ray(np.repeat(np.arange(8), film), np.tile(midpoints(film), 8)[None])
    v, _, _ = arrive(t.scene, x, w)
    once = emitted(t.scene, v)[0] + direct(t.scene, v, 16 * lamp)
    return float(once.mean()), float((once + once_more(t.scene, v, turns, lamp)).mean())


@pytest.mark.claims("GRIS-E50")
@pytest.mark.parametrize("technique", ["both", "BSDF"])
def test_sampling_one_lobe_at_a_time_is_unbiased(technique) -> None:
    L = samples(coated(), ESTIMATORS[technique], {"both": 32, "BSDF": 80}[technique], seed=55)
    _, reference = by_quadrature(40, 100, 12)
    assert abs(z_score(L, reference, 0.005)) < 4


def test_the_quadrature_has_converged() -> None:
    coarse, fine = by_quadrature(24, 60, 8), by_quadrature(40, 100, 12)
    assert coarse == pytest.approx(fine, rel=0.001)


RIGHT = mat.scatter_lobe


def without_shares(t, space, v, P, lobe, i) -> tuple[Array, Array, Array]:
    """A mistake: the density of a sampled lobe lacks the probability of choosing it."""
    weight, p, p_all = RIGHT(t, space, v, P, lobe, i)
    share = np.take_along_axis(P, lobe[None], axis=0)[0]
    return weight * share, p / share, p_all


@pytest.mark.claims("GRIS-E50")
@pytest.mark.parametrize("technique", ["both", "BSDF"])
def test_a_lobe_probability_missing_from_the_density_is_noticed(technique, monkeypatch) -> None:
    monkeypatch.setattr(mat, "scatter_lobe", without_shares)
    L = samples(coated(), ESTIMATORS[technique], 16, seed=56)
    _, reference = by_quadrature(40, 100, 12)
    assert z_score(L, reference, 0.02) < -8
    assert L.mean() < 0.99 * reference
