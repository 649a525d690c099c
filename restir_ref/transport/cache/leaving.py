"""L+, the radiance that a surface sends on, from the irradiance of a cache.  [DDGIR 3.3]

    L+(x, w_o) = rho / C_d E+(x, n) + 1 / C_d int E+(x, w_i) f_g(x, w_o, w_i) |cos_i| dw_i        [DDGIR Eq. 6]

E+ / C_d is the cosine-prefiltered radiance, for the diffuse term about the normal, for the glossy one about w_i; the
integral is estimated by one sample of the glossy lobes, which are all lobes but Lambert's.  Delta lobes have one w_i.

# erratum: Eq. 6 has "2 pi" where 1 / C_d stands here, which may be 1 / (2 pi) badly set.  In a furnace, where E+ = C_d,
only 1 / C_d, 1 / pi in space and 1 / 2 in flatland, gives rho + albedo_g: E+ has one normalisation, the diffuse term's.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from restir_ref.batch import Array, pick, ratio, take
from restir_ref.chance import Chance
from restir_ref.transport import materials as mat
from restir_ref.transport.cache.field import Field
from restir_ref.transport.lobes import KINDS
from restir_ref.transport.materials import Table, Vertex
from restir_ref.transport.scene import Scene
from restir_ref.transport.space import ball_volume
from restir_ref.transport.vectors import dot

LAMBERT = KINDS.index("lambert")

Displacement = Callable[[Array, Array, Array], Array]
"""(n, o, r) -> b (d, N): where a query at x looks, x + b; n, o (d, N) normal and direction towards the vertex before,
r (N,) how far that is."""


def undisplaced(n: Array, o: Array, r: Array) -> Array:
    """b = 0."""
    return np.zeros_like(n)


@dataclass(frozen=True, eq=False)
class Cache:
    """A field of irradiance in its scene, and the displacement of its queries (see `biases`)."""

    scene: Scene
    field: Field
    displaced: Displacement = undisplaced


@dataclass(frozen=True)
class Gloss:
    """One sample of the glossy lobes at N vertices.

    i, w (d, N)   local and world direction;  weight (C, N)  f_g |cos_i| over the density of lobe and direction
    p (N,)        density of w by all glossy lobes together, per direction; 0 for delta lobes
    colour (C, N) the chosen lobe's over its probability;  lost (N,)  whether the lobe had no direction: weight 0
    """

    i: Array
    w: Array
    weight: Array
    p: Array
    colour: Array
    lost: Array


Sampled = Callable[["Cache", Vertex, Array], Gloss]
"""(cache, v, u (d, N)) -> the direction in which a vertex asks for what it mirrors."""


def prefiltered(E: Array, d: int) -> Array:
    """E+ / C_d (C, N): the radiance that arrives, filtered by the cosine about the direction asked."""
    return np.asarray(E / ball_volume(d))


def is_glossy(t: Table, v: Vertex) -> Array:
    """Which lobes at v are not Lambert's, (L, N)."""
    return np.asarray((t.kind != LAMBERT).reshape(-1, t.L).T.take(v.material, axis=-1))


def diffuse_albedo(t: Table, v: Vertex) -> Array:
    """rho (C, N): the colours of the Lambert lobes at v."""
    rho = (t.colour * (t.kind == LAMBERT)).reshape(len(t.colour), -1, t.L).sum(axis=-1)
    return np.asarray(rho.take(v.material, axis=-1))


def glossy_shares(t: Table, v: Vertex) -> Array:
    """Probability of each lobe among the glossy ones, (L, N); columns sum to 1, or to 0 where there is none."""
    P = mat.lobe_shares(t, v) * is_glossy(t, v)
    return ratio(P, P.sum(axis=0))


def gloss(c: Cache, v: Vertex, u: Array) -> Gloss:
    """One sample of the glossy lobes, from u (d, N): lobe 1, direction d-1."""
    s = c.scene
    P = glossy_shares(s.materials, v)
    lobe = mat.choose_lobe(P, u[0])
    return gloss_of(s, v, P, lobe, mat.sample_lobe(s.materials, s.space, v, lobe, u[1:]))


def gloss_of(s: Scene, v: Vertex, P: Array, lobe: Array, i: Array) -> Gloss:
    """What a sample i (d, N) of a lobe carries, chosen with shares P (L, N)."""
    lost = i[-1] == 0
    i = np.concatenate([i[:-1], np.where(lost, 1.0, i[-1])[None]])
    weight, _, p = mat.scatter_lobe(s.materials, s.space, v, P, lobe, i)
    colour = ratio(s.materials.colour.take(v.material * s.materials.L + lobe, axis=-1), pick([*P], lobe))
    return Gloss(i, s.space.to_world(v.n, i), np.where(lost, 0.0, weight), p, colour, lost)


def never_lost(c: Cache, v: Vertex, u: Array) -> Gloss:
    """The same, but a lobe without direction asks where a mirror would, with all of its colour.

    What selects samples must be positive wherever they carry light from another vertex, and one sample may be lost
    here and not there.
    """
    g = gloss(c, v, u)
    mirrored = np.concatenate([-v.o[:-1], v.o[-1:]])
    i = np.where(g.lost, mirrored, g.i)
    return Gloss(i, c.scene.space.to_world(v.n, i), np.where(g.lost, g.colour, g.weight), g.p, g.colour, g.lost)


def leaving(c: Cache, v: Vertex, r: Array, u: Array, sampled: Sampled = gloss) -> Array:
    """L+ (C, N) of vertices v towards v.o, a distance r (N,) away; u (d, N) are the numbers of the glossy sample.

    [DDGIR Eq. 6]
    """
    glossy = np.flatnonzero(is_glossy(c.scene.materials, v).any(axis=0))
    L = diffuse(c, v, r)
    if len(glossy):
        part = take(v, glossy)
        g = sampled(c, part, u.take(glossy, axis=-1))
        L[:, glossy] += g.weight * mirrored(c, part, r.take(glossy), g)
    return L


def telling(displaced: Displacement) -> Callable[[Scene, Field, Vertex, Array, Chance], Array]:
    """Both terms of Eq. 6 for updates of probes: (scene, field, vertices, r (N,), chance) -> L+ (C, N).  [DDGIR 3.3]"""

    def told(scene: Scene, field: Field, v: Vertex, r: Array, chance: Chance) -> Array:
        return leaving(Cache(scene, field, displaced), v, r, chance.uniform(v.x.shape))

    return told


def diffuse(c: Cache, v: Vertex, r: Array) -> Array:
    """rho / C_d E+(x, n), (C, N)."""
    rho = diffuse_albedo(c.scene.materials, v)
    matte, L = np.flatnonzero(rho.any(axis=0)), np.zeros_like(rho)
    if len(matte):
        part = take(v, matte)
        E = c.field.irradiance(part.x, part.n, part.n, displacement(c, part, r.take(matte)))
        L[:, matte] = rho[:, matte] * prefiltered(E, c.scene.space.d)
    return L


def mirrored(c: Cache, v: Vertex, r: Array, g: Gloss) -> Array:
    """E+(x, w_i) / C_d, (C, N): what arrives about w_i; what is transmitted arrives at the surface's other side."""
    through = g.i[-1] < 0
    n, b = np.where(through, -v.n, v.n), displacement(c, v, r)
    b = np.where(through, b - 2 * dot(b, v.n) * v.n, b)
    return prefiltered(c.field.irradiance(v.x, n, g.w, b), c.scene.space.d)


def displacement(c: Cache, v: Vertex, r: Array) -> Array:
    """b (d, N) of queries at v, seen from a distance r (N,)."""
    return c.displaced(v.n, c.scene.space.to_world(v.n, v.o), r)
