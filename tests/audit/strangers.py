"""Estimators as strangers write them: one right, the others with one thing wrong, or not auditable at all."""

from collections.abc import Callable
from typing import Any

import numpy as np

from restir_ref.batch import Array, ratio
from restir_ref.integrals import Pixels, Reservoirs
from restir_ref.oracle.scenes import reference_scene
from restir_ref.restir import initial

SCENE = reference_scene()
FRAME = SCENE.now


def reuse(weigh: Callable[[Array, Array, Array], Array]) -> Callable[[Array, Any], Reservoirs]:
    """Both pixels share their samples, by hand; weigh(p, q, J) -> m of one's own, or the other's sample.

    p is the target here, q p_hat_from the pixel that the sample is not from, in its measure.
    """

    def estimator(index: Array, chance: Any) -> Reservoirs:
        here, near = Pixels(FRAME, index), Pixels(FRAME, index ^ 1)
        X = initial(here, chance)
        y = FRAME.shift(X.x[near.index], near.index, here)
        back = FRAME.shift(X.x, index, near)
        own, other = FRAME.target(index, X.x), FRAME.target(index, y.x)
        q_own = FRAME.target(near.index, back.x) * back.J
        q_other = ratio(FRAME.target(near.index, X.x[near.index]), y.J)
        w = np.stack(
            [own * X.W * weigh(own, own, q_own), other * X.W[near.index] * y.J * weigh(q_other, other, q_other)]
        )
        s = chance.choose(w)
        return Reservoirs(np.where(s == 0, X.x, y.x), ratio(w.sum(axis=0), np.where(s == 0, own, other)), X.c)

    return estimator


right = reuse(lambda mine, p, q: ratio(mine, p + q))
one_over_M = reuse(lambda mine, p, q: np.full(p.shape, 0.5))


# ---------------------------------------------------------------- not auditable


def lazy(index: Array, chance: Any) -> Reservoirs:
    """Always the first cell."""
    return Reservoirs(np.zeros(len(index), dtype=int), np.ones(len(index)), np.ones(len(index)))


def own_dice(index: Array, chance: Any) -> Reservoirs:
    """Draws from a generator of its own."""
    x = np.random.default_rng().integers(4, size=len(index))
    return Reservoirs(x, 4 * FRAME.cells.v[FRAME.ids(index), x], np.ones(len(index)))


def partly_own_dice(index: Array, chance: Any) -> Reservoirs:
    """Draws candidates through the chance, selects by a generator of its own."""
    X = initial(Pixels(FRAME, index), chance)
    keep = np.random.default_rng().random(len(index)) < 0.5
    return Reservoirs(X.x, np.where(keep, 2 * X.W, 0), X.c)


def counting_runs() -> Callable[[Array, Any], Reservoirs]:
    """Keeps history between calls."""
    runs: list[int] = []

    def estimator(index: Array, chance: Any) -> Reservoirs:
        runs.append(1)
        X = initial(Pixels(FRAME, index), chance)
        return Reservoirs(X.x, X.W * len(runs), X.c)

    return estimator


def uniform(index: Array, chance: Any) -> Reservoirs:
    """Draws a continuous number."""
    x = (4 * chance.uniform(index.shape)).astype(int)
    return Reservoirs(x, np.ones(len(index)), np.ones(len(index)))


def until_lit(index: Array, chance: Any) -> Reservoirs:
    """Draws again as long as a sample is dark."""
    here = Pixels(FRAME, index)
    X = initial(here, chance)
    if (X.W == 0).any():
        X = initial(here, chance)
    return X


def batch_mean(index: Array, chance: Any) -> Reservoirs:
    """Normalises by the mean over the batch."""
    X = initial(Pixels(FRAME, index), chance)
    return Reservoirs(X.x, X.W / X.W.mean(), X.c)


def returning(change: Callable[[Reservoirs], Any]) -> Callable[[Array, Any], Any]:
    """Initial samples, returned in some other way."""
    return lambda index, chance: change(initial(Pixels(FRAME, index), chance))


def odd_weights(shape: Callable[[int], tuple[int, ...]]) -> Callable[[Array, Any], Any]:
    """Asks for weights of some shape."""

    def estimator(index: Array, chance: Any) -> Reservoirs:
        x = chance.choose(np.ones(shape(len(index))))
        return Reservoirs(x, np.ones(len(index)), np.ones(len(index)))

    return estimator


def transposed(index: Array, chance: Any) -> Reservoirs:
    """Weights (N, K) where (K, N) is meant."""
    return odd_weights(lambda n: (n, 4))(index, chance)


UNAUDITABLE = {
    "asks nothing": (lazy, "deterministic", "select through it"),
    "its own randomness": (own_dice, "randomness of its own", "select through it"),
    "its own randomness beside the chance": (partly_own_dice, "two runs with the same choices", "start every run anew"),
    "state": (counting_runs(), "two runs with the same choices differ", "start every run anew"),
    "continuous numbers": (uniform, "calls uniform", "draw by choose()"),
    "calls that depend on samples": (until_lit, "number of calls depends on samples", "for all columns"),
    "other columns": (batch_mean, "beside other lanes", "independent replicas"),
    "transposed weights": (transposed, "weights of shape (128, 4)", "(options, columns)"),
    "too few columns": (odd_weights(lambda n: (4, n // 2)), "weights of shape (4, 64)", "one column per entry"),
    "flat weights": (odd_weights(lambda n: (n,)), "weights of shape (128,)", "one column per entry"),
    "a tuple": (returning(lambda X: (X.x, X.W)), "returns tuple", "return Reservoirs"),
    "a mean": (returning(lambda X: Reservoirs(X.x, X.W.mean(), X.c)), "weights W have shape ()", "one each"),
    "too few samples": (returning(lambda X: Reservoirs(X.x[1:], X.W, X.c)), "samples x have shape (127,)", "one each"),
    "floats for cells": (returning(lambda X: Reservoirs(X.x * 1.0, X.W, X.c)), "float64", "cells 0 .. 3"),
    "cells beyond the last": (returning(lambda X: Reservoirs(X.x + 1, X.W, X.c)), "some are not", "cells 0 .. 3"),
    "negative cells": (returning(lambda X: Reservoirs(X.x - 1, X.W, X.c)), "some are not", "cells 0 .. 3"),
    "NaN": (returning(lambda X: Reservoirs(X.x, np.where(X.W > 0, X.W, np.nan), X.c)), "one is nan", "null samples"),
    "complex weights": (returning(lambda X: Reservoirs(X.x, X.W * 1j, X.c)), "complex128", "real numbers"),
}  # fmt: skip
