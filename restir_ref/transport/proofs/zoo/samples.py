"""Bugs in what a sample is said to be: its target, its pixel, its frame.  [GRIS 6.3, App. B]"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from restir_ref.batch import Array
from restir_ref.chance import Chance
from restir_ref.integrals import Pixels, Shifted
from restir_ref.transport.paths import Path, Tracer
from restir_ref.transport.proofs.zoo.bug import TransportBug
from restir_ref.transport.proofs.zoo.domains import through_walls
from restir_ref.transport.restir_pt import PathIntegrals
from restir_ref.transport.shifts import shift_path


@dataclass(frozen=True, eq=False)
class AsItIs(PathIntegrals):
    """Samples are taken over without a shift."""

    def shift(self, x: Path, index: Array, to: Pixels) -> Shifted:
        """x, F and all, with J = 1."""
        return Shifted(x, np.ones(len(index)))


@dataclass(frozen=True)
class Lit:
    """A path as it would be if its light, or its reconnection vertex, were not hidden; and the F it really has."""

    path: Path
    F: Array


@dataclass(frozen=True, eq=False)
class Unoccluded:
    """The target leaves visibility out, contribution and sampler do not: supp p_hat is not in supp X."""

    tracer: Tracer

    @property
    def n(self) -> int:
        """Number of pixels."""
        return self.tracer.sensor.n

    def candidates(self, index: Array, chance: Chance) -> Iterator[tuple[Lit, Array]]:
        """Paths that carry light: the tracer finds no others."""
        for x, W in PathIntegrals(self.tracer).candidates(index, chance):
            yield Lit(x, x.F), W

    def target(self, index: Array, x: Lit) -> Array:
        """p_hat without visibility."""
        return np.asarray(x.path.F.mean(axis=0))

    def contribution(self, index: Array, x: Lit) -> Array:
        """F."""
        return x.F

    def shift(self, x: Lit, index: Array, to: Pixels) -> Shifted:
        """To where the path would be; it carries light there if nothing is between."""
        there: Unoccluded = to.of  # type: ignore[assignment]
        t, pixel = there.tracer, to.index % there.n
        y, J = shift_path(through_walls(t), x.path, pixel)
        real, J_real = shift_path(t, x.path, pixel)
        return Shifted(Lit(y, np.where(J_real > 0, real.F, 0)), J)


SAMPLE_BUGS = (
    TransportBug(
        "path taken over as it is",
        "After a cut or a move of the camera reservoirs are kept: same pixel, same W, same stored radiance.",
        "bright and dark ghosts, smeared edges, light that lags behind",
        "[GRIS Eq. 44, 45]",
        AsItIs,
        ("re-tracing", "finite differences", "spread over pixels", "mean of the image"),
    ),
    TransportBug(
        "target without visibility",
        "Shadow rays are saved in the target, as resampled direct light does; but a path tracer, unlike a light"
        " sampler, never returns what is hidden.",
        "dark penumbras and contact shadows",
        "[GRIS Eq. 35; App. B]",
        Unoccluded,
        ("spread over pixels", "mean of the image"),
    ),
)

HISTORY_BUGS = (
    TransportBug(
        "history rated with the current camera",
        "The previous frame's camera and first hits are gone, so the MIS weights shift samples back to the same pixel"
        " of the current frame.",
        "dark trails where something has moved away, right while nothing moves",
        "[GRIS Eq. 35; 6.3, App. B]",
        PathIntegrals,
        ("disoccluded pixels",),
    ),
)
"""`wrong` is right, but in the wrong place: given the current tracer, it stands for the previous frame's integrals."""
