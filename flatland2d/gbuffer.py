"""G-buffers: what the middle of each pixel sees, and which pixels see alike."""

from dataclasses import dataclass

import numpy as np

from restir_ref.batch import Array
from restir_ref.transport.paths import Sensor
from restir_ref.transport.rays import arrive
from restir_ref.transport.scene import Scene

ALIKE = 25.0, 0.1
"""Degrees between normals, and relative difference of distances.  [Bitterli 2020]"""


@dataclass(frozen=True, eq=False)
class GBuffer:
    """Position x, normal n (2, n), distance t and primitive (n,) of what pixel centres see."""

    x: Array
    n: Array
    t: Array
    prim: Array


def gbuffer(scene: Scene, sensor: Sensor) -> GBuffer:
    """One ray through the middle of every pixel."""
    pixel = np.arange(sensor.n)
    x, w, _ = sensor.ray(pixel, np.full((sensor.numbers, sensor.n), 0.5))
    v, t, _ = arrive(scene, x, w)
    return GBuffer(v.x, v.n, t, v.prim)


def alike(g: GBuffer, degrees: float = ALIKE[0], share: float = ALIKE[1]) -> Array:
    """Whether pixels i and j see alike: normals and distances nearly the same; (n, n) bool.  [Bitterli 2020]"""
    close = np.abs(g.t[:, None] - g.t) <= share * g.t[:, None]
    return np.asarray(close & (g.n.T @ g.n >= np.cos(np.radians(degrees))))
