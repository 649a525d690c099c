"""Direct light from all surfaces: a cache makes every point of the scene a light.  [DDGIR 3.1, 3.5, 3.6]

x_1 is given, one per column.  A sample is a second vertex, a point y on one side of a surface; its measure is area:

    ceil(T)(L_e + L+) = int f_r |cos_1| |cos_y| / r^(d-1) min(1, G_max / G) V (L_e + L+)(y -> x_1) dy    [DDGIR Eq. 9]

with G = |cos_1| |cos_y| / r^(d-1).  Candidates are a few points on lights and one ray by the BSDF, whose densities are
converted to area and combined by the balance heuristic.  A shift copies the point, J = 1.

Selection sees L_e + L+ as a number kept with the sample, which travels (`kept`), or is asked again from every x_1
(`asked`).  With kept values pixels disagree about the same point, and still nothing is biased, because
 - W is divided by the very value that the sample was selected with, which is a part of the sample;
 - that value is positive wherever the point sends light to another x_1;
 - MIS weights depend on the point alone: p_hat is a product of what depends on x_1 and of what is kept.
So p_hat is the product of two means over channels, not the mean of the product.
# erratum: [DDGIR 3.6] names none of the three conditions.

Visibility.  Points on surfaces that do not shine are found by rays only, so that their own pixel sees them.  A target
without visibility, as in [DDGIR 3.1], is then positive where no candidate can be: weights that compare such targets
lose energy.  `CacheIntegrals` look (`looking`); `unseen` integrals look only when they are shown (`lit`).
# erratum: [DDGIR 3.1] claims no bias, but leaves visibility out.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from math import prod

import numpy as np

from restir_ref.batch import Array, ratio, take
from restir_ref.chance import Chance
from restir_ref.guards import positive, whole
from restir_ref.integrals import Pixels, Reservoirs, Shifted
from restir_ref.transport import materials as mat
from restir_ref.transport.cache.leaving import Cache, Sampled, gloss, gloss_of, leaving, never_lost
from restir_ref.transport.materials import Vertex
from restir_ref.transport.paths import Tracer, first_hit
from restir_ref.transport.rays import GRAZING, arrive, emitted, light_pdf, sample_light, vertex
from restir_ref.transport.scene import Scene
from restir_ref.transport.vectors import dot, norm, power

NEAREST = 1e-100
"""Keeps distances positive, and their powers."""

LIGHTS = 4
"""Candidates on lights: "a small number".  [DDGIR 3.1]"""


@dataclass(frozen=True)
class Second:
    """A second vertex, and what the x_1 that holds it knows of it.

    y, n (d, N)   the point, and its unit normal on the side that sends;  prim (N,) its primitive
    u (d, N)      the numbers of its one glossy sample: lobe 1, direction d-1
    L (C, N)      L_e + L+ as selection knows it
    f (C, N)      T f_r |cos_1| |cos_y| / r^(d-1) min(1, G_max / G), per area; times V if the integrals look
    seen (N,)     whether a ray has shown that x_1 sees y
    """

    y: Array
    n: Array
    prim: Array
    u: Array
    L: Array
    f: Array
    seen: Array


@dataclass(frozen=True)
class Connection:
    """From x_1 to a point: distance r (N,), direction w (d, N), f = T f_r |cos_1| |cos_y| / r^(d-1) (C, N), per area.

    G (N,) in 1 / length^(d-1);  p (N,) density per area of the BSDF's ray;  p_w (N,) per direction
    """

    r: Array
    w: Array
    f: Array
    G: Array
    p: Array
    p_w: Array


@dataclass(frozen=True)
class Ray:
    """A ray from x_1 by the BSDF, and the vertex z that it met.

    w (d, N), r (N,)  its direction, and how far z is;  p (N,) density of w by all lobes, 0 of delta lobes
    weight (C, N)     T f_r |cos_1| / p;  0 where nothing was met
    """

    z: Vertex
    w: Array
    r: Array
    p: Array
    weight: Array


@dataclass(frozen=True)
class Found:
    """The candidate x of a ray with its m W (N,), and what the residual takes of the same ray.  [DDGIR 3.5]

    rest (C, N)  the ray's weight times max(1 - G_max / G, 0), and all of it by delta lobes, which cannot be shared
    """

    ray: Ray
    x: Second
    mW: Array
    rest: Array


Value = Callable[["CacheIntegrals", Second, Connection], Array]
"""L_e + L+ (C, N), as selection knows it, of points that come to x_1 by a connection."""

Sight = Callable[["CacheIntegrals", Array, Second], tuple[Array, Array]]
"""V in the target for columns `index` (N,), and whether a ray has shown it; (N,) bool each."""


def kept(of: "CacheIntegrals", x: Second, at: Connection) -> Array:
    """What it was where the point was found: no query.  [DDGIR 3.6]"""
    return x.L


def asked(of: "CacheIntegrals", x: Second, at: Connection) -> Array:
    """(L_e + L+)(y -> x_1) of this x_1, a query; positive wherever the point sends light to any x_1."""
    return radiance(of.cache, x, at, never_lost)


def looking(of: "CacheIntegrals", index: Array, x: Second) -> tuple[Array, Array]:
    """One shadow ray for every point that would send light and is not known to be seen."""
    clear = visible(of, index, x, np.asarray(x.f.any(axis=0)))
    return clear, clear


def unseen(of: "CacheIntegrals", index: Array, x: Second) -> tuple[Array, Array]:
    """V = 1 until `lit`.  Biased, see above."""
    return np.ones(len(index), dtype=bool), x.seen


@dataclass(frozen=True, eq=False)
class CacheIntegrals:
    """The light that x_1 takes from all surfaces, its geometry term bounded by G_max, for given x_1.  [DDGIR Eq. 9]

    v, r, T   x_1 of every column, its distance (N,) from x_0, and the throughput (C, N) that arrives there
    G_max     unit 1 / length^(d-1) in the scene's units, inf for none
    lights    points on lights among the candidates
    value, sight  what selection knows of L_e + L+ and of V
    shape     rows and columns of the image, or (n,)
    Raises ValueError for G_max <= 0 and lights < 1.
    """

    cache: Cache
    v: Vertex
    r: Array
    T: Array
    shape: tuple[int, ...]
    G_max: float
    lights: int = LIGHTS
    value: Value = kept
    sight: Sight = looking

    def __post_init__(self) -> None:
        positive(self.G_max, "G_max", "its unit is 1 / length^(d-1) in scene units: np.inf bounds nothing.")
        whole(self.lights, 1, "the number of candidates on lights", f"The default is {LIGHTS}.")

    @property
    def n(self) -> int:
        """Number of pixels."""
        return prod(self.shape)

    @property
    def scene(self) -> Scene:
        """The cache's scene."""
        return self.cache.scene

    def candidates(self, index: Array, chance: Chance) -> Iterator[tuple[Second, Array]]:
        """Points on lights, then the point that a ray by the BSDF meets; m W = 1 / (sum of all densities per area)."""
        yield from on_lights(self, index, chance)
        found = by_ray(self, index, chance)
        yield found.x, found.mW

    def target(self, index: Array, x: Second) -> Array:
        """p_hat = mean of f times mean of L_e + L+, over channels."""
        return np.asarray(x.f.mean(axis=0) * x.L.mean(axis=0))

    def contribution(self, index: Array, x: Second) -> Array:
        """f (L_e + L+)(y -> x_1), (C, N): a query of this x_1, not what is kept; with the kept numbers."""
        return x.f * radiance(self.cache, x, connection(self, index, x), gloss)

    def shift(self, x: Second, index: Array, to: Pixels) -> Shifted:
        """The same point lights another x_1; J = 1 in area."""
        there: CacheIntegrals = to.of  # type: ignore[assignment]
        unknown = replace(x, seen=np.zeros(len(to.index), dtype=bool))
        return Shifted(held_by(there, to.index, unknown, connection(there, to.index, x)), np.ones(len(to.index)))


def cache_integrals(t: Tracer, cache: Cache, u: Array, pixel: Array, G_max: float) -> CacheIntegrals:
    """Over the first hits of primary numbers u (numbers, N) of `pixel` (N,): a G-buffer."""
    shape: tuple[int, ...] = getattr(t.sensor, "shape", (t.sensor.n,))
    return CacheIntegrals(cache, *first_hit(t, u, pixel), shape, G_max)


# ---------------------------------------------------------------- connections


def bound(G_max: float, G: Array) -> Array:
    """min(1, G_max / G), so that G times it is min(G, G_max); (N,).  [Kollig 2006]"""
    over = np.greater(G, G_max)
    return np.where(over, G_max / np.where(over, G, 1), 1.0)


def connection(of: CacheIntegrals, index: Array, x: Second) -> Connection:
    """From x_1 of columns `index` to the points; what faces away, or grazes, sends nothing."""
    s = of.scene
    v, T = take((of.v, of.T), index)
    to = x.y - v.x
    r = np.maximum(norm(to), NEAREST)
    w = to / r
    local, cos = s.space.to_local(v.n, w), -dot(x.n, w)
    per_area = cos * (cos > GRAZING) / power(r, s.space.d - 1)
    f, p = mat.evaluate_all(s.materials, s.space, v, mat.lobe_shares(s.materials, v), local)
    return Connection(r, w, T * f * per_area, np.abs(local[-1]) * per_area, p * per_area, p)


def held_by(of: CacheIntegrals, index: Array, x: Second, at: Connection) -> Second:
    """The points as x_1 of columns `index` holds them, L as their integrals know it."""
    x = replace(x, f=at.f * bound(of.G_max, at.G))
    V, seen = of.sight(of, index, x)
    x = replace(x, f=x.f * V, seen=seen)
    return replace(x, L=of.value(of, x, at))


def radiance(c: Cache, x: Second, at: Connection, sampled: Sampled) -> Array:
    """(L_e + L+)(y -> x_1), (C, N), 0 where f is."""
    lit = np.flatnonzero(x.f.any(axis=0))
    L, part = np.zeros_like(x.f), take(x, lit)
    z = vertex(c.scene, part.y, part.prim, -at.w.take(lit, axis=-1))
    L[:, lit] = emitted(c.scene, z) + leaving(c, z, at.r.take(lit), part.u, sampled)
    return L


def visible(of: CacheIntegrals, index: Array, x: Second, wanted: Array) -> Array:
    """V(x_1, y) where `wanted` (N,), else False; no ray for points that are known to be seen."""
    clear = wanted.copy()
    columns = np.flatnonzero(clear & ~x.seen)
    clear[columns] = of.scene.visible(of.v.x.take(index[columns], axis=-1), x.y.take(columns, axis=-1))
    return clear


def lit(X: Reservoirs, here: Pixels) -> Reservoirs:
    """W <- W V: at most one shadow ray, none for points that are known to be seen.  [DDGIR 3.1, step 3]"""
    of: CacheIntegrals = here.of  # type: ignore[assignment]
    V = visible(of, here.index, X.x, (X.W > 0) & X.x.f.any(axis=0))
    return replace(X, W=X.W * V, x=replace(X.x, seen=V))


# ---------------------------------------------------------------- candidates


def on_lights(of: CacheIntegrals, index: Array, chance: Chance) -> Iterator[tuple[Second, Array]]:
    """Points on lights, picked by power; m W = 1 / (lights p_A + p) with the density p of the BSDF's ray."""
    d = of.scene.space.d
    for _ in range(of.lights):
        pick, *point = chance.uniform((d, len(index)))
        light = sample_light(of.scene, pick, np.stack(point))
        x = _point(of, light.y, light.n, light_primitive(of.scene, pick), chance)
        at = connection(of, index, x)
        yield _first_held(of, index, x, at), 1 / (of.lights * light.pdf_area + at.p)


def ray(of: CacheIntegrals, index: Array, chance: Chance) -> Ray:
    """One ray by the BSDF, a lobe first; what it carries is weighed by the density of all lobes."""
    s = of.scene
    v, T = take((of.v, of.T), index)
    u, P = chance.uniform(v.x.shape), mat.lobe_shares(s.materials, v)
    lobe = mat.choose_lobe(P, u[0])
    g = gloss_of(s, v, P, lobe, mat.sample_lobe(s.materials, s.space, v, lobe, u[1:]))
    f, p = mat.evaluate_all(s.materials, s.space, v, P, g.i)
    z, r, met = arrive(s, v.x, g.w)
    weight = np.where(g.p > 0, ratio(f, p), g.weight)
    return Ray(z, g.w, r, g.p, T * weight * (met & ~g.lost))


def by_ray(of: CacheIntegrals, index: Array, chance: Chance) -> Found:
    """The point that a ray meets; its density per area is that of all lobes, p |cos_y| / r^(d-1)."""
    found = ray(of, index, chance)
    z, met = found.z, np.asarray(found.weight.any(axis=0))
    x = replace(_point(of, z.x, z.n, z.prim, chance), seen=met)
    at = connection(of, index, x)
    at = replace(at, f=at.f * met)
    shared = met & (found.p > 0) & (at.p > 0)
    p_light = light_pdf(of.scene, z, found.r) * z.o[-1] / power(found.r, of.scene.space.d - 1)
    mW = shared / np.where(shared, of.lights * p_light + at.p, 1)
    rest = found.weight * np.where(found.p > 0, 1 - bound(of.G_max, at.G), 1)
    return Found(found, _first_held(of, index, x, at), mW, rest)


def light_primitive(s: Scene, pick: Array) -> Array:
    """The primitive that `sample_light` takes for the number `pick`, (N,)."""
    return np.flatnonzero(s.pdf_area).take(np.searchsorted(s.lights.upto[:-1], pick, side="right"))


def _point(of: CacheIntegrals, y: Array, n: Array, prim: Array, chance: Chance) -> Second:
    """A point that nobody holds yet."""
    none = np.zeros((of.scene.C, len(prim)))
    return Second(y, n, prim, chance.uniform(y.shape), none, none, np.zeros(len(prim), dtype=bool))


def _first_held(of: CacheIntegrals, index: Array, x: Second, at: Connection) -> Second:
    """The point as the x_1 that has found it holds it: what is kept is asked here."""
    x = held_by(of, index, x, at)
    return replace(x, L=asked(of, x, at))
