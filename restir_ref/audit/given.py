"""Chance at given numbers: the code of `Live` with recorded uniform numbers in place of a generator."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import cast

import numpy as np

from restir_ref.batch import Array
from restir_ref.chance import Live


@dataclass(frozen=True)
class Numbers:
    """Recorded numbers in [0, 1), one array (N,) per draw, in place of a NumPy generator."""

    left: Iterator[Array]

    def random(self, shape: int | tuple[int, ...]) -> Array:
        """The next ones."""
        return next(self.left)


def at(u: Sequence[Array]) -> Live:
    """`Live` chance that draws the numbers u, each (N,), one per call of `choose`."""
    return Live(cast(np.random.Generator, Numbers(iter(u))))
