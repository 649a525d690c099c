"""Enumerate all outcomes of unchanged, batched estimator code.

A *program* is estimator code `program(index, chance)` over columns.  All its discrete chance goes
through `chance.choose`.  The enumerating chance replays recorded answers for a batch of *lanes*
(column = lane * n + pixel).  At the first call without an answer it is handed the weights, splits
every lane into one lane per combination of its pixels' non-zero options, and runs the program
again.  Exact up to rounding; with `fractions.Fraction` arrays, exact.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Generic, TypeVar

import numpy as np

from restir_ref.batch import Array, ratio
from restir_ref.guards import nonnegative

Result = TypeVar("Result")
Program = Callable[[Array, "Enumerating"], Result]

LANES_AT_ONCE = 500_000
"""Lanes run in one batch; a larger frontier is split and finished depth first."""

MOST_LEAVES = 20_000_000
"""Enumerations beyond this many leaves are refused."""

DIVES = 1000
"""Lanes followed down to a leaf to estimate how many leaves there are."""


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
            return self.unanswered(weights)
        return self.answers[self.calls - 1].reshape(-1)

    def unanswered(self, weights: Array) -> Array:
        """What to do about a call that has no answer yet."""
        raise Unanswered(weights)

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

    Raises ValueError when there are more than `most_leaves`, with an estimate of how many there are,
    and where calls of `choose` do not fit the columns or each other; TypeError when the program
    draws continuous numbers.

    >>> import numpy as np
    >>> from restir_ref.oracle.enumeration import outcomes
    >>> def two_coins(index, chance):
    ...     return chance.choose(np.ones((2, len(index)))) + chance.choose(np.ones((2, len(index))))
    >>> for each in outcomes(two_coins, 1):
    ...     print(each)
    Outcome(result=array([0, 1, 1, 2]), probability=array([0.25, 0.25, 0.25, 0.25]))
    """
    open_lanes, leaves = [Lanes([], np.ones(1, dtype=int))], 0
    while open_lanes:
        lanes = open_lanes.pop()
        chance = Enumerating(lanes.answers)
        try:
            result = program(np.arange(len(lanes) * n), chance)
        except Unanswered as question:
            _check_weights(question.weights, len(lanes) * n)
            new = _combinations(question.weights, n).sum()
            least = leaves + sum(map(len, open_lanes)) + new
            if least > most_leaves or new > 100 * DIVES:
                _refuse(least, most_leaves, leaves + _estimate(program, [lanes, *open_lanes], n))
            open_lanes += _split(_expand(lanes, question.weights, n))
        else:
            _check_calls(chance)
            leaves += len(lanes)
            yield Outcome(result, lanes.probability)


def _refuse(least: float, limit: int, estimate: float) -> None:
    """Stop in time: at once beyond the limit, earlier if the estimate is beyond twice the limit."""
    if least > limit:
        raise ValueError(
            f"this enumeration has at least {least:.7g} leaves, more than the limit of {limit}, and probably about "
            f"{max(estimate, least):.2g} in all: take fewer pixels, cells or passes, or raise most_leaves."
        )
    if estimate > 2 * limit:
        raise ValueError(
            f"this enumeration would have about {estimate:.2g} leaves, judging by its branching so far, more than the "
            f"limit of {limit}: take fewer pixels, cells or passes, or raise most_leaves."
        )


def _check_calls(chance: Enumerating) -> None:
    """The program has asked again what it was asked before."""
    if chance.calls < len(chance.answers):
        raise ValueError(
            f"after {len(chance.answers)} calls of choose() were answered the program made only {chance.calls}: "
            "the number of calls must not depend on samples, so call choose() outside of such branches and loops."
        )


def _check_weights(weights: Array, N: int) -> None:
    """Raise ValueError for weights that are not (K, N), finite and >= 0."""
    if weights.ndim != 2 or weights.shape[-1] != N:
        raise ValueError(
            f"choose() was given weights of shape {weights.shape}, but there are {N} columns: "
            "weights are (options, columns), and every column takes part in every call."
        )
    nonnegative(weights, "a weight of choose()", "An option is chosen with probability weight / sum over options.")


def _combinations(weights: Array, n: int) -> Array:
    """Into how many lanes each lane splits: the product over its pixels of their options, (lanes,)."""
    with np.errstate(over="ignore"):
        return np.asarray(np.minimum(_options(weights).reshape(-1, n).prod(axis=1, dtype=float), 1e300))


def _options(weights: Array) -> Array:
    """How many options each column has, (N,); at least one, as all-zero weights choose option 0."""
    return np.asarray(np.maximum((weights != 0).sum(axis=0), 1))


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


# ---------------------------------------------------------------- how many leaves there will be


@dataclass
class Diving(Enumerating):
    """Chance that goes on at random where the answers end, and multiplies up the options it had; below (lanes,)."""

    below: Array = field(default_factory=lambda: np.ones(1))

    def unanswered(self, weights: Array) -> Array:
        """One of the options of non-zero weight, all alike."""
        with np.errstate(over="ignore"):
            self.below = self.below * _combinations(weights, weights.shape[-1] // len(self.below))
        wanted = np.floor(scattered(np.arange(weights.shape[-1]), self.calls) * _options(weights))
        return np.asarray((np.cumsum(weights != 0, axis=0) > wanted).argmax(axis=0))


def _estimate(program: Program[Result], frontier: Sequence[Lanes], n: int) -> float:
    """Leaves below a frontier: the mean product of the options along random dives, Knuth's size of a search tree."""
    return sum(len(lanes) * _mean_below(program, lanes, n) for lanes in frontier)


def _mean_below(program: Program[Result], lanes: Lanes, n: int) -> float:
    """Mean number of leaves below a lane, from DIVES dives spread over the lanes."""
    start = np.arange(DIVES) * len(lanes) // DIVES
    diving = Diving([answers[start] for answers in lanes.answers], below=np.ones(DIVES))
    program(np.arange(DIVES * n), diving)
    return float(diving.below.mean())


def scattered(column: Array, call: int) -> Array:
    """A fixed number in [0, 1) for every column (N,) and call that looks random: SplitMix64 of both."""
    z = column.astype(np.uint64) * np.uint64(0x9E3779B97F4A7C15) + np.uint64(call * 0xD1B54A32D192ED03 % 2**64)
    for shift, factor in ((30, 0xBF58476D1CE4E5B9), (27, 0x94D049BB133111EB)):
        z = (z ^ (z >> np.uint64(shift))) * np.uint64(factor)
    return np.asarray(((z ^ (z >> np.uint64(31))) >> np.uint64(11)) * 2.0**-53)
