"""Spaces to test the transport in: those of the worlds, and d = 4 written here, apart from any world."""

from dataclasses import dataclass

import numpy as np

from flatland2d import PLANE
from restir_ref.batch import Array
from tracer3d.space import SOLID


@dataclass(frozen=True)
class Hyper:
    """d = 4: the ball in three dimensions, tetrahedra, and frames by one mirror; no visible normals."""

    d: int = 4

    def to_local(self, n: Array, w: Array) -> Array:
        """The mirror that swaps the normal and the last axis, up to a sign."""
        sign = np.copysign(1.0, n[3])
        v = n + sign * np.array([0.0, 0, 0, 1])[:, None]
        return -sign * (w - 2 * v * (v * w).sum(axis=0) / (v * v).sum(axis=0))

    def to_world(self, n: Array, w: Array) -> Array:
        return self.to_local(n, w)

    def ball(self, u: Array) -> Array:
        return np.cbrt(u[0]) * SOLID.sphere(u[1:])

    def unball(self, x: Array) -> Array:
        r = np.sqrt((x * x).sum(axis=0))
        return np.stack([r**3, (1 - x[2] / r) / 2, np.arctan2(x[1], x[0]) / (2 * np.pi) % 1])

    def sphere(self, u: Array) -> Array:
        a, b, (p, q) = np.sqrt(u[0]), np.sqrt(1 - u[0]), 2 * np.pi * u[1:]
        return np.stack([a * np.cos(p), a * np.sin(p), b * np.cos(q), b * np.sin(q)])

    def simplex(self, u: Array) -> Array:
        a = 1 - np.cbrt(u[0])
        b = (1 - a) * (1 - np.sqrt(u[1]))
        return np.stack([a, b, (1 - a - b) * u[2]])

    def visible(self, u: Array, v: Array) -> Array:
        raise NotImplementedError

    def unvisible(self, m: Array, v: Array) -> Array:
        raise NotImplementedError


SPACES = {"plane": PLANE, "solid": SOLID, "hyper": Hyper()}
SEEING = {name: space for name, space in SPACES.items() if space.d < 4}
"""Those with visible normals, so with GGX."""
