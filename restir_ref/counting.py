"""Integrals that count how often they are asked: cost in shifts and targets, whatever the machine.

The count is the one thing here that changes; it belongs to the caller, who passes it in.
"""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field

from restir_ref.batch import Array
from restir_ref.chance import Chance
from restir_ref.integrals import Image, Pixels, Sample, Shifted


@dataclass(frozen=True, eq=False)
class Counting:
    """The same image; asked["shift"] and asked["target"] count columns."""

    of: Image
    asked: Counter[str] = field(default_factory=Counter)

    @property
    def n(self) -> int:
        """Number of pixels."""
        return self.of.n

    def candidates(self, index: Array, chance: Chance) -> Iterator[tuple[Sample, Array]]:
        """The same candidates."""
        return self.of.candidates(index, chance)

    def target(self, index: Array, x: Sample) -> Array:
        """p_hat_i(x), counted."""
        self.asked["target"] += len(index)
        return self.of.target(index, x)

    def contribution(self, index: Array, x: Sample) -> Array:
        """f_i(x)."""
        return self.of.contribution(index, x)

    def shift(self, x: Sample, index: Array, to: Pixels) -> Shifted:
        """T(x), counted, into the image that `to` counts for."""
        self.asked["shift"] += len(index)
        there: Counting = to.of  # type: ignore[assignment]
        return self.of.shift(x, index, Pixels(there.of, to.index))
