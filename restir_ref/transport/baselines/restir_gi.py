"""ReSTIR GI as integrals: paths whose shift keeps the radiance stored at x_2.  [Ouyang 2021; GRIS 9.3]

The same candidates as ReSTIR PT with the reconnection shift, but of a path that scatters at x_2 only L is
kept, the radiance that left x_2 towards the x_1 it was found from.  Seen from another x_1 it is taken to be
the same.  That is exact if x_2 is Lambertian: then neither f / p there nor its MIS weights depend on the
direction of x_1.  Elsewhere the BSDF at x_2 should have been evaluated again, and the result is biased.

Paths that scatter only at x_1 have no radiance to keep; they are shifted as in ReSTIR PT.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from restir_ref.batch import Array, ratio, take
from restir_ref.chance import Chance
from restir_ref.integrals import Pixels, Shifted
from restir_ref.transport import materials as mat
from restir_ref.transport.paths import RECONNECTION, Path, Tracer, first_hit, leaves, trace
from restir_ref.transport.rays import GRAZING
from restir_ref.transport.record import record
from restir_ref.transport.shifts import shift_path
from restir_ref.transport.subtrees import behind, of_leaf, one_leaf
from restir_ref.transport.vectors import dot, norm


@dataclass(frozen=True)
class Stored:
    """A path, and what its shift keeps if it connects at x_2 and scatters there.

    path  F and A as of any path, but A is the density of x_2 (area) alone
    n (d, N)  normal of x_2 on the side of x_1;  L (C, N)  radiance leaving x_2: F = T f |cos| / p L
    """

    path: Path
    n: Array
    L: Array


@dataclass(frozen=True, eq=False)
class RadianceIntegrals:
    """The pixels' path integrals as ReSTIR GI shares them; p_hat is the mean of F over channels.

    Raises ValueError for other connections than those at x_2.
    """

    tracer: Tracer

    def __post_init__(self) -> None:
        if self.tracer.rule != RECONNECTION:
            raise ValueError(f"ReSTIR GI connects at x_2: its rule is {RECONNECTION}, not {self.tracer.rule}.")

    @property
    def n(self) -> int:
        """Number of pixels."""
        return self.tracer.sensor.n

    def candidates(self, index: Array, chance: Chance) -> Iterator[tuple[Stored, Array]]:
        """One path tree, resampled to one of its leaves, and the radiance at x_2 that belongs to it."""
        t = self.tracer
        tree = trace(t, chance.uniform((t.D, len(index))), index % self.n)
        leaf, W = one_leaf(tree, chance)
        k, nee, F = zip(*leaves(tree), strict=True)
        x = record(t, tree, np.array(k)[leaf], np.array(nee)[leaf], of_leaf(list(F), leaf))
        none = np.zeros_like(F[0])
        L = of_leaf([none, none, *(L for _, _, L in leaves(behind(tree)))], leaf)  # k = 0 and k = 1 by light sampling
        z, at = tree.x[1], tree.at[0]
        A = np.where(keeps_radiance(x), at.p * z.o[-1] / tree.r[1] ** (t.scene.space.d - 1), x.A)
        yield Stored(replace(x, A=A), z.n, L), W

    def target(self, index: Array, x: Stored) -> Array:
        """p_hat = mean of F over channels, visibility and MIS weight included."""
        return np.asarray(x.path.F.mean(axis=0))

    def contribution(self, index: Array, x: Stored) -> Array:
        """F = omega f / p, (C, N)."""
        return x.path.F

    def shift(self, x: Stored, index: Array, to: Pixels) -> Shifted:
        """Connect x_1 of the other pixel to x_2, which still sends L."""
        there: RadianceIntegrals = to.of  # type: ignore[assignment]
        F, A, J = shift_stored(there.tracer, x, to.index % there.n)
        return Shifted(replace(x, path=replace(x.path, F=F, A=A)), J)


def keeps_radiance(x: Path) -> Array:
    """Whether the path connects at x_2 and scatters there, (N,)."""
    return np.asarray((x.c == 2) & (x.k >= 2))


def shift_stored(t: Tracer, x: Stored, pixel: Array) -> tuple[Array, Array, Array]:
    """F, A and J of the offset paths in `pixel` (N,); J = 0 where undefined."""
    kept = keeps_radiance(x.path)
    F, A, J = np.zeros_like(x.path.F), np.ones_like(x.path.A), np.zeros_like(x.path.A)
    for columns, offset in ((np.flatnonzero(kept), _reconnected), (np.flatnonzero(~kept), _shifted)):
        if len(columns):
            F[:, columns], A[columns], J[columns] = offset(t, take(x, columns), pixel[columns])
    return F, A, J


def _shifted(t: Tracer, x: Stored, pixel: Array) -> tuple[Array, Array, Array]:
    """As in ReSTIR PT."""
    y, J = shift_path(t, x.path, pixel)
    return y.F, y.A, J


def _reconnected(t: Tracer, x: Stored, pixel: Array) -> tuple[Array, Array, Array]:
    """F = T f |cos| / p L; J = p |cos_2| / r^(d-1) of y over that of x."""
    space, table = t.scene.space, t.scene.materials
    v, _, T = first_hit(t, x.path.u, pixel)
    to = x.path.z - v.x
    r = np.maximum(norm(to), 1e-300)
    w = to / r
    local, cos = space.to_local(v.n, w), -dot(x.n, w)
    weight, p, _ = mat.scatter_lobe(table, space, v, mat.lobe_shares(table, v), x.path.lobe_in, local)
    A = p * np.maximum(cos, 0) / r ** (space.d - 1)
    legal = (A > 0) & T.any(axis=0) & (np.minimum(np.abs(local[-1]), cos) > GRAZING)
    asked = np.flatnonzero(legal)
    legal[asked] = t.scene.visible(v.x.take(asked, axis=-1), x.path.z.take(asked, axis=-1))
    return np.where(legal, T * weight * x.L, 0.0), np.where(legal, A, 1.0), np.where(legal, ratio(A, x.path.A), 0.0)
