"""Directions of space as octahedral maps, and rays on a spiral: what a cache's maps are made of."""

from dataclasses import dataclass

import numpy as np

from restir_ref.batch import Array
from restir_ref.chance import Chance
from restir_ref.guards import whole
from restir_ref.transport.cache.maps import Maps
from restir_ref.transport.vectors import normalize

GOLDEN = (1 + 5**0.5) / 2


@dataclass(frozen=True)
class Octahedral:
    """m x m texels on the octahedron |x| + |y| + |z| = 1, unfolded to a square; bilinear interpolation.

    The upper half is the square's inner diamond, the lower one is folded out over its sides.  [Majercik 2019]
    What a border of one texel would hold is found by its index instead of being stored.
    Raises ValueError for no whole number of texels.
    """

    m: int

    def __post_init__(self) -> None:
        whole(self.m, 2, "the side of an octahedral map", "It counts texels.")

    @property
    def K(self) -> int:
        """m^2 texels, row by row."""
        return self.m**2

    def centres(self) -> Array:
        """Unit directions (3, K) of the texels' middles."""
        row, column = np.divmod(np.arange(self.K), self.m)
        return normalize(unfolded((np.stack([column, row]) + 0.5) / self.m * 2 - 1))

    def fetch(self, w: Array) -> tuple[Array, Array]:
        """The 4 texels around w (3, N), and their bilinear weights; (4, N) each."""
        at = (folded(w) + 1) / 2 * self.m - 0.5
        low = np.floor(at).astype(int)
        right, up = at - low
        corners = [(x, y) for y in (0, 1) for x in (0, 1)]
        index = [self.texel(low[0] + x, low[1] + y) for x, y in corners]
        weight = [np.where(x, right, 1 - right) * np.where(y, up, 1 - up) for x, y in corners]
        return np.stack(index), np.stack(weight)

    def texel(self, column: Array, row: Array) -> Array:
        """The texel at a place of the square, or beyond its sides by one: across a side, the map goes on mirrored."""
        beyond = (column < 0) | (column >= self.m)
        row = np.where(beyond, self.m - 1 - row, row)
        column = np.clip(column, 0, self.m - 1)
        beyond = (row < 0) | (row >= self.m)
        column = np.where(beyond, self.m - 1 - column, column)
        return np.asarray(np.clip(row, 0, self.m - 1) * self.m + column)


def folded(w: Array) -> Array:
    """Directions (3, N), not 0, to places (2, N) of the square [-1, 1]^2."""
    p = w[:2] / np.maximum(np.abs(w).sum(axis=0), np.finfo(float).tiny)
    return np.where(w[2] >= 0, p, _over_the_sides(p))


def unfolded(p: Array) -> Array:
    """Places (2, N) of the square to points (3, N) of the octahedron; the inverse of `folded`."""
    z = 1 - np.abs(p).sum(axis=0)
    return np.concatenate([np.where(z >= 0, p, _over_the_sides(p)), z[None]])


def _over_the_sides(p: Array) -> Array:
    """(1 - |y|, 1 - |x|), with the signs of (x, y): from the diamond to the corners of the square, and back."""
    return (1 - np.abs(p[::-1])) * np.where(p >= 0, 1, -1)


def spiral(R: int) -> Array:
    """R directions (3, R) on a spherical Fibonacci spiral: heights 1 - (2 k + 1) / R, turns k / golden ratio."""
    k = np.arange(R)
    z, turn = 1 - (2 * k + 1) / R, 2 * np.pi * (k / GOLDEN % 1)
    flat = np.sqrt(1 - z**2)
    return np.stack([flat * np.cos(turn), flat * np.sin(turn), z])


def rotation(u: Array) -> Array:
    """A uniform rotation (3, 3) from u (3,): that of the unit quaternion with squared halves u_0 and 1 - u_0.

    [Shoemake 1992]
    """
    a, b, p, q = np.sqrt(1 - u[0]), np.sqrt(u[0]), 2 * np.pi * u[1], 2 * np.pi * u[2]
    x, y, z, s = a * np.sin(p), a * np.cos(p), b * np.sin(q), b * np.cos(q)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * s), 2 * (x * z + y * s)],
            [2 * (x * y + z * s), 1 - 2 * (x * x + z * z), 2 * (y * z - x * s)],
            [2 * (x * z - y * s), 2 * (y * z + x * s), 1 - 2 * (x * x + y * y)],
        ]
    )


def rays(R: int, chance: Chance) -> Array:
    """The spiral of R directions (3, R), turned as a whole by a uniform rotation."""
    return np.asarray(rotation(chance.uniform((3,))) @ spiral(R))


MAPS = Maps(Octahedral(8), Octahedral(16), rays)
"""8 x 8 texels for irradiance, 16 x 16 for depth, per probe."""
