"""Stand-ins: chances that answer by script, and integrals with one thing replaced."""

from collections.abc import Iterator
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np

from restir_ref.batch import Array
from restir_ref.chance import Chance, Live
from restir_ref.integrals import Pixels, Reservoirs, Sample, Shifted


def live(seed: int = 1) -> Live:
    """A live chance of this seed."""
    return Live(np.random.default_rng(seed))


def same_bits(X: Reservoirs, Y: Reservoirs) -> bool:
    """Whether reservoirs whose samples are arrays hold the same numbers."""
    return all((getattr(X, each.name) == getattr(Y, each.name)).all() for each in fields(Reservoirs))


@dataclass(frozen=True)
class Always:
    """Chance that always chooses option `s`, and keeps the weights it was asked with."""

    s: int = 0
    asked: list[Array] = field(default_factory=list)

    def choose(self, weights: Array) -> Array:
        self.asked.append(weights)
        return np.full(weights.shape[-1], self.s)

    def uniform(self, shape: tuple[int, ...]) -> Array:
        return np.full(shape, 0.5)


@dataclass(frozen=True)
class Constantly:
    """A generator that always draws the same u."""

    u: float

    def random(self, shape: Any) -> Array:
        return np.full(shape, self.u)


@dataclass(frozen=True, eq=False)
class Wrapped:
    """Integrals that do what others do; subclasses replace one thing."""

    of: Any

    @property
    def n(self) -> int:
        return int(self.of.n)

    def candidates(self, index: Array, chance: Chance) -> Iterator[tuple[Sample, Array]]:
        yield from self.of.candidates(index, chance)

    def target(self, index: Array, x: Sample) -> Array:
        return self.of.target(index, x)

    def contribution(self, index: Array, x: Sample) -> Array:
        return self.of.contribution(index, x)

    def shift(self, x: Sample, index: Array, to: Pixels) -> Shifted:
        return self.of.shift(x, index, Pixels(to.of.of, to.index))
