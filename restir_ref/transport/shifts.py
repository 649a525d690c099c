"""Shift mappings: replay until the first connectable pair of vertices, then reconnect.  [GRIS 7.2-7.5, 8.1]

One code is the reconnection shift, random replay and their hybrid; only the rule of connectability
differs.  In primary sample space the Jacobian is J = A(y) / A(x) with one number A per path: the
density with which primary samples produce the reconnection vertex and the direction leaving it.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from restir_ref.batch import Array, Batch, changed, gathered, part, pick, ratio, take, total
from restir_ref.transport import materials as mat
from restir_ref.transport.materials import Vertex
from restir_ref.transport.paths import (
    Path,
    Tracer,
    connectable,
    first_hit,
    hit_leaf,
    light_leaf,
    scatter,
)
from restir_ref.transport.rays import GRAZING, arrive, emitted, light_pdf, vertex
from restir_ref.transport.vectors import norm

BY_HIT, BY_LIGHT, RECONNECTS = range(3)
"""What follows the free part of a path: a BSDF sample that meets a light, light sampling, or the reconnection."""


@dataclass(frozen=True)
class Prefix:
    """A replayed path up to a free vertex y_i: the vertex, and the throughput T (C, N) that arrives there."""

    v: Vertex
    T: Array


@dataclass(frozen=True)
class Arrival:
    """Columns (n,) of a shift that have come to their last free vertex y_s, and what follows it, the same in all."""

    columns: Array
    x: Path
    y: Prefix
    s: int
    follows: int


def shift_path(t: Tracer, x: Path, pixel: Array) -> tuple[Path, Array]:
    """The offset path in `pixel` (N,) of tracer t, and J (N,), 0 where undefined."""
    F, A, J = np.zeros((t.scene.C, len(pixel))), np.ones(len(pixel)), np.zeros(len(pixel))
    for at in replay(t, x, pixel):
        F_y, A_y, legal = finish(t, at)
        J_y = np.where(legal, ratio(A_y, at.x.A), 0.0)
        F[:, at.columns] = np.where(J_y > 0, F_y, 0.0)
        A[at.columns] = np.where(J_y > 0, A_y, 1.0)
        J[at.columns] = J_y
    return changed(x, F=F, A=A), J


def replay(t: Tracer, x: Path, pixel: Array) -> Iterator[Arrival]:
    """Trace y_1, y_2 .. with x's numbers, all paths together, until the free part of each ends.

    Columns are sorted once by where it ends and what follows, so that those that arrive together lie side by
    side.  Paths that get lost, or on which a pair connects before x's does, do not arrive.
    """
    s = np.where(x.c > 0, x.c - 1, x.k)
    order = 3 * s + np.where(x.c > 0, RECONNECTS, x.nee)
    columns = np.argsort(order.astype(np.min_scalar_type(3 * t.depth + 2)), kind="stable")
    x, order, pixel = gathered(take(x, columns)), order.take(columns), pixel.take(columns)
    v, _, T = first_hit(t, x.u, pixel)
    y, on = Prefix(v, T), T.any(axis=0) | (order < 3)
    for i in range(int(s.max(initial=-1)) + 1):
        if i > 1:
            columns, x, order, y = take((columns, x, order, y), np.flatnonzero(on))
            y, on = _step(t, x, y, i - 1)
        ends = np.searchsorted(order, 3 * i + np.arange(4))
        for follows, (start, stop) in enumerate(pairwise(ends)):
            here = start + np.flatnonzero(on[start:stop])
            if len(here):
                yield Arrival(columns[here], *_few((x, y), here), i, follows)
        on[: ends[-1]] = False


def _few(batch: Batch, columns: Array) -> Batch:
    """Rising columns of a batch; those without a gap are not copied."""
    start, stop = int(columns[0]), int(columns[-1]) + 1
    return part(batch, slice(start, stop)) if stop - start == len(columns) else take(batch, columns)


def _step(t: Tracer, x: Path, y: Prefix, i: int) -> tuple[Prefix, Array]:
    """From y_i to y_(i+1), and whether it is there; not where the two must not be connected."""
    table = t.scene.materials
    at = scatter(t, y.v, x.u, i)
    v, r, met = arrive(t.scene, y.v.x, at.w)
    P = mat.lobe_shares(table, v)
    lobe = np.where(x.c == i + 2, x.lobe_in, mat.choose_lobe(P, t.lobe_number(x.u, i + 1)))
    light_end = (x.c == 0) & x.nee & (x.k == i + 1)
    rough = np.where(light_end, mat.roughest(table, v), mat.lobe_roughness(table, v, lobe))
    early = connectable(t.rule, mat.lobe_roughness(table, y.v, at.lobe), rough, r)
    T = y.T * at.weight
    return Prefix(v, T), met & ~early & T.any(axis=0)


def finish(t: Tracer, at: Arrival) -> tuple[Array, Array, Array]:
    """What follows y_s: F (C, n), A (n,), which is 1 where nothing reconnects, and whether it is legal."""
    if at.follows == RECONNECTS:
        return reconnect(t, at.x, at.y)
    F, legal = (_light_end if at.follows == BY_LIGHT else _hit_end)(t, at.x, at.y, at.s)
    return F, np.ones(len(at.columns)), legal


def _light_end(t: Tracer, x: Path, y: Prefix, k: int) -> tuple[Array, Array]:
    leaf, _ = light_leaf(t, y.v, mat.lobe_shares(t.scene.materials, y.v), x.u, k)
    return y.T * leaf.end, np.ones(len(x.k), dtype=bool)


def _hit_end(t: Tracer, x: Path, y: Prefix, k: int) -> tuple[Array, Array]:
    """A BSDF sample from y_k onto a light, which must not be connectable."""
    if k == 0:
        return y.T * emitted(t.scene, y.v), np.ones(len(x.k), dtype=bool)
    at = scatter(t, y.v, x.u, k)
    v, r, met = arrive(t.scene, y.v.x, at.w)
    rough = mat.lobe_roughness(t.scene.materials, y.v, at.lobe)
    early = connectable(t.rule, rough, np.ones(len(x.k)), r)
    return y.T * at.weight * hit_leaf(t, v, r, at).end, met & ~early


def reconnect(t: Tracer, x: Path, y: Prefix) -> tuple[Array, Array, Array]:
    """Connect y_(c-1) to x_c: F, A, and whether the connection is legal.  [GRIS Eq. 52, 54]"""
    s, table, space = t.scene, t.scene.materials, t.scene.space
    to = x.z - y.v.x
    r = np.maximum(norm(to), 1e-300)
    w = to / r
    z = vertex(s, x.z, x.prim, -w)
    P = mat.lobe_shares(table, y.v)
    local = space.to_local(y.v.n, w)
    weight, p, p_all = mat.scatter_lobe(table, space, y.v, P, x.lobe_in, local)
    far = _roughness_of_z(t, x, z)
    legal = connectable(t.rule, mat.lobe_roughness(table, y.v, x.lobe_in), far, r) & (p > 0)
    p_out, E = _beyond(t, x, z, p_all, r)
    A = p * z.o[-1] / r ** (space.d - 1) * p_out
    legal &= (A > 0) & (np.minimum(np.abs(local[-1]), z.o[-1]) > GRAZING)
    asked = np.flatnonzero(legal)
    legal[asked] = s.meets(*take((y.v.x, x.z, x.prim), asked))
    return y.T * weight * E, A, legal


def _roughness_of_z(t: Tracer, x: Path, z: Vertex) -> Array:
    """Roughness that judges x_c: of its outgoing lobe, its roughest before light sampling, 1 on lights."""
    table = t.scene.materials
    by_lobe = np.where(x.nee & (x.c == x.k), mat.roughest(table, z), mat.lobe_roughness(table, z, x.lobe_out))
    return np.where(x.c > x.k, 1.0, by_lobe)


def _beyond(t: Tracer, x: Path, z: Vertex, p_all_y: Array, r: Array) -> tuple[Array, Array]:
    """Density of the direction leaving x_c (1 if none was sampled), and what arrives from there, (C, N).

    c < k: f / p at x_c times the suffix.  c = k: its MIS weight changes as well.  c = k + 1: the
    light seen from y, with the light density of y_k.
    """
    table, space = t.scene.materials, t.scene.space
    P = mat.lobe_shares(table, z)
    local = space.to_local(z.n, x.out)
    each_f, each_p = mat.evaluate_each(table, space, z, local)
    each_p = [share * pdf for share, pdf in zip(P, each_p, strict=True)]
    (f, p), f_all, p_all = pick([*zip(each_f, each_p, strict=True)], x.lobe_out), total(each_f), total(each_p)
    through = np.where(x.c == x.k, ratio(p_all, p_all + x.p_light), 1.0) * ratio(f, p) * x.S
    lit = ratio(x.p_light, x.p_light + p_all) * f_all * x.S
    seen = emitted(t.scene, z) * ratio(p_all_y, p_all_y + light_pdf(t.scene, z, r))
    at_light, at_last = x.c > x.k, x.nee & (x.c == x.k)
    p_out = np.where(at_light | at_last, 1.0, p)
    return p_out, np.where(at_light, seen, np.where(at_last, lit, through))
