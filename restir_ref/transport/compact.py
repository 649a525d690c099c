"""The fewest numbers from which a path can be shifted again: what a reservoir has to keep.  [GRIS 8.2]

`Path` is convenient: it also holds what follows from the rest.  F and A follow by replaying the path in
its own pixel, S and p_light by tracing on from x_c.  Of the primary sample only d numbers per vertex are
ever read, those of its lobe and direction, or those of light sampling at the end; and where a path
reconnects, x_c and the direction leaving it take the place of just those numbers that they make stale.
So a path of any history is sensor + d depth numbers, and a few small integers.
"""

from dataclasses import dataclass, replace

import numpy as np

from restir_ref.batch import Array, changed, joined, take, total
from restir_ref.transport.materials import Vertex, lobe_shares
from restir_ref.transport.paths import Path, Suffix, Tracer, leaves, light_leaf, trace
from restir_ref.transport.rays import light_pdf, vertex
from restir_ref.transport.shifts import reconnect, replay, shift_path
from restir_ref.transport.vectors import normalize


@dataclass(frozen=True)
class Compact:
    """A path in few bytes.

    numbers (sensor + d depth, N)  the sensor's, then a slot of d per vertex x_i:
        i = c - 1               x_c
        i = c, sampled by BSDF  the direction leaving x_c
        i = k, end by NEE       light pick 1, light point d-1
        else                    lobe 1, direction d-1
    k, nee, c, prim, lobe_in, lobe_out (N,)  as in `Path`; a byte each, unless depth or lobes need more, prim four
    """

    numbers: Array
    k: Array
    nee: Array
    c: Array
    prim: Array
    lobe_in: Array
    lobe_out: Array


def pack(t: Tracer, x: Path) -> Compact:
    """Leave out what follows from the rest."""
    first, i = t.sensor.numbers, _vertices(t)
    by_vertex = x.u[first:].reshape(t.depth, 2, t.scene.space.d, -1)
    slots = np.where(x.nee & (x.k == i), by_vertex[:, 1], by_vertex[:, 0])
    slots = np.where(_goes_on(x, i), x.out, np.where(x.c == i + 1, x.z, slots))
    numbers = np.concatenate([x.u[:first], slots.reshape(-1, len(x.k))])
    small = np.min_scalar_type(max(t.depth + 1, t.scene.materials.L - 1))
    k, c, lobe_in, lobe_out = (each.astype(small) for each in (x.k, x.c, x.lobe_in, x.lobe_out))
    return Compact(numbers, k, x.nee, c, x.prim.astype(np.int32), lobe_in, lobe_out)


def _vertices(t: Tracer) -> Array:
    """1 .. depth along the first of three axes: vertex, number, column."""
    return np.arange(1, t.depth + 1)[:, None, None]


def _goes_on(x: Path | Compact, i: Array) -> Array:
    """Whether the path reconnects at x_i and leaves it by a BSDF sample."""
    return np.asarray((x.c == i) & (i <= x.k) & ~(x.nee & (x.k == i)))


def unpack(t: Tracer, x: Compact, pixel: Array) -> Path:
    """The path record again, by tracing the path in its own `pixel` (N,); numbers that nothing reads are 1/2."""
    known = _untraced(t, x)
    groups = [np.flatnonzero(known.c == c) for c in range(t.depth + 2)]
    parts = [_traced(t, take(known, columns), pixel.take(columns)) for columns in groups if len(columns)]
    return take(joined(parts), np.argsort(np.concatenate(groups)))


def _traced(t: Tracer, x: Path, pixel: Array) -> Path:
    """S and p_light from x_c on, F and A from the pixel on; all columns reconnect at one index."""
    c = int(x.c[0])
    if c == 0:
        return changed(x, F=shift_path(t, x, pixel)[0].F)
    y = replay(t, x, pixel)
    whole = _by_light(t, _by_hit(t, x, c), vertex(t.scene, x.z, x.prim, normalize(y.v.x - x.z)))
    F, A, _ = reconnect(t, whole, y)
    return changed(whole, F=F, A=A)


def _untraced(t: Tracer, x: Compact) -> Path:
    """What needs no tracing: the numbers, x_c and its direction back in their places."""
    first, d, N, i = t.sensor.numbers, t.scene.space.d, len(x.k), _vertices(t)
    slots = x.numbers[first:].reshape(t.depth, d, N)
    at_z, at_out, at_light = x.c == i + 1, _goes_on(x, i), x.nee & (x.k == i)
    own, light = np.where(at_z | at_out | at_light, 0.5, slots), np.where(at_light, slots, 0.5)
    u = np.concatenate([x.numbers[:first], np.stack([own, light], axis=1).reshape(-1, N)])
    z, out = np.where(at_z, slots, 0).sum(axis=0), np.where(at_out, slots, 0).sum(axis=0)
    k, c, prim, lobe_in, lobe_out = (each.astype(int) for each in (x.k, x.c, x.prim, x.lobe_in, x.lobe_out))
    one, S = np.ones(N), np.ones((t.scene.C, N))
    return Path(u, k, x.nee, c, z, prim, lobe_in, lobe_out, out, S, one, one, S)


@dataclass(frozen=True)
class Peephole:
    """A sensor at x_c that looks along the direction leaving it: it receives what the suffix carries."""

    x: Array
    w: Array
    numbers: int = 0
    film_numbers: int = 0

    @property
    def n(self) -> int:
        """One pixel per path."""
        return int(self.x.shape[-1])

    def ray(self, pixel: Array, u: Array) -> tuple[Array, Array, Array]:
        """The ray, weight 1."""
        return self.x, self.w, np.ones(self.n)


def _by_hit(t: Tracer, x: Path, c: int) -> Path:
    """S = leaf (k - c, nee) of a tree that starts at x_c along `out`: the numbers behind x_c are not stale."""
    onward = np.flatnonzero((x.k >= c) & ~(x.nee & (x.k == c)))
    if not len(onward):
        return x
    part = take(x, onward)
    suffix = Suffix(t.scene, Peephole(part.z, part.out), t.depth - c, t.rule)
    tree = trace(suffix, part.u[t.D - suffix.D :], np.arange(len(onward)))
    S, p_light = x.S.copy(), x.p_light.copy()
    S[:, onward] = total([F * ((part.k - c == k) & (part.nee == nee)) for k, nee, F in leaves(tree)])
    p_light[onward] = light_pdf(t.scene, tree.x[0], tree.r[0])
    return replace(x, S=S, p_light=p_light)


def _by_light(t: Tracer, x: Path, z: Vertex) -> Path:
    """Light sampling at x_c itself, c = k: S is the light's emission over its density, `out` its direction."""
    S, p_light, out, ends = x.S.copy(), x.p_light.copy(), x.out.copy(), np.flatnonzero(x.nee & (x.k == x.c))
    if not len(ends):
        return x
    v = take(z, ends)
    leaf, out[:, ends] = light_leaf(
        t, v, lobe_shares(t.scene.materials, v), t.light_numbers(x.u.take(ends, axis=-1), int(x.c[0]))
    )
    S[:, ends], p_light[ends] = leaf.bare, leaf.p_light
    return replace(x, S=S, p_light=p_light, out=out)
