"""Integrals on intervals, with shifts that keep a common coordinate.

Pixel i integrates f_i over Omega_i = [low_i, high_i).  A chart z = phi_i(x), monotone in x, gives
all pixels one common coordinate, and the shift keeps it: T_ij = phi_j^-1 . phi_i, with
J = phi_i'(x) / phi_j'(y).  It is undefined where y leaves Omega_j or falls into a hole.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from restir_ref.batch import Array
from restir_ref.chance import Chance
from restir_ref.integrals import Pixels, Shifted
from restir_ref.oracle.cells import Cells, Frame, cells

Function = Callable[[Array, Array], Array]
"""g(pixel (N,), x (N,)) -> (N,)."""

Holes = Callable[[Array, Array, Array], Array]
"""holes(i, j, z) -> bool, all (N,): shifts between i and j are undefined at z; symmetric in i and j."""


@dataclass(frozen=True)
class Chart:
    """The common coordinate z = to(pixel, x), its inverse x = back(pixel, z), and dz/dx = slope(pixel, x)."""

    to: Function = lambda pixel, x: x
    back: Function = lambda pixel, z: z
    slope: Function = lambda pixel, x: np.ones_like(x)


def no_holes(i: Array, j: Array, z: Array) -> Array:
    """Shifts are defined wherever they stay inside the domains."""
    return np.zeros(z.shape, dtype=bool)


@dataclass(frozen=True, eq=False)
class Line:
    """n integrals of f over [low, high) (n,), sampled uniformly; a sample is its position x (N,)."""

    f: Function
    low: Array
    high: Array
    chart: Chart = Chart()
    holes: Holes = no_holes

    @property
    def n(self) -> int:
        """Number of pixels."""
        return len(self.low)

    def candidates(self, index: Array, chance: Chance) -> Iterator[tuple[Array, Array]]:
        """One uniform sample, W = 1/p = high - low."""
        low, size = self.low[index % self.n], (self.high - self.low)[index % self.n]
        yield low + size * chance.uniform(index.shape), size

    def target(self, index: Array, x: Array) -> Array:
        """p_hat = f inside the domain, 0 outside."""
        i = index % self.n
        return np.where((x >= self.low[i]) & (x < self.high[i]), self.f(i, x), 0.0)

    def pdf(self, index: Array, x: Array) -> Array:
        """p = 1 / (high - low) inside the domain, 0 outside."""
        i = index % self.n
        return np.where((x >= self.low[i]) & (x < self.high[i]), 1 / (self.high - self.low)[i], 0.0)

    def contribution(self, index: Array, x: Array) -> Array:
        """f_i(x), shape (1, N)."""
        return self.target(index, x)[None]

    def shift(self, x: Array, index: Array, to: Pixels) -> Shifted:
        """Keep z.  The offset of an undefined shift is moved into the target domain."""
        there: Line = to.of  # type: ignore[assignment]
        i, j = index % self.n, to.index % there.n
        z = self.chart.to(i, x)
        y = there.chart.back(j, z)
        defined = (y >= there.low[j]) & (y < there.high[j]) & ~self.holes(i, j, z)
        y = np.where(defined, y, there.low[j])
        J = self.chart.slope(i, x) / there.chart.slope(j, y)
        return Shifted(y, np.where(defined, J, 0.0))


def quotient(line: Line, K: int) -> Frame:
    """The same integrals on K cells, uniform in z, integrands constant on each: an exact finite problem.

    Cells belong to a pixel's domain if their middle does; align K with the domains' ends.
    """
    pixel, n = np.arange(line.n)[:, None], line.n
    ends = line.chart.to(pixel, np.stack([line.low, line.high], axis=-1))
    edges = np.linspace(ends.min(), ends.max(), K + 1)
    z = (edges[1:] + edges[:-1]) / 2
    x = line.chart.back(pixel, np.broadcast_to(z, (n, K)))
    inside = (x >= line.low[:, None]) & (x < line.high[:, None])
    v = np.diff(line.chart.back(pixel, np.broadcast_to(edges, (n, K + 1))), axis=-1)
    f = np.where(inside, line.f(pixel, x), 0.0)
    pdf = inside / (inside * v).sum(axis=-1, keepdims=True)
    return Frame(_kept_cells(line, v, f, pdf, inside, z), n)


def _kept_cells(line: Line, v: Array, f: Array, pdf: Array, inside: Array, z: Array) -> Cells:
    """Shifts keep the number of the cell where both domains contain it and no hole is in the way."""
    i, j = np.arange(line.n)[:, None, None], np.arange(line.n)[None, :, None]
    both = inside[:, None] & inside[None] & ((i == j) | ~line.holes(i, j, z))
    return cells(v, f, pdf[None], np.where(both, np.arange(len(z)), -1))
