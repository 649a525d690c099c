"""What can be found out about an estimator without reading it: exact moments, and how they react to changed scenes."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np

from restir_ref.audit.changes import (
    CHANGES,
    applies,
    earlier_frames,
    mass_of,
    other_density,
    other_pixels,
    renumbered,
    standing_in,
)
from restir_ref.audit.rehearsal import Estimator
from restir_ref.batch import Array, ratio
from restir_ref.integrals import Reservoirs
from restir_ref.oracle.cells import Cells
from restir_ref.oracle.enumeration import outcomes
from restir_ref.oracle.laws import bias_per_cell
from restir_ref.oracle.scenes import Scene

LEAST = 1e-9
"""Rounding, generously: what differs by more is different."""


@dataclass(frozen=True, eq=False)
class Moments:
    """E[W 1{X=x}] and E[W^2 1{X=x}] (n, K), least and largest confidence (n,), and the number of outcomes."""

    first: Array
    second: Array
    least: Array
    largest: Array
    leaves: int

    def variance(self, f: Array) -> Array:
        """Var[f(X) W] of every pixel (n,), f (n, K)."""
        return np.asarray((f**2 * self.second).sum(axis=-1) - (f * self.first).sum(axis=-1) ** 2)


def moments(estimator: Estimator, scene: Scene, most_leaves: int) -> Moments:
    """The moments of an estimator, enumerated; confidences are 0 if it returns none."""
    n = len(scene.v)
    first, second = np.zeros(scene.v.shape), np.zeros(scene.v.shape)
    ends: list[Array] = []
    leaves = 0
    for outcome in outcomes(estimator, n, most_leaves):
        X, p = outcome.result, outcome.per_column(n)
        where = (np.arange(len(p)) % n, X.x)
        np.add.at(first, where, p * X.W)
        np.add.at(second, where, p * X.W**2)
        c = confidences(X).reshape(-1, n)
        ends.append(np.stack([c.min(axis=0), c.max(axis=0)]))
        leaves += len(outcome.probability)
    least, largest = np.min(ends, axis=0)[0], np.max(ends, axis=0)[1]
    return Moments(first, second, least, largest, leaves)


def confidences(X: Reservoirs) -> Array:
    """The confidences of reservoirs (N,), or 0 where there are none of that shape."""
    c = np.asarray(getattr(X, "c", 0))
    return c.astype(float) if c.dtype.kind in "iuf" and c.shape == np.shape(X.W) else np.zeros(np.shape(X.W))


def differ(a: Array, b: Array) -> bool:
    """By more than rounding."""
    return bool((abs(a - b) > LEAST * np.maximum(1, np.maximum(abs(a), abs(b)))).any())


@dataclass(frozen=True, eq=False)
class Draw:
    """A call of choose() whose weights do not depend on samples: its number, and its probabilities (options, n)."""

    call: int
    p: Array


def fixed_draws(asked: Sequence[Array], n: int) -> list[Draw]:
    """The calls with more than one option that every lane was asked alike; asked: weights (options, lanes n) each."""
    found = []
    for call, weights in enumerate(asked, 1):
        options = len(weights)
        lanes = np.asarray(weights, dtype=float).reshape(options, -1, n)
        if options > 1 and (lanes == lanes[:, :1]).all():
            found.append(Draw(call, ratio(lanes[:, 0], lanes[:, 0].sum(axis=0, keepdims=True))))
    return found


@dataclass(frozen=True, eq=False)
class Facts:
    """What is known of an estimator on a scene.

    of           its moments there
    bias         (n, K), as in the report
    draws        the calls of choose() that do not depend on samples
    gone         names of the changes after which no bias is left; stays: those after which some is
    neighbours   whether other pixels of the frame change anything, history: whether earlier frames do
    by_number    whether something goes by the number of a cell, not by the scene's tables
    rates        techniques whose density changes something, though nothing is drawn from it
    """

    scene: Scene
    of: Moments
    bias: Array
    draws: Sequence[Draw]
    gone: tuple[str, ...] = ()
    stays: tuple[str, ...] = ()
    neighbours: bool = False
    history: bool = False
    by_number: bool = False
    rates: tuple[int, ...] = ()

    @cached_property
    def inside(self) -> Array:
        """The bias of the cells of the support, one after the other."""
        return np.asarray(self.bias[self.scene.support])

    @cached_property
    def biased(self) -> Array:
        """Those of them that are off."""
        return np.asarray(self.inside[abs(self.inside) > LEAST])

    @property
    def outside(self) -> Array:
        """Pixels with weight outside of their support."""
        return np.flatnonzero((np.where(self.scene.support, 0, self.bias) > LEAST).any(axis=1))

    @property
    def black(self) -> Array:
        """Pixels with light that never return any."""
        return np.flatnonzero(self.scene.support.any(axis=1) & ~(self.of.first > 0).any(axis=1))

    @property
    def factor(self) -> float:
        """1 + bias if all cells that are off have the same, 0 if they do not, or none is."""
        off = self.biased
        return float(1 + off[0]) if off.size and np.ptp(off) <= LEAST else 0.0

    @property
    def everywhere(self) -> bool:
        """All cells of the support are off."""
        return self.biased.size == self.inside.size

    @property
    def sum_is_right(self) -> bool:
        """E[p_hat(X) W], after one pass the mean sum of weights, is right in every pixel, though cells are not."""
        p_hat = self.scene.p_hat
        return not differ((p_hat * self.of.first).sum(axis=-1), (p_hat * self.scene.v).sum(axis=-1))

    @property
    def counts_samples(self) -> bool:
        """A confidence depends on the samples."""
        return differ(self.of.least, self.of.largest)

    @property
    def shared_only(self) -> bool:
        """All cells that only one technique reaches are right."""
        now = self.scene.now
        reach = (now.cells.pdf[:, now.ids(np.arange(now.n))] > 0).sum(axis=0)
        off = (abs(self.bias) > LEAST) & self.scene.support
        return len(now.cells.pdf) > 1 and bool((reach[off] > 1).all()) and bool((reach[self.scene.support] == 1).any())


def examined(estimator: Estimator, scene: Scene, known: Facts, most_leaves: int) -> Facts:
    """The facts with what changed scenes tell; `known` without."""
    tables, n = scene.now.cells, scene.now.n
    run = partial(_rerun, estimator, scene, most_leaves)
    names = [name for name in CHANGES if applies(name, tables, n)]
    left = {name: run(CHANGES[name].tables(tables, n)) for name in names}
    gone = tuple(name for name, (_, bias) in left.items() if abs(bias).max() <= LEAST)
    again = np.roll(run(renumbered(tables))[1], -1, axis=-1)
    neighbours, history = read(estimator, scene, known, most_leaves)
    return replace(
        known,
        gone=gone,
        stays=tuple(name for name, (_, bias) in left.items() if abs(bias).max() > LEAST),
        neighbours=neighbours,
        history=history,
        by_number=differ(again, known.bias),
        rates=rated_only(run, scene, known),
    )


def read(estimator: Estimator, scene: Scene, known: Facts, most_leaves: int) -> tuple[bool, bool]:
    """Whether other pixels of the frame change anything, and whether earlier frames do."""
    tables, n = scene.now.cells, scene.now.n
    run = partial(_rerun, estimator, scene, most_leaves)
    neighbours = any(_moved(run(other_pixels(tables, n, i))[0], known.of, i) for i in range(n))
    if len(tables.v) == n:
        return neighbours, False
    old = run(earlier_frames(tables, n))[0]
    return neighbours, any(_moved(old, known.of, i) for i in range(n))


def _moved(now: Moments, before: Moments, pixel: int) -> bool:
    """Whether the law of a pixel's result is another one."""
    return any(
        differ(getattr(now, name)[pixel], getattr(before, name)[pixel])
        for name in ("first", "second", "least", "largest")
    )


def rated_only(run: Callable[[Cells], tuple[Moments, Array]], scene: Scene, known: Facts) -> tuple[int, ...]:
    """Techniques whose density changes something, though no call draws from it."""
    tables = scene.now.cells
    T = len(tables.pdf)
    drawn = {t for draw in known.draws for t in techniques_of(draw, tables)}
    undrawn = [t for t in range(T) if T > 1 and t not in drawn]
    stirred = {t: run(other_density(tables, t))[0] for t in undrawn}
    return tuple(t for t, now in stirred.items() if any(_moved(now, known.of, i) for i in range(scene.now.n)))


def techniques_of(draw: Draw, tables: Cells) -> list[int]:
    """The techniques from which a call may draw in every pixel: those of any integral count."""
    mass = mass_of(tables)
    if len(draw.p) != mass.shape[-1]:
        return []
    off = np.asarray(abs(mass[:, :, None] - draw.p.T).max(axis=-1).min(axis=1).max(axis=-1))
    return [int(t) for t in np.flatnonzero(off <= LEAST)]


def _rerun(estimator: Estimator, scene: Scene, most_leaves: int, other: Cells) -> tuple[Moments, Array]:
    """Moments and bias on other tables; no numbers if it cannot be run there, which says nothing."""
    with standing_in(scene.now.cells, other), np.errstate(all="ignore"):
        try:
            found = moments(estimator, scene, most_leaves)
        except Exception:  # hazard: on a scene that it was not made for, somebody's code may fail in any way
            nothing = np.full(scene.v.shape, np.nan)
            return Moments(nothing, nothing, nothing[:, 0], nothing[:, 0], 0), nothing
        return found, bias_per_cell(found.first, scene.v, scene.support)
