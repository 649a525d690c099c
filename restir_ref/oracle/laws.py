"""Definition 4.1 for all f at once, decided exactly.  [GRIS Def. 4.1, Eq. 8-9]

W is an unbiased contribution weight of X if E[f(X) W] = int over supp X of f, for every f.  On
finite cells that is one number per cell:  E[W 1{X = x}] / v(x) = 1 on supp X, and 0 elsewhere.
A mean test with f = p_hat would see no selection bug at all: p_hat(Y) W_Y is sum w whatever was chosen.
"""

from collections.abc import Callable

import numpy as np

from restir_ref.batch import Array
from restir_ref.integrals import Reservoirs
from restir_ref.oracle.enumeration import MOST_LEAVES, Enumerating, Program, outcomes

Label = Callable[[Array], Array]


def expected_weight(program: Program[Reservoirs], cells: Array, *, most_leaves: int = MOST_LEAVES) -> Array:
    """E[W_i 1{X_i = x}] of a program's reservoirs, shape of `cells`.

    `cells` (n, K) is any array that shows how many pixels n and cells K there are, for
    example the volumes.  Samples are cell numbers (N,).
    """
    n = len(cells)
    E = np.zeros(cells.shape, dtype=np.result_type(cells, float))
    for outcome in outcomes(program, n, most_leaves):
        X, p = outcome.result, outcome.per_column(n)
        np.add.at(E, (np.arange(len(p)) % n, X.x), p * X.W)
    return E


def expected_sum(program: Program[Array], n: int, *, most_leaves: int = MOST_LEAVES) -> Array:
    """E[g_i] of a program that returns numbers g (C, lanes * n); shape (C, n)."""
    sums = [
        (outcome.result * outcome.per_column(n)).reshape(len(outcome.result), -1, n).sum(axis=1)
        for outcome in outcomes(program, n, most_leaves)
    ]
    return np.asarray(sum(sums[1:], sums[0]))


def bias_per_cell(E: Array, v: Array, support: Array) -> Array:
    """E[W 1{X = x}] / v(x) minus 1 on the support, minus 0 elsewhere; all (n, K).

    An unbiased estimator is 0 everywhere; a fraction, -0.2 say, is the relative bias of that cell.
    """
    return np.asarray(E / v - np.where(support, 1, 0))


def bias_of(program: Program[Reservoirs], v: Array, support: Array) -> Array:
    """Exact relative bias per cell of a program whose samples are cell numbers; (n, K).

    Raises ValueError if lanes leak into one another: what a leak does depends on which lanes are run together.

    >>> import numpy as np
    >>> from restir_ref import Pixels, initial
    >>> from restir_ref.oracle.laws import bias_of
    >>> from restir_ref.oracle.scenes import reference_scene
    >>> scene = reference_scene()
    >>> bias = bias_of(lambda index, chance: initial(Pixels(scene.now, index), chance), scene.v, scene.support)
    >>> bool(abs(bias).max() < 1e-12)
    True
    """
    return bias_per_cell(expected_weight(_watched(program, len(v)), v), v, support)


def _watched(program: Program[Reservoirs], n: int) -> Program[Reservoirs]:
    """The program, whose last lane must do alone what it does beside the others."""

    def watched(index: Array, chance: Enumerating) -> Reservoirs:
        X = program(index, chance)
        if chance.calls == len(chance.answers) and len(index) > n:
            _compare(X, program(index[:n], Enumerating([answers[-1:] for answers in chance.answers])), n)
        return X

    return watched


def _compare(together: Reservoirs, alone: Reservoirs, n: int) -> None:
    """Raise ValueError where the last lane differs from itself alone by more than rounding."""
    x, W = together.x[-n:], together.W[-n:]
    if not (np.array_equal(x, alone.x) and (abs(W - alone.W) <= 1e-9 * abs(alone.W)).all()):
        raise ValueError(
            f"a lane alone gives samples {alone.x} with weights {alone.W}, but {x} with {W} beside other lanes: "
            "columns are independent replicas, so never sum or index across them but within index - index % n + pixel."
        )
