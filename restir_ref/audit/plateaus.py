"""Inputs that look clamped: a pass may be consistent with them, and biased all the same."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from restir_ref.batch import Array

FEWEST = 4
"""An end that comes less often says nothing by itself, and twice only if the other end is its reciprocal."""

GRID = 2.0**10
"""Multiples of 1 / GRID are made up, or quantised: such values repeat without a clamp."""


@dataclass(frozen=True)
class Plateau:
    """A field whose largest or smallest value comes again and again, while no other does."""

    field: str
    end: str
    value: float
    times: int
    of: int

    def __str__(self) -> str:
        return (
            f"{self.field} is {self.value:.6g} in {self.times} of {self.of} places, its {self.end}, while no other "
            "value comes twice: it looks clamped before it was dumped. The pass is consistent, and biased all the "
            f"same: dump {self.field} before the clamp, and refuse a shift both ways instead of clamping it."
        )


def plateaus(found: Mapping[str, Array]) -> Iterator[Plateau]:
    """The clamps that show in J and W of shifted inputs."""
    others = found["canonical"] != 1
    for name in ("J", "W"):
        values = found[name][others]
        yield from _ends(name, values[(values > 0) & (values != 1)])


def _ends(name: str, values: Array) -> Iterator[Plateau]:
    """Both ends, if everything between them is different and no round number, and either end comes several times."""
    distinct, times = np.unique(np.round(values, 9), return_counts=True)
    inner = distinct[1:-1]
    if not inner.size or times[1:-1].max() > 1 or (inner * GRID % 1 == 0).any():
        return
    reciprocal = abs(distinct[0] * distinct[-1] - 1) <= 1e-6
    for place, end in ((-1, "largest"), (0, "smallest")):
        if times[place] >= (2 if reciprocal else FEWEST):
            yield Plateau(name, end, float(distinct[place]), int(times[place]), len(values))
