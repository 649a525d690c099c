"""The bug zoo: what people who implement ReSTIR really get wrong, one small deliberate error each.

Every bug is the right loop with one thing replaced, on a scene small enough to know its bias
exactly.  `BUGS` is the public family; a check that misses one of them is not a check.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from restir_ref.batch import Array, ratio, total
from restir_ref.chance import Chance
from restir_ref.integrals import Pixels, Reservoirs, Shifted, target
from restir_ref.mis import WEIGHTS, Confidences, Density, Weights
from restir_ref.oracle.cells import Frame
from restir_ref.oracle.laws import bias_of
from restir_ref.oracle.scenes import (
    Loop,
    Scene,
    offset,
    reference_scene,
    three_pixel_scene,
    two_frame_loop,
)
from restir_ref.restir import initial, spatial

LARGEST_JACOBIAN = 1.5
"""Where the rejection bug draws its line."""


@dataclass(frozen=True)
class Bug:
    """A named deliberate error: how it gets into renderers, what it looks like, what it breaks."""

    name: str
    story: str
    symptom: str
    breaks: str
    scene: Callable[[], Scene]
    right: Callable[[Scene], Loop]
    wrong: Callable[[Scene], Loop]


class InvertedJacobian(Frame):
    """J of the wrong direction: v_i / v_j."""

    def shift(self, x: Array, index: Array, to: Pixels) -> Shifted:
        """T_ij with 1/J for J."""
        y = super().shift(x, index, to)
        return Shifted(y.x, ratio(np.ones(len(index)), y.J))


class RejectedOneWay(Frame):
    """Shifts with J above a threshold are rejected, their inverses, with J below 1, are not."""

    def shift(self, x: Array, index: Array, to: Pixels) -> Shifted:
        """T_ij where J is small enough."""
        y = super().shift(x, index, to)
        return Shifted(y.x, np.where(y.J > LARGEST_JACOBIAN, 0, y.J))


class RejectedBothWays(Frame):
    """The right form of the same rejection: J and 1/J are tested alike."""

    def shift(self, x: Array, index: Array, to: Pixels) -> Shifted:
        """T_ij where neither J nor 1/J is large."""
        y = super().shift(x, index, to)
        far = np.maximum(y.J, ratio(np.ones(len(index)), y.J)) > LARGEST_JACOBIAN
        return Shifted(y.x, np.where(far, 0, y.J))


def of(frame: type[Frame]) -> Callable[[Scene], Loop]:
    """The two-frame loop on the reference scene made of another kind of frame."""
    return lambda scene: two_frame_loop(Scene([frame(each.cells, each.n, each.t) for each in scene.frames]))


def null_confidence_zero(X: Reservoirs, here: Pixels) -> Reservoirs:
    """Throw away the confidence of null samples."""
    return replace(X, c=np.where(X.W > 0, X.c, 0))


def talbot_capped_below(i: int, q: Density, c: Confidences) -> Array:
    """Talbot weights with confidences capped at 1 in the denominator only."""
    return ratio(c[i] * q(i), total([np.minimum(c[j], 1) * q(j) for j in range(len(c))]))


def brighter_neighbour(scene: Scene) -> Loop:
    """Reuse from whichever neighbour's sample has the larger target."""

    def loop(index: Array, chance: Chance) -> Reservoirs:
        here = Pixels(scene.now, index)
        X = initial(here, chance)
        left, right = (offset(scene.now, index, by) for by in (-1, 1))
        p_left, p_right = (target(at, X.x[at.index]) for at in (left, right))
        chosen = Pixels(scene.now, np.where(p_left > p_right, left.index, right.index))
        return spatial(X, here, [chosen], chance)

    return loop


def right_neighbour(scene: Scene) -> Loop:
    """Reuse from the pixel to the right, whatever its sample."""

    def loop(index: Array, chance: Chance) -> Reservoirs:
        here = Pixels(scene.now, index)
        return spatial(initial(here, chance), here, [offset(scene.now, index, 1)], chance)

    return loop


TALBOT, CONSTANT, ONE_OVER_Z = WEIGHTS["talbot"], WEIGHTS["constant"], WEIGHTS["1/Z"]

BUGS: Mapping[str, Bug] = MappingProxyType(
    {
        bug.name: bug
        for bug in (
            Bug(
                "inverted Jacobian",
                "The Jacobian of a reconnection is written down for the shift back instead of forth.",
                "too bright or too dark where neighbouring pixels see different scales, such as depth edges",
                "[GRIS Eq. 19, 35]",
                reference_scene,
                right=of(Frame),
                wrong=of(InvertedJacobian),
            ),
            Bug(
                "1/M over unequal supports",
                "The sum of weights is divided by the number of merged reservoirs, as in biased ReSTIR DI.",
                "dark at silhouettes and contact shadows",
                "[GRIS Eq. 20]",
                reference_scene,
                right=lambda scene: two_frame_loop(scene, across=ONE_OVER_Z),
                wrong=lambda scene: two_frame_loop(scene, across=CONSTANT),
            ),
            Bug(
                "rejection not mirrored",
                "Shifts with a large Jacobian are refused against fireflies, but MIS still counts them.",
                "dark or bright bands where pixels change scale, fewer fireflies",
                "[GRIS Eq. 35; 5.4]",
                reference_scene,
                right=of(RejectedBothWays),
                wrong=of(RejectedOneWay),
            ),
            Bug(
                "null confidence 0",
                "A pixel that found no light this frame is skipped, sample count and all.",
                "bright where light is rarely found: caustics, small or occluded lights",
                "[GRIS 6.2]",
                reference_scene,
                right=lambda scene: two_frame_loop(scene, across=TALBOT),
                wrong=lambda scene: two_frame_loop(scene, across=TALBOT, edit=null_confidence_zero),
            ),
            Bug(
                "neighbour chosen by sample value",
                "Reuse prefers the neighbour whose current sample looks best.",
                "bright overall",
                "[GRIS 6.2]",
                three_pixel_scene,
                right=right_neighbour,
                wrong=brighter_neighbour,
            ),
            Bug(
                "cap only in the denominator",
                "The M-cap is applied where weights are normalised, but not where history is weighed.",
                "bright, more so the longer the history",
                "[GRIS 6.2, 6.4]",
                reference_scene,
                right=two_frame_loop,
                wrong=lambda scene: two_frame_loop(scene, along=Weights(talbot_capped_below), cap=np.inf),
            ),
        )
    }
)


def exact_bias(loop: Loop, scene: Scene) -> Array:
    """Relative bias per cell of a loop on a scene, enumerated; (n, K)."""
    return bias_of(loop, scene.v, scene.support)
