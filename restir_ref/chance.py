"""The only two doors of chance: `choose` an index, or draw `uniform` numbers.

Drivers hold a NumPy generator and turn it into a `Live` chance; everything below takes a `Chance`.
`restir_ref.oracle.enumeration` holds the other source: it answers `choose` with *every* option,
so the same estimator code yields exact expectations.  For that to work, calls of `choose` must
not sit inside branches that depend on sample values: every column makes the same calls.
"""

from collections import Counter
from dataclasses import dataclass
from itertools import accumulate
from typing import Protocol

import numpy as np

from restir_ref.batch import Array


class Chance(Protocol):
    """Where random decisions come from; the batch axis is last.

    >>> import numpy as np
    >>> from restir_ref import Chance, Live
    >>> def coin(chance: Chance, n: int):
    ...     return chance.choose(np.ones((2, n)))
    >>> coin(Live(np.random.default_rng(1)), 5)
    array([1, 1, 0, 1, 0])
    """

    def choose(self, weights: Array) -> Array:
        """Index (N,) with P(k) = weights[k] / sum(weights), weights (K, N) >= 0; 0 where all are 0."""

    def uniform(self, shape: tuple[int, ...]) -> Array:
        """Independent uniform numbers in [0, 1) of the given shape."""


@dataclass(frozen=True)
class Live:
    """Chance from a NumPy generator: `Live(numpy.random.default_rng(seed))`.

    >>> import numpy as np
    >>> from restir_ref import Live
    >>> chance = Live(np.random.default_rng(1))
    >>> chance.choose(np.array([[1.0, 0.0, 3.0], [1.0, 2.0, 0.0]]))  # three columns, two options
    array([1, 1, 0])
    >>> chance.uniform((2,)).round(3)
    array([0.949, 0.312])
    """

    rng: "np.random.Generator | Columns"

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


ROWS = "rows"
AT_ONCE = 2**16
"""Numbers that are dropped at once where a generator cannot jump."""


@dataclass(frozen=True, eq=False)
class Columns:
    """A generator of which only the columns `at` of every row of n numbers are seen; drawn[ROWS] counts rows.

    So the columns of a window get the numbers that they would get among all n.
    """

    rng: np.random.Generator
    at: slice
    n: int
    drawn: Counter[str]

    def random(self, shape: int | tuple[int, ...]) -> Array:
        """Uniform numbers in [0, 1), (.., columns of the window).  Raises ValueError for rows of another width."""
        found, width = np.empty(shape), self.at.stop - self.at.start
        if found.shape[-1:] != (width,):
            raise ValueError(
                f"a window of {width} columns was asked for numbers of shape {found.shape}: ask for one per column, "
                f"with the batch axis last."
            )
        for row in found.reshape(-1, width):
            _jump(self.rng, self.at.start)
            self.rng.random(out=row)
            _jump(self.rng, self.n - self.at.stop)
            self.drawn[ROWS] += 1
        return found


def skip(rng: np.random.Generator, count: int) -> None:
    """Leave out so many numbers of `random`, and keep the half number that a jump forgets and drawing does not."""
    bits = rng.bit_generator
    half = {name: value for name, value in bits.state.items() if name in ("has_uint32", "uinteger")}
    _jump(rng, count)
    bits.state = {**bits.state, **half}


def _jump(rng: np.random.Generator, count: int) -> None:
    """At once where a number is one step of the generator; else by drawing."""
    bits = rng.bit_generator
    if isinstance(bits, np.random.PCG64 | np.random.PCG64DXSM):
        bits.advance(count)
        return
    for at in range(0, count, AT_ONCE):
        rng.random(min(AT_ONCE, count - at))
