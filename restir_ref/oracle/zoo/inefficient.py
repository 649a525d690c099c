"""Mistakes that cost efficiency, not bias: means stay silent, a variance or a bound speaks.  [GRIS 5.4, 5.6, 6.2]"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from restir_ref.batch import Array, ratio, where
from restir_ref.chance import Chance
from restir_ref.integrals import Image, Pixels, Reservoirs, Sample, target
from restir_ref.mis import WEIGHTS, Weights, defensive, talbot
from restir_ref.oracle.cells import Frame
from restir_ref.oracle.scenes import Parts, one_frame, reference_scene, three_pixel_scene
from restir_ref.oracle.zoo.bug import Bug, of
from restir_ref.oracle.zoo.confidence import first_half
from restir_ref.oracle.zoo.merging import merging
from restir_ref.oracle.zoo.shifts import RejectedBothWays
from restir_ref.resampling import Input, gris
from restir_ref.restir import around, capped, spatial, temporal

TALBOT = WEIGHTS["talbot"]


def without_jacobian(at: Pixels, x: Sample) -> Array:
    """p_hat / v: J = v_y / v_x drops out of every p_hat_from, up to a factor that all inputs share."""
    frame: Frame = at.of  # type: ignore[assignment]
    return ratio(target(at, x), frame.cells.v[frame.ids(at.index), x])


def flat(at: Pixels, x: Sample) -> Array:
    """1 on the support of p_hat."""
    return np.where(target(at, x) > 0, 1.0, 0.0)


def capped_after(
    X: Reservoirs, here: Pixels, Y: Reservoirs, before: Sequence[Pixels], chance: Chance, /, *, mis: Weights, cap: float
) -> Reservoirs:
    """The merged confidence is capped, not the incoming one."""
    return capped(temporal(X, here, Y, before, chance, mis=mis, cap=np.inf), cap)


def last_merged_twice(inputs: Sequence[Input], here: Pixels, mis: Weights, chance: Chance) -> Reservoirs:
    """The last input comes twice, and MIS knows it."""
    return gris([*inputs, inputs[-1]], here, mis, chance)


def own_merged_twice(inputs: Sequence[Input], here: Pixels, mis: Weights, chance: Chance) -> Reservoirs:
    """The canonical input comes twice, and MIS knows it."""
    return gris([inputs[0], *inputs], here, mis, chance)


def remerged(
    X: Reservoirs, here: Pixels, neighbours: Sequence[Pixels], chance: Chance, /, *, mis: Weights
) -> Reservoirs:
    """The result is merged with the same neighbours' old samples once more."""
    Y = spatial(X, here, neighbours, chance, mis=mis)
    return gris([Input(Y, here), *around(X, neighbours)], here, mis, chance)


def in_place(
    X: Reservoirs, here: Pixels, neighbours: Sequence[Pixels], chance: Chance, /, *, mis: Weights
) -> Reservoirs:
    """The late half reads whole reservoirs that the early half has already replaced."""
    early = first_half(here)
    Y = where(early, spatial(X, here, neighbours, chance, mis=mis), X)
    return where(early, Y, spatial(Y, here, neighbours, chance, mis=mis))


def random_neighbour(of: Image, index: Array, X: Reservoirs, chance: Chance) -> Sequence[Pixels]:
    """Left or right by the toss of a coin."""
    by = 1 - 2 * chance.choose(np.ones((2, len(index))))
    return [Pixels(of, index - index % of.n + (index + by) % of.n)]


def by_parity(X: Reservoirs, here: Pixels) -> Reservoirs:
    """Confidence 4 in odd pixels, whatever was counted."""
    return replace(X, c=np.where(here.index % 2 == 1, 4, X.c))


INEFFICIENT_BUGS = (
    Bug(
        "no Jacobian in any MIS weight",
        "All densities of the MIS weights lack their Jacobian alike, so they still sum to one.",
        "noisier at depth edges, no bias",
        "[GRIS Eq. 35]",
        reference_scene,
        right=Parts(),
        wrong=Parts(along=Weights(talbot, proxy=without_jacobian), across=Weights(defensive, proxy=without_jacobian)),
    ),
    Bug(
        "flat proxy target in MIS",
        "MIS weights ask only whether an input could have made the sample, not how likely.",
        "fireflies where neighbours rarely find what matters, no bias",
        "[GRIS 5.6, Eq. 39]",
        reference_scene,
        right=Parts(),
        wrong=Parts(along=Weights(talbot, proxy=flat), across=Weights(talbot, proxy=flat)),
    ),
    Bug(
        "1/Z weights",
        "The contribution weight 1/Z repairs the bias of 1/M, not the selection.",
        "fireflies at silhouettes that more neighbours do not cure, no bias",
        "[GRIS Eq. 17, 39; 5.6]",
        reference_scene,
        right=Parts(),
        wrong=Parts(across=WEIGHTS["1/Z"]),
    ),
    Bug(
        "cap after the merge",
        "The stored confidence is capped, so that new samples of the next frame meet a longer or shorter history.",
        "another trade of noise for lag, no bias",
        "[GRIS 6.4]",
        reference_scene,
        right=Parts(),
        wrong=Parts(temporal=capped_after),
    ),
    Bug(
        "no cap on history",
        "Confidence grows for ever, so new samples are hardly ever taken.",
        "freezes: the same noise in all frames, however long one waits, no bias",
        "[GRIS 6.4, Fig. 2]",
        reference_scene,
        right=Parts(),
        wrong=Parts(cap=np.inf),
    ),
    Bug(
        "neighbour merged twice, MIS knows",
        "Random neighbours repeat, and every copy is counted.",
        "a little noisier, no bias",
        "[GRIS Eq. 20]",
        reference_scene,
        right=Parts(),
        wrong=merging(last_merged_twice),
    ),
    Bug(
        "own sample merged twice, MIS knows",
        "The pixel itself is among its neighbours, and every copy is counted.",
        "reuse helps less than it could, no bias",
        "[GRIS Eq. 20]",
        reference_scene,
        right=Parts(),
        wrong=merging(own_merged_twice),
    ),
    Bug(
        "result merged with its inputs again",
        "A second pass reads the buffer from before the first one, whose samples the result has seen.",
        "correlated samples, less gain than the count suggests, no bias",
        "[GRIS Eq. 20; 6.3]",
        reference_scene,
        right=Parts(),
        wrong=Parts(spatial=remerged),
    ),
    Bug(
        "spatial reuse in place",
        "Whole reservoirs are read while others are written, under a lock.",
        "directional smears of equal samples, no bias",
        "[GRIS 6.3]",
        reference_scene,
        right=Parts(),
        wrong=Parts(spatial=in_place),
    ),
    Bug(
        "shifts rejected both ways",
        "A heuristic refuses shifts, and MIS knows.",
        "noisier where the heuristic refuses, no bias",
        "[GRIS 5.4, Eq. 35]",
        reference_scene,
        right=of(Frame),
        wrong=of(RejectedBothWays),
    ),
    Bug(
        "neighbour chosen by a coin",
        "Neighbours are drawn at random, without a look at geometry or samples.",
        "noise changes from pixel to pixel, no bias",
        "[GRIS 6.2]",
        three_pixel_scene,
        right=Parts(one_frame),
        wrong=Parts(one_frame, neighbours=random_neighbour),
    ),
    Bug(
        "confidence made up per pixel",
        "Sample counts are overwritten by a number that has nothing to do with what was counted.",
        "noise is moved between pixels, no bias",
        "[GRIS 6.2]",
        reference_scene,
        right=Parts(),
        wrong=Parts(edit=by_parity),
    ),
)
