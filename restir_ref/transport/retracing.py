"""The primary sample that a path's own pixel would have needed for it, and the path again from there.

After a shift the numbers of a record are those of its base path up to the reconnection, and stale from there on.
What they should be follows from the record alone: the directions into and out of x_c are inverted; of a lobe's
number only the interval is known, and where in it the number lies nothing reads, so it is drawn; all others are
valid as they are, for nothing behind x_c knows where the path came from.  [MCMC 5.2.5; Bitterli 2017]
"""

from dataclasses import dataclass, replace
from itertools import accumulate

import numpy as np

from restir_ref.batch import Array, pick, take
from restir_ref.chance import Chance
from restir_ref.transport import materials as mat
from restir_ref.transport.materials import Vertex
from restir_ref.transport.paths import REPLAY, Path, Tracer, leaves, trace
from restir_ref.transport.rays import vertex
from restir_ref.transport.record import record
from restir_ref.transport.shifts import replay
from restir_ref.transport.vectors import normalize

INSIDE = 1 - 2.0**-30
"""Keeps a number off the end of its interval, where rounding would make it the next lobe's."""

MOST = np.nextafter(1, 0)
"""The largest primary number."""


def traced(t: Tracer, u: Array, pixel: Array, k: Array, nee: Array) -> Path:
    """The record of the path that primary samples u (D, N) give in `pixel` (N,) as leaf (k, nee)."""
    tree = trace(t, u, pixel)
    F = np.zeros((t.scene.C, len(k)))
    for at, by_light, value in leaves(tree):
        F = np.where((k == at) & (nee == by_light), value, F)
    return record(t, tree, k, nee, F)


@dataclass(frozen=True)
class Connection:
    """The two ends of a reconnection as one path sees them: x_(c-1), x_c, and the lobe shares at each."""

    v: Vertex
    z: Vertex
    P_in: Array
    P_out: Array
    w: Array


def connection(t: Tracer, x: Path, pixel: Array) -> Connection:
    """Where the path of `pixel` (N,) leaves its free prefix; all columns must reconnect."""
    v = replay(replace(t, rule=REPLAY), x, pixel).v  # as it is, whether or not it could have connected before
    w = normalize(x.z - v.x)
    z = vertex(t.scene, x.z, x.prim, -w)
    table = t.scene.materials
    return Connection(v, z, mat.lobe_shares(table, v), mat.lobe_shares(table, z), w)


def own_numbers(t: Tracer, x: Path, pixel: Array, chance: Chance) -> Array:
    """u (D, N) that tracing in `pixel` (N,) takes to the very path x, whatever reuse it went through.

    Where inside of its lobe's interval a number lies is drawn, uniformly; two draws per column.
    """
    rest = chance.uniform((2, len(pixel)))
    u = np.array(x.u)
    for c in np.unique(x.c[x.c > 0]):
        columns = np.flatnonzero(x.c == c)
        part = take(x, columns)
        u[:, columns] = _connected(t, part, connection(t, part, pixel.take(columns)), rest.take(columns, axis=-1))
    return u


def _connected(t: Tracer, x: Path, at: Connection, rest: Array) -> Array:
    """The numbers at x_(c-1), and where a BSDF sample leaves it at x_c, in their places; all columns have one c."""
    u, c = np.array(x.u), int(x.c[0])
    t.lobe_number(u, c - 1)[:] = inside(at.P_in, x.lobe_in, rest[0])
    t.direction_numbers(u, c - 1)[:] = direction_number(t, at.v, x.lobe_in, at.w)
    through = np.flatnonzero((x.c <= x.k) & ~(x.nee & (x.c == x.k)))
    if len(through):
        z, P, lobe, out, r = take((at.z, at.P_out, x.lobe_out, x.out, rest[1]), through)
        t.lobe_number(u, c)[through] = inside(P, lobe, r)
        t.direction_numbers(u, c)[:, through] = direction_number(t, z, lobe, out)
    return u


def inside(P: Array, lobe: Array, r: Array) -> Array:
    """A number that chooses `lobe` by shares P (L, N): r in [0, 1) of the way through its interval, (N,)."""
    start = pick([np.zeros(len(r)), *accumulate(P[:-1])], lobe)
    return np.asarray(start + r * INSIDE * pick([*P], lobe))


def direction_number(t: Tracer, v: Vertex, lobe: Array, w: Array) -> Array:
    """The numbers (d-1, N) with which a lobe at v samples direction w (d, N), world."""
    space = t.scene.space
    return np.clip(mat.invert_lobe(t.scene.materials, space, v, lobe, space.to_local(v.n, w)), 0, MOST)
