"""Shift mappings: replay until the first connectable pair of vertices, then reconnect.  [GRIS 7.2-7.5, 8.1]

One code is the reconnection shift, random replay and their hybrid; only the rule of connectability
differs.  In primary sample space the Jacobian is J = A(y) / A(x) with one number A per path: the
density with which primary samples produce the reconnection vertex and the direction leaving it.
"""

from dataclasses import dataclass, replace

import numpy as np

from restir_ref.batch import Array, pick, ratio, take, total, where
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


@dataclass(frozen=True)
class Prefix:
    """A replayed path up to its last free vertex y_s: the vertex, throughput T (C, N), and whether it is legal."""

    v: Vertex
    T: Array
    legal: Array


def shift_path(t: Tracer, x: Path, pixel: Array) -> tuple[Path, Array]:
    """The offset path in `pixel` (N,) of tracer t, and J (N,), 0 where undefined."""
    s = np.where(x.c > 0, x.c - 1, x.k)
    prefix = replay(t, x, pixel, s)
    replayed, reconnected = x.c == 0, x.c > 0
    F, A = np.zeros_like(x.F), np.ones_like(x.A)
    legal = prefix.legal
    for columns, finish in ((np.flatnonzero(reconnected & legal), reconnect), (np.flatnonzero(replayed & legal), end)):
        if len(columns):
            F_part, A_part, legal_part = finish(t, take(x, columns), take(prefix, columns))
            F[:, columns], A[columns], legal[columns] = F_part, A_part, legal_part
    J = np.where(legal, ratio(A, x.A), 0.0)
    return replace(x, F=np.where(J > 0, F, 0.0), A=np.where(J > 0, A, 1.0)), J


def replay(t: Tracer, x: Path, pixel: Array, s: Array) -> Prefix:
    """Trace y_1 .. y_s with x's numbers; illegal where a pair connects before x's does."""
    v, _, T = first_hit(t, x.u, pixel)
    prefix = Prefix(v, T, T.any(axis=0) | (s == 0))
    for i in range(1, int(s.max(initial=0))):
        columns = np.flatnonzero((s > i) & prefix.legal)
        if not len(columns):
            break
        part = _step(t, take(x, columns), take(prefix, columns), i, take(s, columns))
        prefix = _put(prefix, columns, part)
    return prefix


def _step(t: Tracer, x: Path, y: Prefix, i: int, s: Array) -> Prefix:
    """From y_i to y_(i+1), and the test that they must not connect."""
    table = t.scene.materials
    at = scatter(t, y.v, x.u, i)
    v, r, met = arrive(t.scene, y.v.x, at.w)
    P = mat.lobe_shares(table, v)
    lobe = np.where((i + 1 == s) & (x.c > 0), x.lobe_in, mat.choose_lobe(P, t.lobe_number(x.u, i + 1)))
    light_end = (i + 1 == s) & (x.c == 0) & x.nee
    rough = np.where(light_end, mat.roughest(table, v), mat.lobe_roughness(table, v, lobe))
    early = connectable(t.rule, mat.lobe_roughness(table, y.v, at.lobe), rough, r)
    T = y.T * at.weight
    return Prefix(v, T, met & ~early & T.any(axis=0))


def end(t: Tracer, x: Path, y: Prefix) -> tuple[Array, Array, Array]:
    """The last steps of pure replay: F, A = 1, and whether the end is legal."""
    F, legal = np.zeros_like(x.F), y.legal.copy()
    for k in np.unique(x.k):
        for nee in (False, True):
            columns = np.flatnonzero((x.k == k) & (x.nee == nee))
            if len(columns):
                finish = _light_end if nee else _hit_end
                F[:, columns], legal[columns] = finish(t, take(x, columns), take(y, columns), int(k))
    return F, np.ones_like(x.A), legal


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


def _put(whole: Prefix, columns: Array, part: Prefix) -> Prefix:
    """`whole` with `part` in the given columns."""
    position = np.zeros(len(whole.legal), dtype=int)
    position[columns] = np.arange(len(columns))
    mask = np.zeros(len(whole.legal), dtype=bool)
    mask[columns] = True
    return where(mask, take(part, position), whole)
