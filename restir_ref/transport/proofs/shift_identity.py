"""The change of variables as an identity of means: what one can hold against a shift as a whole.  [GRIS Def. 4.2]

    E_x[p_hat(Tx) J W h(Tx)] = E_y[p_hat(y) W 1{T^-1 y defined} h(y)]     for every h

h = m(y) 1{kind of y} with Talbot's weight m keeps both sides below what one path tree carries: rare large
Jacobians are no excuse.  Unlike the checks path by path this one needs no primary sample of y, but many
paths, and mistakes that cancel on average escape it.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from itertools import product

import numpy as np

from restir_ref.batch import Array, ratio, take
from restir_ref.chance import Chance, Live
from restir_ref.transport.paths import Path
from restir_ref.transport.proofs.shift_checks import (
    Case,
    Finding,
    Offender,
    more_paths,
    pairs,
    undecided,
)

SIGMAS, NOISE, FEW, BLOCKS = 5.0, 0.05, 50, 4
"""Largest |z|; largest relative standard error of the whole; fewest paths of a kind; blocks of pixels."""


@dataclass
class Tape:
    """Stands in for a generator of numbers: what chance has said is said again to the next reader."""

    chance: Chance
    said: list[Array] = field(default_factory=list)
    at: int = 0

    def random(self, shape: tuple[int, ...] | int) -> Array:
        """The next numbers on the tape; new ones at its end."""
        if self.at == len(self.said):
            self.said.append(self.chance.uniform((shape,) if isinstance(shape, int) else shape))
        self.at += 1
        return self.said[self.at - 1]


@dataclass(frozen=True)
class Side:
    """One side of the identity, column by column: base path, pixel, shift and J; the y that h judges and T^-1 y.

    value (N,)  p_hat(y) J W m(y), or p_hat(y) W m(y);  J is that of `path` -> `shifted`
    """

    path: Path
    pixel: Array
    shifted: Path
    J: Array
    y: Path
    back: Path
    value: Array


@dataclass(frozen=True)
class Mean:
    """Both means over one kind of y, their difference's standard error, how many paths, and the differences (N,)."""

    name: str
    left: float
    right: float
    error: float
    paths: int
    differences: Array

    @property
    def z(self) -> float:
        """How many standard errors the sides are apart."""
        return abs(self.left - self.right) / self.error if self.error else 0.0


def change_of_variables(case: Case) -> Finding:
    """E_x[p_hat(Tx) J W h(Tx)] = E_y[p_hat(y) W 1{T^-1 y defined} h(y)] for all kinds of y."""
    i, j = pairs(case.of.n, np.full(case.effort.paths, min(case.effort.reach, case.of.n - 1)), case.chance)
    tape = Tape(case.chance)  # the same numbers in both pixels: what they share cancels
    left, right = _left(case, i, j, tape), _right(case, i, j, replace(tape, at=0))
    whole, *kinds = _means(left, right, i, j, case.of.n)
    if needs := _lacking(case, whole):
        return undecided(needs)
    means = [whole, *(each for each in kinds if each.paths >= FEW)]
    worst = max(means, key=lambda mean: mean.z)
    failed = sum(mean.z > SIGMAS for mean in means)
    culprit = _culprit(left, right, worst, i, j) if failed else None
    return Finding(len(means), failed, 0, worst.z / SIGMAS, culprit)


def _lacking(case: Case, whole: Mean) -> str:
    """What it takes to compare the means of the whole: FEW paths, and NOISE at most; "" if nothing."""
    if whole.paths < FEW:
        few = f"paths that count: {whole.paths}, at least {FEW} are needed"
        return f"{few}: {more_paths(case, 2 * FEW / max(whole.paths, 1))}, or a brighter scene"
    if whole.error <= NOISE * whole.right:
        return ""
    noise = whole.error / whole.right if whole.right else np.inf
    times = (noise / NOISE) ** 2 if whole.right else 10
    return f"the means are known to {noise:.0%}, at most {NOISE:.0%} are needed: {more_paths(case, 1.2 * times)}"


def _left(case: Case, i: Array, j: Array, tape: Tape) -> Side:
    """x of pixels i, shifted to pixels j, where y = Tx."""
    ((x, W),) = case.of.candidates(i, Live(tape))  # type: ignore[arg-type]
    y, J = case.shift(x, i, j)
    back, J_back = case.shift(y, j, i)
    return Side(x, i, y, J, y, back, case.p_hat(y) * J * W * _talbot(case, y, back, J_back))


def _right(case: Case, i: Array, j: Array, tape: Tape) -> Side:
    """y of pixels j."""
    ((y, W),) = case.of.candidates(j, Live(tape))  # type: ignore[arg-type]
    back, J_back = case.shift(y, j, i)
    return Side(y, j, back, J_back, y, back, case.p_hat(y) * W * _talbot(case, y, back, J_back))


def _talbot(case: Case, y: Path, back: Path, J_back: Array) -> Array:
    """m(y) = q / (q + p_hat(y)), q = p_hat(T^-1 y) |dT^-1/dy|: 0 where T^-1 is undefined.  [GRIS Eq. 36]"""
    q = case.p_hat(back) * J_back
    return ratio(q, q + case.p_hat(y))


def _means(left: Side, right: Side, i: Array, j: Array, n: int) -> Iterator[Mean]:
    """All of it, then by kinds of y: where it reconnects, how it ends, how dense T^-1 y is; and by place on film."""
    everywhere = np.ones(len(i), dtype=bool)
    yield _mean("all", left, right, everywhere, everywhere)
    for kind in product(np.unique(right.y.c).tolist(), (0, 1), (-1, 0, 1)):
        yield _mean(_kind_in_words(*kind), left, right, _is_kind(left, kind), _is_kind(right, kind))
    for block, up in product(range(BLOCKS), (False, True)):
        here = (j * BLOCKS // n == block) & ((i < j) == up)
        yield _mean(f"y in block {block} of pixels, from {'below' if up else 'above'}", left, right, here, here)


def _is_kind(side: Side, kind: tuple[int, int, int]) -> Array:
    """Reconnection index, light sampling or not, and the sign of A(T^-1 y) - A(y); (N,)."""
    denser = side.back.A - side.y.A
    sign = np.sign(np.where(np.abs(denser) > 1e-9 * side.y.A, denser, 0))
    return np.asarray((side.y.c == kind[0]) & (side.y.nee == kind[1]) & (sign == kind[2]))


def _kind_in_words(c: int, nee: int, sign: int) -> str:
    return f"y by {('BSDF', 'light')[nee]} sampling, c = {c}, {('as dense', 'denser', 'thinner')[sign]} in pixel i"


def _mean(name: str, left: Side, right: Side, of_left: Array, of_right: Array) -> Mean:
    """Means over all columns of the values in those of a kind."""
    L, R = left.value * of_left, right.value * of_right
    error = (L - R).std() / np.sqrt(len(L))
    return Mean(name, float(L.mean()), float(R.mean()), float(error), int(((L > 0) | (R > 0)).sum()), L - R)


def _culprit(left: Side, right: Side, worst: Mean, i: Array, j: Array) -> Offender:
    """The path that counts most on the side that is too large."""
    side, d = (left, worst.differences) if worst.left > worst.right else (right, -worst.differences)
    n = np.array([int(d.argmax())])
    one, other = take(side, n), np.where(side.pixel[n] == i[n], j[n], i[n])
    what = f"mean of {worst.name}, z = {worst.z:.1f}"
    return Offender(one.path, one.pixel, one.shifted, other, one.J, what, worst.left, worst.right)
