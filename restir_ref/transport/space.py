"""What the transport must be told about a dimension, and the two constants that depend on it.

Local directions have the tangential components first and the cosine last, in the frame of a normal.
"""

from math import gamma, pi
from typing import Protocol

from restir_ref.batch import Array


class Space(Protocol):
    """Sampling and frames in d dimensions; every sampler has its inverse beside it."""

    @property
    def d(self) -> int:
        """The dimension."""

    def to_local(self, n: Array, w: Array) -> Array:
        """Components of w (d, N) in an orthonormal frame whose last axis is the normal n (d, N)."""

    def to_world(self, n: Array, w: Array) -> Array:
        """The inverse of `to_local`."""

    def ball(self, u: Array) -> Array:
        """Uniform point of the unit ball B^(d-1) from u (d-1, N)."""

    def unball(self, x: Array) -> Array:
        """The inverse of `ball`."""

    def sphere(self, u: Array) -> Array:
        """Uniform direction on S^(d-1), (d, N), from u (d-1, N)."""

    def simplex(self, u: Array) -> Array:
        """Barycentric coordinates (d-1, N) of a uniform point of a simplex with d corners; the rest is 1 - sum."""

    def visible(self, u: Array, v: Array) -> Array:
        """A normal m (d, N) of the unit hemisphere with density max(0, m.v) 2 / (C_d (1 + v_z)), from u (d-1, N).

        The normals that v (d, N), v_z >= 0, sees, each by the area that v sees of it: uniform over their projection.
        """

    def unvisible(self, m: Array, v: Array) -> Array:
        """The inverse of `visible`."""


def ball_volume(d: int) -> float:
    """C_d = |B^(d-1)| = integral of the cosine over a hemisphere of S^(d-1): 2 in flatland, pi in 3D."""
    return float(pi ** ((d - 1) / 2) / gamma((d + 1) / 2))


def sphere_area(d: int) -> float:
    """|S^(d-1)|: 2 pi in flatland, 4 pi in 3D."""
    return float(2 * pi ** (d / 2) / gamma(d / 2))
