"""The only two doors of chance: `choose` an index, or draw `uniform` numbers.

Drivers hold a NumPy generator and turn it into a `Live` chance; everything below takes a `Chance`.
`restir_ref.oracle.enumeration` holds the other source: it answers `choose` with *every* option,
so the same estimator code yields exact expectations.  For that to work, calls of `choose` must
not sit inside branches that depend on sample values: every column makes the same calls.
"""

from dataclasses import dataclass
from itertools import accumulate
from typing import Protocol

import numpy as np

from restir_ref.batch import Array


class Chance(Protocol):
    """Where random decisions come from; the batch axis is last."""

    def choose(self, weights: Array) -> Array:
        """Index (N,) with P(k) = weights[k] / sum(weights), weights (K, N) >= 0; 0 where all are 0."""

    def uniform(self, shape: tuple[int, ...]) -> Array:
        """Independent uniform numbers in [0, 1) of the given shape."""


@dataclass(frozen=True)
class Live:
    """Chance from a NumPy generator: `Live(numpy.random.default_rng(seed))`."""

    rng: np.random.Generator

    def choose(self, weights: Array) -> Array:
        """Invert the running sum of the weights at one uniform number per column.

        Options of zero weight are never chosen: their running sum equals their predecessor's,
        and rounding cannot step past the last positive one.
        """
        *upto, total = accumulate(weights)  # adds rows, which is 20 times as fast as cumsum(axis=0)
        t = self.rng.random(len(total)) * total
        index = np.zeros(len(total), dtype=int)
        for passed in upto:
            index += (passed <= t) & (passed < total)
        return index

    def uniform(self, shape: tuple[int, ...]) -> Array:
        """Independent uniform numbers in [0, 1)."""
        return self.rng.random(shape)
