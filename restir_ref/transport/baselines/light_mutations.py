"""Mutations of light samples: reservoirs of ReSTIR DI move their points over the lights.  [MCMC 5.2.6]

A point steps in the numbers that draw it, so that per area the ratio T(y' -> y) / T(y -> y') is p_A(y) / p_A(y').
W is 0 behind obstacles, and a proposal there is rejected, by its one shadow ray: what is kept invariant is p_hat V.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from restir_ref.batch import Array, ratio
from restir_ref.chance import Chance
from restir_ref.decorrelation import Step, wrapped
from restir_ref.guards import positive
from restir_ref.integrals import Pixels, Shifted
from restir_ref.transport.baselines.restir_di import LightIntegrals, LightSample, visibility
from restir_ref.transport.mutations import REMEDY, SIGMA
from restir_ref.transport.rays import sample_light


@dataclass(frozen=True)
class NumberedSample(LightSample):
    """A light sample with the numbers u (d, N) that draw it: pick 1, point d-1."""

    u: Array


@dataclass(frozen=True, eq=False)
class MovingLights(LightIntegrals):
    """Direct light at given x_1, whose samples can be mutated; raises ValueError for sigma <= 0."""

    sigma: float = SIGMA
    step: Step = wrapped

    def __post_init__(self) -> None:
        positive(self.sigma, "sigma", REMEDY)

    def candidates(self, index: Array, chance: Chance) -> Iterator[tuple[NumberedSample, Array]]:
        """A point on a light that is picked by power; W = 1 / pdf_area."""
        x = self._drawn(index, chance.uniform((self.scene.space.d, len(index))))
        yield x, 1 / x.light.pdf_area

    def _drawn(self, index: Array, u: Array) -> NumberedSample:
        light = sample_light(self.scene, u[0], u[1:])
        return NumberedSample(light, self.arriving(index, light), u)

    def shift(self, x: NumberedSample, index: Array, to: Pixels) -> Shifted:  # type: ignore[override]
        """The same point lights another x_1; J = 1 in area."""
        there: MovingLights = to.of  # type: ignore[assignment]
        return Shifted(NumberedSample(x.light, there.arriving(to.index, x.light), x.u), np.ones(len(to.index)))

    def propose(self, index: Array, x: NumberedSample, chance: Chance) -> tuple[NumberedSample, Array]:
        """A point by steps of all numbers, and T(y' -> y) / T(y -> y') (N,), 0 where x_1 does not see it."""
        u, T = self.step(x.u, self.sigma, chance)
        y = self._drawn(index, u)
        T = T * ratio(x.light.pdf_area, y.light.pdf_area) * x.f.any(axis=0)
        return y, T * visibility(Pixels(self, index), y)
