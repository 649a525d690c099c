"""Enumerate all outcomes of unchanged, batched estimator code.

A *program* is estimator code `program(index, chance)` over columns.  All its discrete chance goes
through `chance.choose`.  The enumerating chance replays recorded answers for a batch of *lanes*
(column = lane * n + pixel).  At the first call without an answer it is handed the weights, splits
every lane into one lane per combination of its pixels' non-zero options, and runs the program
again.  Exact up to rounding; with `fractions.Fraction` arrays, exact.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Generic, TypeVar

import numpy as np

from restir_ref.batch import Array, ratio

Result = TypeVar("Result")
Program = Callable[[Array, "Enumerating"], Result]

LANES_AT_ONCE = 500_000
"""Lanes run in one batch; a larger frontier is split and finished depth first."""

MOST_LEAVES = 20_000_000
"""Enumerations beyond this many leaves are refused."""


class Unanswered(Exception):
    """A program asked for a choice not answered yet; its weights are (K, lanes * n)."""

    def __init__(self, weights: Array) -> None:
        super().__init__("an enumerated program was caught short; run it through outcomes()")
        self.weights = weights


@dataclass
class Enumerating:
    """Chance that replays `answers`, one array (lanes, n) per call of `choose`."""

    answers: list[Array]
    calls: int = field(default=0)

    def choose(self, weights: Array) -> Array:
        """The recorded answer of this call; raises `Unanswered` to have the lanes expanded."""
        self.calls += 1
        if self.calls > len(self.answers):
            raise Unanswered(weights)
        return self.answers[self.calls - 1].reshape(-1)

    def uniform(self, shape: tuple[int, ...]) -> Array:
        """Refused: a continuous number has no finite list of outcomes."""
        raise TypeError("uniform() cannot be enumerated: draw by choose() over finite cells, or use a Live chance.")


@dataclass(frozen=True)
class Lanes:
    """A batch of partial histories: answers per call (lanes, n), probability (lanes,)."""

    answers: list[Array]
    probability: Array

    def __len__(self) -> int:
        return len(self.probability)


@dataclass(frozen=True)
class Outcome(Generic[Result]):
    """Results of finished lanes, columns lane * n + pixel, and each lane's probability (lanes,)."""

    result: Result
    probability: Array

    def per_column(self, n: int) -> Array:
        """The probability of each column's lane, (lanes * n,)."""
        return np.repeat(self.probability, n)


def outcomes(program: Program[Result], n: int, most_leaves: int = MOST_LEAVES) -> Iterator[Outcome[Result]]:
    """Yield all outcomes of a program over n columns; their probabilities sum to 1.

    Raises ValueError when more than `most_leaves` lanes are open or done, TypeError when the
    program draws continuous numbers.
    """
    open_lanes, leaves = [Lanes([], np.ones(1, dtype=int))], 0
    while open_lanes:
        lanes = open_lanes.pop()
        try:
            result = program(np.arange(len(lanes) * n), Enumerating(lanes.answers))
        except Unanswered as question:
            open_lanes += _split(_expand(lanes, question.weights, n))
        else:
            leaves += len(lanes)
            yield Outcome(result, lanes.probability)
        _refuse_beyond(most_leaves, leaves + sum(map(len, open_lanes)))


def _refuse_beyond(most_leaves: int, leaves: int) -> None:
    if leaves > most_leaves:
        raise ValueError(
            f"this enumeration has at least {leaves} leaves, more than the limit of {most_leaves}: "
            "take fewer pixels, cells or passes, or raise most_leaves."
        )


def _expand(lanes: Lanes, weights: Array, n: int) -> Lanes:
    """Split every lane into the product over its pixels of their options of non-zero probability."""
    probability = _probabilities(weights).reshape(len(weights), len(lanes), n)
    parent, weight = np.arange(len(lanes)), lanes.probability
    chosen: list[Array] = []
    for pixel in range(n):
        options = probability[:, parent, pixel]
        row, answer = np.nonzero(options.T)
        chosen = [*(earlier[row] for earlier in chosen), answer]
        parent, weight = parent[row], weight[row] * options[answer, row]
    return Lanes([*(answers[parent] for answers in lanes.answers), np.stack(chosen, axis=-1)], weight)


def _probabilities(weights: Array) -> Array:
    """P(k) per column, (K, N); option 0 where all weights are 0, as `Live.choose` has it."""
    p = ratio(weights, weights.sum(axis=0))
    p[0] = np.where(weights.sum(axis=0) == 0, 1, p[0])
    return p


def _split(lanes: Lanes) -> list[Lanes]:
    """Cut a frontier that is too long for one batch."""
    cuts = range(0, len(lanes), LANES_AT_ONCE)
    return [
        Lanes([a[k : k + LANES_AT_ONCE] for a in lanes.answers], lanes.probability[k : k + LANES_AT_ONCE]) for k in cuts
    ]
