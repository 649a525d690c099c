"""Gradient-domain ReSTIR: a pair of pixels is one integral, and each sign of it is another.  [GPT 3-4]

The paired domain of pixels (i, j) is (Omega_i x {0}) + (Omega_j x {1}): a base path in one pixel
whose offset path in the other is rebuilt by the inner shift whenever it is needed.  `Pairs` wraps
any integrals; the passes of `restir` do the rest.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from restir_ref.batch import Array, ratio
from restir_ref.chance import Chance
from restir_ref.integrals import Integrals, Pixels, Sample, Shifted, target


@dataclass(frozen=True)
class Based:
    """A base path x and the side k (N,) of the pair it lives on: 0 for pixel i, 1 for pixel j."""

    x: Sample
    k: Array


@dataclass(frozen=True, eq=False)
class Pairs:
    """The differences int f_i - int f_j of pairs (i, j), restricted to one sign of the integrand.

    ends (2, E) holds the pixels i and j of every pair; column = replica * E + pair.  sign = +1 or
    -1; contributions are signed, so an estimate adds up the two signs' shading.  Scalar integrands
    only: with colours the sign of a difference is ambiguous.
    """

    of: Integrals
    ends: Array
    sign: int

    def candidates(self, index: Array, chance: Chance) -> Iterator[tuple[Based, Array]]:
        """Both pixels' candidates: they cover disjoint halves of the paired domain."""
        for k in (0, 1):
            side = np.full(len(index), k)
            for x, mW in self.of.candidates(self.end(index, side), chance):
                yield Based(x, side), mW

    def target(self, index: Array, x: Based) -> Array:
        """p_hat = max(+-w* G, 0).  [GPT Eq. 26]"""
        return np.asarray(np.maximum(self.sign * self.difference(index, x), 0))

    def contribution(self, index: Array, x: Based) -> Array:
        """w* G where it has this sign, shape (1, N).  [GPT Eq. 24]"""
        return np.asarray(self.sign * self.target(index, x)[None])

    def shift(self, x: Based, index: Array, to: Pixels) -> Shifted:
        """Outer shift: the base path moves from i to i' or j to j'; J* = J_tau.  [GPT Eq. 21-22]"""
        there: Pairs = to.of  # type: ignore[assignment]
        outer = self.of.shift(x.x, self.end(index, x.k), Pixels(there.of, there.end(to.index, x.k)))
        return Shifted(Based(outer.x, x.k), outer.J)

    def end(self, index: Array, k: Array) -> Array:
        """The pixel on side k (N,) of each column's pair."""
        return np.asarray(self.ends[k, index % self.ends.shape[-1]])

    def difference(self, index: Array, x: Based) -> Array:
        """w* G = w (f_base(x) - f_offset(T x) J), negated for bases in pixel j; (N,).  [GPT Eq. 13, 15, 16]"""
        base = Pixels(self.of, self.end(index, x.k))
        offset = Pixels(self.of, self.end(index, 1 - x.k))
        y = self.of.shift(x.x, base.index, offset)
        p_base, p_offset = target(base, x.x), target(offset, y.x) * y.J
        f_base, f_offset = self._f(base, x.x), self._f(offset, y.x) * y.J
        difference = ratio(p_base * (f_base - f_offset), p_base + p_offset)
        return np.where(x.k == 0, difference, -difference)

    def _f(self, at: Pixels, x: Sample) -> Array:
        """The scalar integrand of one pixel."""
        return np.asarray(self.of.contribution(at.index, x)[0])
