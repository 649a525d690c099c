"""Edges between neighbouring pixels by G-buffer, and neighbours along them: functions of pixels, never of samples.

# erratum: [GPT 4.3.2] has normals with Dot(n_i, n_j) > 0.9 mark an edge; that marks every flat surface.  It is < 0.9.
"""

from dataclasses import dataclass

import numpy as np

from restir_ref.batch import Array
from restir_ref.images import Alike
from restir_ref.transport.materials import albedo
from restir_ref.transport.paths import Sensor
from restir_ref.transport.rays import arrive
from restir_ref.transport.scene import Scene
from restir_ref.transport.vectors import dot

THRESHOLDS = 0.1, 0.9, 0.1
"""Difference of albedos, cosine between normals, and difference of depths over the first one's.  [GPT 4.3.2]"""

TRIES = 256
"""N: neighbours tried until one sees alike.  [GPT 4.3.2]"""


@dataclass(frozen=True, eq=False)
class Seen:
    """What the middles of pixels see: albedo, the mean over channels, and depth t (n,), normal n (d, n).

    Where a ray meets nothing the depth is infinite.
    """

    albedo: Array
    n: Array
    t: Array


def seen(scene: Scene, sensor: Sensor) -> Seen:
    """One ray through the middle of every pixel, with .5 for all numbers: from a place without a lens, to one side."""
    x, w, _ = sensor.ray(np.arange(sensor.n), np.full((sensor.numbers, sensor.n), 0.5))
    v, t, met = arrive(scene, x, w)
    return Seen(albedo(scene.materials).mean(axis=0)[v.material], v.n, np.where(met, t, np.inf))


def unlike(g: Seen, i: Array, j: Array) -> Array:
    """Whether pixels i and j (N,) see different things: an edge, if they are neighbours; (N,).  [GPT 4.3.2]"""
    colour, turn, depth = THRESHOLDS
    t_i, t_j = g.t[i], g.t[j]
    met, both = np.isfinite(t_i) == np.isfinite(t_j), np.isfinite(t_i) & np.isfinite(t_j)
    apart = ~met | (both & (np.abs(np.where(both, t_i, 0) - np.where(both, t_j, 0)) > depth * t_i))
    return np.asarray((np.abs(g.albedo[i] - g.albedo[j]) > colour) | (dot(g.n[:, i], g.n[:, j]) < turn) | apart)


def edges(g: Seen, ends: Array) -> Array:
    """Which pairs of pixels, ends (2, E), are edge pairs; (E,).  Depths are compared with that of ends[0]."""
    return unlike(g, ends[0], ends[1])


def like_pairs(g: Seen, ends: Array) -> Alike:
    """Whether pairs see alike, end by end, by the same thresholds."""

    def alike(pair: Array, other: Array) -> Array:
        return ~(unlike(g, ends[0, pair], ends[0, other]) | unlike(g, ends[1, pair], ends[1, other]))

    return alike
