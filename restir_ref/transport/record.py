"""From a traced tree and a chosen leaf to the path record: where it reconnects, and what its suffix carries."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from restir_ref.batch import Array, entry, pick
from restir_ref.transport import materials as mat
from restir_ref.transport.paths import Path, Tracer, Tree, connectable


@dataclass(frozen=True)
class Stacks:
    """Per-vertex numbers of a tree, first axis the vertex; entry 0 is unused padding."""

    x: Array
    prim: Array
    cos: Array
    r: Array
    lobe: Array
    w: Array
    p: Array


def first_connectable(t: Tracer, tree: Tree) -> tuple[Array, Array]:
    """c of every leaf (k, BSDF) and (k, NEE), each (depth + 1, N): the first index whose vertex pair connects.

    A vertex is judged by the lobe that leaves it, the last vertex before light sampling by its
    roughest lobe, a light vertex as rough; light sampling itself is replayed, not reconnected.
    """
    table, n = t.scene.materials, tree.u.shape[-1]
    by_hit, by_light = np.zeros((t.depth + 1, n), dtype=int), np.zeros((t.depth + 1, n), dtype=int)
    first, rough_before = np.zeros(n, dtype=int), np.zeros(n)
    for i, at in enumerate(tree.at, start=1):
        v, rough = tree.x[i - 1], mat.lobe_roughness(table, tree.x[i - 1], at.lobe)
        if i > 1:
            end = connectable(t.rule, rough_before, mat.roughest(table, v), tree.r[i - 1])
            by_light[i] = np.where(first > 0, first, np.where(end, i, 0))
            through = connectable(t.rule, rough_before, rough, tree.r[i - 1])
            first = np.where(first > 0, first, np.where(through, i, 0))
        on_light = connectable(t.rule, rough, np.ones(n), tree.r[i])
        by_hit[i] = np.where(first > 0, first, np.where(on_light, i + 1, 0))
        rough_before = rough
    return by_hit, by_light


def record(t: Tracer, tree: Tree, k: Array, nee: Array, F: Array) -> Path:
    """The path record of leaf (k, nee) (N,) of each column, with contribution F (C, N)."""
    by_hit, by_light = first_connectable(t, tree)
    return record_from(t, tree, (k, nee), np.where(nee, entry(by_light, k), entry(by_hit, k)), F)


def record_from(t: Tracer, tree: Tree, leaf: tuple[Array, Array], c: Array, F: Array) -> Path:
    """The same with x_c to reconnect to, whether or not it is the first that can be; c (N,) is 0 or 2 .. depth + 1."""
    k, nee = leaf
    s = stacks(tree)
    before = np.maximum(c - 1, 0)
    through = (c > 0) & (c <= k) & ~(nee & (c == k))
    lights = np.stack([np.zeros_like(tree.u[: t.scene.space.d]), *(w for _, w in tree.lights)])
    inner = np.minimum(c, t.depth)
    out = np.where(through, entry(s.w, inner), entry(lights, k))
    A = entry(s.p, before) * entry(s.cos, c) / entry(s.r, c) ** (t.scene.space.d - 1)
    A = np.where(c > 0, A * np.where(through, entry(s.p, inner), 1), 1)
    S, p_light = _suffix(t, tree, k, nee, c)
    return Path(
        u=tree.u,
        k=k,
        nee=nee,
        c=c,
        z=entry(s.x, c),
        prim=entry(s.prim, c),
        lobe_in=entry(s.lobe, before),
        lobe_out=np.where(through, entry(s.lobe, inner), 0),
        out=out,
        S=S,
        p_light=p_light,
        A=A,
        F=F,
    )


def stacks(tree: Tree) -> Stacks:
    """Stack the tree's vertices; index i is x_i."""
    at = tree.at
    return Stacks(
        _padded([v.x for v in tree.x]),
        _padded([v.prim for v in tree.x]),
        _padded([v.o[-1] for v in tree.x]),
        _padded(tree.r),
        _padded([each.lobe for each in at]),
        _padded([each.w for each in at]),
        _padded([each.p for each in at]),
    )


def _suffix(t: Tracer, tree: Tree, k: Array, nee: Array, c: Array) -> tuple[Array, Array]:
    """S, the product of everything behind `out`, and the light density at x_k.

    c < k: weights of x_(c+1) .. and the end with its MIS weight.  c = k: the bare end, whose MIS
    weight depends on the direction arriving at x_c.  c = k + 1: 1, the light is evaluated again.
    """
    leaf = pick([*(leaf for leaf, _ in tree.lights), *tree.hits], np.maximum(k, 1) - 1 + np.where(nee, 0, t.depth))
    S = np.where(c < k, leaf.end, np.where(c == k, leaf.bare, 1.0))
    last = np.where(nee, k - 1, k)
    for i, at in enumerate(tree.at, start=1):
        S = S * np.where((i > c) & (i <= last), at.weight, 1.0)
    return S, leaf.p_light


def _padded(parts: Sequence[Array]) -> Array:
    """Stack arrays with a copy of the first in front, so that index i is vertex i."""
    return np.stack([parts[0], *parts])
