"""Bugs inside a pass: what is weighed, with which Jacobian, and which inputs are left out.  [GRIS Eq. 19, 35; 6.2]"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from restir_ref.batch import Array, ratio, where
from restir_ref.chance import Chance
from restir_ref.integrals import Pixels, Reservoirs, Shifted, p_hat_from, target
from restir_ref.mis import WEIGHTS, Weights
from restir_ref.oracle.scenes import Parts, reference_scene
from restir_ref.oracle.zoo.bug import Bug
from restir_ref.oracle.zoo.merging import Merge, confidence, edited, jacobians, merging, rated, shifted
from restir_ref.oracle.zoo.shifts import LARGEST_JACOBIAN
from restir_ref.resampling import Input, gris, select, weigh

LARGEST_WEIGHT = 3.0
"""Where the clamp of W draws its line."""


def reweighted(factor: Callable[[Array], Array]) -> Merge:
    """`gris` of inputs whose W is multiplied by a function of J."""

    def edit(source: Input, here: Pixels) -> Reservoirs:
        return replace(source.X, W=source.X.W * factor(shifted(source, here).J))

    return edited(edit)


def undone(J: Array) -> Array:
    """1 / J, which leaves w without a Jacobian."""
    return ratio(np.ones(J.shape), J)


def clamped(J: Array) -> Array:
    """min(J, limit) / J, which leaves w with a clamped Jacobian."""
    return ratio(np.minimum(J, LARGEST_JACOBIAN), J)


def clamped_weight(X: Reservoirs, here: Pixels) -> Reservoirs:
    """W <- min(W, limit)."""
    return replace(X, W=np.minimum(X.W, LARGEST_WEIGHT))


def skipped_unless(kept: Callable[[Shifted, Array], Array]) -> Merge:
    """`gris` without the inputs whose own sample fails a test of (Y_i, p_hat(Y_i)): `continue` in the loop."""

    def edit(source: Input, here: Pixels) -> Reservoirs:
        y = shifted(source, here)
        skipped = (source.at is not here) & ~kept(y, target(here, y.x))
        return replace(source.X, c=np.where(skipped, 0, source.X.c))

    return edited(edit)


def can_be_shifted(y: Shifted, p_hat: Array) -> Array:
    """J > 0."""
    return np.asarray(y.J > 0)


def is_lit(y: Shifted, p_hat: Array) -> Array:
    """p_hat(Y_i) J > 0."""
    return np.asarray(p_hat * y.J > 0)


def twice(inputs: Sequence[Input], here: Pixels, mis: Weights, chance: Chance) -> Reservoirs:
    """The last input is offered twice, with MIS weights that count it once."""
    offered = list(weigh(inputs, here, mis))
    return select([*offered, offered[-1]], chance, confidence(inputs))


def early_out(inputs: Sequence[Input], here: Pixels, mis: Weights, chance: Chance) -> Reservoirs:
    """The canonical sample alone, if the Jacobian of *either* shift, forth or back, is large."""
    own = inputs[0].X
    forth = jacobians(inputs[1:], here)
    back = [here.of.shift(own.x, here.index, source.at).J for source in inputs[1:]]
    Y = gris(inputs, here, mis, chance)
    large = np.max(np.stack([*forth, *back]), axis=0) > LARGEST_JACOBIAN
    return where(large, replace(own, c=Y.c), Y)


def at_unshifted_sample(j: int, i: int, y: Shifted, inputs: Sequence[Input], here: Pixels) -> Array:
    """q_j at X_i as if it were Y_i."""
    x, at = inputs[i].X.x, inputs[j].at
    return target(here, x) if at is here else p_hat_from(at, x, here)


def own_without_jacobian(j: int, i: int, y: Shifted, inputs: Sequence[Input], here: Pixels) -> Array:
    """q_i(Y_i) = p_hat_i(X_i), all others as they should be."""
    at = inputs[j].at
    if at is here:
        return target(here, y.x)
    return target(at, inputs[i].X.x) if j == i else p_hat_from(at, y.x, here)


def as_it_should_be(j: int, i: int, y: Shifted, inputs: Sequence[Input], here: Pixels) -> Array:
    """q_j(Y_i) = p_hat_from_j(Y_i)."""
    return ratio(own_without_jacobian(j, i, y, inputs, here), y.J if j == i else np.ones(len(here.index)))


TALBOT = WEIGHTS["talbot"]


def talbot_with(merge: Merge) -> Parts:
    """A loop of Talbot weights with another merge."""
    return replace(merging(merge), across=TALBOT)


PASS_BUGS = (
    Bug(
        "Jacobian left out of w",
        "MIS weights are shifted with their Jacobian, but the resampling weight is still p_hat m W.",
        "too bright or too dark at depth edges, in proportion to how distances differ",
        "[GRIS Eq. 19]",
        reference_scene,
        right=Parts(),
        wrong=merging(reweighted(undone)),
    ),
    Bug(
        "Jacobian clamped in w",
        "A limit on the Jacobian stops fireflies; it is put on the resampling weight alone.",
        "dark creases and corners, fireflies gone",
        "[GRIS Eq. 19]",
        reference_scene,
        right=Parts(),
        wrong=merging(reweighted(clamped)),
    ),
    Bug(
        "W clamped",
        "A limit on the stored contribution weight stops fireflies.",
        "dark where samples are rare and strong: caustics, small lights",
        "[GRIS Def. 4.1, Eq. 22]",
        reference_scene,
        right=Parts(),
        wrong=Parts(edit=clamped_weight),
    ),
    Bug(
        "neighbour skipped if its sample cannot be shifted",
        "The merge loop says `continue` when a shift fails, before the neighbour is counted.",
        "bright at silhouettes and glossy edges",
        "[GRIS Eq. 20; 6.2]",
        reference_scene,
        right=Parts(along=TALBOT, across=TALBOT),
        wrong=talbot_with(skipped_unless(can_be_shifted)),
    ),
    Bug(
        "neighbour skipped if its shifted target is 0",
        "The merge loop says `continue` when the shifted sample is black, before the neighbour is counted.",
        "bright penumbras and contact shadows",
        "[GRIS Eq. 20; 6.2]",
        reference_scene,
        right=Parts(along=TALBOT, across=TALBOT),
        wrong=talbot_with(skipped_unless(is_lit)),
    ),
    Bug(
        "input streamed twice",
        "A random neighbour comes up twice, or the pixel itself among its neighbours; MIS counts it once.",
        "bright overall, more with every repetition",
        "[GRIS Eq. 20]",
        reference_scene,
        right=Parts(),
        wrong=merging(twice),
    ),
    Bug(
        "early out on either Jacobian",
        "If one of the two Jacobians is suspicious, the pair is left alone, and the other sample with it.",
        "blotches near depth edges, darker on one side and brighter on the other",
        "[GRIS 5.4, Eq. 20]",
        reference_scene,
        right=Parts(),
        wrong=merging(early_out),
    ),
    Bug(
        "MIS at the unshifted sample",
        "The MIS weight is computed before the shift, or at the neighbour's own hit point.",
        "too bright or too dark wherever pixels differ, unchanged where they agree",
        "[GRIS Eq. 19, 35]",
        reference_scene,
        right=Parts(along=TALBOT, across=TALBOT),
        wrong=talbot_with(rated(at_unshifted_sample)),
    ),
    Bug(
        "own MIS term without Jacobian",
        "The sample's own density needs no shift back, so its Jacobian is forgotten too.",
        "too bright or too dark where neighbouring pixels see different scales, milder than without any Jacobian",
        "[GRIS Eq. 35, 36]",
        reference_scene,
        right=Parts(along=TALBOT, across=TALBOT),
        wrong=talbot_with(rated(own_without_jacobian)),
    ),
)
