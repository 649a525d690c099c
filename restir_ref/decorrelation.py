"""Metropolis-Hastings mutations between temporal and spatial reuse decorrelate neighbours.  [MCMC 3.2]

Integrals that can be mutated have one more method,
`propose(index, x, chance) -> (x', T(x' -> x) / T(x -> x'))`.
"""

from typing import Protocol

import numpy as np

from restir_ref.batch import Array, ratio, where
from restir_ref.chance import Chance
from restir_ref.integrals import Integrals, Pixels, Reservoirs, Sample, target


class Mutable(Integrals, Protocol):
    """Integrals whose samples can be mutated."""

    def propose(self, index: Array, x: Sample, chance: Chance) -> tuple[Sample, Array]:
        """A proposal x' and the ratio T(x' -> x) / T(x -> x') of its transition densities (N,)."""


def mutate(X: Reservoirs, here: Pixels, chance: Chance) -> Reservoirs:
    """One Metropolis-Hastings step that leaves p_hat invariant.  [MCMC 3.2.1, 3.2.4]

    a = min(1, p_hat(x') T(x' -> x) / (p_hat(x) T(x -> x')));  if accepted W <- W p_hat(x) / p_hat(x').
    """
    of: Mutable = here.of  # type: ignore[assignment]
    proposal, T_ratio = of.propose(here.index, X.x, chance)
    p_hat, p_hat_new = target(here, X.x), target(here, proposal)
    a = np.minimum(1, ratio(p_hat_new * T_ratio, p_hat))
    accepted = chance.choose(np.stack([1 - a, a])) == 1
    W = np.where(accepted, X.W * ratio(p_hat, p_hat_new), X.W)
    return Reservoirs(where(accepted, proposal, X.x), W, X.c)
