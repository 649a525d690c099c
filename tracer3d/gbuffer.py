"""G-buffers: what the middle of each pixel sees, and which pixels see alike."""

from dataclasses import dataclass

import numpy as np

from restir_ref.batch import Array
from restir_ref.images import Alike
from restir_ref.transport.paths import Sensor
from restir_ref.transport.rays import arrive
from restir_ref.transport.scene import Scene
from restir_ref.transport.vectors import dot

DEGREES, SHARE = 25.0, 0.1
"""Degrees between normals, and relative difference of distances.  [Bitterli 2020]"""


@dataclass(frozen=True, eq=False)
class GBuffer:
    """Position x, normal n (3, n), distance t and primitive (n,) of what pixel centres see; met (n,): whether anything.

    Where nothing is met, the others are those of a point on the way.
    """

    x: Array
    n: Array
    t: Array
    prim: Array
    met: Array


def gbuffer(scene: Scene, sensor: Sensor) -> GBuffer:
    """One ray through the middle of every pixel."""
    pixel = np.arange(sensor.n)
    x, w, _ = sensor.ray(pixel, np.full((sensor.numbers, sensor.n), 0.5))
    v, t, met = arrive(scene, x, w)
    return GBuffer(v.x, v.n, t, v.prim, met)


def alike(g: GBuffer, degrees: float = DEGREES, share: float = SHARE) -> Alike:
    """Whether pixels j see like pixels i: something, normals and distances nearly the same.  [Bitterli 2020]

    The function compares pairs, (N,) each; no table of all pairs is made.
    """
    least = np.cos(np.radians(degrees))

    def same(i: Array, j: Array) -> Array:
        t = g.t.take(i)
        turned = dot(g.n.take(i, axis=-1), g.n.take(j, axis=-1)) < least
        return np.asarray(g.met.take(i) & g.met.take(j) & ~turned & (np.abs(t - g.t.take(j)) <= share * t))

    return same
