"""Directions of the plane as periodic bins, and rays that are as even as can be: what a cache's maps are made of."""

from dataclasses import dataclass

import numpy as np

from restir_ref.batch import Array
from restir_ref.chance import Chance
from restir_ref.guards import whole
from restir_ref.transport.cache.maps import Maps


@dataclass(frozen=True)
class Bins:
    """K equal bins of the angle from 0 to 2 pi, whose centres hold values; linear interpolation, periodic.

    Raises ValueError for no whole number of bins.
    """

    K: int

    def __post_init__(self) -> None:
        whole(self.K, 1, "the number of bins", "A direction must be in one.")

    def centres(self) -> Array:
        """Unit vectors (2, K) at angles (k + 1/2) 2 pi / K."""
        return turned((np.arange(self.K) + 0.5) / self.K)

    def fetch(self, w: Array) -> tuple[Array, Array]:
        """The bins whose centres are on either side of w (2, N), and their weights; (2, N) each."""
        at = np.arctan2(w[1], w[0]) / (2 * np.pi) * self.K - 0.5
        low = np.floor(at)
        part = at - low
        index = low.astype(int)
        return np.stack([index % self.K, (index + 1) % self.K]), np.stack([1 - part, part])


def turned(turn: Array) -> Array:
    """Unit vectors (2, N) at turns of 2 pi."""
    return np.stack([np.cos(2 * np.pi * turn), np.sin(2 * np.pi * turn)])


def rays(R: int, chance: Chance) -> Array:
    """R equispaced directions (2, R), turned as a whole: angles (k + u) 2 pi / R with one common u."""
    return turned((np.arange(R) + chance.uniform((1,))) / R)


MAPS = Maps(Bins(32), Bins(64), rays)
"""32 bins for irradiance, 64 for depth, per probe."""
