"""Bugs in MIS weights: sums that are not one where they should be.  [GRIS Eq. 5, 16-20, 35-38; 5.6]

Each is another `Weights`: another formula, or another density in it.
"""

import numpy as np

from restir_ref.batch import Array, ratio, total
from restir_ref.integrals import Pixels, Sample, target
from restir_ref.mis import WEIGHTS, Confidences, Density, Mis, Weights, constant, defensive, talbot
from restir_ref.oracle.cells import Frame
from restir_ref.oracle.scenes import Parts, reference_scene
from restir_ref.oracle.zoo.bug import Bug

TALBOT, PAIRWISE = WEIGHTS["talbot"], WEIGHTS["pairwise"]

FAINTEST = 0.5
"""What an occlusion-free target takes an occluded sample for."""


def talbot_capped_below(i: int, q: Density, c: Confidences) -> Array:
    """Talbot weights with confidences capped at 1 in the denominator only."""
    return ratio(c[i] * q(i), total([np.minimum(c[j], 1) * q(j) for j in range(len(c))]))


def counting_undefined(i: int, q: Density, c: Confidences) -> Array:
    """Talbot weights in which an input that cannot have made y counts as if it were canonical."""

    def kept(j: int) -> Array:
        return np.where(q(j) > 0, q(j), q(c.canonical[0])) if c.canonical else q(j)

    return talbot(i, kept, c)


def swapped_pairwise(i: int, q: Density, c: Confidences) -> Array:
    """Pairwise weights with D_j = C_R q_j + C_N p_hat, and c_i / C where there are no pairs."""
    if not (c.canonical and c.others):
        return constant(i, q, c)
    p_hat = q(c.canonical[0])

    def share(j: int, p: Array) -> Array:
        return ratio(c[j] * p, c.C_R * q(j) + c.C_N * p_hat)

    if i in c.canonical:
        return ratio(c[i] * total([share(j, p_hat) for j in c.others]), c.C_N)
    return share(i, q(i))


def misrated(factor: float) -> Mis:
    """Talbot weights in which the canonical m_c rates the others' densities by a factor; their own m_j does not."""

    def m(i: int, q: Density, c: Confidences) -> Array:
        def rated(j: int) -> Array:
            return q(j) if i not in c.canonical or j in c.canonical else factor * q(j)

        return talbot(i, rated, c)

    return m


def current_target(at: Pixels, x: Sample) -> Array:
    """p_hat of the pixel in the frame after the one it belongs to, wherever there is one."""
    frame: Frame = at.of  # type: ignore[assignment]
    last = len(frame.cells.v) // frame.n - 1
    return target(Pixels(type(frame)(frame.cells, frame.n, last), at.index), x)


def without_visibility(at: Pixels, x: Sample) -> Array:
    """A target that does not see what occludes: never 0."""
    return np.maximum(target(at, x), FAINTEST)


WEIGHT_BUGS = (
    Bug(
        "1/M over unequal supports",
        "The sum of weights is divided by the number of merged reservoirs, as in biased ReSTIR DI.",
        "dark at silhouettes and contact shadows",
        "[GRIS Eq. 20]",
        reference_scene,
        right=Parts(),
        wrong=Parts(across=WEIGHTS["constant"]),
    ),
    Bug(
        "contribution weights over all inputs",
        "Selection uses proper weights, but W is normalised by all sample counts, possible or not.",
        "dark at silhouettes, noise as low as with proper weights",
        "[GRIS Eq. 17, 21]",
        reference_scene,
        right=Parts(),
        wrong=Parts(across=Weights(talbot, constant)),
    ),
    Bug(
        "undefined shift kept in MIS",
        "The flag of a failed shift is not read in the MIS weights, and some leftover target is counted.",
        "dark wherever shifts fail: silhouettes, glossy edges",
        "[GRIS Eq. 35, 36]",
        reference_scene,
        right=Parts(along=TALBOT, across=TALBOT),
        wrong=Parts(along=Weights(counting_undefined), across=Weights(counting_undefined)),
    ),
    Bug(
        "pairwise targets swapped",
        "The two counts of a pair are attached to the wrong targets; nothing shows while they are equal.",
        "dark where only new samples find the light, bright elsewhere, once history is long; right in the first frames",
        "[GRIS Eq. 37]",
        reference_scene,
        right=Parts(along=PAIRWISE, cap=2),
        wrong=Parts(along=Weights(swapped_pairwise), cap=2),
    ),
    Bug(
        "visibility left out of MIS",
        "To save shadow rays the MIS weights use the unoccluded target, while occluded samples are zeroed.",
        "dark penumbras and contact shadows",
        "[GRIS Eq. 35; 5.6]",
        reference_scene,
        right=Parts(),
        wrong=Parts(
            along=Weights(talbot, proxy=without_visibility), across=Weights(defensive, proxy=without_visibility)
        ),
    ),
    Bug(
        "current target for history",
        "The previous camera and scene are gone, so history is rated with this frame's target.",
        "dark trails at disocclusions and behind moving shadows, right while nothing moves",
        "[GRIS Eq. 35; 6.3, App. B]",
        reference_scene,
        right=Parts(),
        wrong=Parts(along=Weights(talbot, proxy=current_target)),
    ),
    Bug(
        "history overrated in the canonical weight",
        "The new sample's own MIS weight guesses what history could do, and guesses too much.",
        "dark while history lives, right after a reset",
        "[GRIS Eq. 20, 36]",
        reference_scene,
        right=Parts(),
        wrong=Parts(along=Weights(misrated(2))),
    ),
    Bug(
        "history underrated in the canonical weight",
        "The new sample's own MIS weight uses a previous target that has lost a term since.",
        "bright while history lives, right after a reset",
        "[GRIS Eq. 20, 36]",
        reference_scene,
        right=Parts(),
        wrong=Parts(along=Weights(misrated(0.5))),
    ),
    Bug(
        "history forgotten in the canonical weight",
        "A test finds the motion vector invalid for the new sample's weight, while history is merged all the same.",
        "bright after disocclusion and along moving edges",
        "[GRIS Eq. 20, 36]",
        reference_scene,
        right=Parts(),
        wrong=Parts(along=Weights(misrated(0))),
    ),
    Bug(
        "cap only in the denominator",
        "The M-cap is applied where weights are normalised, but not where history is weighed.",
        "bright, more so the longer the history",
        "[GRIS 6.2, 6.4]",
        reference_scene,
        right=Parts(),
        wrong=Parts(along=Weights(talbot_capped_below), cap=np.inf),
    ),
)
