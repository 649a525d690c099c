"""The primary sample of an offset path: what a tracer would have to draw to find it by itself.

Shifts never need it (the reconnection data takes over), but their proof does: tracing u^y from
scratch must find the same path, and its finite differences must give the same Jacobian.
"""

import numpy as np

from restir_ref.batch import Array, take
from restir_ref.transport import materials as mat
from restir_ref.transport.paths import Path, Tracer
from restir_ref.transport.retracing import Connection, connection, traced

__all__ = ["Connection", "connection", "primary_sample", "traced"]


def primary_sample(tx: Tracer, x: Path, pixel_x: Array, ty: Tracer, y: Path, pixel_y: Array) -> Array:
    """u^y (D, N) of the offset path y of a base path x that was traced.

    It is y.u up to the connection, the lobes' inverses there, and x.u behind; y.u where nothing reconnects.
    """
    u = np.array(y.u)
    for c in np.unique(x.c[x.c > 0]):
        columns = np.flatnonzero(x.c == c)
        part_x, part_y = take(x, columns), take(y, columns)
        at_x, at_y = connection(tx, part_x, pixel_x[columns]), connection(ty, part_y, pixel_y[columns])
        u[:, columns] = _reconnected(ty, part_x, part_y.u, at_x, at_y, int(c))
    return u


def _reconnected(t: Tracer, x: Path, u_y: Array, at_x: Connection, at_y: Connection, c: int) -> Array:
    """y's own numbers up to y_(c-2); those of y_(c-1) and, where a BSDF sample leaves it, of x_c are replaced."""
    table, space, u = t.scene.materials, t.scene.space, np.array(x.u)
    before = t.sensor.numbers + 2 * space.d * (c - 2)
    u[:before] = u_y[:before]
    t.lobe_number(u, c - 1)[:] = mat.choose_number(at_x.P_in, at_y.P_in, x.lobe_in, t.lobe_number(x.u, c - 1))
    local = space.to_local(at_y.v.n, at_y.w)
    t.direction_numbers(u, c - 1)[:] = mat.invert_lobe(table, space, at_y.v, x.lobe_in, local)
    through = np.flatnonzero((x.c <= x.k) & ~(x.nee & (x.c == x.k)))
    if len(through):
        z, out = take(at_y.z, through), x.out.take(through, axis=-1)
        numbers = t.lobe_number(x.u, c).take(through)
        P_x, P_y = at_x.P_out.take(through, axis=-1), at_y.P_out.take(through, axis=-1)
        lobe = x.lobe_out.take(through)
        t.lobe_number(u, c)[through] = mat.choose_number(P_x, P_y, lobe, numbers)
        t.direction_numbers(u, c)[:, through] = mat.invert_lobe(table, space, z, lobe, space.to_local(z.n, out))
    return u
