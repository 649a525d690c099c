"""Facets in one place: a lamp flush in a wall, a two-sided lamp, a wall with another material behind.

Facets coincide where they overlap and one lies in the other's plane, up to the clearance of rays; no distance tells
which of them a ray meets.  They are ordered as in the limit in which each moves a hair towards its own front, later
ones of the list farther, lamps farthest.  So a lamp in a wall shines, and from behind the wall is there.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from restir_ref.batch import Array, take, total
from restir_ref.transport.vectors import dot

AT_ONCE = 2**18
"""Pairs of facets whose boxes are compared at once, or those of one facet if these are more."""


@dataclass(frozen=True, eq=False)
class Coincidence:
    """others (P,), primitive by primitive, those of p from first[p] to first[p + 1], (S + B + 1,).

    rank (S + B,)  how far each is moved towards its front
    normals (d, S), maps (d, S, d), offsets (d, S)  of the facets
    """

    first: Array
    others: Array
    rank: Array
    normals: Array
    maps: Array
    offsets: Array


def coincidence(pairs: Array, emits: Array, normals: Array, maps: Array, offsets: Array) -> Coincidence:
    """Of pairs (2, P) of facets and whether primitives emit (S + B,)."""
    n, d = len(emits), len(normals)
    own, others = pairs.take(np.argsort(pairs[0], kind="stable"), axis=1)
    first, rank = np.searchsorted(own, np.arange(n + 1)), np.arange(1, n + 1) + n * emits
    return Coincidence(first, others, rank, normals, maps.reshape(d, -1, d), offsets.reshape(d, -1))


def coincident(corners: Array, maps: Array, offsets: Array, least: float) -> Array:
    """All pairs of facets that coincide, both ways round, (2, P), from corners (S, d, d) and the scene's maps.

    Hazard: from d = 4 on, neighbours in one plane that none of their own faces separates count too.
    """
    found = [np.zeros((2, 0), dtype=int)]
    for a, b in _boxes_that_meet(corners, least):
        in_a, off_a = _seen_from(maps, offsets, a, corners[b], least)
        in_b, off_b = _seen_from(maps, offsets, b, corners[a], least)
        found.append(np.stack([a, b])[:, (in_a | in_b) & ~off_a & ~off_b])
    pairs = np.concatenate(found, axis=1)
    pairs = pairs[:, np.lexsort(pairs[::-1])]
    return np.concatenate([pairs, pairs[::-1]], axis=1)


def _boxes_that_meet(corners: Array, least: float) -> Iterator[tuple[Array, Array]]:
    """Facets a < b, (P,) each, whose boxes along the axes are nowhere farther apart than `least`.

    Sorted along the axis that separates most of them, box i meets boxes i + 1 .. until one begins where it has ended.
    """
    low, high = (corners.min(axis=1) - least).T, corners.max(axis=1).T
    order, far = min((_until(*ends) for ends in zip(low, high, strict=True)), key=lambda found: int(found[1].sum()))
    low, high, upto = low[:, order], high[:, order], np.cumsum(far)
    cuts = np.searchsorted(upto, np.arange(AT_ONCE, upto[-1] + AT_ONCE, AT_ONCE)) + 1
    for start, stop in pairwise([0, *np.unique(np.minimum(cuts, len(order))).tolist()]):
        i = np.arange(start, stop).repeat(far[start:stop])
        j = i + 1 + np.arange(len(i)) - (upto - far)[i] + (upto - far)[start]
        for l, h in zip(low, high, strict=True):
            meet = (l[i] <= h[j]) & (h[i] >= l[j])
            i, j = i[meet], j[meet]
        yield np.minimum(order[i], order[j]), np.maximum(order[i], order[j])


def _until(low: Array, high: Array) -> tuple[Array, Array]:
    """Intervals in the order in which they begin, and how many of the next ones begin before each has ended; (S,)."""
    order = np.argsort(low, kind="stable")
    return order, np.searchsorted(low[order], high[order], side="right") - np.arange(1, len(low) + 1)


def _seen_from(maps: Array, offsets: Array, a: Array, v: Array, least: float) -> tuple[Array, Array]:
    """Whether corners v (P, d, d) lie in the plane of facet a (P,), and whether all are beyond one of its faces."""
    d = maps.shape[1]
    slope = maps.reshape(d, -1, d)[:, a]
    at = np.einsum("kpc,pvc->kpv", slope, v) + offsets.reshape(d, -1, 1)[:, a]
    at, slope = (np.concatenate([[first - each[:-1].sum(axis=0)], each]) for first, each in ((1, at), (0, slope)))
    beyond = at[:-1].max(axis=2) <= least * np.linalg.norm(slope[:-1], axis=2)
    return (np.abs(at[-1]) <= least).all(axis=1), beyond.any(axis=0)


def foremost(c: Coincidence, x: Array, prim: Array, w: Array) -> Array:
    """The primitive that a ray along w (d, N) meets at x, of those that coincide with `prim` there; (N,)."""
    if not c.others.size:
        return prim
    found = prim.copy()
    crowded = np.flatnonzero(c.first.take(prim + 1) > c.first.take(prim))
    if len(crowded):
        found[crowded] = _first_of_many(c, *take((x, prim, w), crowded))
    return found


def _first_of_many(c: Coincidence, x: Array, prim: Array, w: Array) -> Array:
    """`foremost`, by asking all."""
    start, stop = c.first.take(prim), c.first.take(prim + 1)
    found, height = prim, _height(c, prim, w)
    for k in range(int((stop - start).max())):
        other = np.where(start + k < stop, c.others.take(start + k, mode="clip"), prim)
        above = _height(c, other, w)
        better = (above > height) & _covers(c, other, x)
        found, height = np.where(better, other, found), np.where(better, above, height)
    return found


def _height(c: Coincidence, prim: Array, w: Array) -> Array:
    """How far facets are moved against the ray, (N,)."""
    return -np.sign(dot(c.normals.take(prim, axis=-1), w)) * c.rank.take(prim)


def _covers(c: Coincidence, prim: Array, x: Array) -> Array:
    """Whether the facet is there at x, a point of its plane; (N,)."""
    slopes = c.maps[:-1].take(prim, axis=1)
    b = np.stack([dot(slope.T, x) for slope in slopes]) + c.offsets[:-1].take(prim, axis=1)
    return np.asarray((b >= 0).all(axis=0) & (total([*b]) <= 1))
