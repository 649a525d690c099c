"""Integrals on intervals, with shifts that keep a common coordinate.

Pixel i integrates f_i over Omega_i = [low_i, high_i).  A chart z = phi_i(x), monotone in x, gives
all pixels one common coordinate, and the shift keeps it: T_ij = phi_j^-1 . phi_i, with
J = phi_i'(x) / phi_j'(y).  It is undefined where y leaves Omega_j or falls into a hole.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from restir_ref.batch import Array, total
from restir_ref.chance import Chance
from restir_ref.integrals import Pixels, Shifted
from restir_ref.oracle.cells import Cells, Frame, cells

Function = Callable[[Array, Array], Array]
"""g(pixel (N,), x (N,)) -> (N,)."""

Holes = Callable[[Array, Array, Array], Array]
"""holes(i, j, z) -> bool, all (N,): shifts between i and j are undefined at z; symmetric in i and j."""


@dataclass(frozen=True)
class Chart:
    """The common coordinate z = to(pixel, x), its inverse x = back(pixel, z), and dz/dx = slope(pixel, x).

    >>> import numpy as np
    >>> from toy1d import Chart, Line
    >>> stretched = Chart(lambda i, x: x / (i + 1), lambda i, z: z * (i + 1), lambda i, x: 1 / (i + 1.0))
    >>> line = Line(lambda pixel, x: np.ones(len(x)), np.zeros(2), np.array([1.0, 2.0]), stretched)
    >>> line.chart.to(np.array([1]), np.array([1.5]))
    array([0.75])
    """

    to: Function = lambda pixel, x: x
    back: Function = lambda pixel, z: z
    slope: Function = lambda pixel, x: np.ones_like(x)


@dataclass(frozen=True)
class Technique:
    """A way to sample a domain scaled to [0, 1): s = sample(pixel, u) of density pdf(pixel, s); uniform by default.

    >>> import numpy as np
    >>> from toy1d import Technique
    >>> towards_one = Technique(lambda i, u: np.sqrt(u), lambda i, s: 2 * s)
    >>> towards_one.sample(np.zeros(1), np.array([0.25])), towards_one.pdf(np.zeros(1), np.array([0.5]))
    (array([0.5]), array([1.]))
    """

    sample: Function = lambda pixel, u: u
    pdf: Function = lambda pixel, s: np.ones_like(s)


def no_holes(i: Array, j: Array, z: Array) -> Array:
    """Shifts are defined wherever they stay inside the domains."""
    return np.zeros(z.shape, dtype=bool)


def grey(pixel: Array, x: Array) -> Array:
    """One channel, f = |f|; shape (1, N)."""
    return np.ones((1, *x.shape))


@dataclass(frozen=True, eq=False)
class Line:
    """n integrals over [low, high) (n,); a sample is its position x (N,).

    f is the brightness |f|, which is also the target; chroma(pixel, x) = f / |f| has shape (C, N) and mean 1.
    Every technique draws one candidate; they need not all cover the domain.

    >>> import numpy as np
    >>> from restir_ref import Live, Pixels, initial, shade
    >>> from toy1d import Line
    >>> squares = Line(lambda pixel, x: (pixel + 1) * x**2, low=np.zeros(2), high=np.array([1.0, 2.0]))
    >>> here = Pixels(squares, np.arange(40_000))
    >>> X = initial(here, Live(np.random.default_rng(1)), M=4)
    >>> shade(X, here).reshape(-1, 2).mean(axis=0).round(2)  # 1/3, 16/3
    array([0.33, 5.34])
    """

    f: Function
    low: Array
    high: Array
    chart: Chart = Chart()
    holes: Holes = no_holes
    techniques: Sequence[Technique] = (Technique(),)
    chroma: Function = grey

    @property
    def n(self) -> int:
        """Number of pixels."""
        return len(self.low)

    def pixel(self, index: Array) -> Array:
        """The pixel of each column; a single replica is spared the remainder, which is slow."""
        return index if index.max(initial=0) < self.n else index % self.n

    def candidates(self, index: Array, chance: Chance) -> Iterator[tuple[Array, Array]]:
        """One sample per technique, balance heuristic between them: m W = 1 / sum_t p_t(x)."""
        i = self.pixel(index)
        low, size = self.low[i], (self.high - self.low)[i]
        for each in self.techniques:
            s = each.sample(i, chance.uniform(index.shape))
            yield low + size * s, size / total([other.pdf(i, s) for other in self.techniques])

    def target(self, index: Array, x: Array) -> Array:
        """p_hat = |f| inside the domain, 0 outside."""
        i = self.pixel(index)
        return np.where(self.covers(i, x), self.f(i, x), 0.0)

    def pdf(self, index: Array, x: Array) -> Array:
        """p(x) of a line with one technique: its density inside the domain, 0 outside."""
        i = self.pixel(index)
        inside, size = self.covers(i, x), (self.high - self.low)[i]
        s = np.where(inside, (x - self.low[i]) / size, 0.0)
        return np.where(inside, self.techniques[0].pdf(i, s) / size, 0.0)

    def contribution(self, index: Array, x: Array) -> Array:
        """f_i(x), shape (C, N)."""
        return self.chroma(self.pixel(index), x) * self.target(index, x)

    def shift(self, x: Array, index: Array, to: Pixels) -> Shifted:
        """Keep z.  The offset of an undefined shift is moved into the target domain."""
        there: Line = to.of  # type: ignore[assignment]
        i, j = self.pixel(index), there.pixel(to.index)
        z = self.chart.to(i, x)
        y = there.chart.back(j, z)
        defined = there.covers(j, y) & ~self.holes(i, j, z)
        y = np.where(defined, y, ((there.low + there.high) / 2).take(j))
        J = np.abs(self.chart.slope(i, x) / there.chart.slope(j, y))
        return Shifted(y, np.where(defined, J, 0.0))

    def covers(self, pixel: Array, x: Array) -> Array:
        """Whether x is in the pixel's domain."""
        return np.asarray((x >= self.low.take(pixel)) & (x < self.high.take(pixel)))


def quotient(line: Line, K: int) -> Frame:
    """The same integrals on K cells, uniform in z, integrands constant on each: an exact finite problem.

    Cells belong to a pixel's domain if their middle does; align K with the domains' ends.

    >>> import numpy as np
    >>> from toy1d import quotient, two_pixels
    >>> frame = quotient(two_pixels(), 32)
    >>> frame.n, frame.cells.v.shape
    (2, (2, 32))
    """
    pixel, n = np.arange(line.n)[:, None], line.n
    ends = line.chart.to(pixel, np.stack([line.low, line.high], axis=-1))
    edges = np.linspace(ends.min(), ends.max(), K + 1)
    z = (edges[1:] + edges[:-1]) / 2
    x = line.chart.back(pixel, np.broadcast_to(z, (n, K)))
    inside = line.covers(pixel, x)
    v = np.abs(np.diff(line.chart.back(pixel, np.broadcast_to(edges, (n, K + 1))), axis=-1))
    f = np.where(inside, line.f(pixel, x), 0.0)
    s = np.where(inside, (x - line.low[:, None]) / (line.high - line.low)[:, None], 0.0)
    p = np.stack([inside * each.pdf(pixel, s) for each in line.techniques])
    return Frame(_kept_cells(line, v, f, p / (p * v).sum(axis=-1, keepdims=True), inside, z), n)


def _kept_cells(line: Line, v: Array, f: Array, pdf: Array, inside: Array, z: Array) -> Cells:
    """Shifts keep the number of the cell where both domains contain it and no hole is in the way."""
    i, j = np.arange(line.n)[:, None, None], np.arange(line.n)[None, :, None]
    both = inside[:, None] & inside[None] & ((i == j) | ~line.holes(i, j, z))
    return cells(v, f, pdf, np.where(both, np.arange(len(z)), -1))
