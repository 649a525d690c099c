"""Gradient-domain ReSTIR: a pair of pixels is one integral, and each sign of it is another.  [GPT 3-4]

The paired domain of pixels (i, j) is (Omega_i x {0}) + (Omega_j x {1}): a base path in one pixel
beside its offset path in the other, which the inner shift makes.  `Pairs` wraps any integrals; the
passes of `restir` do the rest.  A coloured difference has no sign: its parts are told apart by the sign of its mean.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np

from restir_ref.batch import Array, ratio, take
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
    pixels,
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
    """f_i(x) - f_j(T_ij x) J, y = T_ij x; (C, N).  [GPT Eq. 2, 15]

    >>> import numpy as np
    >>> from restir_ref import Pixels
    >>> from restir_ref.gradient import gap
    >>> from restir_ref.integrals import shifted
    >>> from toy1d import two_pixels
    >>> line, x = two_pixels(), np.array([0.25, 0.6])
    >>> here, other = Pixels(line, np.array([0, 0])), Pixels(line, np.array([1, 1]))
    >>> gap(x, here, shifted(x, here, other), other).round(2)
    array([[ 1.69, -2.73]])
    """
    return np.asarray(base.of.contribution(base.index, read_only(x)) - weighted(offset, y.x, y.J))


def one_sided(X: Reservoirs, base: Pixels, offset: Pixels, proxy: Proxy = target) -> Array:
    """<Delta'_ij> = w_ij(y) (f_i(y) - f_j(T_ij y) J) W_y; (C, N).  [GPT Eq. 11]"""
    y = shifted(X.x, base, offset)
    return times(omega(X.x, base, y, offset, proxy) * gap(X.x, base, y, offset), X.W)


def gradient_after(X: Reservoirs, i: Pixels, j: Pixels, proxy: Proxy = target) -> Array:
    """<Delta_ij> = <Delta'_ij> - <Delta'_ji> from the pixels' own samples, all in X; (C, N).  [GPT Eq. 12]"""
    return one_sided(held(X, i), i, j, proxy) - one_sided(held(X, j), j, i, proxy)


COLOURED = 0.1
"""By this share of the mean of |d| a coloured d belongs to both signs: where its mean is 0, it need not be."""


@dataclass(frozen=True)
class Part:
    """What one reservoir samples of a signed integrand d (C, N).

    target  p_hat(d) >= 0, (N,);  share  how much of d belongs to it, (N,): 1 in all, over the parts of d
    """

    target: Callable[[Array], Array]
    share: Callable[[Array], Array]


def upward(d: Array) -> Array:
    """max(d, 0); of several channels max(mean d, 0) + COLOURED mean |d|, so that all of d is sampled; (N,).  [ours]"""
    slack = COLOURED * abs(d).mean(axis=0) if len(d) > 1 else 0
    return np.asarray(np.maximum(d.mean(axis=0), 0) + slack)


def share_upward(d: Array) -> Array:
    """p_hat_+ / (p_hat_+ + p_hat_-); of one channel 1 where d > 0, else 0; (N,)."""
    up = upward(d)
    return ratio(up, up + upward(-d))


def size(d: Array) -> Array:
    """|d|, the mean over channels; (N,)."""
    return np.asarray(abs(d).mean(axis=0))


POSITIVE = Part(upward, share_upward)
"""max(d, 0).  [GPT Eq. 25]"""

NEGATIVE = Part(lambda d: upward(-d), lambda d: share_upward(-d))
"""max(-d, 0).  [GPT Eq. 26]"""

MAGNITUDE = Part(size, lambda d: (size(d) > 0).astype(float))
"""|d|: one reservoir for both signs, whose estimate +-sum w jumps between them.  [GPT Eq. 19]"""


SIGNS: Mapping[str, Part] = MappingProxyType({"positive": POSITIVE, "negative": NEGATIVE})
"""Positivization: d = max(d, 0) - max(-d, 0).  [GPT Eq. 23]"""


Drawn = tuple[Sample, Array]
"""A candidate x with its m W (N,)."""


@dataclass(frozen=True)
class Paired:
    """A base path x, the side k (N,) of the pair it lives on (0 for i, 1 for j), and its offset path with J."""

    x: Sample
    k: Array
    offset: Shifted


def distinct_ends(ends: Array, n: int) -> None:
    """Raise ValueError, naming the pair, unless ends (2, E) are two different ones of n pixels each."""
    if ends.ndim != 2 or len(ends) != 2 or ends.dtype.kind not in "iu":
        raise ValueError(
            f"the ends of pairs have shape {ends.shape} and type {ends.dtype}, but are two rows of whole numbers: the "
            f"pixels i, and the pixels j."
        )
    wrong = (ends < 0).any(axis=0) | (ends >= n).any(axis=0) | (ends[0] == ends[1])
    if wrong.any():
        at = int(np.argmax(wrong))
        raise ValueError(
            f"pair {at} is of the pixels {ends[0, at]} and {ends[1, at]}, but a pair has two different ones of the {n} "
            f"that there are, counted from 0."
        )


@dataclass(frozen=True, eq=False)
class Pairs:
    """One part of the differences int f_i - int f_j of pairs (i, j).

    ends (2, E) holds the pixels i and j of every pair; column = replica * E + pair.  Contributions
    are signed: an estimate adds up the shading of both signs, or is that of `MAGNITUDE` alone.
    The weight w* compares targets [GPT Eq. 13]; proxy=pdf compares sampling densities instead
    [GPT Eq. 4, as Eq. 16 has it], for candidates fresh from the samplers.
    Raises ValueError for ends of another shape, for pixels that do not exist, and for a pair of a pixel and itself.

    >>> import numpy as np
    >>> from restir_ref import Live, Pixels, initial, shade
    >>> from restir_ref.gradient import SIGNS, Pairs
    >>> from toy1d import shared_peak
    >>> chance, index, ends = Live(np.random.default_rng(1)), np.arange(20_000), np.array([[0], [1]])  # one pair
    >>> parts = [Pixels(Pairs(shared_peak(), ends, part), index) for part in SIGNS.values()]
    >>> [shade(initial(here, chance, M=8), here).mean().round(2) for here in parts]  # their sum is I_0 - I_1
    [np.float64(0.16), np.float64(-0.1)]
    """

    of: Integrals
    ends: Array
    part: Part
    proxy: Proxy = target

    def __post_init__(self) -> None:
        distinct_ends(self.ends, pixels(self.of))

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

    def offered(self, index: Array, drawn: Iterable[Drawn]) -> Iterator[tuple[Paired, Array]]:
        """Candidates from what has been drawn for all pixels of whole images, once for every reservoir that reads it.

        Both signs of a pair, all pairs of a pixel, and the pixel itself may share one draw: each is unbiased by itself.
        """
        drawn = list(drawn)
        for side in (0, 1):
            k = np.full(len(index), side)
            columns = self.end(index, k).index
            for x, mW in drawn:
                yield self.paired(index, take(x, columns), k), mW.take(columns)

    def paired(self, index: Array, x: Sample, k: Array) -> Paired:
        """The base path x on side k with its offset path T_ij(x) on the other: the inner shift.  [GPT 4.2.1]"""
        return Paired(x, k, shifted(x, self.end(index, k), self.end(index, 1 - k)))

    def target(self, index: Array, x: Paired) -> Array:
        """p_hat = max(+-w* G, 0), or w* |G|; (N,).  [GPT Eq. 19, 25-26]"""
        # hazard: Eq. 19 is printed with T* inside p_hat; x has been shifted already, and once more is biased.
        return self.part.target(self.difference(index, x))

    def contribution(self, index: Array, x: Paired) -> Array:
        """The part's share of w* G, which is all of it where p_hat > 0 if there is one channel; (C, N).

        [GPT Eq. 17, 24]
        """
        d = self.difference(index, x)
        return d * self.part.share(d)

    def shift(self, x: Paired, index: Array, to: Pixels) -> Shifted:
        """T*: the base path moves from i to i' or j to j', its offset path is rebuilt; J* = J_tau.  [GPT Eq. 21-22]"""
        there: Pairs = to.of  # type: ignore[assignment]
        tau = shifted(x.x, self.end(index, x.k), there.end(to.index, x.k))
        return Shifted(there.paired(to.index, tau.x, x.k), tau.J)

    def displaced(self, x: Paired, by: Array) -> Paired:
        """The base path at another place of the film, for integrals that have one; its offset path is rebuilt later."""
        of: Any = self.of
        return Paired(of.displaced(x.x, by), x.k, x.offset)

    def place(self, x: Paired) -> Array:
        """The base path's place in its pixel, for integrals that have one; (film, N)."""
        of: Any = self.of
        return np.asarray(of.place(x.x))

    def end(self, index: Array, k: Array) -> Pixels:
        """The pixels on side k (N,) of each column's pair."""
        return Pixels(self.of, index // self.n * pixels(self.of) + self.ends[k, index % self.n])

    def difference(self, index: Array, x: Paired) -> Array:
        """w* G = w (f_base(x) - f_offset(T x) J), negated for bases in pixel j; (C, N).  [GPT Eq. 15-16]"""
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
