"""A frame of a volume: every probe casts rays, and blends what they bring into its maps.  [DDGIR 3.1, 3.2]

The radiance of a point that a ray meets comes from the volume of the frame before (Jacobi), so light bounces once more
with every frame.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from restir_ref.batch import Array
from restir_ref.chance import Chance
from restir_ref.guards import whole
from restir_ref.transport.cache.biases import self_shadow
from restir_ref.transport.cache.field import Field
from restir_ref.transport.cache.grid import Grid
from restir_ref.transport.cache.leaving import diffuse_albedo
from restir_ref.transport.cache.maps import Directions, fetched, gathering
from restir_ref.transport.cache.rules import AUGMENTED, Rule, gathered
from restir_ref.transport.cache.volume import Volume
from restir_ref.transport.cache.walls import batches, bundle
from restir_ref.transport.materials import Vertex
from restir_ref.transport.rays import GRAZING, arrive, emitted, sample_light
from restir_ref.transport.scene import Scene
from restir_ref.transport.space import ball_volume
from restir_ref.transport.vectors import dot, norm, power

SHARPNESS = 50
"""Exponent of the cosine with which rays count for depth.  [Majercik 2019]"""

Leaving = Callable[[Scene, Field, Vertex, Array, Chance], Array]
"""L+ (C, N) that a cache tells of vertices, towards their o; with the length (N,) of the segment that they are seen on.

[DDGIR Eq. 6]
"""


def diffuse(s: Scene, field: Field, v: Vertex, r: Array, chance: Chance) -> Array:
    """rho / C_d E+(x, n), the diffuse term alone, with the self-shadow bias; (C, N).  [DDGIR Eq. 4, 6]"""
    rho = diffuse_albedo(s.materials, v)
    b = self_shadow(v.n, s.space.to_world(v.n, v.o), field.spacing)
    return np.asarray(rho / ball_volume(s.space.d) * field.irradiance(v.x, v.n, v.n, b))


def scattered_once(s: Scene, v: Vertex, chance: Chance) -> Array:
    """T_fd L_e at vertices, by one light point each; (C, N).  [DDGIR Eq. 4]"""
    d, N = s.space.d, v.x.shape[-1]
    light = sample_light(s, chance.uniform((N,)), chance.uniform((d - 1, N)))
    to = light.y - v.x
    r = np.maximum(norm(to), np.finfo(float).tiny)
    cos, cos_y = dot(v.n, to) / r, -dot(light.n, to) / r
    facing = np.flatnonzero((cos > 0) & (cos_y > GRAZING))
    G = np.zeros(N)
    G[facing] = (cos * cos_y / power(r, d - 1)).take(facing) * s.visible(
        v.x.take(facing, axis=-1), light.y.take(facing, axis=-1)
    )
    rho = diffuse_albedo(s.materials, v)
    return np.asarray(rho / ball_volume(d) * light.emission * (G / light.pdf_area))


@dataclass(frozen=True)
class Updating:
    """How a frame updates probes.

    leaving      L+ of what rays meet
    rule         what else of it enters a probe
    rays         R, of each probe, per frame
    hysteresis   a in E <- a E + (1 - a) E_new; the first frame has a = 0
    attenuation  scales the further way that direct light is attenuated by; 0 leaves it as it is at the probe
    Raises ValueError for no rays, a hysteresis outside [0, 1), or an attenuation that is negative or not finite.
    """

    leaving: Leaving = diffuse
    rule: Rule = AUGMENTED
    rays: int = 64
    hysteresis: float = 0.97
    attenuation: float = 1.0

    def __post_init__(self) -> None:
        whole(self.rays, 1, "the number of rays of a probe", "Without rays a probe learns nothing.")
        if not 0 <= self.hysteresis < 1:
            raise ValueError(f"hysteresis must be in [0, 1), but is {self.hysteresis}: 1 would never learn anything.")
        if not 0 <= self.attenuation < np.inf:
            raise ValueError(
                f"the attenuation of direct light must be finite and >= 0, but is {self.attenuation}: "
                "1 is the paper's, 0 none."
            )


@dataclass(frozen=True)
class Learning:
    """What rays w (d, R) become in one map: shares (R, K), which of K texels they tell of (`gathering`), and a."""

    shares: Array
    known: Array
    a: float

    def blended(self, old: Array, values: Array) -> Array:
        """a old + (1 - a) sum_r values_r share_r where there are rays, old elsewhere; values (.., n, R), (.., n, K)."""
        return np.where(self.known, self.a * old + (1 - self.a) * (values @ self.shares), old)


def learning(maps: Directions, w: Array, exponent: int, a: float) -> Learning:
    """Rays w (d, R) for a map, with max(0, n.w)^exponent."""
    return Learning(*gathering(maps, w, exponent), a)


def update(v: Volume, s: Scene, how: Updating, chance: Chance) -> Volume:
    """E <- a E + (1 - a) C_d sum max(0, n.w) L / sum max(0, n.w), and depth with max(0, n.w)^50.  [DDGIR Eq. 5]

    Nothing is known of what is beyond rays that meet nothing: it is black, and as far as distances are stored.
    """
    a = how.hysteresis * (v.frames > 0)
    w = v.maps.rays(how.rays, chance)
    light, depth = learning(v.maps.irradiance, w, 1, a), learning(v.maps.depth, w, SHARPNESS, a)
    E, r = v.E.copy(), v.r.copy()
    for probe in batches(v.grid, how.rays):
        part = probe[v.active[probe]]
        if len(part):
            E[:, part], r[:, part] = _probes(v, s, how, _Rays(part, w, light, depth), chance)
    return replace(v, E=E, r=r, frames=v.frames + 1)


@dataclass(frozen=True)
class _Rays:
    """Probes (n,) that are updated together, their common directions w (d, R), and what they become."""

    probe: Array
    w: Array
    light: Learning
    depth: Learning


def _probes(v: Volume, s: Scene, how: Updating, rays: _Rays, chance: Chance) -> tuple[Array, Array]:
    """E (C, n, K) and r (2, n, K') of some probes."""
    x, w = bundle(v.grid, rays.probe, rays.w)
    vertex, t, met = arrive(s, x, w)
    clipped = np.where(met, np.minimum(t, v.grid.reach), v.grid.reach).reshape(len(rays.probe), -1)
    r = rays.depth.blended(v.r[:, rays.probe], np.stack([clipped, clipped**2]))
    beyond = how.attenuation * behind(v.grid, v.maps.depth, r[0], rays.w)
    fading = power(t / (t + beyond.reshape(-1)), s.space.d - 1)
    once = scattered_once(s, vertex, chance) if how.rule.scattered else np.zeros((s.C, 1))
    L = gathered(how.rule, how.leaving(s, v, vertex, t, chance), fading * emitted(s, vertex), once) * met
    E_new = ball_volume(s.space.d) * L.reshape(s.C, len(rays.probe), -1)
    return rays.light.blended(v.E[:, rays.probe], E_new), r


def behind(grid: Grid, maps: Directions, r1: Array, w: Array) -> Array:
    """db = min(r1(-w), way to the probe's boundary): how much further than the probe the lit surface is; (n, R).

    r1 (n, K') mean distances of probes, w (d, R) directions to the light.  So (d / (d + s db))^(dim - 1) attenuates
    what is emitted at distance d; the user's s is 1 unless scenes come out too dark.  [DDGIR 3.2]
    Ours: the paper does not say where a probe's boundary is; here its box reaches as far as its interpolation weight.
    """
    index, weight = maps.fetch(-w)
    n, R = len(r1), w.shape[-1]
    probe, ray = np.repeat(np.arange(n), R), np.tile(np.arange(R), n)
    seen = fetched(r1[None], probe, index.take(ray, axis=-1), weight.take(ray, axis=-1))[0]
    return np.asarray(np.minimum(seen.reshape(n, R), grid.to_boundary(w)))
