"""Where probes stand: a grid in d dimensions, and multilinear interpolation between its nodes."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from restir_ref.batch import Array
from restir_ref.guards import whole
from restir_ref.transport.vectors import norm

CLIPPED = 1.5
"""Distances are stored up to so many diagonals of a cell: every corner's distance to a point of its cells is below."""


@dataclass(frozen=True)
class Grid:
    """P probes on a grid: the first one's place, their distances along each axis, and how many there are along each.

    origin, spacing (d,) in scene units, counts (d,) whole numbers; probes are numbered with the last axis fastest.
    Raises ValueError for no probes, spacings that are not positive and finite, or tuples of different lengths.
    """

    origin: tuple[float, ...]
    spacing: tuple[float, ...]
    counts: tuple[int, ...]

    def __post_init__(self) -> None:
        if not len(self.origin) == len(self.spacing) == len(self.counts) >= 1:
            raise ValueError(
                f"origin, spacing and counts need one number per axis, but are {self.origin}, {self.spacing} and "
                f"{self.counts}."
            )
        for count in self.counts:
            whole(count, 1, "the number of probes along an axis", "A volume without probes knows nothing.")
        if not all(0 < each < np.inf for each in self.spacing):
            raise ValueError(f"probes must be a positive, finite distance apart along each axis, but {self.spacing}.")
        if not np.isfinite(self.origin).all():
            raise ValueError(f"the first probe's place must be finite, but is {self.origin}.")

    @property
    def d(self) -> int:
        """The dimension."""
        return len(self.counts)

    @property
    def P(self) -> int:
        """Number of probes."""
        return int(np.prod(self.counts))

    @property
    def reach(self) -> float:
        """1.5 diagonals of a cell, where distances are clipped."""
        return CLIPPED * float(np.linalg.norm(self.spacing))

    def place(self, probe: Array) -> Array:
        """Where probes (N,) stand, (d, N)."""
        node = np.stack(np.unravel_index(probe, self.counts))
        return np.asarray(_column(self.origin) + node * _column(self.spacing))

    def corners(self, x: Array) -> Iterator[tuple[Array, Array]]:
        """The 2^d probes around x (d, N), and their multilinear weights; (N,) each, weights sum to 1.

        A point outside the grid is taken for the nearest point inside: what the outermost probes know goes on.
        """
        last = np.array(self.counts)[:, None] - 1
        at = np.clip((x - _column(self.origin)) / _column(self.spacing), 0, last)
        low = np.minimum(np.floor(at).astype(int), np.maximum(last - 1, 0))
        part = at - low
        for corner in product((0, 1), repeat=self.d):
            up = np.array(corner)[:, None]
            probe = np.ravel_multi_index(tuple(np.minimum(low + up, last)), self.counts)
            yield np.asarray(probe), np.where(up, part, 1 - part).prod(axis=0)

    def to_boundary(self, w: Array) -> Array:
        """Distance from a probe, along w (d, N), to the boundary of its box, a spacing away: there it has no weight."""
        size = np.maximum(np.abs(w), np.finfo(float).tiny)
        return np.asarray((_column(self.spacing) / size).min(axis=0))


def over(low: Sequence[float], high: Sequence[float], counts: Sequence[int]) -> Grid:
    """A grid in whose cells a box from low to high falls: outermost probes half a spacing inside.

    Raises ValueError as `Grid` does, and for an empty box.
    """
    for count in counts:
        whole(count, 1, "the number of probes along an axis", "A volume without probes knows nothing.")
    spacing = [(b - a) / n for a, b, n in zip(low, high, counts, strict=True)]
    return Grid(tuple(float(a + s / 2) for a, s in zip(low, spacing, strict=True)), tuple(spacing), tuple(counts))


def distances(to: Array) -> tuple[Array, Array]:
    """|to| (N,) and to / |to| (d, N), 0 where there is no direction."""
    r = norm(to)
    return r, to / np.where(r > 0, r, 1)


def _column(values: Sequence[float]) -> Array:
    return np.array(values, dtype=float)[:, None]
