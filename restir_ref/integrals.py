"""The protocol every system plugs into: many integrals whose samples can be shifted into each other.

A *sample* x is opaque to the theory: an array or a frozen dataclass of arrays, batch axis last,
already evaluated.  A *column* is one integral of one replica.  Integrals that form an image of n
pixels read a column as  column = replica * n + pixel,  so replicas, and the lanes of the exact
oracle, are just more columns.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Protocol

import numpy as np

from restir_ref.batch import Array, columns, joined, part, take, wide
from restir_ref.chance import Chance
from restir_ref.guards import aligned, apart, nonnegative, per_column, read_only

Sample = Any


NOWHERE = -1
"""The column of a source that does not exist: disoccluded, outside of the image, no history yet."""


class Integrals(Protocol):
    """One frame's (or one sign's) integrals I_i = int_Omega_i f_i, one per column of `index`.

    Methods are functions of their arguments: they write into none of them (samples come read-only), and
    return arrays that nobody writes into afterwards, new ones or parts of the samples; never a buffer
    that the next call fills again.

    >>> import numpy as np
    >>> from restir_ref import Live, Pixels, Shifted, initial, shade
    >>> class Ramps:  # f_i(x) = (i + 1) x on [0, 1)
    ...     def candidates(self, index, chance):
    ...         yield chance.uniform((len(index),)), np.ones(len(index))
    ...     def target(self, index, x):
    ...         return (index + 1) * x
    ...     def contribution(self, index, x):
    ...         return self.target(index, x)[None]
    ...     def shift(self, x, index, to):
    ...         return Shifted(x, np.ones(len(index)))
    >>> here = Pixels(Ramps(), np.array([0, 1]).repeat(10_000))
    >>> Y = initial(here, Live(np.random.default_rng(1)), M=4)
    >>> shade(Y, here).reshape(2, -1).mean(axis=1).round(2)
    array([0.5, 1. ])
    """

    def candidates(self, index: Array, chance: Chance) -> Iterator[tuple[Sample, Array]]:
        """Yield (x, m W): initial samples with their MIS weight times W = 1/p(x), each (N,).

        Techniques, leaves of a path tree, or repeated draws; together they cover supp p_hat.
        """

    def target(self, index: Array, x: Sample) -> Array:
        """p_hat_i(x) >= 0, (N,); reads x, traces nothing.  Law: supp p_hat in supp X."""

    def contribution(self, index: Array, x: Sample) -> Array:
        """f_i(x), shape (C, N)."""

    def shift(self, x: Sample, index: Array, to: "Pixels") -> "Shifted":
        """T(x) from Omega_index to the domains of `to` (another pixel, frame or sign), with its Jacobian."""


class Image(Integrals, Protocol):
    """Integrals that form an image of n pixels: column = replica * n + pixel."""

    @property
    def n(self) -> int:
        """Number of pixels."""


class Tractable(Integrals, Protocol):
    """Integrals that know the density of their candidates."""

    def pdf(self, index: Array, x: Sample) -> Array:
        """p_i(x) of one candidate, (N,)."""


@dataclass(frozen=True, eq=False)
class Pixels:
    """N integrals, one per column: `of` says which image, `index` (N,) which column of it.

    As a source of reuse, `index` is `NOWHERE` where there is none: the column enters with W = 0 and c = 0.
    Raises TypeError for an index that is no array (N,) of integers, IndexError for one below `NOWHERE`.

    >>> import numpy as np
    >>> from restir_ref import Pixels
    >>> from toy1d import two_pixels
    >>> line = two_pixels()
    >>> here = Pixels(line, np.arange(6))  # three replicas of both pixels
    >>> here.of.n, here.index % here.of.n
    (2, array([0, 1, 0, 1, 0, 1]))
    """

    of: Integrals
    index: Array

    def __post_init__(self) -> None:
        columns(self.index, NOWHERE)


@dataclass(frozen=True)
class Shifted:
    """y = T(x) and J = |dT/dx| (N,); J = 0 where x is outside the domain of T (y is then any valid sample).

    >>> import numpy as np
    >>> from restir_ref import Pixels
    >>> from toy1d import overlapping_supports
    >>> line = overlapping_supports()
    >>> y = line.shift(np.array([0.25, 0.5]), np.array([3, 3]), Pixels(line, np.array([4, 4])))
    >>> y.x.round(2), y.J  # the first one has no counterpart in the next pixel
    (array([0.58, 0.5 ]), array([0., 1.]))
    """

    x: Sample
    J: Array


@dataclass(frozen=True)
class Reservoirs:
    """Samples x with unbiased contribution weights W (N,) and confidence weights c (N,).  [GRIS 6.2]

    Null samples have W = 0 and keep their confidence: confidence never depends on sample values.

    >>> import numpy as np
    >>> from restir_ref import Live, Pixels, initial
    >>> from toy1d import two_pixels
    >>> X = initial(Pixels(two_pixels(), np.arange(2)), Live(np.random.default_rng(1)), M=8)
    >>> X.x.round(3), X.W.round(3), X.c
    (array([0.144, 0.538]), array([0.669, 0.333]), array([1, 1]))
    """

    x: Sample
    W: Array
    c: Array


def target(at: Pixels, x: Sample) -> Array:
    """p_hat(x) of the integrals `at`, checked: (N,), finite and >= 0.

    >>> import numpy as np
    >>> from restir_ref import Pixels
    >>> from restir_ref.integrals import target
    >>> from toy1d import two_pixels
    >>> target(Pixels(two_pixels(), np.array([1, 1])), np.array([0.6, 2.0])).round(2)  # 2.0 is outside of the domain
    array([3.2, 0. ])
    """
    p_hat = per_column(wide(np.asarray(at.of.target(at.index, read_only(x)))), len(at.index), "the target p_hat")
    return nonnegative(p_hat, "the target p_hat", "Return |f|, or another finite non-negative proxy, from target().")


Proxy = Callable[[Pixels, Sample], Array]
"""A density of the samples of `Pixels`, up to a factor: `target`, or `pdf`."""


def pdf(at: Pixels, x: Sample) -> Array:
    """p(x), checked: for integrals that also know the density of their candidates; (N,)."""
    of: Tractable = at.of  # type: ignore[assignment]
    p = per_column(wide(np.asarray(of.pdf(at.index, read_only(x)))), len(at.index), "the density p")
    return nonnegative(p, "the density p", "Return the density of the candidates from pdf().")


def shifted(x: Sample, at: Pixels, to: Pixels) -> Shifted:
    """y = T(x) from the domains of `at` to those of `to`, N columns; J is checked: (N,), finite and >= 0."""
    y = at.of.shift(read_only(x), at.index, to)
    J = per_column(np.asarray(y.J), len(to.index), "the Jacobian J")
    nonnegative(J, "the Jacobian J", "Return |dT/dx| from shift(), its absolute value, and 0 where T is undefined.")
    return Shifted(aligned(y.x, len(to.index), "the samples y = T(x) of a shift"), J)


def shifted_together(xs: Sequence[Sample], ats: Sequence[Pixels], tos: Sequence[Pixels]) -> Sequence[Shifted]:
    """Every x of its domains `at` shifted to its domains `to`; from one image to one other by one call.

    Samples that are mere numbers cost less to shift than to copy together: each array is shifted by a call of its own.
    """
    own = [1 + i if isinstance(x, np.ndarray) else 0 for i, x in enumerate(xs)]
    images = [(id(at.of), id(to.of), alone) for at, to, alone in zip(ats, tos, own, strict=True)]
    found: dict[int, Shifted] = {}
    for pair in dict.fromkeys(images):
        group = [i for i, each in enumerate(images) if each == pair]
        at, to = (Pixels(domains[group[0]].of, joined([domains[i].index for i in group])) for domains in (ats, tos))
        y = shifted(joined([xs[i] for i in group]), at, to)
        J, stop = y.J if y.J.shape else np.full(to.index.shape, y.J), 0
        for i in group:
            start, stop = stop, stop + len(tos[i].index)
            found[i] = Shifted(part(y.x, slice(start, stop)), J[start:stop])
    return kept_apart([found[i] for i in range(len(xs))])


def kept_apart(ys: Sequence[Shifted]) -> Sequence[Shifted]:
    """The same shifted samples, none of which has overwritten the one before it."""
    for one, other in pairwise(ys):
        apart(one.x, other.x, "samples from shift()")
        apart(one.J, other.J, "Jacobians from shift()")
    return ys


def weighted(at: Pixels, x: Sample, W: Array) -> Array:
    """f(x) W, and 0 where W = 0, whatever f is there; (C, N)."""
    return times(at.of.contribution(at.index, read_only(x)), W)


def times(f: Array, W: Array) -> Array:
    """f W, and 0 where W = 0 and f is infinite or no number: null samples may lie where f is undefined."""
    return np.asarray(np.where((W != 0) | (abs(f) < np.inf), f, 0) * W)


def pixels(of: Integrals) -> int:
    """The number of pixels n of integrals that form an image; others count as an image of one."""
    return int(getattr(of, "n", 1))


def held(X: Reservoirs, at: Pixels) -> Reservoirs:
    """Columns `at.index` of X, which holds images of `at.of` in order: column k is at place k.

    Raises IndexError where X does not hold them.
    """
    n, N = pixels(at.of), np.size(X.W)
    if at.index.size and at.index.max() >= N:
        raise IndexError(
            f"column {at.index.max()} is asked of reservoirs that hold {N}, of images of {n} pixels: they must hold "
            f"whole images, column = replica * {n} + pixel."
        )
    return take(X, at.index)


def p_hat_from(j: Pixels, y: Sample, here: Pixels, proxy: Proxy = target) -> Array:
    """p_hat_from_j(y) = p_hat_j(T_j^-1(y)) |dT_j^-1/dy|, 0 where undefined; (N,).  [GRIS Eq. 35]

    The factor "y in T_j(supp X_j)" is in p_hat_j, whose support lies inside supp X_j.

    >>> import numpy as np
    >>> from restir_ref import Pixels
    >>> from restir_ref.integrals import p_hat_from
    >>> from toy1d import overlapping_supports
    >>> line = overlapping_supports()
    >>> here, near = (Pixels(line, np.full(3, pixel)) for pixel in (3, 4))
    >>> y = np.array([0.25, 0.5, 0.75])
    >>> p_hat_from(near, y, here).round(3), line.target(here.index, y).round(3)
    (array([0.   , 0.901, 0.467]), array([0.214, 1.1  , 0.214]))
    """
    back = shifted(y, here, j)
    return back.J * proxy(j, back.x)
