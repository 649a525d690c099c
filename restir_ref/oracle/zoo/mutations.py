"""Bugs in Metropolis-Hastings mutations between the passes.  [MCMC 3.2, 4.2, 5.2, Alg. 3]

The wrong mutations themselves stand in `oracle.mutations`; here they run before a spatial pass.
"""

from dataclasses import replace

import numpy as np

from restir_ref.batch import Array, ratio, where
from restir_ref.chance import Chance
from restir_ref.decorrelation import Move, attempt, mutate
from restir_ref.integrals import Pixels, Reservoirs
from restir_ref.oracle.cells import Frame
from restir_ref.oracle.mutations import (
    FOLDS,
    Mutation,
    inverted,
    last_accepted,
    repeated,
    unsymmetric,
    upside_down,
)
from restir_ref.oracle.scenes import Loop, Parts, Scene, reference_scene
from restir_ref.oracle.zoo.bug import Bug

STEPS = 2
"""Mutations per pixel; one would hide what goes wrong between them."""

BLUE = 0.5
"""Weight w_bn of the blue-noise term in the acceptance."""


def mutating(mutation: Mutation) -> Parts:
    """New samples, mutated, then one round of spatial reuse."""

    def steps(parts: Parts, scene: Scene) -> Loop:
        now = scene.made_of(parts.here).now

        def loop(index: Array, chance: Chance) -> Reservoirs:
            here = Pixels(now, index)
            X = mutation(parts.draw(here, chance), here, chance)
            return parts.spatial(X, here, parts.neighbours(now, index, X, chance), chance, mis=parts.across)

        return loop

    return Parts(steps)


class Stepping(Frame):
    """Mutations by two cells up or down; what leaves on one side enters on the other."""

    fold = staticmethod(FOLDS["wrapped"])

    def propose(self, index: Array, x: Array, chance: Chance) -> tuple[Array, Array]:
        """A step of +2 or -2, as likely forth as back: T is a density, so its ratio is that of the volumes."""
        step = 4 * chance.choose(np.ones((2, len(index)))) - 2
        y, i = self.fold(x, x + step, self.cells.v.shape[-1]), self.ids(index)
        return y, ratio(self.cells.v[i, y], self.cells.v[i, x])


class Clamping(Stepping):
    """Steps that leave are moved back to the ends, and still taken for symmetric."""

    fold = staticmethod(FOLDS["clamped"])


def half_blue(move: Move) -> Array:
    """a = min(1, (w a_bn + (1 - w) C'/C) T'/T) with a_bn = 1, as it is in all grey pixels."""
    mixed = BLUE + (1 - BLUE) * ratio(move.p_hat_new, move.p_hat)
    return np.minimum(1, mixed * move.T_ratio)


def blue(X: Reservoirs, here: Pixels, chance: Chance) -> Reservoirs:
    """A step accepted by the mixture."""
    return mutate(X, here, chance, half_blue)


def turned_round(X: Reservoirs, here: Pixels, chance: Chance) -> Reservoirs:
    """A step whose ratio of transitions is upside down."""
    return mutate(X, here, chance, upside_down)


def printed(X: Reservoirs, here: Pixels, chance: Chance) -> Reservoirs:
    """Two steps of Alg. 6: the mixture accepts, and what was accepted is forgotten if the last proposal is not."""
    base, accepted = X, np.zeros(len(here.index), dtype=bool)
    for _ in range(STEPS):
        base, accepted = attempt(base, here, chance, half_blue)
    return where(accepted, base, X)


RIGHT = mutating(repeated(STEPS))
UNEVEN = replace(RIGHT, here=Stepping, near=Stepping)
"""Steps between cells of unequal volumes, whose densities are no symmetric ones."""

MUTATION_BUGS = (
    Bug(
        "inverted weight update",
        "After an accepted mutation W is multiplied by mutated over base target, as one sentence of print has it.",
        "bright fireflies that grow from frame to frame, dark between them",
        "[MCMC 3.2.4, 5.2.4]",
        reference_scene,
        right=RIGHT,
        wrong=mutating(repeated(STEPS, inverted)),
    ),
    Bug(
        "only the last proposal updates",
        "`accept` is overwritten in every iteration and read once, after the loop, as the pseudo-code has it.",
        "bright or dark with two or more mutations, right with one",
        "[MCMC Alg. 3]",
        reference_scene,
        right=RIGHT,
        wrong=mutating(last_accepted(STEPS)),
    ),
    Bug(
        "proposal clamped to the unit interval",
        "A step that leaves [0, 1) is clamped, and the proposal still taken for symmetric.",
        "bright or dark lines where a primary sample number is 0 or 1",
        "[MCMC 3.2.1, 5.2.2]",
        reference_scene,
        right=UNEVEN,
        wrong=replace(RIGHT, here=Clamping, near=Clamping),
    ),
    Bug(
        "blue noise averaged into the acceptance",
        "A preference for blue noise is mixed with the ratio of targets, so detailed balance holds for neither.",
        "own pixels look right, but bright or dark after the next spatial pass",
        "[MCMC 4.2]",
        reference_scene,
        right=RIGHT,
        wrong=mutating(repeated(STEPS, blue)),
    ),
    Bug(
        "transition ratio left out",
        "The proposal is symmetric in the numbers that were stepped, and another number follows from where it leads.",
        "bright or dark where the moved vertex comes near to what it is joined to",
        "[MCMC 3.2.1, 4.1]",
        reference_scene,
        right=UNEVEN,
        wrong=replace(mutating(repeated(STEPS, unsymmetric)), here=Stepping, near=Stepping),
    ),
    Bug(
        "transition ratio upside down",
        "The code has T(u -> u') over T(u' -> u): primes are easily lost between derivation and code.",
        "bright or dark where the moved vertex comes near to what it is joined to, and stronger than without the ratio",
        "[MCMC 3.2.1, 4.1]",
        reference_scene,
        right=UNEVEN,
        wrong=replace(mutating(repeated(STEPS, turned_round)), here=Stepping, near=Stepping),
    ),
    Bug(
        "blue noise by the printed algorithm",
        "Algorithm 6 as it stands: the mixed acceptance, and `accept` that only the last proposal decides.",
        "own pixels look right, but bright or dark after the next spatial pass",
        "[MCMC Alg. 6]",
        reference_scene,
        right=RIGHT,
        wrong=mutating(printed),
    ),
)
