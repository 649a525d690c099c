"""Gradient-domain path tracing: every leaf of a path tree is shifted to the pixels beside it.  [GPT 3.1, B.2; KMA15]

    D_ij = sum over leaves x of i's tree  w_ij(x) (f_i(x) - f_j(T_ij x) J) - sum over those of j's  w_ji (f_j - f_i J)

A renderer that shifts whole trees traces what their leaves share once; `distinct` counts rays so.
"""

from dataclasses import dataclass

import numpy as np

from restir_ref.batch import Array, joined, take
from restir_ref.chance import Chance
from restir_ref.gradient import one_sided
from restir_ref.integrals import Pixels, Reservoirs
from restir_ref.transport.paths import trace
from restir_ref.transport.record import record
from restir_ref.transport.restir_pt import PathIntegrals


@dataclass(frozen=True)
class Forest:
    """The lit leaves of one path tree per column, as samples of W = 1, and the column `tree` (M,) of each.

    Dark leaves have w = 0, as weights by targets have it, and are left out.
    """

    X: Reservoirs
    tree: Array
    columns: int

    def added(self, values: Array) -> Array:
        """Sums over the leaves of each tree of values (C, M) of leaves; (C, columns)."""
        return np.stack([np.bincount(self.tree, row, self.columns) for row in values])

    def of(self, columns: Array) -> "Forest":
        """The trees of some columns (N,), numbered anew, in their order; each may be named once."""
        place = np.full(self.columns, -1)
        place[columns] = np.arange(len(columns))
        found = place.take(self.tree)
        kept = np.flatnonzero(found >= 0)
        return Forest(take(self.X, kept), found.take(kept), len(columns))


def grown(image: PathIntegrals, index: Array, chance: Chance) -> Forest:
    """One path tree in every pixel of `index` (N,)."""
    t, N = image.tracer, len(index)
    tree = trace(t, chance.uniform((t.D, N)), index % image.n)
    parts, found = [], []
    for k, nee, F in image.leaves(tree):
        lit = np.flatnonzero(F.mean(axis=0) > 0)
        parts.append(take(record(t, tree, np.full(N, k), np.full(N, nee), F), lit))
        found.append(lit)
    of = np.concatenate(found)
    return Forest(Reservoirs(joined(parts), np.ones(len(of)), np.ones(len(of))), of, N)


def radiance_of(trees: Forest) -> Array:
    """I of every tree's pixel, (C, columns): plain path tracing."""
    return trees.added(trees.X.x.F)


def difference(trees: Forest, i: Pixels, j: Pixels) -> Array:
    """<Delta_ij> = <I_i - I_j> of pairs (i, j), (C, N), from the trees of both pixels, one per column of the images.

    [GPT Eq. 3, 4, 12]
    """
    return one_way(trees, i, j) - one_way(trees, j, i)


def one_way(trees: Forest, base: Pixels, offset: Pixels) -> Array:
    """Sum over a tree's leaves of w (f_base(x) - f_offset(T x) J), (C, N)."""
    here = trees.of(base.index)
    start, end = (Pixels(each.of, each.index.take(here.tree)) for each in (base, offset))
    return here.added(one_sided(here.X, start, end))
