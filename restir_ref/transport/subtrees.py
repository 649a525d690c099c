"""Parts of a traced tree: one of its leaves, or everything behind its first vertex."""

from collections.abc import Sequence
from itertools import accumulate
from operator import mul

import numpy as np

from restir_ref.batch import Array, entry
from restir_ref.chance import Chance
from restir_ref.resampling import Candidate, select
from restir_ref.transport.paths import Tree, leaves


def behind(tree: Tree) -> Tree:
    """The tree as x_1 sees it: it begins at x_2, with throughput 1; `leaves` gives the radiance leaving x_2."""
    T = accumulate((at.weight for at in tree.at[1:]), mul, initial=np.ones_like(tree.T[0]))
    return Tree(tree.u, tree.x[1:], tree.at[1:], tree.r[1:], tree.hits[0], tree.lights[1:], tree.hits[1:], list(T))


def one_leaf(tree: Tree, chance: Chance) -> tuple[Array, Array]:
    """RIS over the leaves of each tree by the mean of F over channels: their number in `leaves`, and W; (N,) each."""
    return one_of([F for _, _, F in leaves(tree)], chance)


def one_of(F: Sequence[Array], chance: Chance) -> tuple[Array, Array]:
    """The same over any of the leaves, F (C, N) each: the number of the chosen one among them, and W."""
    values = [each.mean(axis=0) for each in F]
    one = np.ones(len(values[0]))
    chosen = select([Candidate(np.full(len(one), i), p_hat, one) for i, p_hat in enumerate(values)], chance, one)
    return chosen.x, chosen.W


def of_leaf(values: Sequence[Array], leaf: Array) -> Array:
    """values[leaf[n]][..., n] for every column n: what belongs to the chosen leaves."""
    return entry(np.stack(values), leaf)
