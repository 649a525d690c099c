"""The selected sample's own law: its density p_Y, and the contribution weight given where it fell.  [GRIS 4.4, App. A]

A null sample, W = 0, is no sample: p_Y integrates to the probability that there is one.
"""

from dataclasses import dataclass

import numpy as np

from restir_ref.batch import Array, ratio
from restir_ref.integrals import Reservoirs
from restir_ref.oracle.enumeration import MOST_LEAVES, Program, outcomes
from restir_ref.oracle.moments import Operator

STEP = 0.2
"""Spacing in log t: the integrand is analytic for Re t > 0, so the trapezoidal rule errs by about exp(-pi^2 / STEP)."""


@dataclass(frozen=True)
class Selected:
    """P(Y = y), E[W_Y 1{Y=y}] and E[W_Y^2 1{Y=y}] per cell; (n, K) each."""

    P: Array
    W: Array
    WW: Array


def selected(program: Program[Reservoirs], cells: Array, *, most_leaves: int = MOST_LEAVES) -> Selected:
    """The law of a program's reservoirs, enumerated; `cells` (n, K) shows the numbers of pixels and cells."""
    n = len(cells)
    sums = np.zeros((3, *cells.shape))
    for outcome in outcomes(program, n, most_leaves):
        Y, p = outcome.result, outcome.per_column(n)
        for into, value in zip(sums, (Y.W > 0, Y.W, Y.W**2), strict=True):
            np.add.at(into, (np.arange(len(p)) % n, Y.x), p * value)
    return Selected(*sums)


def contribution_variance(Y: Selected, f: Array) -> Array:
    """Var[f(Y) W_Y] = E[f^2 W_Y^2] - E[f W_Y]^2; f (n, K) -> (n,).  Of p_hat: Var[sum w].  [GRIS Eq. 22]"""
    return np.asarray((f**2 * Y.WW).sum(axis=-1) - (f * Y.W).sum(axis=-1) ** 2)


def total_variance(Y: Selected, f: Array) -> tuple[Array, Array]:
    """Var[f(Y) / p_Y(Y)] and E[f(Y)^2 Var[W_Y | Y]], whose sum is Var[f(Y) W_Y]; (n,) each.  [GRIS Eq. 31]

    For 1 / p_Y(y) it takes the conditional mean E[W_Y | Y=y].  [GRIS Eq. 9]
    """
    squared_mean = ratio(Y.W**2, Y.P)
    between = (f**2 * squared_mean).sum(axis=-1) - (f * Y.W).sum(axis=-1) ** 2
    return between, (f**2 * (Y.WW - squared_mean)).sum(axis=-1)


def probability(one_pass: Operator, P: Array, W: Array, n: Array) -> Array:
    """P(Y=y) = int_0^oo sum_i E[w_i 1{Y_i=y} exp(-t w_i)] prod_(j != i) E[exp(-t w_j)] dt; (K,).

    That is E[sum_i w_i 1{Y_i=y} / sum_j w_j] for *independent* inputs: n (I,) copies of every input
    of the pass, which fall into cell x with probability P (I, K) and have the weight W (I, K) there.
    The copies enter the pass as one input of confidence n, as in `moments`.
    """
    w = one_pass.u.reshape(P.shape) * W / n[:, None]
    norm = n @ (P * w).sum(axis=-1)
    if norm == 0:
        return np.zeros(len(one_pass.L))
    t = _abscissae(norm, w[(w > 0) & (P > 0)].min())
    decay = P * np.exp(-t[:, None, None] * w)
    each = decay.sum(axis=-1)
    chosen = ratio(decay * w, each[..., None]) * n[:, None]
    density = (t * (each**n).prod(axis=-1)) @ chosen.reshape(len(t), -1)
    return np.asarray((one_pass.L != 0) @ density * STEP)


def _abscissae(norm: float, smallest: float) -> Array:
    """Values t that leave out less than 1e-17 at either end."""
    return np.asarray(np.exp(np.arange(np.log(1e-17 / norm), np.log(50 / smallest) + STEP, STEP)))


def l1_distance(P: Array, p_hat: Array, v: Array) -> Array:
    """int |p_Y - p_bar|; all (..., K) -> (...).  [GRIS Eq. 61]"""
    return np.asarray(abs(P - share(p_hat, v)).sum(axis=-1))


def mean_square_distance(P: Array, p_hat: Array, v: Array) -> Array:
    """E[(p_bar(Y) / p_Y(Y) - 1)^2]; all (..., K) -> (...).  [GRIS Eq. 60]"""
    return np.asarray((P * (ratio(share(p_hat, v), P) - 1) ** 2).sum(axis=-1))


def share(p_hat: Array, v: Array) -> Array:
    """The probability p_bar(y) v(y) of every cell under the target; (..., K)."""
    return np.asarray(p_hat * v / (p_hat * v).sum(axis=-1, keepdims=True))
