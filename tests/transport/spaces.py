"""Spaces to test the transport in: the plane, and d = 3 and 4 written here, apart from any world."""

from dataclasses import dataclass

import numpy as np

from flatland2d import PLANE
from restir_ref.batch import Array


@dataclass(frozen=True)
class Solid:
    """d = 3: concentric disk, triangles, and visible normals of the hemisphere (Heitz 2018)."""

    d: int = 3

    def to_local(self, n: Array, w: Array) -> Array:
        """Components in Duff's frame (2017)."""
        s, t = self._tangents(n)
        return np.stack([(s * w).sum(axis=0), (t * w).sum(axis=0), (n * w).sum(axis=0)])

    def to_world(self, n: Array, w: Array) -> Array:
        s, t = self._tangents(n)
        return w[0] * s + w[1] * t + w[2] * n

    def _tangents(self, n: Array) -> tuple[Array, Array]:
        sign = np.copysign(1.0, n[2])
        a = -1 / (sign + n[2])
        b = n[0] * n[1] * a
        return np.stack([1 + sign * n[0] ** 2 * a, sign * b, -sign * n[0]]), np.stack([b, sign + n[1] ** 2 * a, -n[1]])

    def ball(self, u: Array) -> Array:
        """Squares around the centre become circles."""
        x, y = 2 * u - 1
        flat = np.abs(x) > np.abs(y)
        r = np.where(flat, x, y)
        safe = np.where(r == 0, 1, r)
        angle = np.where(flat, np.pi / 4 * y / safe, np.pi / 2 - np.pi / 4 * x / safe)
        return np.stack([r * np.cos(angle), r * np.sin(angle)])

    def unball(self, x: Array) -> Array:
        r, angle = np.hypot(*x), np.arctan2(x[1], x[0])
        quarter = np.round(angle / (np.pi / 2)).astype(int) % 4
        off = 4 / np.pi * ((angle - quarter * np.pi / 2 + np.pi) % (2 * np.pi) - np.pi) * r
        sides = [(r, off), (-off, r), (-r, -off), (off, -r)]
        a, b = (np.choose(quarter, [side[k] for side in sides]) for k in (0, 1))
        return (np.stack([a, b]) + 1) / 2

    def sphere(self, u: Array) -> Array:
        z, r = 1 - 2 * u[0], 2 * np.sqrt(u[0] * (1 - u[0]))
        return np.stack([r * np.cos(2 * np.pi * u[1]), r * np.sin(2 * np.pi * u[1]), z])

    def simplex(self, u: Array) -> Array:
        root = np.sqrt(u[0])
        return np.stack([root * (1 - u[1]), root * u[1]])

    def visible(self, u: Array, v: Array) -> Array:
        """Half of the disk across v is squeezed by the slant of the hemisphere's rim."""
        s, t, squeeze = self._across(v)
        x, y = self.ball(u)
        y = (1 - squeeze) * np.sqrt(np.maximum(1 - x**2, 0)) + squeeze * y
        return x * s + y * t + np.sqrt(np.maximum(1 - x**2 - y**2, 0)) * v

    def unvisible(self, m: Array, v: Array) -> Array:
        s, t, squeeze = self._across(v)
        x, y = (m * s).sum(axis=0), (m * t).sum(axis=0)
        return self.unball(np.stack([x, (y - (1 - squeeze) * np.sqrt(np.maximum(1 - x**2, 0))) / squeeze]))

    def _across(self, v: Array) -> tuple[Array, Array, Array]:
        r = np.hypot(v[0], v[1])
        level = r < 1e-12
        s = np.stack(
            [np.where(level, 1, -v[1] / np.where(level, 1, r)), np.where(level, 0, v[0] / np.where(level, 1, r)), 0 * r]
        )
        return s, np.cross(v, s, axis=0), (1 + v[2]) / 2


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
        return np.cbrt(u[0]) * Solid().sphere(u[1:])

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


SPACES = {"plane": PLANE, "solid": Solid(), "hyper": Hyper()}
SEEING = {name: space for name, space in SPACES.items() if space.d < 4}
"""Those with visible normals, so with GGX."""
