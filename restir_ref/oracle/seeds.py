"""Random numbers that coincide: passes or pixels whose seeds collide draw one and the same number u.

What is known of u after each answer is an interval, and the next answer is drawn given that: exact, without steps.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from restir_ref.batch import Array, ratio
from restir_ref.chance import Chance

Key = Callable[[int, int], int]
"""key(call, pixel): calls and pixels with the same key draw the same number."""

ROUNDING = 1e-14
"""Options that are not longer are none."""


@dataclass
class Seeds:
    """Chance for n pixels in which call k (from 0) of pixel p draws the number of key(k, p).

    `Seeds(chance, 2, lambda k, p: p + k)` is a hash in which the second pass of a pixel repeats the first of the next
    one; `lambda k, p: p` never advances its generator.  Make a new one in every run of an estimator.
    """

    chance: Chance
    n: int
    key: Key
    calls: int = 0
    known: dict[int, tuple[Array, Array]] = field(default_factory=dict)

    def choose(self, weights: Array) -> Array:
        """Where u lies in the running sum of the weights, given all answers so far; one pixel after the other."""
        pixel = np.arange(weights.shape[1]) % self.n
        s = np.zeros(weights.shape[1], dtype=int)
        for p in range(self.n):
            s = np.where(pixel == p, self._answered(weights, pixel == p, self.key(self.calls, p)), s)
        self.calls += 1
        return s

    def uniform(self, shape: tuple[int, ...]) -> Array:
        """Passes through: only choices share numbers."""
        return self.chance.uniform(shape)

    def _answered(self, weights: Array, mine: Array, key: int) -> Array:
        """The answers of one pixel's columns; what they say of u holds for their lanes."""
        lanes = int(mine.sum())
        start, stop = self.known.get(key, (np.zeros(lanes), np.ones(lanes)))
        upto = np.cumsum(ratio(weights, weights.sum(axis=0)), axis=0)[:, mine]
        edges = np.concatenate([np.zeros((1, lanes)), upto])
        low, high = np.clip(edges[:-1], start, stop), np.clip(edges[1:], start, stop)
        options = np.zeros(weights.shape)
        options[:, mine] = np.where(high - low > ROUNDING, high - low, 0)
        s = self.chance.choose(options)
        column, chosen = np.arange(lanes), s[mine]
        null = weights[:, mine].sum(axis=0) == 0
        self.known[key] = (
            np.where(null, start, low[chosen, column]),
            np.where(null, stop, high[chosen, column]),
        )
        return s
