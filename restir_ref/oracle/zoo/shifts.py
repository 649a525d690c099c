"""Bugs in shifts: another Jacobian, another domain, another way back.  [GRIS Def. 4.2, Eq. 7, 19, 35]

Each is a kind of frame.  Where it stands for `here` *and* `near` the whole renderer is wrong alike;
`near` alone is the way forth, `here` alone the way back that MIS weights take.
"""

import numpy as np

from restir_ref.batch import Array, ratio
from restir_ref.integrals import Pixels, Shifted
from restir_ref.oracle.cells import Frame
from restir_ref.oracle.scenes import Parts, reference_scene
from restir_ref.oracle.zoo.bug import Bug, of

LARGEST_JACOBIAN = 1.5
"""Where the rejections of the zoo draw their line."""


class UnitJacobian(Frame):
    """J left out: 1 wherever the shift is defined."""

    def shift(self, x: Array, index: Array, to: Pixels) -> Shifted:
        """T_ij with 1 for J."""
        y = super().shift(x, index, to)
        return Shifted(y.x, np.where(y.J > 0, 1.0, 0.0))


class InvertedJacobian(Frame):
    """J of the wrong direction: v_i / v_j."""

    def shift(self, x: Array, index: Array, to: Pixels) -> Shifted:
        """T_ij with 1/J for J."""
        y = super().shift(x, index, to)
        return Shifted(y.x, ratio(np.ones(len(index)), y.J))


class SquaredJacobian(Frame):
    """J with the exponent of another dimension: J^2."""

    def shift(self, x: Array, index: Array, to: Pixels) -> Shifted:
        """T_ij with J^2 for J."""
        y = super().shift(x, index, to)
        return Shifted(y.x, y.J**2)


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


class TwoToOne(Frame):
    """Holes are patched: what has no counterpart goes to the first cell of the other pixel."""

    def shift(self, x: Array, index: Array, to: Pixels) -> Shifted:
        """T_ij, or the first cell with the Jacobian of its volume."""
        there: Frame = to.of  # type: ignore[assignment]
        y = super().shift(x, index, to)
        v = self.cells.v
        patched = ratio(v[there.ids(to.index), 0], v[self.ids(index), x])
        return Shifted(y.x, np.where(y.J > 0, y.J, patched))  # an undefined shift already points at cell 0


class Unreached(Frame):
    """A target where no technique of the pixel's own sampler reaches."""

    def target(self, index: Array, x: Array) -> Array:
        """p_hat = f everywhere."""
        return np.asarray(self.cells.f[self.ids(index), x])


SHIFT_BUGS = (
    Bug(
        "Jacobian left out",
        "The code was written for a shift that preserves measure, and the shift was improved later.",
        "too bright or too dark where neighbouring pixels see different scales, such as depth edges",
        "[GRIS Eq. 7, 19]",
        reference_scene,
        right=of(Frame),
        wrong=of(UnitJacobian),
    ),
    Bug(
        "inverted Jacobian",
        "The Jacobian of a reconnection is written down for the shift back instead of forth.",
        "too bright or too dark at depth edges, with the opposite sign on their other side",
        "[GRIS Eq. 19, 35]",
        reference_scene,
        right=of(Frame),
        wrong=of(InvertedJacobian),
    ),
    Bug(
        "Jacobian of another dimension",
        "The squared distance of 3D is kept in flatland, or a solid angle meets an area: the power of J is wrong.",
        "too bright or too dark near corners and contacts, where distances differ most",
        "[GRIS Eq. 19, 52]",
        reference_scene,
        right=of(Frame),
        wrong=of(SquaredJacobian),
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
        "rejection unknown to MIS",
        "A heuristic test on normals or depth refuses samples after they are shifted, but not inside the MIS weights.",
        "dark wherever the heuristic refuses: edges of geometry and materials",
        "[GRIS Eq. 35]",
        reference_scene,
        right=of(RejectedBothWays),
        wrong=Parts(near=RejectedBothWays),
    ),
    Bug(
        "rejection only in MIS",
        "The shift back of the MIS weights got a stricter test than the shift that brings the samples.",
        "bright outlines, as samples are counted that no weight expects",
        "[GRIS Eq. 35]",
        reference_scene,
        right=of(RejectedBothWays),
        wrong=Parts(here=RejectedBothWays),
    ),
    Bug(
        "two-to-one shift",
        "Where a shift fails it falls back to something valid: clamped coordinates, the nearest vertex or pixel.",
        "bright and dark rims along the borders of the shift's domain: screen edges, corners, silhouettes",
        "[GRIS Def. 4.2]",
        reference_scene,
        right=of(Frame),
        wrong=of(TwoToOne),
    ),
    Bug(
        "target beyond the sampler's support",
        "The target rates what the pixel's own sampler never finds, such as light beyond the depth limit.",
        "dark where a neighbour seems able to help but never does",
        "[GRIS Eq. 15, 35]",
        reference_scene,
        right=of(Frame),
        wrong=of(Unreached),
    ),
)
