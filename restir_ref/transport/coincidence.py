"""Facets in one place: a lamp flush in a wall, a two-sided lamp, a wall with another material behind.

Facets coincide where they overlap and one lies in the other's plane, up to the clearance of rays; no distance tells
which of them a ray meets.  They are ordered as in the limit in which each moves a hair towards its own front, later
ones of the list farther, lamps farthest.  So a lamp in a wall shines, and from behind the wall is there.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from restir_ref.batch import Array, take, total
from restir_ref.transport.vectors import dot

if TYPE_CHECKING:
    from restir_ref.transport.scene import Scene

AT_ONCE = 2**18
"""Pairs of facets whose boxes are compared at once."""


@dataclass(frozen=True, eq=False)
class Coincidence:
    """others (P,), primitive by primitive, those of p from first[p] to first[p + 1], (S + B + 1,).

    rank (S + B,)  how far each is moved towards its front
    """

    first: Array
    others: Array
    rank: Array


def coincidence(pairs: Array, emits: Array) -> Coincidence:
    """Of pairs (2, P) of facets and whether primitives emit (S + B,)."""
    n = len(emits)
    own, others = pairs.take(np.argsort(pairs[0], kind="stable"), axis=1)
    return Coincidence(np.searchsorted(own, np.arange(n + 1)), others, np.arange(1, n + 1) + n * emits)


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
    return np.concatenate([pairs, pairs[::-1]], axis=1)


def _boxes_that_meet(corners: Array, least: float) -> Iterator[tuple[Array, Array]]:
    """Facets a < b, (P,) each, whose boxes along the axes are nowhere farther apart than `least`."""
    low, high = (corners.min(axis=1) - least).T, corners.max(axis=1).T
    step = max(AT_ONCE // len(corners), 1)
    for at in range(0, len(corners), step):
        part = slice(at, at + step)
        meet = [(l[:, None] <= h[part]) & (h[:, None] >= l[part]) for l, h in zip(low, high, strict=True)]
        a, b = np.nonzero(np.logical_and.reduce(meet))
        yield a[a < b + at], (b + at)[a < b + at]


def _seen_from(maps: Array, offsets: Array, a: Array, v: Array, least: float) -> tuple[Array, Array]:
    """Whether corners v (P, d, d) lie in the plane of facet a (P,), and whether all are beyond one of its faces."""
    d = maps.shape[1]
    slope = maps.reshape(d, -1, d)[:, a]
    at = np.einsum("kpc,pvc->kpv", slope, v) + offsets.reshape(d, -1, 1)[:, a]
    at, slope = (np.concatenate([[first - each[:-1].sum(axis=0)], each]) for first, each in ((1, at), (0, slope)))
    beyond = at[:-1].max(axis=2) <= least * np.linalg.norm(slope[:-1], axis=2)
    return (np.abs(at[-1]) <= least).all(axis=1), beyond.any(axis=0)


def foremost(s: "Scene", x: Array, prim: Array, w: Array) -> Array:
    """The primitive that a ray along w (d, N) meets at x, of those that coincide with `prim` there; (N,)."""
    first, found = s.coincidence.first, prim.copy()
    crowded = np.flatnonzero(first.take(prim + 1) > first.take(prim))
    if len(crowded):
        found[crowded] = _first_of_many(s, *take((x, prim, w), crowded))
    return found


def _first_of_many(s: "Scene", x: Array, prim: Array, w: Array) -> Array:
    """`foremost`, by asking all."""
    start, stop = s.coincidence.first.take(prim), s.coincidence.first.take(prim + 1)
    found, height = prim, _height(s, prim, w)
    for k in range(int((stop - start).max())):
        other = np.where(start + k < stop, s.coincidence.others.take(start + k, mode="clip"), prim)
        above = _height(s, other, w)
        better = (above > height) & _covers(s, other, x)
        found, height = np.where(better, other, found), np.where(better, above, height)
    return found


def _height(s: "Scene", prim: Array, w: Array) -> Array:
    """How far facets are moved against the ray, (N,)."""
    return -np.sign(dot(s.normals.take(prim, axis=-1), w)) * s.coincidence.rank.take(prim)


def _covers(s: "Scene", prim: Array, x: Array) -> Array:
    """Whether the facet is there at x, a point of its plane; (N,)."""
    d = s.space.d
    slope, offset = s.maps.reshape(d, s.S, d)[:-1].take(prim, axis=1), s.offsets.reshape(d, s.S)[:-1].take(prim, axis=1)
    b = np.einsum("knd,dn->kn", slope, x) + offset
    return np.asarray((b >= 0).all(axis=0) & (total([*b]) <= 1))
