"""From a second vertex to the image: what selection only guesses is asked anew, once.  [DDGIR 3.1, 3.3, 3.5]

    L = L_e(x_1) + ceil(T)(L_e + L+) by the selected sample + floor(T)(L_e + L+) by the ray among the candidates

For shading, L+ may be `plain`, Eq. 6 at x_2, or `recursive`: a path that goes on by glossy lobes until it has spread.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from restir_ref.batch import Array, take
from restir_ref.chance import Chance
from restir_ref.guards import positive, whole
from restir_ref.integrals import Pixels, Reservoirs
from restir_ref.transport import materials as mat
from restir_ref.transport.cache.footprint import pixel_footprint, widening
from restir_ref.transport.cache.integrals import CacheIntegrals, Found, Ray, connection
from restir_ref.transport.cache.leaving import (
    Cache,
    diffuse,
    gloss_of,
    glossy_shares,
    is_glossy,
    leaving,
    mirrored,
)
from restir_ref.transport.materials import Vertex
from restir_ref.transport.rays import arrive, emitted, vertex
from restir_ref.transport.vectors import power

MOST = 8
"""Vertices after which a recursion asks the cache in any case."""


@dataclass(frozen=True)
class Arrival:
    """Second vertices z, as x_1 meets them.

    r (N,)  distance from x_1;  p (N,)  density per direction, of all lobes at x_1, 0 of delta lobes
    a0 (N,)  the pixel's footprint at x_1;  wanted (N,)  whether anybody asks for their radiance
    """

    z: Vertex
    r: Array
    p: Array
    a0: Array
    wanted: Array


Shading = Callable[[Cache, Arrival, Chance], Array]
"""L+(z -> x_1) (C, N), without bias where the cache has none; anything where it is not wanted."""


def plain(c: Cache, at: Arrival, chance: Chance) -> Array:
    """Eq. 6 at x_2.  [DDGIR Eq. 6]"""
    u, columns = chance.uniform(at.z.x.shape), np.flatnonzero(at.wanted)
    L = np.zeros((c.scene.C, len(at.r)))
    if len(columns):
        L[:, columns] = leaving(c, take(at.z, columns), at.r.take(columns), u.take(columns, axis=-1))
    return L


def recursive(threshold: float, most: int = MOST) -> Shading:
    """A path from x_2 on that ends where its footprint a > threshold a_0, or after `most` vertices.  [DDGIR 3.3]

    Where the diffuse lobes are chosen it ends in rho / C_d E+; where a glossy one is, in its part of Eq. 6 if the path
    has spread, else it goes on.  Raises ValueError for threshold <= 0 and most < 1.
    """
    positive(threshold, "the threshold c of footprints", "np.inf traces to the last vertex; for none take `plain`.")
    whole(most, 1, "the number of vertices of a recursion", f"The default is {MOST}.")

    def followed(c: Cache, at: Arrival, chance: Chance) -> Array:
        d, columns = c.scene.space.d, np.flatnonzero(at.wanted)
        L, T = np.zeros((c.scene.C, len(at.r))), np.ones((c.scene.C, len(columns)))
        v, r, p, a0 = take((at.z, at.r, at.p, at.a0), columns)
        length = np.zeros(len(columns))
        for i in range(most):
            u = chance.uniform(at.z.x.shape).take(columns, axis=-1)
            if not len(columns):
                continue
            length = length + widening(r, p, v.o[-1], d)
            ends = (power(length, d - 1) > threshold * a0) | (i == most - 1)
            step = _step(c, v, r, u, ends)
            L[:, columns] += T * step.L
            on = np.flatnonzero(step.goes_on)
            columns, T, length, a0 = take((columns, T * step.weight, length, a0), on)
            v, r, hit = arrive(c.scene, v.x.take(on, axis=-1), step.w.take(on, axis=-1))
            p, T = step.p.take(on), T * hit
            L[:, columns] += T * emitted(c.scene, v)
        return L

    return followed


@dataclass(frozen=True)
class Step:
    """What a recursion does at a vertex: the radiance L (C, N) that ends it, or a direction w (d, N) to go on.

    weight (C, N) f |cos| over the probability of all that was chosen;  p (N,) density of w by the glossy lobes
    """

    L: Array
    goes_on: Array
    w: Array
    weight: Array
    p: Array


def _step(c: Cache, v: Vertex, r: Array, u: Array, ends: Array) -> Step:
    """Choose a lobe by u[0]; ask the cache, about the normal, or where `ends` (N,) about the lobe's direction."""
    t, space = c.scene.materials, c.scene.space
    P, glossy = mat.lobe_shares(t, v), is_glossy(t, v)
    P_g, lobe = (P * glossy).sum(axis=0), mat.choose_lobe(P, u[0])
    g = gloss_of(c.scene, v, glossy_shares(t, v), lobe, mat.sample_lobe(t, space, v, lobe, u[1:]))
    by_gloss = np.take_along_axis(glossy, lobe[None], axis=0)[0]
    weight = g.weight / np.where(by_gloss, P_g, 1) * by_gloss
    L = np.zeros_like(weight)
    matte, asked = np.flatnonzero(~by_gloss), np.flatnonzero(by_gloss & ends & ~g.lost)
    if len(matte):
        L[:, matte] = diffuse(c, take(v, matte), r.take(matte)) / (1 - P_g.take(matte))
    if len(asked):
        part = take((v, r, g), asked)
        L[:, asked] = weight[:, asked] * mirrored(c, *part)
    return Step(L, by_gloss & ~ends & weight.any(axis=0), g.w, weight, g.p)


# ---------------------------------------------------------------- the terms of Eq. 9


def own_light(of: CacheIntegrals, index: Array) -> Array:
    """L_e(x_1), as it arrives at the sensor; (C, N)."""
    v, T = take((of.v, of.T), index)
    return np.asarray(T * emitted(of.scene, v))


def bounded(X: Reservoirs, here: Pixels, shading: Shading, chance: Chance) -> Array:
    """ceil(T)(L_e + L+) = f W (L_e + L+), L+ as shading knows it; (C, N)."""
    of: CacheIntegrals = here.of  # type: ignore[assignment]
    x, at = X.x, connection(of, here.index, X.x)
    wanted = np.asarray((X.W > 0) & x.f.any(axis=0))
    z = vertex(of.scene, x.y, x.prim, -at.w)
    return np.asarray(x.f * X.W) * sent(of.cache, arrival(of, here.index, z, at.r, at.p_w, wanted), shading, chance)


def residual(of: CacheIntegrals, index: Array, found: Found, shading: Shading, chance: Chance) -> Array:
    """floor(T)(L_e + L+) by the ray that found a candidate, and all light by delta lobes of x_1; (C, N).

    [DDGIR Eq. 9]
    """
    return found.rest * sent(of.cache, met(of, index, found.ray, found.rest), shading, chance)


def arrival(of: CacheIntegrals, index: Array, z: Vertex, r: Array, p: Array, wanted: Array) -> Arrival:
    """Vertices z as x_1 of columns `index` (N,) meets them."""
    a0 = pixel_footprint(of.r.take(index), of.v.o[-1].take(index), of.scene.space.d)
    return Arrival(z, r, p, a0, wanted)


def met(of: CacheIntegrals, index: Array, ray: Ray, weight: Array) -> Arrival:
    """What rays from x_1 of columns `index` (N,) meet, wanted where they carry anything."""
    return arrival(of, index, ray.z, ray.r, ray.p, np.asarray(weight.any(axis=0)))


def sent(c: Cache, at: Arrival, shading: Shading, chance: Chance) -> Array:
    """L_e + L+ (C, N) where wanted, else 0."""
    return np.where(at.wanted, emitted(c.scene, at.z) + shading(c, at, chance), 0.0)
