"""Metropolis-Hastings mutations between temporal and spatial reuse decorrelate neighbours.  [MCMC 3.2, 4.2]

Integrals that can be mutated have one more method,
`propose(index, x, chance) -> (x', T(x' -> x) / T(x -> x'))`.  Those whose proposals need something of x that no
mutation changes have another, `standing(X, index)`: integrals that know it, for the mutations of one pass.

    passes = replace(WHOLE, mutation=mutations(5))     a frame with five mutations per pixel, see `loop.frame`
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Protocol

import numpy as np
from scipy.special import ndtri

from restir_ref.batch import Array, ratio, total, where
from restir_ref.chance import Chance
from restir_ref.guards import apart, nonnegative, positive, read_only, whole
from restir_ref.integrals import Integrals, Pixels, Reservoirs, Sample, target, weighted


class Mutable(Integrals, Protocol):
    """Integrals whose samples can be mutated."""

    def propose(self, index: Array, x: Sample, chance: Chance) -> tuple[Sample, Array]:
        """A proposal x' and the ratio T(x' -> x) / T(x -> x') of its transition densities (N,).

        The ratio 0 says that x' is invalid: it is rejected, and the step counts all the same.
        """


@dataclass(frozen=True, eq=False)
class Move:
    """A proposal x -> x_new for reservoirs X, with p_hat(x), p_hat(x') and T(x' -> x) / T(x -> x'), each (N,)."""

    here: Pixels
    X: Reservoirs
    x_new: Sample
    p_hat: Array
    p_hat_new: Array
    T_ratio: Array


Acceptance = Callable[[Move], Array]
"""The probability a (N,) that a move is made."""


def metropolis(move: Move) -> Array:
    """a = min(1, p_hat(x') T(x' -> x) / (p_hat(x) T(x -> x'))).  [MCMC 3.2.1]"""
    # erratum: the printed a lacks the minimum, and is no probability above 1.  Compared with a uniform u < a it
    # needs none, since u < 1; where a itself counts, as in detailed balance, in `choose` or in expectations, it does.
    return ratio(np.minimum(move.p_hat_new * move.T_ratio, move.p_hat), move.p_hat)


def mutate(X: Reservoirs, here: Pixels, chance: Chance, acceptance: Acceptance = metropolis) -> Reservoirs:
    """One Metropolis-Hastings step that leaves p_hat invariant; k steps are k calls.  [MCMC 3.2]

    >>> import numpy as np
    >>> from restir_ref import Live, Pixels, initial, shade
    >>> from restir_ref.decorrelation import mutate
    >>> from toy1d import two_pixels, walking
    >>> here, chance = Pixels(walking(two_pixels()), np.arange(20_000)), Live(np.random.default_rng(1))
    >>> X = initial(here, chance, M=4)
    >>> Y = mutate(X, here, chance)
    >>> bool(np.allclose(shade(X, here), shade(Y, here))), float((X.x != Y.x).mean().round(2))
    (True, 0.96)
    """
    return attempt(X, here, chance, acceptance)[0]


def attempt(X: Reservoirs, here: Pixels, chance: Chance, acceptance: Acceptance) -> tuple[Reservoirs, Array]:
    """Propose x'; where accepted, X <- x' and W <- W p_hat(x) / p_hat(x'): p_hat W stays.  [MCMC 3.2.4]

    Null samples, W = 0, stay where they are.  Returns the reservoirs and where the proposal was accepted (N,).
    """
    # erratum: the prose of 5.2.4 turns the ratio of W upside down, unlike 3.2.4 and Alg. 6; and Alg. 3
    # forgets all accepted moves if the last proposal is rejected.
    of: Mutable = mutable(here.of)
    x_new, T_ratio = of.propose(here.index, read_only(X.x), chance)
    nonnegative(T_ratio, "the ratio T(x' -> x) / T(x -> x')", "Return 0 for an invalid proposal from propose().")
    move = Move(here, X, x_new, target(here, X.x), target(here, x_new), T_ratio)
    apart(move.p_hat, move.p_hat_new, "results of target()")
    a = np.where((move.p_hat_new > 0) & (X.W > 0), acceptance(move), 0)
    accepted = chance.choose(np.stack([1 - a, a])) == 1
    W_new = X.W * ratio(move.p_hat, np.where(accepted, move.p_hat_new, 1))
    return Reservoirs(where(accepted, x_new, X.x), np.where(accepted, W_new, X.W), X.c), accepted


def mutable(of: Integrals) -> Mutable:
    """The integrals, if they can propose; raises TypeError, naming them, if they cannot."""
    if not hasattr(of, "propose"):
        raise TypeError(
            f"{type(of).__name__} has no propose(index, x, chance), so that its samples cannot be mutated: give it "
            "one, take integrals that have it (of paths `transport.mutations`, of lines `toy1d.walking`), or k = 0."
        )
    return of  # type: ignore[return-value]


# ---------------------------------------------------------------- the pass

Mutation = Callable[[Reservoirs, Pixels, Chance], Reservoirs]
"""A pass that changes the samples of reservoirs."""

Rule = Callable[[Reservoirs, Pixels, Chance], Acceptance]
"""How the proposals of a pass are accepted, given the reservoirs that enter it."""


def by_target(X: Reservoirs, here: Pixels, chance: Chance) -> Acceptance:
    """Metropolis and Hastings for p_hat, whatever enters."""
    return metropolis


def mutations(k: int, rule: Rule = by_target) -> Mutation:
    """The decorrelation pass: k mutations of every reservoir, one after the other.  [MCMC 3.2.4, Alg. 3]

    Raises ValueError for k that is no whole number >= 0, and the pass TypeError for integrals that cannot propose.

    >>> import numpy as np
    >>> from restir_ref import Live, Pixels, initial
    >>> from restir_ref.decorrelation import mutations
    >>> from toy1d import two_pixels, walking
    >>> here, chance = Pixels(walking(two_pixels()), np.arange(1000)), Live(np.random.default_rng(1))
    >>> X = initial(here, chance)
    >>> Y = mutations(5)(X, here, chance)
    >>> float((X.x != Y.x).mean().round(2))
    1.0
    """
    whole(k, 0, "the number k of mutations", "It counts proposals per pixel and frame; 0 leaves the pass out.")

    def walk(X: Reservoirs, here: Pixels, chance: Chance) -> Reservoirs:
        if k == 0:
            return X
        mutable(here.of)
        acceptance, there = rule(X, here, chance), ready(X, here)
        for _ in range(k):
            X = mutate(X, there, chance, acceptance)
        return X

    return walk


def ready(X: Reservoirs, here: Pixels) -> Pixels:
    """`here`, as integrals that know what the mutations of X have in common, where there are such."""
    standing = getattr(here.of, "standing", None)
    return here if standing is None else Pixels(standing(X, here.index), here.index)


# ---------------------------------------------------------------- steps of primary sample numbers

Step = Callable[[Array, float, Chance], tuple[Array, Array]]
"""step(u (..., N), sigma, chance) -> (u', T(u' -> u) / T(u -> u') (N,)), u in [0, 1)."""


def gaussian(u: Array, sigma: float, chance: Chance) -> Array:
    """u + sigma n, n standard normal."""
    return np.asarray(u + sigma * ndtri(np.maximum(chance.uniform(u.shape), 2.0**-60)))


def wrapped(u: Array, sigma: float, chance: Chance) -> tuple[Array, Array]:
    """u' = u + sigma n modulo 1, symmetric on the circle.  [MCMC 5.2.2]"""
    u_new = gaussian(u, sigma, chance) % 1
    return np.where(u_new < 1, u_new, 0), np.ones(u.shape[-1])  # -1e-20 % 1 is 1


def bounded(u: Array, sigma: float, chance: Chance) -> tuple[Array, Array]:
    """u' = u + sigma n, invalid outside of [0, 1); clamping it there would not be symmetric.  [MCMC 5.2.2]"""
    u_new = gaussian(u, sigma, chance)
    inside = (u_new >= 0) & (u_new < 1)
    return np.where(inside, u_new, u), np.where(inside.reshape(-1, u.shape[-1]).all(axis=0), 1.0, 0.0)


STEPS: Mapping[str, Step] = MappingProxyType({"wrapped": wrapped, "bounded": bounded})

# ---------------------------------------------------------------- blue noise


def energy(distance: Array | float, difference: Array) -> Array:
    """E(i, j) = exp(-|i_c - j_c|^2 / 2.1^2 - sqrt(|i_s - j_s|)): pixels i_c, luminances i_s.  [MCMC 4.2]"""
    return np.asarray(np.exp(-((distance / 2.1) ** 2) - np.sqrt(abs(difference))))


def annealed(e: Array, e_new: Array, temperature: float) -> Array:
    """a_bn = 1 if e' < e, otherwise exp(-(e' - e) / T).  [MCMC 4.2]"""
    return np.asarray(np.exp(-np.maximum(e_new - e, 0) / temperature))


@dataclass(frozen=True, eq=False)
class Blue:
    """The acceptance a = min(1, (w_bn a_bn + (1 - w_bn) p_hat(x') / p_hat(x)) T(x' -> x) / T(x -> x')).  [MCMC 4.2]

    luminance (N,) is that of the columns before the mutations; `neighbours` are arrays (N,) of columns,
    `distances` their distances in pixels, one each or (N,).  Raises ValueError for w outside of [0, 1], or a
    temperature <= 0.

    # erratum: [MCMC 4.2] says that keeping T outside the weighted average guarantees detailed balance;
    # it does not for any w_bn > 0.  It prints no min(1, .) either, see `metropolis`.
    Hazard: w_bn > 0 does not leave p_hat invariant, so W is
    biased; and in grey pixels, whose luminance p_hat W cannot change, a_bn is always 1.
    """

    luminance: Array
    neighbours: Sequence[Array]
    distances: Sequence[Array | float]
    w: float
    temperature: float = 0.01

    def __post_init__(self) -> None:
        if not 0 <= self.w <= 1:
            raise ValueError(
                f"the weight w of blue noise must be in [0, 1], but is {self.w}: 0 leaves it out, 1 p_hat."
            )
        positive(self.temperature, "the temperature of blue noise", "small ones accept little that makes noise redder.")

    def __call__(self, move: Move) -> Array:
        """a (N,)."""
        a_bn = annealed(*self.energies(move), self.temperature)
        mixed = self.w * a_bn + (1 - self.w) * ratio(move.p_hat_new, move.p_hat)
        return np.minimum(1, mixed * move.T_ratio)

    def energies(self, move: Move) -> tuple[Array, Array]:
        """e and e': mean energies with the neighbours of the old luminance and of the mutated one.  [MCMC Alg. 6]"""
        W_new = move.X.W * ratio(move.p_hat, move.p_hat_new)
        mutated = weighted(move.here, move.x_new, W_new).mean(axis=0)
        return self._mean_energy(self.luminance), self._mean_energy(mutated)

    def _mean_energy(self, luminance: Array) -> Array:
        pairs = zip(self.neighbours, self.distances, strict=True)
        terms = [energy(distance, luminance - self.luminance[near]) for near, distance in pairs]
        return total(terms) / len(terms)


Near = Callable[[Pixels, Chance], tuple[Sequence[Array], Sequence[Array | float]]]
"""Chooses neighbours: columns (N,) of each, and how far away they are, in pixels."""


def blue(w: float, near: Near, temperature: float = 0.01) -> Rule:
    """The rule of a pass that prefers blue noise, with the luminances that enter it.  [MCMC 4.2, Alg. 6]"""

    def rule(X: Reservoirs, here: Pixels, chance: Chance) -> Acceptance:
        columns, distances = near(here, chance)
        return Blue(weighted(here, X.x, X.W).mean(axis=0), columns, distances, w, temperature)

    return rule
