"""Shifts that are defined where they, or their inverse, should not be."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from restir_ref.batch import Array, ratio, take
from restir_ref.integrals import Pixels, Shifted
from restir_ref.transport.intersection import Surfaces
from restir_ref.transport.paths import RECONNECTION, REPLAY, Path, Tracer
from restir_ref.transport.restir_pt import PathIntegrals
from restir_ref.transport.scene import Scene
from restir_ref.transport.shifts import reconnect, replay, shift_path

LARGEST_JACOBIAN = 1.5
"""Where the one-way rejection draws its line."""


@dataclass(frozen=True, eq=False)
class Transparent:
    """Surfaces of which nothing stands between two points; rays still meet them."""

    surfaces: Surfaces

    def intersect(self, x: Array, w: Array) -> tuple[Array, Array]:
        """As ever."""
        return self.surfaces.intersect(x, w)

    def visible(self, x: Array, y: Array) -> Array:
        """Always."""
        return np.ones(x.shape[-1], dtype=bool)

    def foremost(self, x: Array, prim: Array, w: Array) -> Array:
        """As ever."""
        return self.surfaces.foremost(x, prim, w)


def transparent(scene: Scene) -> Scene:
    """`scene` without shadows."""
    return replace(scene, surfaces=Transparent(scene.surfaces))


def never_early(t: Tracer) -> Tracer:
    """Nothing connects, so nothing connects too early."""
    return replace(t, rule=REPLAY)


def anything_goes(t: Tracer) -> Tracer:
    """Everything but delta lobes connects, however near."""
    return replace(t, rule=RECONNECTION)


def through_walls(t: Tracer) -> Tracer:
    """Nothing hides."""
    return replace(t, scene=transparent(t.scene))


def as_it_is(t: Tracer) -> Tracer:
    """The tracer itself."""
    return t


Change = Callable[[Tracer], Tracer]


@dataclass(frozen=True, eq=False)
class Loosened(PathIntegrals):
    """The shift with one of its tests taken away: on the way to the connection, or at it."""

    before: Change = as_it_is
    at: Change = as_it_is

    def shift(self, x: Path, index: Array, to: Pixels) -> Shifted:
        """Replay with one tracer, reconnect with another."""
        there: PathIntegrals = to.of  # type: ignore[assignment]
        t, pixel = there.tracer, to.index % there.n
        y, J = shift_path(self.before(t), x, pixel)  # right for paths that never reconnect
        F, A, J = y.F.copy(), y.A.copy(), np.where(x.c > 0, 0, J)
        F[:, x.c > 0], A[x.c > 0] = 0, 1
        columns = np.flatnonzero(x.c > 0)
        if len(columns):
            part = take(x, columns)
            found, density, legal = reconnect(self.at(t), part, replay(self.before(t), part, pixel[columns]))
            J[columns] = np.where(legal, ratio(density, part.A), 0)
            F[:, columns], A[columns] = found * legal, np.where(legal, density, 1)
        return Shifted(replace(y, F=F, A=A), J)


@dataclass(frozen=True, eq=False)
class Refused(PathIntegrals):
    """Shifts that a rule does not allow are undefined; allowed(x, from pixel, to pixel, J) -> (N,)."""

    allowed: Callable[[Path, Array, Array, Array], Array]

    def shift(self, x: Path, index: Array, to: Pixels) -> Shifted:
        """T where it is allowed."""
        y = super().shift(x, index, to)
        return Shifted(y.x, np.where(self.allowed(x, index % self.n, to.index % self.n, y.J), y.J, 0))


def small(x: Path, i: Array, j: Array, J: Array) -> Array:
    """J <= 1.5, and nothing asked of 1 / J: the way back is allowed where the way forth is not."""
    return J <= LARGEST_JACOBIAN


def small_both_ways(x: Path, i: Array, j: Array, J: Array) -> Array:
    """The right form of the same rejection."""
    return np.maximum(J, ratio(np.ones(1), J)) <= LARGEST_JACOBIAN
