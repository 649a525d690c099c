"""A volume of probes, and what a query of it tells.  [DDGIR 2, 3.4], [Majercik 2019]

A probe knows the irradiance E[n] that arrives at it from the hemisphere around n, and the first two moments of how far
it sees.  A query blends the probes around a point: by distance, by whether they are in front of its surface, and by
whether they see it, which the moments tell with Chebyshev's inequality.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np

from restir_ref.batch import Array, ratio
from restir_ref.transport.cache.grid import Grid, distances
from restir_ref.transport.cache.maps import Maps, fetched
from restir_ref.transport.cache.walls import embedded_words, in_walls
from restir_ref.transport.scene import Scene
from restir_ref.transport.vectors import dot

FLOOR = 0.05
"""The least visibility: where no probe sees a point all of them count, and light leaks."""

CRUSHED = 0.2
"""Weights below are crushed: they fall with their cube, so that nothing jumps when they reach 0."""


def wrap(cos: Array) -> Array:
    """((cos + 1) / 2)^2 + .2, cos (N,) between the normal and the direction to the probe.  [Majercik 2019]"""
    return np.asarray(((cos + 1) / 2) ** 2 + 0.2)


def chebyshev(v: Array, r1: Array, r2: Array, floor: float = FLOOR) -> Array:
    """P(r >= v) <= var / (var + (v - r1)^2), var = |r1^2 - r2|, cubed; 1 where v <= r1.  [Majercik 2019]

    v (N,) distance of the point from the probe, r1 and r2 (N,) mean and mean square of what the probe sees there.
    """
    var = np.abs(r1**2 - r2)
    bound = ratio(var, var + (v - r1) ** 2) ** 3
    return np.where(v <= r1, 1.0, np.maximum(bound, floor))


def crush(weight: Array) -> Array:
    """weight^3 / .2^2 below .2, the weight itself above.  [Majercik 2019]"""
    return np.where(weight < CRUSHED, weight**3 / CRUSHED**2, weight)


@dataclass(frozen=True)
class Weighting:
    """How a query trusts a probe, besides its distance: wrap(cos), visibility(v, r1, r2), and crush of their product.

    `partial(chebyshev, floor=...)` moves the floor.
    """

    wrap: Callable[[Array], Array] = wrap
    visibility: Callable[[Array, Array, Array], Array] = chebyshev
    crush: Callable[[Array], Array] = crush


@dataclass(frozen=True, eq=False)
class Volume:
    """Probes of a scene; a `Field`.  Nothing writes into one: `update` returns the next.

    E (C, P, K)     irradiance of P probes in the K texels of maps.irradiance
    r (2, P, K')    first and second moment of distance, scene units, in the K' texels of maps.depth
    active (P,)     whether a probe takes part: it does not inside a wall
    frames          how many updates it has seen
    """

    grid: Grid
    maps: Maps
    E: Array
    r: Array
    active: Array
    frames: int = 0
    weighting: Weighting = field(default_factory=Weighting)

    @property
    def C(self) -> int:
        """Number of channels."""
        return len(self.E)

    @property
    def spacing(self) -> Array:
        """Distance (d,) of neighbouring probes along each axis, scene units."""
        return np.array(self.grid.spacing)

    @property
    def bytes_per_probe(self) -> float:
        """Memory of a probe's two maps."""
        return (self.E.nbytes + self.r.nbytes) / self.grid.P

    def irradiance(self, x: Array, n: Array, w: Array, b: Array) -> Array:
        """E+ = sum_k weight_k E_k(w) / sum_k weight_k over the probes k around x + b; (C, N).  [Majercik 2019]

        Outside the grid the nearest point inside stands for x + b in choosing probes; where none of them takes part,
        or every weight is 0, E+ = 0.
        """
        texels = self.maps.irradiance.fetch(w)
        E, whole = np.zeros((self.C, x.shape[-1])), np.zeros(x.shape[-1])
        for probe, weight in self.heard(x, n, b):
            E += weight * fetched(self.E, probe, *texels)
            whole += weight
        return ratio(E, whole)

    def heard(self, x: Array, n: Array, b: Array) -> Iterator[tuple[Array, Array]]:
        """The 2^d probes around x + b, and their weights before they are normalised; (N,) each."""
        for probe, near in self.grid.corners(x + b):
            yield probe, near * self.trust(probe, x, n, b)

    def trust(self, probe: Array, x: Array, n: Array, b: Array) -> Array:
        """crush(wrap visibility) of one probe for each query, 0 of those that do not take part; (N,)."""
        place = self.grid.place(probe)
        _, to_probe = distances(place - x)
        v, to_point = distances(x + b - place)
        r1, r2 = fetched(self.r, probe, *self.maps.depth.fetch(to_point))
        seen = self.weighting.visibility(np.minimum(v, self.grid.reach), r1, r2)
        return np.asarray(self.weighting.crush(self.weighting.wrap(dot(n, to_probe)) * seen) * self.active.take(probe))


def unlit(scene: Scene, grid: Grid, maps: Maps) -> Volume:
    """A volume that has seen nothing yet: E = 0, r = 0.  Probes inside walls take no part, see `in_walls`.

    Raises ValueError for a grid or maps of another dimension than the scene's, and where every probe is inside a wall.
    """
    d = scene.space.d
    if len({d, grid.d, len(maps.irradiance.centres()), len(maps.depth.centres())}) > 1:
        raise ValueError(
            f"the scene has {d} dimensions, the grid {grid.d}, the maps {len(maps.irradiance.centres())} and "
            f"{len(maps.depth.centres())}: take a grid of {d} axes, and the maps of the scene's own world."
        )
    embedded = in_walls(scene, grid, maps.depth)
    if embedded.all():
        raise ValueError(f"{embedded_words(grid, embedded)}: move the grid into the room, or make its cells smaller.")
    E = np.zeros((scene.C, grid.P, maps.irradiance.K))
    return Volume(grid, maps, E, np.zeros((2, grid.P, maps.depth.K)), ~embedded)
