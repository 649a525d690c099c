"""Where rays meet surfaces, and what stands between two points: matrix products over all sheets.

A simplex with corners v_0 .. v_(d-1) has an affine map to coordinates b >= 0 with sum b <= 1 and to a
height h along its normal.  A ray x + t w crosses its plane at 1/t = -h'/h, and is inside if that times
b, b(x)/t + b', is >= 0 and sums to at most 1/t: one division per simplex, and the maps are matrix products.
Where two simplices make a box (see `sheets`), each 1/t b is at most 1/t, and their sum tells which of the two it is.

Floating point: what lies within CLEARANCE of a surface is on it, and neither meets nor is hidden by
it, at any angle.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Protocol

import numpy as np

from restir_ref.batch import Array, ratio, total
from restir_ref.transport.coincidence import Coincidence, foremost
from restir_ref.transport.sheets import Sheets
from restir_ref.transport.vectors import dot

CLEARANCE = 1e-10
"""Heights below this share of the scene's extent are 0."""

BLOCK = 2**15
"""Sheets times rays to be treated at once: what stays in the cache; never more than 4 times as many."""

# Hazard: glibc gives freed memory back to the system at once, and every temporary array then costs
# page faults, 5 times the arithmetic.  Once a large array has come and gone (this one is never
# touched) it keeps up to twice its size; other allocators do not mind.
np.empty(3 * 2**20)


class Surfaces(Protocol):
    """What a scene asks where rays go; primitives are the S facets, then the B balls."""

    def intersect(self, x: Array, w: Array) -> tuple[Array, Array]:
        """Distance t (N,) to the nearest surface along x + t w, and its primitive (N,); inf and 0 if there is none."""

    def visible(self, x: Array, y: Array) -> Array:
        """Whether nothing stands between x and y, (N,); the same, to the last bit, as between y and x."""

    def foremost(self, x: Array, prim: Array, w: Array) -> Array:
        """The primitive that a ray along w meets at x, of those that coincide with `prim` there; (N,)."""


@dataclass(frozen=True, eq=False)
class Matrices:
    """`Surfaces` by asking all of them at once.

    maps (d S, d), offsets (d S, 1)  of facets: coordinates first, heights last;  sheets  the same, two by two
    centres (d, B), radii (B, 1);  extent  of which CLEARANCE is a share
    """

    maps: Array
    offsets: Array
    sheets: Sheets
    centres: Array
    radii: Array
    extent: float
    coincidence: Coincidence

    @property
    def d(self) -> int:
        """The dimension."""
        return int(self.maps.shape[1])

    @property
    def asked(self) -> int:
        """Sheets and balls."""
        return self.sheets.P + self.radii.size

    def intersect(self, x: Array, w: Array) -> tuple[Array, Array]:
        """Distance and primitive, block by block."""
        near, prim = np.empty(x.shape[-1]), np.empty(x.shape[-1], dtype=int)
        for part in blocks(self.asked, x.shape[-1]):
            near[part], prim[part] = _nearest(self, x[:, part], w[:, part])
        if self.coincidence.others.size:
            hit = np.flatnonzero(near)
            x, w = x.take(hit, axis=-1), w.take(hit, axis=-1)
            prim[hit] = self.foremost(x + w / near[hit], prim[hit], w)
        with np.errstate(divide="ignore"):
            return 1 / np.abs(near), prim  # facets that were missed may have left -0

    def visible(self, x: Array, y: Array) -> Array:
        """Whether nothing stands between x and y, block by block."""
        clear = np.empty(x.shape[-1], dtype=bool)
        for part in blocks(self.asked, x.shape[-1]):
            clear[part] = ~_facets_between(self, x[:, part], y[:, part])
            if self.radii.size:
                clear[part] &= ~_balls_between(self, x[:, part], y[:, part])
        return clear

    def foremost(self, x: Array, prim: Array, w: Array) -> Array:
        """By the order of the list and by what emits."""
        return foremost(self.coincidence, x, prim, w)


def blocks(asked: int, n: int) -> Iterator[slice]:
    """Slices of the batch axis: BLOCK / P columns, or 256 if these are more, cut where P times that exceeds 4 BLOCK.

    Narrower ones would cost more by their number than they save in the cache.

    Hazard: BLAS rounds a lone column in another way, so cutting must not leave one.
    """
    wide, most = max(BLOCK // asked, 256), max(4 * BLOCK // asked, 3)
    for at in range(0, n, wide):
        width = min(wide, n - at)
        parts = -(-width // most)
        cuts = [at + width * k // parts for k in range(parts + 1)]
        yield from (slice(*ends) for ends in pairwise(cuts))


def _nearest(s: Matrices, x: Array, w: Array) -> tuple[Array, Array]:
    """1 / t of the nearest surface (n,), 0 if there is none, and its primitive (n,)."""
    near, b = _crossings(s, x, w)
    if s.radii.size:
        near = np.concatenate([near, _ball_nearness(s, x, w)])
    nearest = near.max(axis=0)
    index = np.arange(len(near), dtype=np.min_scalar_type(len(near)))[:, None]
    found = ((near == nearest) * index).max(axis=0).astype(int)  # argmax(axis=0), but 3 times as fast
    return nearest, _primitive(s.sheets, found, nearest, b) * (nearest > 0)


def _primitive(sheets: Sheets, found: Array, near: Array, b: Sequence[Array]) -> Array:
    """Which facet of the sheet that was met, or which ball, (n,)."""
    if not sheets.boxes:
        return np.asarray(sheets.prims[0].take(found))
    at = np.minimum(found, sheets.P - 1) * len(near) + np.arange(len(near))
    beyond = total([b_k.ravel().take(at) for b_k in b]) > near
    return np.asarray(sheets.prims[beyond.astype(int), found])


def _crossings(s: Matrices, x: Array, w: Array) -> tuple[Array, list[Array]]:
    """1 / t of the crossing with each sheet, 0 if it is missed, and 1 / t times its coordinates; (P, n) each."""
    *b, h = _coordinates(s.sheets, x)
    *back, descent = _product(s.sheets.maps, -w).reshape(s.d, -1, w.shape[-1])
    h[np.abs(h) <= CLEARANCE * s.extent] = np.inf
    near = np.asarray(descent / h)
    scaled = [b_k * near - back_k for b_k, back_k in zip(b, back, strict=True)]
    return near * ((near > 0) & _inside(s.sheets.boxes, scaled, near)), scaled


def _inside(boxes: int, b: Sequence[Array], one: Array) -> Array:
    """Whether coordinates b, times `one`, lie in the sheets, of which the first ones are boxes; (P, n)."""
    inside = total([b_k[boxes:] for b_k in b]) <= one[boxes:]
    if boxes:
        in_box = np.logical_and.reduce([b_k[:boxes] <= one[:boxes] for b_k in b])
        inside = np.concatenate([in_box, inside])
    for b_k in b:
        inside &= b_k >= 0
    return np.asarray(inside)


def _coordinates(sheets: Sheets, x: Array) -> Array:
    """Coordinates and height of points x in all sheets, (d, P, n)."""
    at = _product(sheets.maps, x)
    at += sheets.offsets
    return at.reshape(len(x), -1, x.shape[-1])


def _product(maps: Array, x: Array) -> Array:
    """maps @ x.  Hazard: BLAS rounds a lone column in another way, so it comes with a twin."""
    return maps @ x if x.shape[-1] != 1 else (maps @ x.repeat(2, axis=-1))[:, :1]


def _ball_nearness(s: Matrices, x: Array, w: Array) -> Array:
    """1 / t of the first crossing with each ball, 0 if it is missed; (B, n).

    |x + t w - c|^2 = r^2 at t |w|^2 = along +- sqrt(along^2 + |w|^2 depth), with along = (c - x).w.
    """
    to, depth = _depth(s, x)
    along, w2 = dot(to, w), dot(w, w)
    root2 = along**2 + w2 * depth
    root = np.sqrt(np.maximum(root2, 0))
    far = np.where(depth >= 0, along + root, along - root)
    return ratio(w2, far * ((far > 0) & (root2 > 0)))


def _depth(s: Matrices, x: Array) -> tuple[Array, Array]:
    """To the balls' centres (d, B, n), and r^2 - |x - c|^2 (B, n): positive inside, 0 on a ball."""
    to = s.centres[:, :, None] - x[:, None]
    depth = s.radii**2 - dot(to, to)
    return to, depth * (np.abs(depth) > 2 * s.radii * CLEARANCE * s.extent)


def _facets_between(s: Matrices, x: Array, y: Array) -> Array:
    """Whether heights have opposite signs and (b(x) h(y) - b(y) h(x)) / (h(y) - h(x)) is inside a sheet; (n,)."""
    (*b_x, h_x), (*b_y, h_y) = _coordinates(s.sheets, x), _coordinates(s.sheets, y)
    least = CLEARANCE * s.extent
    hidden = (np.minimum(h_x, h_y) < -least) & (np.maximum(h_x, h_y) > least)
    with np.errstate(divide="ignore", invalid="ignore"):
        scale = 1 / (h_y - h_x)
        b = [(k_x * h_y - k_y * h_x) * scale for k_x, k_y in zip(b_x, b_y, strict=True)]
        hidden &= _inside(s.sheets.boxes, b, np.ones((s.sheets.P, 1)))
    return np.asarray(hidden.any(axis=0))


def _balls_between(s: Matrices, x: Array, y: Array) -> Array:
    """Whether the segment enters or leaves a ball, other than at its ends; (n,)."""
    (to_x, depth_x), (to_y, depth_y) = _depth(s, x), _depth(s, y)
    to = y - x
    along_x, along_y = dot(to_x, to), -dot(to_y, to)
    through = (depth_x < 0) & (depth_y > 0) | (depth_x > 0) & (depth_y < 0)
    chord2 = (depth_x + depth_y) * dot(to, to) + (along_x**2 + along_y**2)
    outside = (np.maximum(depth_x, depth_y) <= 0) & (np.minimum(depth_x, depth_y) < 0)
    hidden = through | outside & (along_x > 0) & (along_y > 0) & (chord2 > 0)
    return np.asarray(hidden.any(axis=0))
