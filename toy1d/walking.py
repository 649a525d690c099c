"""Lines whose samples can be mutated.  [MCMC 3.2.3, 5.2.2]"""

from dataclasses import dataclass, fields

import numpy as np

from restir_ref.batch import Array
from restir_ref.chance import Chance
from restir_ref.decorrelation import Step, wrapped
from toy1d.line import Line


@dataclass(frozen=True, eq=False)
class Walking(Line):
    """A line, sampled uniformly, with mutations that step the primary sample number u = (x - low) / (high - low).

    >>> from toy1d import Walking, two_pixels, walking
    >>> isinstance(walking(two_pixels()), Walking)
    True
    """

    sigma: float = 0.02
    step: Step = wrapped

    def propose(self, index: Array, x: Array, chance: Chance) -> tuple[Array, Array]:
        """x' of u', and the ratio T(x' -> x) / T(x -> x') of the step."""
        i = index % self.n
        low, size = self.low[i], (self.high - self.low)[i]
        u, T_ratio = self.step(np.clip((x - low) / size, 0, 1), self.sigma, chance)
        return low + size * u, T_ratio


def walking(line: Line, sigma: float = 0.02, step: Step = wrapped) -> Walking:
    """The same line with mutations.

    >>> import numpy as np
    >>> from restir_ref import Live
    >>> from toy1d import two_pixels, walking
    >>> line = walking(two_pixels(), sigma=0.1)
    >>> x, ratio = line.propose(np.array([0, 1]), np.array([0.5, 0.5]), Live(np.random.default_rng(1)))
    >>> x.round(2), ratio
    (array([0.5 , 0.66]), array([1., 1.]))
    """
    same = {each.name: getattr(line, each.name) for each in fields(Line)}
    return Walking(**same, sigma=sigma, step=step)
