"""`Surfaces` by Embree: a hierarchy of boxes finds a facet in float32, and float64 decides what it means.

The facet that a ray finds is asked what `Matrices` asks of all of them, by the same maps: on which side of it the
ends are, where it is crossed, and whether that is inside.  If x lies on it, it neither meets nor hides, and the ray
goes on behind it.  Columns that stay in doubt, such as a ray along an edge, are left to `Matrices`.  Balls are no
meshes: they are asked beside the facets, all at once.

Hazard: a ray begins START of the scene's extent behind x, so that what x lies on does not meet it in float32.  What
stands within that of an end can be overlooked, such as a wall beside a point in a corner.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from importlib import import_module
from typing import Any

import numpy as np

from restir_ref.batch import Array, take, total
from restir_ref.transport.coincidence import coincidence
from restir_ref.transport.intersection import CLEARANCE, Matrices
from restir_ref.transport.scene import Scene
from restir_ref.transport.sheets import Sheets
from restir_ref.transport.vectors import norm

START, ABOVE, LOST = 2.0**-21, 2.0**-20, 2.0**15
"""Where rays begin, and how high above what x lies on they go on, as shares of the extent; float32 has 2^-24.

A ray that is not as high LOST times START away is left to `Matrices`.
"""

CASTS = 4
"""Rays that are cast, one behind the other, before a column is left to `Matrices`."""

NOTHING, OWN, MET, DOUBT = range(4)
"""What a ray finds: no facet, one that x lies on, one that counts, or one that only rounding has found."""

Judge = Callable[[Array, Array], tuple[Array, Array]]
"""Of facets found in columns, (n,) each: what they are, and how fast the ray leaves them, in heights per length w."""


@dataclass(frozen=True, eq=False)
class Embree:
    """The facets of a scene in a hierarchy.

    brute  the same scene as matrices;  balls  its balls alone
    maps (d, d + 1, S)  those of `brute` facet by facet, offsets last;  tree  Embree's own scene
    """

    brute: Matrices
    balls: Matrices
    maps: Array
    tree: Any

    def intersect(self, x: Array, w: Array) -> tuple[Array, Array]:
        """Distance and primitive: the nearest facet, or a ball before it."""
        prim, what, near = self._nearest_facet(x, w)
        doubt = np.flatnonzero(what == DOUBT)
        with np.errstate(divide="ignore"):
            t = 1 / np.abs(near)
        t[doubt], prim[doubt] = self.brute.intersect(x.take(doubt, axis=-1), w.take(doubt, axis=-1))
        if self.brute.coincidence.others.size:
            hit = np.flatnonzero(what == MET)
            at, along = take((x, w), hit)
            prim[hit] = self.foremost(at + t[hit] * along, prim[hit], along)
        if self.balls.radii.size:
            t_ball, ball = self.balls.intersect(x, w)
            prim = np.where(t_ball < t, ball + self.maps.shape[-1], prim)
            t = np.minimum(t, t_ball)
        return t, prim

    def visible(self, x: Array, y: Array) -> Array:
        """Whether nothing stands between x and y: asked from the one that is less, coordinate by coordinate."""
        x, y = ordered(x, y)
        _, what = self._first(x, y - x, np.ones(x.shape[-1]), lambda prim, at: self._between(prim, *take((x, y), at)))
        clear, doubt = what == NOTHING, np.flatnonzero(what == DOUBT)
        clear[doubt] = self.brute.visible(x.take(doubt, axis=-1), y.take(doubt, axis=-1))
        return np.asarray(clear & self.balls.visible(x, y)) if self.balls.radii.size else clear

    def foremost(self, x: Array, prim: Array, w: Array) -> Array:
        """By the order of the list and by what emits."""
        return self.brute.foremost(x, prim, w)

    def _nearest_facet(self, x: Array, w: Array) -> tuple[Array, Array, Array]:
        """The facet that is met, what it is, and 1 / t, 0 where there is none; (N,) each."""
        near = np.zeros(x.shape[-1])

        def judge(prim: Array, at: Array) -> tuple[Array, Array]:
            what, near[at], descent = self._met(prim, *take((x, w), at))
            return what, descent

        prim, what = self._first(x, w, np.full(x.shape[-1], np.inf), judge)
        met = what == MET
        return np.where(met, prim, 0), what, np.where(met, near, 0.0)

    def _first(self, x: Array, w: Array, most: Array, judge: Judge) -> tuple[Array, Array]:
        """The first facet along x + t w, t < most, that is not x's own, and what it is; (N,) each."""
        start = START * self.brute.extent / np.maximum(norm(w), 1e-300)
        prim, what = np.zeros(len(start), dtype=int), np.full(len(start), OWN)
        left, s, lost = np.arange(len(start)), start, np.minimum(most - start, start * LOST)
        for _ in range(CASTS):
            some_x, some_w, far = take((x, w, most - start), left)
            found = self._cast(some_x + s * some_w, some_w, far - s)
            what[left], descent = judge(found, left)
            what[left[s >= lost[left]]] = DOUBT
            prim[left] = found
            again = what[left] == OWN
            left, s, descent = left[again], s[again], descent[again]
            if not len(left):
                break
            s = np.maximum(s + start[left], ABOVE * self.brute.extent / np.maximum(np.abs(descent), 1e-300))
        return prim, np.where(what == OWN, DOUBT, what)

    def _cast(self, x: Array, w: Array, most: Array) -> Array:
        """The facet nearest to x along w, at most so many w away; -1 if there is none; (N,)."""
        origins, directions, far = (each.T.astype(np.float32, order="C") for each in (x, w, np.clip(most, 0, 1e30)))
        found: Array = self.tree.run(origins, directions, dists=far)
        return found.astype(int)

    def _met(self, prim: Array, x: Array, w: Array) -> tuple[Array, Array, Array]:
        """What the ray x + t w finds, 1 / t, and how fast it comes nearer to the facet."""
        maps = self.maps.take(prim, axis=-1, mode="clip")
        (*b, h), (*back, descent) = _at(maps, x), _along(maps, -w)
        with np.errstate(divide="ignore", invalid="ignore"):
            near = descent / h
            scaled = [b_k * near - back_k for b_k, back_k in zip(b, back, strict=True)]
            inside = (near > 0) & (total(scaled) <= near)
            for b_k in scaled:
                inside &= b_k >= 0
        own = np.abs(h) <= CLEARANCE * self.brute.extent
        return np.select([prim < 0, own, inside], [NOTHING, OWN, MET], DOUBT), near, descent

    def _between(self, prim: Array, x: Array, y: Array) -> tuple[Array, Array]:
        """What the segment from x to y finds, nothing if y lies on it, and how much lower y is."""
        maps, least = self.maps.take(prim, axis=-1, mode="clip"), CLEARANCE * self.brute.extent
        (*b_x, h_x), (*b_y, h_y) = _at(maps, x), _at(maps, y)
        with np.errstate(divide="ignore", invalid="ignore"):
            scale = 1 / (h_y - h_x)
            b = [(k_x * h_y - k_y * h_x) * scale for k_x, k_y in zip(b_x, b_y, strict=True)]
            inside = (np.minimum(h_x, h_y) < 0) & (np.maximum(h_x, h_y) > 0) & (total(b) <= 1)
            for b_k in b:
                inside &= b_k >= 0
        own, last = np.abs(h_x) <= least, np.abs(h_y) <= least
        return np.select([(prim < 0) | last, own, inside], [NOTHING, OWN, MET], DOUBT), h_x - h_y


def _at(maps: Array, x: Array) -> Array:
    """Coordinates and height of a point (d, n) in each column's own facet, (d, n)."""
    return _along(maps, x) + maps[:, -1]


def _along(maps: Array, w: Array) -> Array:
    """The same of a direction."""
    return total([maps[:, k] * w_k for k, w_k in enumerate(w)])


def ordered(x: Array, y: Array) -> tuple[Array, Array]:
    """The two ends, the one that is less first: coordinate by coordinate, the first that differs decides."""
    swap = np.zeros(x.shape[-1], dtype=bool)
    for x_k, y_k in zip(x[::-1], y[::-1], strict=True):
        swap = (y_k < x_k) | ((y_k == x_k) & swap)
    return np.where(swap, y, x), np.where(swap, x, y)


def embree() -> tuple[Any, Any]:
    """Embree's modules of scenes and of meshes.  Raises ValueError, naming the extra, where it is not installed."""
    try:
        return import_module("embreex.rtcore_scene"), import_module("embreex.mesh_construction")
    except ImportError:
        raise ValueError("this needs the package embreex: install restir-ref with its extra 'embree'.") from None


def with_embree(scene: Scene) -> Scene:
    """The same scene, whose facets are asked by Embree.

    Raises ValueError where it is not installed, TypeError for a scene that is no longer asked by its matrices.
    """
    brute, (scenes, meshes) = scene.surfaces, embree()
    if not isinstance(brute, Matrices):
        raise TypeError(f"Embree is built beside the matrices of a scene, but its surfaces are {type(brute).__name__}.")
    tree = scenes.EmbreeScene(robust=True)
    meshes.TriangleMesh(tree, np.ascontiguousarray(scene.corners.transpose(2, 0, 1), dtype=np.float32))
    maps = np.concatenate([brute.maps, brute.offsets], axis=1).reshape(brute.d, -1, brute.d + 1)
    return replace(scene, surfaces=Embree(brute, _balls(brute), maps.transpose(0, 2, 1).copy(), tree))


def _balls(s: Matrices) -> Matrices:
    """The balls alone."""
    maps, offsets = s.maps[:0], s.offsets[:0]
    none = coincidence(np.zeros((2, 0), dtype=int), np.zeros(0), s.coincidence.normals, maps, offsets)
    sheets = Sheets(maps, offsets, 0, np.tile(np.arange(s.radii.size), (2, 1)))
    return replace(s, maps=maps, offsets=offsets, sheets=sheets, coincidence=none)
