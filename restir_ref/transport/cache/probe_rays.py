"""What the last rays of probes brought, as a function of direction that is constant around each ray.  [DDGIR 5.1]

It is used at x_1, of the nearest probe, without interpolation: then its integral is known, as a control variate and as
a density to guide rays by need.  The cells around rays are the world's.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from restir_ref.batch import Array
from restir_ref.chance import Chance
from restir_ref.transport.cache.leaving import Cache, leaving
from restir_ref.transport.rays import arrive, emitted


class Cells(Protocol):
    """R directions, and cells around them that fill the sphere."""

    @property
    def w(self) -> Array:
        """The directions (d, R)."""

    @property
    def size(self) -> Array:
        """Solid angle (angle in flatland) of each cell, (R,)."""

    def cell(self, w: Array) -> Array:
        """In whose cell w (d, N) is, (N,)."""

    def cosines(self, n: Array) -> Array:
        """int max(0, n.w) dw over each cell, for normals n (d, N); (R, N)."""

    def within(self, cell: Array, u: Array) -> Array:
        """An evenly distributed direction (d, N) of the cells (N,), from u (d-1, N)."""


@dataclass(frozen=True, eq=False)
class ProbeRays:
    """Radiance L (C, P, R) that arrives at P places (d, P) from the R directions of `cells`."""

    place: Array
    cells: Cells
    L: Array


def brought(c: Cache, place: Array, cells: Cells, chance: Chance) -> ProbeRays:
    """L_e + L+ of what rays from places (d, P) meet, 0 where they meet nothing; no attenuation."""
    P, w = place.shape[-1], cells.w
    R = w.shape[-1]
    v, t, met = arrive(c.scene, np.repeat(place, R, axis=1), np.tile(w, P))
    L = (emitted(c.scene, v) + leaving(c, v, t, chance.uniform(v.x.shape))) * met
    return ProbeRays(place, cells, L.reshape(-1, P, R))


def nearest(rays: ProbeRays, x: Array) -> Array:
    """The nearest probe to x (d, N), (N,)."""
    return np.asarray(((x[:, None] - rays.place[:, :, None]) ** 2).sum(axis=0).argmin(axis=0))


def arriving(rays: ProbeRays, x: Array, w: Array) -> Array:
    """g(w) (C, N): what the nearest probe to x saw by the ray nearest to w."""
    return np.asarray(rays.L[:, nearest(rays, x), rays.cells.cell(w)])


def irradiance(rays: ProbeRays, x: Array, n: Array) -> Array:
    """int g(w) max(0, n.w) dw, (C, N): exactly, cell by cell."""
    return np.asarray(np.einsum("cnr,rn->cn", rays.L[:, nearest(rays, x)], rays.cells.cosines(n)))
