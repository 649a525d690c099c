"""ReSTIR PT once more, in the measure of directions: the twin of primary sample space.  [GRIS 8.1]

Here a path is its film numbers, its lobes, and the directions w_1 .. w_k that leave its vertices.  The
integrand is omega f, not divided by anything; a traced path has density p = p_1 .. p_k, so W = 1 / p.
In primary sample space the integrand is F = omega f / p and W = 1.  A shift moves a path by

    du_y/du_x = du_y/dw_y  dw_y/dw_x  dw_x/du_x,    du/dw = p,

so the two Jacobians differ by p(y) / p(x) [GRIS Eq. 54], and all of p_hat, W and J change while
p_hat W J, f W and every MIS weight stay.  Nothing of `record` and `shifts` is used.

Lobes are discrete, but the number that chooses one is not: what is left of it, v in [0, 1) inside the
lobe's interval of length P, is a coordinate of the path that nothing reads [GRIS 8.1, padding].  Thus p
contains P; replay changes v by P_x / P_y, a reconnection copies lobe and v.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from restir_ref.batch import Array, ratio
from restir_ref.chance import Chance
from restir_ref.integrals import Pixels, Shifted
from restir_ref.resampling import Candidate, select
from restir_ref.transport.paths import Tracer, leaves, trace
from restir_ref.transport.proofs.reading import (
    ExtendedPath,
    Factors,
    contribution,
    density,
    factors,
    first_connectable,
    leaf_path,
    offset_path,
)
from restir_ref.transport.vectors import power


@dataclass(frozen=True)
class Walk:
    """A path x with its factors, where it reconnects c (N,), omega f (C, N), and its density p (N,)."""

    x: ExtendedPath
    of: Factors
    c: Array
    f: Array
    p: Array


def walk(t: Tracer, x: ExtendedPath) -> Walk:
    """Evaluate a path from its vertices and directions."""
    of = factors(t, x)
    return Walk(x, of, first_connectable(t, x, of), contribution(x, of), density(of))


def shift_walk(t: Tracer, x: Walk, pixel: Array) -> tuple[Walk, Array]:
    """y = T(x) in `pixel` (N,) of tracer t, and |dw_y / dw_x| (N,): 0 unless y reconnects where x does."""
    y = walk(t, offset_path(t, x.x, x.c, pixel))
    legal = (y.c == x.c) & complete(y)
    return y, np.where(legal, direction_jacobian(t.scene.space.d, x, y), 0.0)


def complete(y: Walk) -> Array:
    """Whether the path could have been traced: it has a density, and no ray left the scene."""
    return np.asarray(y.x.seen.all(axis=0) & (y.p > 0))


def direction_jacobian(d: int, x: Walk, y: Walk) -> Array:
    """|dw_y / dw_x|: replay at the vertices 1 .. c-2, a reconnection at c-1, copied directions behind; (N,).

    c = 0 replays the directions of all vertices 1 .. k, light sampling's included.
    """
    i, k = np.arange(len(x.of.p))[:, None], np.arange(len(x.c))
    replayed = (i >= 1) & (i < np.where(x.c > 0, x.c - 1, x.x.k + 1))
    J = np.where(replayed, replay_jacobian(x.of, y.of), 1.0).prod(axis=0)
    return np.asarray(J * np.where(x.c > 0, reconnection_jacobian(d, x.of, y.of)[x.c, k], 1.0))


def replay_jacobian(x: Factors, y: Factors) -> Array:
    """|dw_y / dw_x| = p_x / p_y where both directions come from the same numbers; (K, N).  [GRIS Eq. 53]

    du_y = du_x, and du = p dw on either side.
    """
    return ratio(x.p, y.p)


def reconnection_jacobian(d: int, x: Factors, y: Factors) -> Array:
    """|dw_y / dw_x| = |cos_y / cos_x| (r_x / r_y)^(d-1) where both directions end in x_c; (K, N).  [GRIS Eq. 52]

    Both see the same area da at x_c, dw = cos da / r^(d-1).  Entry i is for a connection to x_i.
    """
    return np.asarray(y.cos / x.cos * power(x.r / y.r, d - 1))


def primary_jacobian(d: int, x: Walk, y: Walk) -> Array:
    """|du_y / du_x| = p(y) / p(x) |dw_y / dw_x|, the Jacobian of `shifts`; (N,).  [GRIS Eq. 54]

    Replayed vertices cancel.  What is left are the density ratios of the direction into x_c and, if a BSDF
    sample leaves x_c, of that direction: it is copied, but its density depends on where it comes from.
    """
    return ratio(y.p, x.p) * direction_jacobian(d, x, y)


@dataclass(frozen=True, eq=False)
class DirectionIntegrals:
    """The pixels' path integrals over directions; p_hat is the mean of omega f over channels.

    The same calls of chance as `restir_pt.PathIntegrals`, and the same images.
    """

    tracer: Tracer

    @property
    def n(self) -> int:
        """Number of pixels."""
        return self.tracer.sensor.n

    def candidates(self, index: Array, chance: Chance) -> Iterator[tuple[Walk, Array]]:
        """One path tree, resampled to one of its leaves: each is a candidate with W = 1 / p."""
        t, pixel, one = self.tracer, index % self.n, np.ones(len(index))
        tree = trace(t, chance.uniform((t.D, len(index))), pixel)
        kinds = [(np.full(len(index), k), np.full(len(index), nee)) for k, nee, _ in leaves(tree)]
        walks = [walk(t, leaf_path(t, tree, pixel, k, nee)) for k, nee in kinds]
        chosen = select([Candidate(x, self.target(index, x), ratio(one, x.p)) for x in walks], chance, one)
        yield chosen.x, chosen.W

    def target(self, index: Array, x: Walk) -> Array:
        """p_hat = mean of omega f over channels, not divided by p."""
        return np.asarray(x.f.mean(axis=0))

    def contribution(self, index: Array, x: Walk) -> Array:
        """Omega f, (C, N)."""
        return x.f

    def shift(self, x: Walk, index: Array, to: Pixels) -> Shifted:
        """Replay and reconnect in the other image's scene, seen by its sensor."""
        there: DirectionIntegrals = to.of  # type: ignore[assignment]
        return Shifted(*shift_walk(there.tracer, x, to.index % there.n))
