"""Gradient-domain ReSTIR: a pair of pixels is one integral, and each sign of it is another.  [GPT 3-4]

The paired domain of pixels (i, j) is (Omega_i x {0}) + (Omega_j x {1}): a base path in one pixel
beside its offset path in the other, which the inner shift makes.  `Pairs` wraps any integrals; the
passes of `restir` do the rest.  Scalar integrands only: the sign of a coloured difference is ambiguous.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from restir_ref.batch import Array, ratio
from restir_ref.chance import Chance
from restir_ref.guards import apart, read_only
from restir_ref.integrals import (
    Integrals,
    Pixels,
    Proxy,
    Reservoirs,
    Sample,
    Shifted,
    held,
    shifted,
    target,
    times,
    weighted,
)


def omega(x: Sample, base: Pixels, y: Shifted, offset: Pixels, proxy: Proxy = target) -> Array:
    """w_ij(x) = q_i(x) / (q_i(x) + q_j(T_ij x) J); q = p_hat [GPT Eq. 13], or `pdf` [GPT Eq. 4].

    w = 1 where the shift is undefined.  With q = p, base paths of f = 0 must be kept, for w > 0 and
    their offset paths may have f > 0; with q = p_hat they have w = 0 and may be thrown away.
    """
    q, q_offset = proxy(base, x), proxy(offset, y.x)
    apart(q, q_offset, "results of the proxy")
    return ratio(q, q + q_offset * y.J)


def gap(x: Sample, base: Pixels, y: Shifted, offset: Pixels) -> Array:
    """f_i(x) - f_j(T_ij x) J, y = T_ij x; (N,).  [GPT Eq. 2, 15]"""
    f_base = scalar(base.of.contribution(base.index, read_only(x)))
    return np.asarray(f_base - scalar(weighted(offset, y.x, y.J)))


def scalar(f: Array) -> Array:
    """The one channel of a contribution (1, N).

    Raises ValueError for more.
    """
    if len(f) != 1:
        raise ValueError(
            f"gradients are of scalar integrands, but this contribution has {len(f)} channels, of shape {f.shape}: "
            f"take one channel, or their mean, at a time."
        )
    return np.asarray(f[0])


def one_sided(X: Reservoirs, base: Pixels, offset: Pixels, proxy: Proxy = target) -> Array:
    """<Delta'_ij> = w_ij(y) (f_i(y) - f_j(T_ij y) J) W_y; (N,).  [GPT Eq. 11]"""
    y = shifted(X.x, base, offset)
    return times(omega(X.x, base, y, offset, proxy) * gap(X.x, base, y, offset), X.W)


def gradient_after(X: Reservoirs, i: Pixels, j: Pixels, proxy: Proxy = target) -> Array:
    """<Delta_ij> = <Delta'_ij> - <Delta'_ji> from the pixels' own samples, all in X; (N,).  [GPT Eq. 12]"""
    return one_sided(held(X, i), i, j, proxy) - one_sided(held(X, j), j, i, proxy)


Part = Callable[[Array], Array]
"""The part >= 0 of a signed integrand that one reservoir samples."""


def positive(d: Array) -> Array:
    """max(d, 0).  [GPT Eq. 25]"""
    return np.asarray(np.maximum(d, 0))


def negative(d: Array) -> Array:
    """max(-d, 0).  [GPT Eq. 26]"""
    return np.asarray(np.maximum(-d, 0))


def magnitude(d: Array) -> Array:
    """|d|: one reservoir for both signs, whose estimate +-sum w jumps between them.  [GPT Eq. 19]"""
    return np.asarray(abs(d))


SIGNS: Mapping[str, Part] = MappingProxyType({"positive": positive, "negative": negative})
"""Positivization: d = positive(d) - negative(d).  [GPT Eq. 23]"""


@dataclass(frozen=True)
class Paired:
    """A base path x, the side k (N,) of the pair it lives on (0 for i, 1 for j), and its offset path with J."""

    x: Sample
    k: Array
    offset: Shifted


@dataclass(frozen=True, eq=False)
class Pairs:
    """One part of the differences int f_i - int f_j of pairs (i, j).

    ends (2, E) holds the pixels i and j of every pair; column = replica * E + pair.  Contributions
    are signed: an estimate adds up the shading of both signs, or is that of `magnitude` alone.
    The weight w* compares targets [GPT Eq. 13]; proxy=pdf compares sampling densities instead
    [GPT Eq. 4, as Eq. 16 has it], for candidates fresh from the samplers.
    """

    of: Integrals
    ends: Array
    part: Part
    proxy: Proxy = target

    @property
    def n(self) -> int:
        """Number of pairs."""
        return int(self.ends.shape[-1])

    def candidates(self, index: Array, chance: Chance) -> Iterator[tuple[Paired, Array]]:
        """Both pixels' candidates: they cover disjoint halves of the paired domain."""
        for side in (0, 1):
            yield from self.based(index, np.full(len(index), side), chance)

    def based(self, index: Array, k: Array, chance: Chance) -> Iterator[tuple[Paired, Array]]:
        """Candidates whose base paths live on side k."""
        for x, mW in self.of.candidates(self.end(index, k).index, chance):
            yield self.paired(index, x, k), mW

    def paired(self, index: Array, x: Sample, k: Array) -> Paired:
        """The base path x on side k with its offset path T_ij(x) on the other: the inner shift.  [GPT 4.2.1]"""
        return Paired(x, k, shifted(x, self.end(index, k), self.end(index, 1 - k)))

    def target(self, index: Array, x: Paired) -> Array:
        """p_hat = max(+-w* G, 0), or w* |G|; (N,).  [GPT Eq. 19, 25-26]"""
        # hazard: Eq. 19 is printed with T* inside p_hat; x has been shifted already, and once more is biased.
        return self.part(self.difference(index, x))

    def contribution(self, index: Array, x: Paired) -> Array:
        """w* G where p_hat > 0, shape (1, N).  [GPT Eq. 17, 24]"""
        d = self.difference(index, x)
        return np.where(self.part(d) > 0, d, 0)[None]

    def shift(self, x: Paired, index: Array, to: Pixels) -> Shifted:
        """T*: the base path moves from i to i' or j to j', its offset path is rebuilt; J* = J_tau.  [GPT Eq. 21-22]"""
        there: Pairs = to.of  # type: ignore[assignment]
        tau = shifted(x.x, self.end(index, x.k), there.end(to.index, x.k))
        return Shifted(there.paired(to.index, tau.x, x.k), tau.J)

    def end(self, index: Array, k: Array) -> Pixels:
        """The pixels on side k (N,) of each column's pair."""
        return Pixels(self.of, self.ends[k, index % self.n])

    def difference(self, index: Array, x: Paired) -> Array:
        """w* G = w (f_base(x) - f_offset(T x) J), negated for bases in pixel j; (N,).  [GPT Eq. 15-16]"""
        base, offset = self.end(index, x.k), self.end(index, 1 - x.k)
        d = omega(x.x, base, x.offset, offset, self.proxy) * gap(x.x, base, x.offset, offset)
        return np.where(x.k == 0, d, -d)


@dataclass(frozen=True, eq=False)
class TossedPairs(Pairs):
    """Pairs whose candidates live on one side at a time."""

    def candidates(self, index: Array, chance: Chance) -> Iterator[tuple[Paired, Array]]:
        """The candidates of i or j by the toss of a coin, whose probability 1/2 enters W.  [ours; GPT 4.2]"""
        k = chance.choose(np.ones((2, len(index))))
        for x, mW in self.based(index, k, chance):
            yield x, 2 * mW
