"""The protocol every system plugs into: many integrals whose samples can be shifted into each other.

A *sample* x is opaque to the theory: an array or a frozen dataclass of arrays, batch axis last,
already evaluated.  A *column* is one integral of one replica.  Integrals that form an image of n
pixels read a column as  column = replica * n + pixel,  so replicas, and the lanes of the exact
oracle, are just more columns.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from restir_ref.batch import Array, wide
from restir_ref.chance import Chance
from restir_ref.guards import nonnegative, per_column

Sample = Any


class Integrals(Protocol):
    """One frame's (or one sign's) integrals I_i = int_Omega_i f_i, one per column of `index`."""

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
    """N integrals, one per column: `of` says which image, `index` (N,) which column of it."""

    of: Integrals
    index: Array


@dataclass(frozen=True)
class Shifted:
    """y = T(x) and J = |dT/dx| (N,); J = 0 where x is outside the domain of T (y is then any valid sample)."""

    x: Sample
    J: Array


@dataclass(frozen=True)
class Reservoirs:
    """Samples x with unbiased contribution weights W (N,) and confidence weights c (N,).  [GRIS 6.2]

    Null samples have W = 0 and keep their confidence: confidence never depends on sample values.
    """

    x: Sample
    W: Array
    c: Array


def target(at: Pixels, x: Sample) -> Array:
    """p_hat(x) of the integrals `at`, checked: (N,), finite and >= 0."""
    p_hat = per_column(wide(np.asarray(at.of.target(at.index, x))), len(at.index), "the target p_hat")
    return nonnegative(p_hat, "the target p_hat", "Return |f|, or another finite non-negative proxy, from target().")


Proxy = Callable[[Pixels, Sample], Array]
"""A density of the samples of `Pixels`, up to a factor: `target`, or `pdf`."""


def pdf(at: Pixels, x: Sample) -> Array:
    """p(x), checked: for integrals that also know the density of their candidates; (N,)."""
    of: Tractable = at.of  # type: ignore[assignment]
    p = per_column(wide(np.asarray(of.pdf(at.index, x))), len(at.index), "the density p")
    return nonnegative(p, "the density p", "Return the density of the candidates from pdf().")


def shifted(x: Sample, at: Pixels, to: Pixels) -> Shifted:
    """y = T(x) from the domains of `at` to those of `to`; J is checked: (N,), finite and >= 0."""
    y = at.of.shift(x, at.index, to)
    J = per_column(np.asarray(y.J), len(to.index), "the Jacobian J")
    nonnegative(J, "the Jacobian J", "Return |dT/dx| from shift(), its absolute value, and 0 where T is undefined.")
    return y


def p_hat_from(j: Pixels, y: Sample, here: Pixels, proxy: Proxy = target) -> Array:
    """p_hat_from_j(y) = p_hat_j(T_j^-1(y)) |dT_j^-1/dy|, 0 where undefined; (N,).  [GRIS Eq. 35]

    The factor "y in T_j(supp X_j)" is in p_hat_j, whose support lies inside supp X_j.
    """
    back = shifted(y, here, j)
    return back.J * proxy(j, back.x)
