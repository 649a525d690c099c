"""Whole paths to look at: every vertex, lobe, density and factor of a leaf, and of its offset path.

Estimators never need them: `Path` holds what a shift reads.  Pictures do, and so does whoever wants to
see f = f_0 f_1 .. f_(k+1) and p = p_0 p_1 .. p_(k+1) factor by factor, F = omega f / p.  All factors are
evaluated here from positions, directions and lobes; nothing of `record` or `shifts` enters.

The first axis is the vertex: entry i is x_i, and what lies beyond x_(k+1) is padding.
"""

from dataclasses import dataclass

import numpy as np

from restir_ref.batch import Array, pick, ratio, take
from restir_ref.transport import materials as mat
from restir_ref.transport.lobes import KINDS, LOBES
from restir_ref.transport.materials import Vertex
from restir_ref.transport.paths import Tracer, Tree, connectable, trace
from restir_ref.transport.rays import emitted, light_pdf, sample_light, vertex
from restir_ref.transport.vectors import norm, normalize

ALL = -1
"""The lobe of a vertex that ends in light sampling, all of them: the symbol N of [GRIS Eq. 50]."""

NONE = -2
"""The lobe of what does not scatter: the sensor, the light, and padding."""

DELTA = np.array([LOBES[kind].delta for kind in KINDS])


@dataclass(frozen=True)
class ExtendedPath:
    """A path x_0 .. x_(k+1) with the lobes that leave its vertices; K = depth + 2.  [GRIS Eq. 50]

    pixel (N,), u (D, N)  where it begins, and its primary sample; stale from a reconnection on
    k, nee (N,)         scattering vertices, and whether light sampling found the end; the path has k + 2 vertices
    x, w (K, d, N)      positions, and the unit direction leaving each for the next; NaN beyond the end
    prim, lobe (K, N)   primitive, -1 on the sensor and beyond the end; lobe, ALL or NONE
    seen (K, N)         whether x_i sees x_(i+1); true beyond the end
    """

    pixel: Array
    u: Array
    k: Array
    nee: Array
    x: Array
    w: Array
    prim: Array
    lobe: Array
    seen: Array


@dataclass(frozen=True)
class Factors:
    """What F is a product of; entries that do not exist are 1, normals NaN.

    n (K, d, N)     normal of x_i on the side of x_(i-1)
    r, cos (K, N)   distance from x_(i-1), and the cosine with which its direction arrives
    P (K, N)        probability of choosing the lobe
    f (K, C, N)     f |cos| of the lobe, of all lobes before light sampling; the sensor's weight at x_0, L_e at x_(k+1)
    p, p_all (K, N)  density (directions) of w_i: of its lobe, P included (a delta lobe's is P), or of light sampling;
                    and of all lobes together, 0 where a delta lobe was sampled
    p_light (N,)    density (directions) of light sampling for w_k
    """

    n: Array
    r: Array
    cos: Array
    P: Array
    f: Array
    p: Array
    p_all: Array
    p_light: Array


def extended_path(t: Tracer, u: Array, pixel: Array, k: Array, nee: Array) -> ExtendedPath:
    """The path that primary samples u (D, N) give in `pixel` (N,) as leaf (k, nee)."""
    return leaf_path(t, trace(t, u, pixel), pixel, k, nee)


def leaf_path(t: Tracer, tree: Tree, pixel: Array, k: Array, nee: Array) -> ExtendedPath:
    """The path from `pixel` to leaf (k, nee) of a traced tree, (N,) each."""
    u, K, N = tree.u, t.depth + 2, len(k)
    start, first, _ = t.sensor.ray(pixel, u[: t.sensor.numbers])
    x = np.stack([start, *(v.x for v in tree.x)])
    w = np.stack([first, *(at.w for at in tree.at), first])
    prim = np.stack([np.full(N, -1), *(v.prim for v in tree.x)])
    lobe = np.stack([np.full(N, NONE), *(at.lobe for at in tree.at), np.full(N, NONE)])
    for i, (_, towards) in enumerate(tree.lights, start=1):
        end = nee & (k == i)
        point, light = _light(t, u, i)
        w[i], lobe[i] = np.where(end, towards, w[i]), np.where(end, ALL, lobe[i])
        x[i + 1], prim[i + 1] = np.where(end, point, x[i + 1]), np.where(end, light, prim[i + 1])
    index = np.arange(K)[:, None]
    x, w = np.where((index <= k + 1)[:, None], x, np.nan), np.where((index <= k)[:, None], w, np.nan)
    prim, lobe = np.where(index <= k + 1, prim, -1), np.where(index <= k, lobe, NONE)
    return ExtendedPath(pixel, u, k, nee, x, w, prim, lobe, _seen(tree, k, nee))


def _light(t: Tracer, u: Array, i: int) -> tuple[Array, Array]:
    """Position and primitive of the light point that light sampling at x_i draws."""
    pick, point = t.light_numbers(u, i)
    lit = np.flatnonzero(t.scene.pdf_area)
    which = np.searchsorted(t.scene.lights.upto[:-1], pick, side="right")
    return sample_light(t.scene, pick, point).y, lit.take(which)


def _seen(tree: Tree, k: Array, nee: Array) -> Array:
    """False where a ray left the scene or got lost, and where the light is hidden."""
    rows = [tree.T[0].any(axis=0)]
    for i, (at, (light, _)) in enumerate(zip(tree.at, tree.lights, strict=True), start=1):
        rows.append(np.where(nee & (k == i), light.bare.any(axis=0), at.weight.any(axis=0)) | (i > k))
    return np.stack([*rows, np.ones(len(k), dtype=bool)])


def offset_path(t: Tracer, x: ExtendedPath, c: Array, pixel: Array) -> ExtendedPath:
    """T(x) in `pixel` of tracer t, legal or not: y_1 .. y_(c-1) replayed, x_c .. copied; c = 0 replays all.

    Replay copies numbers, so that lobes may switch; a reconnection copies the lobe at x_(c-1).  [GRIS 7.6]
    """
    y, i = extended_path(t, x.u, pixel, x.k, x.nee), np.arange(len(x.x))[:, None]
    own, replayed = (i < c) | (c == 0), (i < c - 1) | (c == 0)
    at, w = np.where(own[:, None], y.x, x.x), np.where(replayed[:, None], y.w, x.w)
    seen = np.where(replayed, y.seen, x.seen)
    for j in range(2, len(x.x)):
        here = np.flatnonzero(c == j)
        start, end, prim = take((at[j - 1], at[j], x.prim[j]), here)
        w[j - 1][:, here], seen[j - 1, here] = normalize(end - start), t.scene.meets(start, end, prim)
    prim, lobe = np.where(own, y.prim, x.prim), np.where(replayed, y.lobe, x.lobe)
    return ExtendedPath(pixel, x.u, x.k, x.nee, at, w, prim, lobe, seen)


def positions(x: ExtendedPath) -> tuple[Array, Array]:
    """x_0 .. x_(k+1) as (K, d, N), NaN beyond, so that lines end there; and how many there are, (N,)."""
    return x.x, x.k + 2


def factors(t: Tracer, x: ExtendedPath) -> Factors:
    """Every factor of a path, evaluated vertex by vertex."""
    (K, d, N), C = x.x.shape, t.scene.C
    n, one = np.full((K, d, N), np.nan), np.ones((K, N))
    found = Factors(n, one, one.copy(), one.copy(), np.ones((K, C, N)), one.copy(), one.copy(), np.zeros(N))
    found.f[0] = t.sensor.ray(x.pixel, x.u[: t.sensor.numbers])[2]
    for i in range(1, K):
        for columns, put in ((np.flatnonzero(x.k >= i), _put_scattering), (np.flatnonzero(x.k + 1 == i), _put_end)):
            part = take(x, columns)
            v = vertex(t.scene, part.x[i], part.prim[i], -part.w[i - 1])
            found.n[i][:, columns], found.cos[i, columns] = v.n, v.o[-1]
            found.r[i, columns] = norm(part.x[i] - part.x[i - 1])
            put(t, found, part, v, i, columns)
    return found


def _put_scattering(t: Tracer, to: Factors, x: ExtendedPath, v: Vertex, i: int, columns: Array) -> None:
    """P, f, p and p_all at x_i; p of light sampling follows at the end."""
    table, space, lobe = t.scene.materials, t.scene.space, x.lobe[i]
    P, local, single = mat.lobe_shares(table, v), space.to_local(v.n, x.w[i]), np.maximum(lobe, 0)
    f_all, p_all = mat.evaluate_all(table, space, v, P, local)
    f, p = mat.evaluate_lobe(table, space, v, single, local)
    delta = DELTA[table.kind.take(v.material * table.L + single)] & (lobe != ALL)
    chosen = pick([*P], single)
    to.P[i, columns] = np.where(lobe == ALL, 1, chosen)
    to.f[i][:, columns] = np.where(lobe == ALL, f_all, f)
    to.p[i, columns] = chosen * np.where(delta, 1, p)
    to.p_all[i, columns] = np.where(delta, 0, p_all)


def _put_end(t: Tracer, to: Factors, x: ExtendedPath, v: Vertex, i: int, columns: Array) -> None:
    """L_e at x_(k+1), and the density of light sampling at x_k."""
    to.f[i][:, columns] = emitted(t.scene, v)
    to.p_light[columns] = light_pdf(t.scene, v, to.r[i, columns])
    sampled = columns[x.nee]
    to.p[i - 1, sampled] = to.p_light[sampled]


def mis_weight(x: ExtendedPath, of: Factors) -> Array:
    """omega = p / (p_light + p_all) at x_k, p the technique's own; 1 without a rival.  [GRIS Eq. 49]"""
    p_all = np.take_along_axis(of.p_all, x.k[None], axis=0)[0]
    alone = (x.k == 0) | (p_all == 0) & ~x.nee
    return np.where(alone, 1.0, ratio(np.where(x.nee, of.p_light, p_all), of.p_light + p_all))


def contribution(x: ExtendedPath, of: Factors) -> Array:
    """omega f = omega f_0 f_1 .. f_(k+1), 0 where something stands between, (C, N): not yet divided by p."""
    return np.asarray(mis_weight(x, of) * x.seen.all(axis=0) * of.f.prod(axis=0))


def density(of: Factors) -> Array:
    """p = p_1 .. p_k, (N,): of the path's lobes and directions; the film stays in primary numbers."""
    return np.asarray(of.p.prod(axis=0))


def throughput(of: Factors) -> Array:
    """T_i = f_0 / p_0 .. f_i / p_i, with which what x_(i+1) sends arrives at the sensor, (K, C, N)."""
    return np.asarray(np.cumprod(ratio(of.f, of.p[:, None]), axis=0))


def first_connectable(t: Tracer, x: ExtendedPath, of: Factors) -> Array:
    """c: the first index i >= 2 with x_(i-1) and x_i connectable; 0 if there is none.  [GRIS 7.5, 7.6]

    A vertex is as rough as the lobe that leaves it, as its roughest lobe before light sampling, and a light is
    rough; light sampling itself is replayed, not reconnected.
    """
    rough, c = roughnesses(t, x), np.zeros(len(x.k), dtype=int)
    for i in range(2, len(x.x)):
        exists = i <= np.where(x.nee, x.k, x.k + 1)
        c = np.where((c == 0) & exists & connectable(t.rule, rough[i - 1], rough[i], of.r[i]), i, c)
    return c


def roughnesses(t: Tracer, x: ExtendedPath) -> Array:
    """Perceptual roughness that judges every vertex, (K, N); 0 for the sensor and padding."""
    table = t.scene.materials
    material = t.scene.material.take(x.prim)
    by_lobe = table.roughness.take(material * table.L + np.maximum(x.lobe, 0))
    scattering = np.where(x.lobe == ALL, table.roughest.take(material), by_lobe)
    i = np.arange(len(x.x))[:, None]
    return np.where((i == 0) | (i > x.k + 1), 0.0, np.where(i == x.k + 1, 1.0, scattering))
