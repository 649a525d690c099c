"""What the two paths of a shift have at their connections: the numbers that wrong Jacobians leave out."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from restir_ref.batch import Array, pick, ratio, take
from restir_ref.integrals import Pixels, Shifted
from restir_ref.transport import materials as mat
from restir_ref.transport.paths import Path, Tracer
from restir_ref.transport.proofs.inversion import connection
from restir_ref.transport.rays import emitted, light_pdf
from restir_ref.transport.restir_pt import PathIntegrals
from restir_ref.transport.vectors import norm


@dataclass(frozen=True)
class End:
    """The connection x_(c-1), x_c of one path.

    r, cos (N,)      its length, and the cosine at x_c
    P, p, p_all      at x_(c-1): probability of the lobe, its density with that, the density of all lobes
    p_out            density of the direction leaving x_c with its lobe's probability; 1 where none was sampled
    p_light          density of light sampling from x_(c-1), 0 where x_c is no light
    omega (N,)       MIS weight of the path's end; 1 where it does not depend on the connection
    beyond (C, N)    f / p at x_c, or all of f before light sampling; 1 on a light
    """

    r: Array
    cos: Array
    P: Array
    p: Array
    p_all: Array
    p_out: Array
    p_light: Array
    omega: Array
    beyond: Array

    @property
    def A(self) -> Array:
        """p |cos| / r^(d-1) p_out, without the power of r."""
        return np.asarray(self.p * self.cos * self.p_out)


def end(t: Tracer, x: Path, pixel: Array) -> End:
    """The connection of paths of `pixel` (N,), all of which reconnect."""
    at, table, space = connection(t, x, pixel), t.scene.materials, t.scene.space
    _, p, p_all = mat.scatter_lobe(table, space, at.v, at.P_in, x.lobe_in, space.to_local(at.v.n, at.w))
    out = space.to_local(at.z.n, x.out)
    weight, p_out, _ = mat.scatter_lobe(table, space, at.z, at.P_out, x.lobe_out, out)
    f_all, p_all_out = mat.evaluate_all(table, space, at.z, at.P_out, out)
    on_light, lit = x.c > x.k, x.nee & (x.c == x.k)
    r = norm(x.z - at.v.x)
    p_light = light_pdf(t.scene, at.z, r) * emitted(t.scene, at.z).any(axis=0)
    by_light, by_hit = ratio(x.p_light, x.p_light + p_all_out), ratio(p_all_out, p_all_out + x.p_light)
    omega = np.where(x.c < x.k, 1.0, np.where(on_light, ratio(p_all, p_all + p_light), np.where(lit, by_light, by_hit)))
    return End(
        r,
        at.z.o[-1],
        pick([*at.P_in], x.lobe_in),
        p,
        p_all,
        np.where(on_light | lit, 1.0, p_out),
        p_light,
        omega,
        np.where(on_light, 1.0, np.where(lit, f_all, weight)),
    )


def both_ends(of: PathIntegrals, x: Path, index: Array, y: Shifted, to: Pixels) -> tuple[Array, End, End]:
    """The columns (M,) whose shift is defined and reconnects, and both paths' connections there."""
    there: PathIntegrals = to.of  # type: ignore[assignment]
    columns = np.flatnonzero((y.J > 0) & (x.c > 0))
    at_x = end(of.tracer, take(x, columns), index[columns] % of.n)
    return columns, at_x, end(there.tracer, take(y.x, columns), to.index[columns] % there.n)


Factor = Callable[[int, End, End], Array]
"""(d, base, offset) -> a factor that should not be there; (N,) or (C, N)."""


@dataclass(frozen=True, eq=False)
class Rescaled(PathIntegrals):
    """Jacobians of reconnections are off by a factor."""

    factor: Factor

    def shift(self, x: Path, index: Array, to: Pixels) -> Shifted:
        """T with J times the factor."""
        y = super().shift(x, index, to)
        columns, at_x, at_y = both_ends(self, x, index, y, to)
        J = y.J.copy()
        J[columns] *= self.factor(self.tracer.scene.space.d, at_x, at_y)
        return Shifted(y.x, J)


@dataclass(frozen=True, eq=False)
class Misvalued(PathIntegrals):
    """What an offset path carries is off by a factor."""

    factor: Factor

    def shift(self, x: Path, index: Array, to: Pixels) -> Shifted:
        """T with F times the factor."""
        y = super().shift(x, index, to)
        columns, at_x, at_y = both_ends(self, x, index, y, to)
        F = y.x.F.copy()
        F[:, columns] *= self.factor(self.tracer.scene.space.d, at_x, at_y)
        return Shifted(replace(y.x, F=F), y.J)
