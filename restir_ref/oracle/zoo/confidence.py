"""Bugs in who counts how much, who is asked, and when: confidences, neighbours, seeds, races.  [GRIS 6.2-6.4]"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from restir_ref.batch import Array, ratio, where
from restir_ref.chance import Chance
from restir_ref.integrals import Image, Pixels, Reservoirs, target
from restir_ref.mis import WEIGHTS, Weights
from restir_ref.oracle.scenes import Parts, offset, one_frame, reference_scene, three_pixel_scene
from restir_ref.oracle.zoo.bug import Bug
from restir_ref.restir import spatial, temporal

TALBOT = WEIGHTS["talbot"]

# ---------------------------------------------------------------- confidences


def null_confidence_zero(X: Reservoirs, here: Pixels) -> Reservoirs:
    """Throw away the confidence of null samples."""
    return replace(X, c=np.where(X.W > 0, X.c, 0))


def duplicates_count_half(X: Reservoirs, here: Pixels) -> Reservoirs:
    """Halve the confidence of a sample that the next pixel holds as well."""
    of: Image = here.of  # type: ignore[assignment]
    other = offset(of, here.index, 1)
    y = of.shift(X.x, here.index, other)
    same = (y.x == X.x[other.index]) & (y.J > 0)
    return replace(X, c=np.where(same, X.c / 2, X.c))


def sum_not_capped(
    X: Reservoirs, here: Pixels, Y: Reservoirs, before: Sequence[Pixels], chance: Chance, /, *, mis: Weights, cap: float
) -> Reservoirs:
    """M is capped after the merge, and W = sum w / (M p_hat) is formed with the capped M."""
    Z = temporal(X, here, Y, before, chance, mis=mis, cap=np.inf)
    c = np.minimum(Z.c, cap)
    return replace(Z, W=Z.W * Z.c / c, c=c)


# ---------------------------------------------------------------- neighbours


def brighter_neighbour(of: Image, index: Array, X: Reservoirs, chance: Chance) -> Sequence[Pixels]:
    """Whichever of the pixels to the left and to the right has the sample with the larger target."""
    left, right = (offset(of, index, by) for by in (-1, 1))
    p_left, p_right = (target(at, X.x[at.index]) for at in (left, right))
    return [Pixels(of, np.where(p_left > p_right, left.index, right.index))]


# ---------------------------------------------------------------- seeds


@dataclass
class OneSeed:
    """Chance that answers every question with one and the same number u, as a generator that is never advanced.

    What is known of u after each answer is an interval; the next answer is drawn given that.
    """

    chance: Chance
    known: list[tuple[Array, Array]] = field(default_factory=list)

    def choose(self, weights: Array) -> Array:
        """Where u lies in the running sum of the weights, given the answers so far."""
        upto = np.cumsum(ratio(weights, weights.sum(axis=0)), axis=0)
        start, stop = self.known[-1] if self.known else (np.zeros(upto.shape[1]), np.ones(upto.shape[1]))
        edges = np.concatenate([np.zeros((1, upto.shape[1])), upto])
        low, high = np.clip(edges[:-1], start, stop), np.clip(edges[1:], start, stop)
        s = self.chance.choose(np.where(high - low > 1e-14, high - low, 0))
        column = np.arange(len(s))
        null = weights.sum(axis=0) == 0
        self.known.append((np.where(null, start, low[s, column]), np.where(null, stop, high[s, column])))
        return s

    def uniform(self, shape: tuple[int, ...]) -> Array:
        """Passes through: only choices share the number."""
        return self.chance.uniform(shape)


# ---------------------------------------------------------------- races


def first_half(here: Pixels) -> Array:
    """Pixels that are done first: the even ones."""
    of: Image = here.of  # type: ignore[assignment]
    return np.asarray(here.index % of.n % 2 == 0)


def torn(X: Reservoirs, here: Pixels, neighbours: Sequence[Pixels], chance: Chance, /, *, mis: Weights) -> Reservoirs:
    """In place, while the neighbours are written: the late half reads new weights beside old samples."""
    early = first_half(here)
    Y = where(early, spatial(X, here, neighbours, chance, mis=mis), X)
    read = where(early, replace(Y, x=X.x), X)
    return where(early, Y, spatial(read, here, neighbours, chance, mis=mis))


ONE_FRAME = Parts(one_frame)

CONFIDENCE_BUGS = (
    Bug(
        "null confidence 0",
        "A pixel that found no light this frame is skipped, sample count and all.",
        "bright where light is rarely found: caustics, small or occluded lights",
        "[GRIS 6.2]",
        reference_scene,
        right=Parts(across=TALBOT),
        wrong=Parts(across=TALBOT, edit=null_confidence_zero),
    ),
    Bug(
        "confidence lowered for duplicates",
        "A duplication map lowers the sample count of samples that spread, against blotches.",
        "a few percent too bright where samples spread",
        "[GRIS 6.2]",
        reference_scene,
        right=Parts(across=TALBOT),
        wrong=Parts(across=TALBOT, edit=duplicates_count_half),
    ),
    Bug(
        "M capped, sum of weights not",
        "The count is clamped where the reservoir is stored, but its sum of weights belongs to the full count.",
        "bright overall, as soon as the cap is reached",
        "[GRIS 6.2, 6.4]",
        reference_scene,
        right=Parts(cap=2),
        wrong=Parts(cap=2, temporal=sum_not_capped),
    ),
    Bug(
        "neighbour chosen by sample value",
        "Reuse prefers the neighbour whose current sample looks best.",
        "bright in most places, slightly dark in a few",
        "[GRIS 6.2]",
        three_pixel_scene,
        right=ONE_FRAME,
        wrong=replace(ONE_FRAME, neighbours=brighter_neighbour),
    ),
    Bug(
        "one seed for two passes",
        "Temporal and spatial reuse start their random numbers from the same pixel and frame hash.",
        "slightly dark or bright in a fixed pattern, too little to see in a mean",
        "[GRIS 3.1, 6.3]",
        reference_scene,
        right=Parts(),
        wrong=Parts(dice=OneSeed),
    ),
    Bug(
        "torn reservoirs",
        "Spatial reuse works in place: a thread reads a neighbour's new weight beside its old sample.",
        "speckles and flicker that change with the machine, bright and dark",
        "[GRIS Def. 4.1; 6.3]",
        reference_scene,
        right=Parts(),
        wrong=Parts(spatial=torn),
    ),
)
