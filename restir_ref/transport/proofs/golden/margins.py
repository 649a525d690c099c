"""How far a path's discrete choices are from falling the other way: what a file promises its readers.

A margin is a number without unit: the distance of a random number from the nearest boundary between lobes or lights, of
a ray from the nearest edge that it meets or misses, as a share of the primitive, of a hit from the next surface, as a
share of the ray, or the cosine with a surface whose other side is dark.
"""

from collections.abc import Sequence

import numpy as np

from restir_ref.batch import Array, take
from restir_ref.transport.lobes import visible_normal
from restir_ref.transport.materials import Vertex, lobe_roughness
from restir_ref.transport.paths import Tracer, Tree
from restir_ref.transport.rays import normal, sample_light
from restir_ref.transport.scene import Scene
from restir_ref.transport.vectors import dot, norm, normalize, reflect

BEYOND = 4
"""Extents of a scene that a ray which meets nothing is followed."""

START = 1e-6
"""What is met within this share of a ray is where it starts, or where it ends."""


def of_rays(s: Scene, x: Array, y: Array) -> Array:
    """Margin of the rays from x (d, N) that end at y (d, N), at what they meet or look for there; (N,)."""
    return np.minimum(_of_facets(s, x, y), _of_balls(s, x, y))


def _of_facets(s: Scene, x: Array, y: Array) -> Array:
    """Over facets: the least barycentric coordinate where the ray ends; what keeps each other one from being hit."""
    corner, edges = (
        s.corners[0],
        np.moveaxis(s.corners[1:] - s.corners[:1], -1, 0).swapaxes(1, 2),
    )  # (d, S), (S, d, d-1)
    height = np.einsum("ds,dn->sn", s.normals, x) - np.einsum("ds,ds->s", s.normals, corner)[:, None]
    rise = np.einsum("ds,dn->sn", s.normals, y - x)
    t = -height / np.where(rise == 0, 1e-300, rise)
    within = x[:, None] + np.clip(t, -1e9, 1e9) * (y - x)[:, None] - corner[:, :, None]
    b = np.einsum("skd,dsn->ksn", np.linalg.pinv(edges), within)
    least = np.minimum(b.min(axis=0), 1 - b.sum(axis=0))
    missed = np.maximum(np.maximum(-least, t - 1), -t)
    ends, starts = abs(t - 1) < START, abs(t) < START
    return np.asarray(np.where(starts, np.inf, np.where(ends, abs(least), abs(missed))).min(axis=0))


def _of_balls(s: Scene, x: Array, y: Array) -> Array:
    """Over balls: how far from grazing the hit one is, and what keeps each other one from being hit."""
    if not s.radii.size:
        return np.full(x.shape[-1], np.inf)
    from_centre, ray = x[:, None] - s.centres[:, :, None], (y - x)[:, None]
    a, b, r2 = dot(ray, ray), dot(from_centre, ray), s.radii**2
    height2 = dot(from_centre, from_centre) - b**2 / a  # squared distance of the line from the centre
    half = np.sqrt(np.maximum(r2 - height2, 0) / a)
    near, far = -b / a - half, -b / a + half
    passed = abs(np.sqrt(np.maximum(height2, 0)) / s.radii - 1)
    ends, starts = abs(near - 1) < START, (abs(near) < START) | (abs(far) < START)
    crossed = np.where(far < 0, np.inf, abs(near - 1))
    missed = np.where(height2 > r2, passed, crossed)
    return np.asarray(np.where(starts & ~ends, np.inf, np.where(ends, passed, missed)).min(axis=0))


def of_number(P: Array, u: Array) -> Array:
    """Distance of u (N,) from the nearest boundary of the running sum of P (L, N) inside (0, 1); (N,)."""
    upto = np.cumsum(P, axis=0)[:-1]
    distance = np.where((upto > 0) & (upto < 1), abs(upto - u), np.inf)
    return np.asarray(distance.min(axis=0, initial=np.inf))


def of_trees(t: Tracer, tree: Tree, x_0: Array) -> tuple[Array, Array]:
    """Margins of a tree from x_0 (d, N): of what leads to x_i and its lobe, and of light sampling there.

    Both (depth + 1, N); row i of the first is about x_(i+1), row i of the second about x_i, row 0 of it is inf.
    """
    way, lights = [of_rays(t.scene, x_0, tree.x[0].x)], [np.full(tree.u.shape[-1], np.inf)]
    for i, (v, at) in enumerate(zip(tree.x[:-1], tree.at, strict=True), start=1):
        lobe = of_number(at.P, t.lobe_number(tree.u, i))
        there = of_rays(t.scene, v.x, tree.x[i].x)
        way.append(least([lobe, there, abs(dot(v.n, at.w)), tree.x[i].o[-1]]))
        lights.append(of_light(t, v, t.light_numbers(tree.u, i)))
    return np.stack(way), np.stack(lights)


def of_darkness(t: Tracer, tree: Tree, i: int) -> Array:
    """Margin of what leaves x_i being dark: its lobe, how far below the surface, or how far past everything; (N,)."""
    v, at = tree.x[i - 1], tree.at[i - 1]
    side, as_normal = abs(dot(v.n, at.w)), abs(at.w - v.n).max(axis=0) < START
    below = np.flatnonzero(~at.weight.any(axis=0) & as_normal)  # such a sample has the normal in its place
    side[below] = _depth_below(t, *take((v, at.lobe, t.direction_numbers(tree.u, i)), below))
    past = of_rays(t.scene, v.x, v.x + BEYOND * t.scene.extent * at.w)
    past = np.where(np.isfinite(t.scene.intersect(v.x, at.w)[0]), 0, past)
    past[below] = np.inf
    return least([of_number(at.P, t.lobe_number(tree.u, i)), side, past])


def _depth_below(t: Tracer, v: Vertex, lobe: Array, u: Array) -> Array:
    """|cos| of the mirrored direction that a rough lobe throws away, 0 if it does not; (N,)."""
    alpha = lobe_roughness(t.scene.materials, v, lobe) ** 2
    i = reflect(v.o, visible_normal(t.scene.space, np.maximum(alpha, START), v.o, u))
    return np.asarray(np.maximum(-i[-1], 0))


def of_light(t: Tracer, v: Vertex, numbers: tuple[Array, Array]) -> Array:
    """Margin of light sampling at v by its numbers: the light chosen, the sides, and what stands between; (N,)."""
    pick, point = numbers
    light = sample_light(t.scene, pick, point)
    w = normalize(light.y - v.x)
    shares = np.diff(t.scene.lights.upto, prepend=0)[:, None] + 0 * pick
    facing = np.minimum(abs(dot(light.n, w)), abs(dot(v.n, w)))
    return least([of_number(shares, pick), facing, of_rays(t.scene, v.x, light.y)])


def of_pairs(t: Tracer, tree: Tree) -> Array:
    """Margin of connecting x_i to x_(i+1) by distance, |r / threshold - 1|, (depth + 1, N); row 0 is inf."""
    r = np.stack(tree.r)
    margin = abs(r / t.rule.distance - 1) if t.rule.distance > 0 else np.full(r.shape, np.inf)
    margin[0] = np.inf
    return np.asarray(margin)


def roughnesses(t: Tracer) -> Array:
    """Distance of every lobe's roughness from the threshold of connections; no path may need to tell them apart."""
    return np.asarray(abs(t.scene.materials.roughness - t.rule.roughness))


def least(margins: Sequence[Array]) -> Array:
    """The smallest, column by column."""
    return np.asarray(np.minimum.reduce(list(margins)))


def of_connections(t: Tracer, y: Vertex, z: Array, prim: Array) -> Array:
    """Margin of connecting vertices y to points z (d, N) of primitives: what is between, sides, the distance; (N,)."""
    r = norm(z - y.x)
    by_distance = abs(r / t.rule.distance - 1) if t.rule.distance > 0 else np.full(len(r), np.inf)
    w = normalize(z - y.x)
    sides = np.minimum(abs(dot(y.n, w)), abs(dot(normal(t.scene, z, prim), w)))
    return least([of_rays(t.scene, y.x, z), by_distance, sides])
