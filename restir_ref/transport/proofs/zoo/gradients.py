"""What people get wrong about differences of pixels, one deliberate error each, on models whose numbers are exact.

Pairs on finite cells (`pairs`), history with a place on the film (`areas`), and a row of pixels seen by a G-buffer:
each has the right model beside the wrong one.  [GPT 2-4]
"""

from collections.abc import Callable, Mapping
from functools import partial
from types import MappingProxyType

import numpy as np

from restir_ref.batch import Array
from restir_ref.gradient import SIGNS, TossedPairs
from restir_ref.integrals import pdf
from restir_ref.transport.edges import THRESHOLDS, Seen, edges
from restir_ref.transport.proofs.zoo import areas, pairs
from restir_ref.transport.proofs.zoo.bug import ModelBug
from restir_ref.transport.vectors import dot

# ---------------------------------------------------------------- a row of pixels

EDGES = np.array([False, False, True, False, True, False, True, False])
"""Of a row of nine pixels: a step of albedo, a step of depth and a crease between flat pieces."""

NEIGHBOURS = np.stack([np.arange(8), np.arange(1, 9)])


def row() -> Seen:
    """What the nine pixels see."""
    piece = np.append(0, np.cumsum(EDGES))
    n = np.where(piece == 3, [[0.8], [0.6]], [[0.0], [1.0]])
    return Seen(np.array([0.2, 0.7, 0.7, 0.7])[piece], n, np.array([1.0, 1.0, 1.3, 1.3])[piece])


Test = Callable[[Seen, Array], Array]
"""Which pairs of pixels are edge pairs."""


def normals_as_printed(g: Seen, ends: Array) -> Array:
    """A mistake: [GPT 4.3.2] as printed, where normals that agree make an edge."""
    colour, turn, depth = THRESHOLDS
    i, j = ends
    steps = (np.abs(g.albedo[i] - g.albedo[j]) > colour) | (np.abs(g.t[i] - g.t[j]) > depth * g.t[i])
    return np.asarray(steps | (dot(g.n[:, i], g.n[:, j]) > turn))


def marked(test: Test) -> Array:
    """Pairs marked as edges minus edges, (1, 8): 1 where there is none, -1 where one is missed.  [GPT 4.3.2]"""
    return np.asarray(test(row(), NEIGHBOURS).astype(float) - EDGES)[None]


# ---------------------------------------------------------------- the family

PAIRS, AFTER, AREA = pairs.bias_of_pairs, pairs.bias_of_after, areas.bias_of_history
AFTER_RIGHT = partial(AFTER, pairs.difference_of(pairs.side_by_targets, pairs.side_by_targets))

GRADIENT_BUGS: Mapping[str, ModelBug] = MappingProxyType(
    {
        bug.name: bug
        for bug in (
            ModelBug(
                "half weight where the shift is undefined",
                "Both pixels' samples are averaged, w = 1/2, and samples without an offset path count half as well.",
                "weak outlines and shadow edges: of what one pixel alone can see, half the light is missing",
                "[GPT Eq. 3]",
                right=PAIRS,
                wrong=partial(PAIRS, pairs.HalfWeights),
            ),
            ModelBug(
                "difference as one integral",
                "Base paths of one pixel only, as for a shift that reaches all of the other one.",
                "strong outlines of what is bright, as what only the darker pixel sees is never subtracted",
                "[GPT Eq. 2, 3]",
                right=PAIRS,
                wrong=partial(PAIRS, pairs.OneIntegral),
            ),
            ModelBug(
                "dark base paths thrown away",
                "Paths without light are not stored, though their weight beside an offset path with light is not 0.",
                "weak shadow edges, where one path of two is dark",
                "[GPT Eq. 4, 13]",
                right=partial(PAIRS, proxy=pdf),
                wrong=partial(PAIRS, pairs.Sieved, pdf),
            ),
            ModelBug(
                "outer shift applied twice",
                "The target is written with the shift inside, as printed, and asked of samples that are shifted.",
                "weak edges as soon as pairs reuse, right without reuse",
                "[GPT Eq. 18-20]",
                right=PAIRS,
                wrong=partial(PAIRS, merge=pairs.shifted_once_more),
            ),
            ModelBug(
                "inner Jacobian in the outer shift",
                "The Jacobian of the offset path, which the difference has already, is multiplied into the pair's.",
                "weak and strong edges where pairs reuse and shifts stretch",
                "[GPT Eq. 22]",
                right=PAIRS,
                wrong=partial(PAIRS, pairs.InnerJacobian),
            ),
            ModelBug(
                "offset path not rebuilt",
                "The reused pair brings its own offset path along, instead of one that belongs to its new base path.",
                "weak and strong edges as soon as pairs reuse, right without reuse",
                "[GPT Eq. 21]",
                right=PAIRS,
                wrong=partial(PAIRS, pairs.NotRebuilt),
            ),
            ModelBug(
                "probability of the side left out",
                "The base path's pixel is tossed for, and the candidate's weight knows nothing of that.",
                "weak by one half: all differences, so that the image is blurred",
                "[GPT Eq. 14]",
                right=partial(PAIRS, TossedPairs),
                wrong=partial(PAIRS, pairs.Forgetful),
            ),
            ModelBug(
                "parts added instead of subtracted",
                "The negative reservoir holds magnitudes, and they are added to those of the positive one.",
                "strong edges that all rise one way, as if nothing ever got darker",
                "[GPT Eq. 24]",
                right=PAIRS,
                wrong=partial(PAIRS, together=pairs.magnitudes_added),
            ),
            ModelBug(
                "difference from one pixel's samples",
                "After resampling one pixel's sample is shifted to the other one, but not that one's sample back.",
                "weak edges on one side, strong ones on the other",
                "[GPT Eq. 12]",
                right=AFTER_RIGHT,
                wrong=partial(AFTER, pairs.difference_of(pairs.side_by_targets, pairs.nothing)),
            ),
            ModelBug(
                "1/J in the weights of one side",
                "The weight of the shifted-back sample is computed with the Jacobian at hand, that of the way forth.",
                "weak and strong edges where shifts stretch",
                "[GPT Eq. 4, 13]",
                right=AFTER_RIGHT,
                wrong=partial(AFTER, pairs.difference_of(pairs.side_by_targets, pairs.side_by_inverse)),
            ),
            ModelBug(
                "targets on one side, densities on the other",
                "Weights of one side compare p_hat, those of the other one p, so that they do not add up to 1.",
                "weak and strong edges where samplers do not follow the light",
                "[GPT Eq. 4, 13]",
                right=AFTER_RIGHT,
                wrong=partial(AFTER, pairs.difference_of(pairs.side_by_targets, pairs.side_by_densities)),
            ),
            ModelBug(
                "differences of hue in no part",
                "A coloured difference is positive or negative by its luminance, and where that is 0 it is lost.",
                "weak edges, or none, between colours of one luminance",
                "[GPT Eq. 25, 26]",
                right=partial(pairs.bias_of_hues, *SIGNS.values()),
                wrong=partial(pairs.bias_of_hues, *pairs.MEANS_ONLY.values()),
            ),
            ModelBug(
                "moved square ignored one way",
                "History keeps its place in the pixel while the camera moves by fractions; the weights know better.",
                "dark and bright in motion by fractions of a pixel, right while nothing moves",
                "[GPT 4.3.1]",
                right=AREA,
                wrong=partial(AREA, areas.IgnoredOneWay),
            ),
            ModelBug(
                "place on the film drawn anew",
                "The reused path gets a new jitter in its pixel, as a new path would.",
                "dark and bright in motion, where pixels are not of one colour",
                "[GPT 4.3.1]",
                right=AREA,
                wrong=partial(AREA, areas.DrawnAnew),
            ),
            ModelBug(
                "share of the area on W",
                "The weight of an overlapped pixel's history is multiplied by its area, its confidence is not.",
                "dark in motion by fractions of a pixel, the more history there is",
                "[GPT 4.3.1]",
                right=AREA,
                wrong=partial(AREA, share=areas.share_of_weight),
            ),
            ModelBug(
                "overlapped pixel chosen by its sample",
                "Of the previous pixels that were overlapped the one with the better sample is taken.",
                "bright in motion by fractions of a pixel, and a little only",
                "[GPT 4.3.1; GRIS 6.2]",
                right=partial(AREA, choice=areas.one_of_them),
                wrong=partial(AREA, choice=areas.the_bright_one),
            ),
            ModelBug(
                "normals that agree mark an edge",
                "The test of normals is taken as it reads, with > instead of <.",
                "no bias: flat surfaces are marked as edges, and get noisier by reuse; creases are missed",
                "[GPT 4.3.2]",
                right=partial(marked, edges),
                wrong=partial(marked, normals_as_printed),
            ),
        )
    }
)
"""By name."""

SAME = 1e-9
"""Tables of biases that differ by less are the same."""


def named(bias: Array) -> tuple[str, ...]:
    """The mistakes whose table of biases, on the model it was made on, is this one; none for an unbiased table.

    >>> from restir_ref.transport.proofs.zoo import gradients, pairs
    >>> gradients.named(pairs.bias_of_pairs(pairs.Forgetful))
    ('probability of the side left out',)
    >>> gradients.named(pairs.bias_of_pairs())
    ()
    """
    if abs(bias).max() < SAME:
        return ()
    tables = {name: bug.wrong() for name, bug in GRADIENT_BUGS.items()}
    return tuple(n for n, t in tables.items() if t.shape == bias.shape and abs(t - bias).max() < SAME)
