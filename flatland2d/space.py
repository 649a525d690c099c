"""The plane: what the transport must be told about d = 2."""

from dataclasses import dataclass

import numpy as np

from restir_ref.batch import Array


@dataclass(frozen=True)
class Plane:
    """Frames, and sampling of intervals, circles, segments and visible normals."""

    d: int = 2

    def to_local(self, n: Array, w: Array) -> Array:
        """(tangent . w, n . w) with tangent (n_y, -n_x)."""
        return np.stack([n[1] * w[0] - n[0] * w[1], n[0] * w[0] + n[1] * w[1]])

    def to_world(self, n: Array, w: Array) -> Array:
        """w_0 tangent + w_1 n."""
        return np.stack([n[1] * w[0] + n[0] * w[1], n[1] * w[1] - n[0] * w[0]])

    def ball(self, u: Array) -> Array:
        """B^1 = [-1, 1]: x = 2 u - 1."""
        return 2 * u - 1

    def unball(self, x: Array) -> Array:
        """u = (x + 1) / 2."""
        return (x + 1) / 2

    def sphere(self, u: Array) -> Array:
        """Angle 2 pi u."""
        return np.stack([np.cos(2 * np.pi * u[0]), np.sin(2 * np.pi * u[0])])

    def simplex(self, u: Array) -> Array:
        """A segment's coordinate is the number itself."""
        return u

    def visible(self, u: Array, v: Array) -> Array:
        """m = t e + sqrt(1 - t^2) v with e = (v_z, -v_x), t uniform over the part that v sees.

        t in [-1, v_z] where v_x >= 0, in [-v_z, 1] elsewhere.
        """
        low, high = self._range(v)
        t = low + u[0] * (high - low)
        e = np.stack([v[1], -v[0]])
        return np.asarray(t * e + np.sqrt(np.maximum(1 - t**2, 0)) * v)

    def unvisible(self, m: Array, v: Array) -> Array:
        """u = (t - low) / (high - low), t = e . m."""
        low, high = self._range(v)
        t = v[1] * m[0] - v[0] * m[1]
        return np.asarray(((t - low) / (high - low))[None])

    def _range(self, v: Array) -> tuple[Array, Array]:
        right = v[0] >= 0
        return np.where(right, -1.0, -v[1]), np.where(right, v[1], 1.0)


PLANE = Plane()
