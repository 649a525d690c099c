"""Space: what the transport must be told about d = 3."""

from dataclasses import dataclass

import numpy as np

from restir_ref.batch import Array
from restir_ref.transport.vectors import dot


@dataclass(frozen=True)
class Solid:
    """Frames, and sampling of disks, spheres, triangles and visible normals, each with its inverse."""

    d: int = 3

    def to_local(self, n: Array, w: Array) -> Array:
        """(s . w, t . w, n . w) with tangents s and t.  [Duff 2017]"""
        s, t = _tangents(n)
        return np.stack([dot(s, w), dot(t, w), dot(n, w)])

    def to_world(self, n: Array, w: Array) -> Array:
        """w_0 s + w_1 t + w_2 n."""
        s, t = _tangents(n)
        return np.asarray(w[0] * s + w[1] * t + w[2] * n)

    def ball(self, u: Array) -> Array:
        """The unit disk: squares around the centre become circles.  [Shirley 1997]

        With (a, b) = 2 u - 1 and |a| > |b|: radius a, angle pi/4 b/a; else radius b, angle pi/2 - pi/4 a/b.
        """
        a, b = 2 * u - 1
        flat = np.abs(a) > np.abs(b)
        r = np.where(flat, a, b)
        turn = np.pi / 4 * np.where(flat, b, a) / np.where(r == 0, 1, r)
        angle = np.where(flat, turn, np.pi / 2 - turn)
        return np.stack([r * np.cos(angle), r * np.sin(angle)])

    def unball(self, x: Array) -> Array:
        """The inverse of `ball`, quarter by quarter: 0 to the right, then counterclockwise."""
        r, angle = np.hypot(*x), np.arctan2(x[1], x[0])
        quarter = np.round(angle / (np.pi / 2)).astype(int) % 4
        off = 4 / np.pi * ((angle - quarter * np.pi / 2 + np.pi) % (2 * np.pi) - np.pi) * r
        a, b = np.choose(quarter, [r, -off, -r, off]), np.choose(quarter, [off, r, -off, -r])
        return (np.stack([a, b]) + 1) / 2

    def sphere(self, u: Array) -> Array:
        """Height z = 1 - 2 u_0, angle 2 pi u_1."""
        z, r = 1 - 2 * u[0], 2 * np.sqrt(u[0] * (1 - u[0]))
        return np.stack([r * np.cos(2 * np.pi * u[1]), r * np.sin(2 * np.pi * u[1]), z])

    def unsphere(self, w: Array) -> Array:
        """u_0 = (1 - z) / 2, u_1 = angle / (2 pi); (2, N)."""
        return np.stack([(1 - w[2]) / 2, np.arctan2(w[1], w[0]) / (2 * np.pi) % 1])

    def simplex(self, u: Array) -> Array:
        """sqrt(u_0) (1 - u_1), sqrt(u_0) u_1."""
        root = np.sqrt(u[0])
        return np.stack([root * (1 - u[1]), root * u[1]])

    def unsimplex(self, b: Array) -> Array:
        """u_0 = (b_0 + b_1)^2, u_1 = b_1 / (b_0 + b_1); any number at the corner where both are 0; (2, N)."""
        root = b[0] + b[1]
        return np.stack([root**2, b[1] / np.where(root > 0, root, 1)])

    def visible(self, u: Array, v: Array) -> Array:
        """m = x s + y t + sqrt(1 - x^2 - y^2) v, (x, y) in the disk across v.  [Heitz 2018]

        Its half beyond the hemisphere's rim is squeezed into what v sees:
        y <- (1 - q) sqrt(1 - x^2) + q y with q = (1 + v_z) / 2.
        """
        s, t, q = _across(v)
        x, y = self.ball(u)
        y = (1 - q) * np.sqrt(np.maximum(1 - x**2, 0)) + q * y
        return np.asarray(x * s + y * t + np.sqrt(np.maximum(1 - x**2 - y**2, 0)) * v)

    def unvisible(self, m: Array, v: Array) -> Array:
        """The inverse of `visible`: the coordinates of m across v, unsqueezed."""
        s, t, q = _across(v)
        x, y = dot(m, s), dot(m, t)
        return self.unball(np.stack([x, (y - (1 - q) * np.sqrt(np.maximum(1 - x**2, 0))) / q]))


def _tangents(n: Array) -> tuple[Array, Array]:
    """Unit vectors s and t (3, N) across n, such that s, t, n are right-handed.  [Duff 2017]"""
    sign = np.copysign(1.0, n[2])
    a = -1 / (sign + n[2])
    b = n[0] * n[1] * a
    return np.stack([1 + sign * n[0] ** 2 * a, sign * b, -sign * n[0]]), np.stack([b, sign + n[1] ** 2 * a, -n[1]])


def _across(v: Array) -> tuple[Array, Array, Array]:
    """s level, t = v x s, and the share q = (1 + v_z) / 2 of the disk across v that is lit."""
    r = np.hypot(v[0], v[1])
    level = r < 1e-12
    x, y = (np.where(level, end, part / np.where(level, 1, r)) for part, end in ((-v[1], 1), (v[0], 0)))
    return np.stack([x, y, 0 * r]), np.stack([-v[2] * y, v[2] * x, v[0] * y - v[1] * x]), (1 + v[2]) / 2


SOLID = Solid()
