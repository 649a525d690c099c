"""Angles around equispaced rays: the cells in which what a probe's rays brought is constant."""

from dataclasses import dataclass

import numpy as np

from restir_ref.batch import Array
from restir_ref.guards import whole


@dataclass(frozen=True)
class Sectors:
    """R equal angles, the first about the angle `start`, radians; `Cells` of flatland.

    Raises ValueError for less than 2 of them.
    """

    R: int
    start: float = 0.0

    def __post_init__(self) -> None:
        whole(self.R, 2, "the number of sectors", "One would be the whole circle.")

    @property
    def w(self) -> Array:
        """Their middles (2, R)."""
        return _directions(self.start + np.arange(self.R) * self._width)

    @property
    def size(self) -> Array:
        """2 pi / R each, (R,)."""
        return np.full(self.R, self._width)

    @property
    def _width(self) -> float:
        return 2 * np.pi / self.R

    def cell(self, w: Array) -> Array:
        """The sector that w (2, N) points into, (N,)."""
        return np.asarray(np.floor((np.arctan2(w[1], w[0]) - self.start) / self._width + 0.5).astype(int) % self.R)

    def cosines(self, n: Array) -> Array:
        """int max(0, cos) = sin(end) - sin(start) of what of a sector is within pi / 2 of n (2, N); (R, N)."""
        middle = self.start + np.arange(self.R)[:, None] * self._width - np.arctan2(n[1], n[0])
        middle = (middle + np.pi) % (2 * np.pi) - np.pi
        low, high = middle - self._width / 2, middle + self._width / 2
        around = (_part(low + turn, high + turn) for turn in (-2 * np.pi, 0.0, 2 * np.pi))
        return np.asarray(sum(around))

    def within(self, cell: Array, u: Array) -> Array:
        """The angle at a share u (1, N) of the sector."""
        return _directions(self.start + (cell + u[0] - 0.5) * self._width)


def _part(low: Array, high: Array) -> Array:
    """int cos over what of [low, high] is in [-pi/2, pi/2]."""
    ends = (np.clip(each, -np.pi / 2, np.pi / 2) for each in (high, low))
    high, low = (np.sin(each) for each in ends)
    return np.asarray(high - low)


def _directions(angle: Array) -> Array:
    return np.stack([np.cos(angle), np.sin(angle)])
