"""What must hold before an estimator can be enumerated, tried out on a few dozen fixed sequences of choices.

An estimator is a function of `index` and of the answers of `chance.choose`, of nothing else, and one
replica (*lane*) of the scene's pixels knows nothing of the others.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from restir_ref.audit.given import at
from restir_ref.batch import Array
from restir_ref.integrals import Reservoirs
from restir_ref.oracle.enumeration import scattered

Estimator = Callable[[Array, Any], Reservoirs]
"""estimator(index, chance): samples and weights of the columns index = lane * n + pixel."""

TOGETHER, ALONE = 64, 16
"""Lanes rehearsed in one batch, and how many of them again one by one."""


class CannotAudit(ValueError):
    """Nothing exact can be said about this estimator; the message says why, and what to change."""


@dataclass
class Rehearsing:
    """Chance that answers each lane with its own fixed numbers, and writes down what it was asked."""

    lanes: Array
    n: int
    asked: list[Array] = field(default_factory=list)

    def choose(self, weights: Array) -> Array:
        """Options at the lanes' numbers for this call."""
        column = (self.lanes[:, None] * self.n + np.arange(self.n)).reshape(-1)
        if np.ndim(weights) != 2 or np.shape(weights)[-1] != len(column):
            raise CannotAudit(
                f"call {len(self.asked) + 1} of choose() has weights of shape {np.shape(weights)}, but there are "
                f"{len(column)} columns: weights are (options, columns), one column per entry of index."
            )
        self.asked.append(np.array(weights))
        return at([scattered(column, len(self.asked))]).choose(weights)

    def uniform(self, shape: tuple[int, ...]) -> Array:
        """Refused."""
        raise CannotAudit(
            f"the estimator calls uniform({shape}), a continuous number with no finite list of outcomes: "
            "draw by choose() over the cells of the finite scene, as its candidates() do."
        )


@dataclass(frozen=True)
class Take:
    """One run of a rehearsal: the weights asked in every call, samples x and weights W (N,)."""

    asked: list[Array]
    x: Array
    W: Array


def rehearse(estimator: Estimator, cells: Array) -> list[Array]:
    """The weights that choose() is asked, (options, lanes n) per call.

    Raises CannotAudit if the estimator is no function of index and choices, or of the wrong shape.

    `cells` (n, K) shows the numbers of pixels and cells.
    """
    first, second = (_take(estimator, np.arange(TOGETHER), cells) for _ in range(2))
    repeats = np.array_equal(first.x, second.x) and np.array_equal(first.W, second.W)
    if not first.asked:
        raise CannotAudit(_ASKS_NOTHING.format("is deterministic" if repeats else "uses randomness of its own"))
    if not (repeats and _same_weights(first, second)):
        raise CannotAudit(
            "two runs with the same choices differ: the estimator keeps a state or uses randomness of its own; "
            "draw everything through the given chance, and start every run anew."
        )
    for lane in range(ALONE):
        _compare(_take(estimator, np.array([lane]), cells), first, lane)
    return first.asked


_ASKS_NOTHING = (
    "the estimator never calls choose() and {}: it ignores the given chance; draw samples and select "
    "through it, or nothing can be enumerated."
)


def checked(X: Reservoirs, N: int, K: int) -> Reservoirs:
    """X, if it holds N cells below K with N finite weights; raises CannotAudit naming what is wrong."""
    if not (hasattr(X, "x") and hasattr(X, "W")):
        raise CannotAudit(
            f"the estimator returns {type(X).__name__}, without samples x and weights W: return Reservoirs(x, W, c)."
        )
    x, W = np.asarray(X.x), np.asarray(X.W)
    for name, values in (("samples x", x), ("weights W", W)):
        if values.shape != (N,):
            raise CannotAudit(f"the {name} have shape {values.shape}, but there are {N} columns: return one each.")
    if x.dtype.kind not in "iu" or (N and not (x.min() >= 0 and x.max() < K)):
        raise CannotAudit(f"the samples x must be cells 0 .. {K - 1}, but some are not: {x.dtype} {x[:8]}.")
    if W.dtype.kind not in "iuf":
        raise CannotAudit(f"the weights W must be real numbers, but they are {W.dtype}.")
    if not np.isfinite(W).all():
        raise CannotAudit(
            f"the weights W must be finite, but one is {W[~np.isfinite(W)][0]}: mind 0 / 0 of null samples."
        )
    return X


def _take(estimator: Estimator, lanes: Array, cells: Array) -> Take:
    n, K = cells.shape
    chance = Rehearsing(lanes, n)
    X = checked(estimator(np.arange(len(lanes) * n), chance), len(lanes) * n, K)
    return Take(chance.asked, np.asarray(X.x), np.asarray(X.W))


def _same_weights(a: Take, b: Take) -> bool:
    return len(a.asked) == len(b.asked) and all(map(np.array_equal, a.asked, b.asked))


def _compare(alone: Take, together: Take, lane: int) -> None:
    """One lane on its own does what it does beside the others."""
    if len(alone.asked) != len(together.asked):
        raise CannotAudit(
            f"{TOGETHER} lanes together call choose() {len(together.asked)} times, but lane {lane} alone calls it "
            f"{len(alone.asked)} times: the number of calls depends on samples; call choose() for all columns, "
            "and use its answers where they are needed."
        )
    n = len(alone.x)
    mine = slice(lane * n, (lane + 1) * n)
    same = np.array_equal(alone.x, together.x[mine]) and np.allclose(alone.W, together.W[mine], rtol=1e-9, atol=0)
    if not same:
        raise CannotAudit(
            f"lane {lane} alone gives samples {alone.x} with weights {alone.W}, but {together.x[mine]} with "
            f"{together.W[mine]} beside other lanes: columns are independent replicas, so never sum or index across "
            "them but within index - index % n + pixel."
        )
