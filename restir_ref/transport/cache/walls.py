"""Probes that stand inside walls: which they are, and words for them."""

import numpy as np

from restir_ref.batch import Array
from restir_ref.transport.cache.grid import Grid
from restir_ref.transport.cache.maps import Directions
from restir_ref.transport.rays import normal
from restir_ref.transport.scene import Scene
from restir_ref.transport.vectors import dot

RAYS = 2**15
"""Rays that are traced at once."""

NAMED = 8
"""Probes that a message names."""


def batches(grid: Grid, rays: int) -> list[Array]:
    """All probes in order, (n,) each, so many that n times `rays` is at most RAYS, or one."""
    most = max(RAYS // rays, 1)
    return [np.arange(at, min(at + most, grid.P)) for at in range(0, grid.P, most)]


def bundle(grid: Grid, probe: Array, w: Array) -> tuple[Array, Array]:
    """Rays of probes (n,) in directions w (d, R), probe by probe: starts and directions, (d, n R)."""
    x = np.repeat(grid.place(probe), w.shape[-1], axis=1)
    return x, np.tile(w, len(probe))


def in_walls(scene: Scene, grid: Grid, maps: Directions) -> Array:
    """Whether a probe is inside a solid, (P,): of what it meets in the directions of the map, all are backs.

    A partition that is one facet thick has a back as well, but not all round.
    """
    w = maps.centres()
    return np.concatenate([_only_backs(scene, grid, probe, w) for probe in batches(grid, w.shape[-1])])


def _only_backs(scene: Scene, grid: Grid, probe: Array, w: Array) -> Array:
    x, w = bundle(grid, probe, w)
    t, prim = scene.intersect(x, w)
    met = np.isfinite(t)
    front = dot(normal(scene, x + np.where(met, t, 0) * w, prim), w) < 0
    met, front = met.reshape(len(probe), -1), (met & front).reshape(len(probe), -1)
    return np.asarray(met.any(axis=1) & ~front.any(axis=1))


def embedded_words(grid: Grid, embedded: Array) -> str:
    """How many probes are inside walls, and the nodes of the first of them."""
    which = np.flatnonzero(embedded)
    nodes = [str(tuple(int(k) for k in np.unravel_index(probe, grid.counts))) for probe in which[:NAMED]]
    named = ", ".join(nodes) + (", .." if len(which) > NAMED else "")
    return f"{len(which)} of {grid.P} probes are inside walls" + (f", at nodes {named}" if nodes else "")
