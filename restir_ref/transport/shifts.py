"""Shift mappings: replay until the first connectable pair of vertices, then reconnect.  [GRIS 7.2-7.6, 8.1]

One code is the reconnection shift, random replay and their hybrid; only the rule of connectability
differs.  (Where x_1 or x_2 cannot be connected, `RECONNECTION` replays it and connects behind; what joins
x_2 or nothing is `restir_pt.ReconnectionAtX2`.)  In primary sample space the Jacobian is J = A(y) / A(x)
with one number A per path: the density with which primary samples produce the reconnection vertex and
the direction leaving it,

    A = p |cos| / r^(d-1) p_out,

p of the direction from x_(c-1), r and cos where it arrives at x_c, p_out of the direction leaving x_c, where
one was sampled: A(y) / A(x) is [GRIS Eq. 54] with [GRIS Eq. 52] put in, which has d = 3.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from restir_ref.batch import Array, changed, part, pick, put, ratio, rows, take, total
from restir_ref.transport import materials as mat
from restir_ref.transport.materials import Vertex
from restir_ref.transport.paths import (
    Path,
    Tracer,
    connectable,
    first_hit,
    hit_leaf,
    light_leaf,
    scatter_by,
)
from restir_ref.transport.rays import GRAZING, arrive, emitted, light_pdf, vertex
from restir_ref.transport.vectors import norm


@dataclass(frozen=True)
class Prefix:
    """A path up to its last replayed vertex y_s, which is on the light if a BSDF sample finds it.

    v, r (N,), p_all (N,)  y_s, its distance from y_(s-1), and the density of that direction over all lobes
    T (C, N), legal (N,)   the throughput (not the shift) that arrives there, and whether the path may
    """

    v: Vertex
    r: Array
    p_all: Array
    T: Array
    legal: Array


def shift_path(t: Tracer, x: Path, pixel: Array) -> tuple[Path, Array]:
    """The offset path y = T(x) in `pixel` (N,) of tracer t, and J = A(y) / A(x) (N,), 0 where undefined.

    Columns are sorted once by what follows the replayed vertices: a light that a BSDF sample meets, light
    sampling, or the reconnection; each is then computed for a slice of columns.
    """
    replayed = x.c == 0
    kinds = [np.flatnonzero(kind) for kind in (replayed & ~x.nee, replayed & x.nee, ~replayed)]
    order, ends = np.concatenate(kinds), np.cumsum([0, *map(len, kinds)])
    base = take(x, order)
    prefix = replay(t, base, pixel.take(order))
    F, A, J = np.zeros((t.scene.C, len(order))), np.ones(len(order)), np.zeros(len(order))
    for finish, (start, stop) in zip((_hit_end, _light_end, reconnect), pairwise(ends), strict=True):
        if start < stop:
            here = slice(start, stop)
            F_y, A_y, legal = finish(t, *part((base, prefix), here))
            J_y = np.where(legal, ratio(A_y, base.A[here]), 0.0)
            put((F, A, J), order[here], (np.where(J_y > 0, F_y, 0.0), np.where(J_y > 0, A_y, 1.0), J_y))
    return changed(x, F=F, A=A), J


def replay(t: Tracer, x: Path, pixel: Array) -> Prefix:
    """Trace y_1 .. y_s with x's numbers; illegal where light gets lost, or a pair connects before x's does.

    Not illegal is what ends dark: a path onto a light that sends nothing this way is a path with F = 0.
    """
    s = np.where(x.c > 0, x.c - 1, np.where(x.nee, x.k, x.k + 1))
    v, r, T = first_hit(t, rows(x, "u", slice(t.sensor.numbers)), pixel)
    y = Prefix(v, r, np.zeros(len(s)), np.array(T), T.any(axis=0) | (x.k == 0))
    for i in range(1, int(s.max(initial=0))):
        columns = np.flatnonzero((s > i) & y.legal)
        if not len(columns):
            break
        put(y, columns, _step(t, *take((x, y.v, y.T), columns), i))
    return y


def _step(t: Tracer, x: Path, v: Vertex, T: Array, i: int) -> Prefix:
    """From y_i, v with the throughput T, to y_(i+1), and the test that they must not connect."""
    at = scatter_by(t, v, rows(x, "u", t.scatter_numbers(i)))
    there, r, met = arrive(t.scene, v.x, at.w)
    by_hit = (x.c == 0) & ~x.nee & (x.k == i)
    far = np.where(by_hit, 1.0, _roughness_of_y(t, x, there, i + 1)) if i < t.depth else np.ones(len(r))
    early = connectable(t.rule, mat.lobe_roughness(t.scene.materials, v, at.lobe), far, r)
    T = T * at.weight
    return Prefix(there, r, at.p_all, T, met & ~early & (T.any(axis=0) | by_hit))


def _roughness_of_y(t: Tracer, x: Path, v: Vertex, i: int) -> Array:
    """Roughness of y_i: of the lobe leaving it (copied by a reconnection), its roughest before light sampling."""
    table = t.scene.materials
    chosen = mat.choose_lobe(mat.lobe_shares(table, v), rows(x, "u", t.scatter_numbers(i))[0])
    lobe = np.where(x.c == i + 1, x.lobe_in, chosen)
    by_light = (x.c == 0) & x.nee & (x.k == i)
    return np.where(by_light, mat.roughest(table, v), mat.lobe_roughness(table, v, lobe))


def _hit_end(t: Tracer, x: Path, y: Prefix) -> tuple[Array, Array, Array]:
    """A BSDF sample has met the light: F, A = 1, and whether it is legal."""
    return y.T * hit_leaf(t, y.v, y.r, y.p_all).end, np.ones_like(y.r), y.legal


def _light_end(t: Tracer, x: Path, y: Prefix) -> tuple[Array, Array, Array]:
    """Light sampling from y_k: F, A = 1, and whether it is legal."""
    F, legal = np.zeros_like(y.T), np.flatnonzero(y.legal)
    base, v, T = take((x, y.v, y.T), legal)
    leaf, _ = light_leaf(t, v, mat.lobe_shares(t.scene.materials, v), t.end_numbers(base))
    put(F, legal, T * leaf.end)
    return F, np.ones_like(y.r), y.legal


def reconnect(t: Tracer, x: Path, y: Prefix) -> tuple[Array, Array, Array]:
    """Connect y_(c-1) to x_c: F, A = p |cos| / r^(d-1) p_out, and whether it is legal.  [GRIS Eq. 52, 54]"""
    s, table, space = t.scene, t.scene.materials, t.scene.space
    to = x.z - y.v.x
    r = np.maximum(norm(to), 1e-300)
    w = to / r
    z = vertex(s, x.z, x.prim, -w)
    P = mat.lobe_shares(table, y.v)
    local = space.to_local(y.v.n, w)
    weight, p, p_all = mat.scatter_lobe(table, space, y.v, P, x.lobe_in, local)
    far = roughness_of_z(t, x, z)
    legal = y.legal & connectable(t.rule, mat.lobe_roughness(table, y.v, x.lobe_in), far, r) & (p > 0)
    p_out, E = beyond(t, x, z, p_all, r)
    A = p * z.o[-1] / r ** (space.d - 1) * p_out
    legal &= (A > 0) & (np.minimum(np.abs(local[-1]), z.o[-1]) > GRAZING)
    asked = np.flatnonzero(legal)
    legal[asked] = s.meets(*take((y.v.x, x.z, x.prim), asked))
    return y.T * weight * E, A, legal


def roughness_of_z(t: Tracer, x: Path, z: Vertex) -> Array:
    """Roughness that judges x_c: of its outgoing lobe, its roughest before light sampling, 1 on lights.  [GRIS 7.6]"""
    table = t.scene.materials
    by_lobe = np.where(x.nee & (x.c == x.k), mat.roughest(table, z), mat.lobe_roughness(table, z, x.lobe_out))
    return np.where(x.c > x.k, 1.0, by_lobe)


def beyond(t: Tracer, x: Path, z: Vertex, p_all_y: Array, r: Array) -> tuple[Array, Array]:
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
