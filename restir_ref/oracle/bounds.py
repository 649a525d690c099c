"""Bounds that decide whether resampling converges, and how fast: formulas only.  [GRIS 5, App. A]

V is Var[sum w], norm is ||p_hat||, C_i a bound p_hat_i(X_i) W_i <= C_i.  What goes in comes from
`selected`, `moments` or an enumeration, so both sides of every inequality are exact numbers.
"""

import numpy as np

from restir_ref.batch import Array, ratio
from restir_ref.oracle.enumeration import Program, outcomes

Numbers = Array | float

PRINTED, SHARPER = 2.0, 1.0
"""The factor of sqrt(V) in Theorem 1: as the paper has it, and as it can be."""


def reasonable(f: Array, p_hat: Array) -> Array:
    """C_f = max_x f(x) / p_hat(x), infinite where f > 0 = p_hat; f, p_hat (..., K) -> (...).  [GRIS Def. 5.1]"""
    return np.asarray(np.where(p_hat > 0, ratio(f, p_hat), np.where(f > 0, np.inf, 0)).max(axis=-1))


def limit_variance(f: Array, p_hat: Array, v: Array) -> Array:
    """Var[f(X) / p_bar(X)] = ||p_hat|| int f^2 / p_hat - (int f)^2, X ~ p_bar; (..., K) -> (...).  [GRIS Eq. 28]

    Infinite where f > 0 = p_hat, as C_f is: no number of samples finds that part.
    """
    norm, missed = (p_hat * v).sum(axis=-1), ((p_hat == 0) & (f > 0)).any(axis=-1)
    finite = norm * (ratio(f**2, p_hat) * v).sum(axis=-1) - (f * v).sum(axis=-1) ** 2
    return np.where(missed, np.inf, finite)


def excess_bound(C_f: Numbers, V: Numbers, norm: Numbers, constant: float = PRINTED) -> Array:
    """b = C_f^2 sqrt(V) (||p_hat|| + constant sqrt(V)) bounds Var[f(Y) W_Y] above its limit.  [GRIS Thm. 1, Eq. 30]

    The constant can be 1, because `sharpest_excess_bound` is smaller still.
    """
    return np.asarray(C_f**2 * np.sqrt(V) * (norm + constant * np.sqrt(V)))


def sharpest_excess_bound(C_f: Numbers, V: Numbers, norm: Numbers) -> Array:
    """b = C_f^2 sqrt(V (||p_hat||^2 + V)), which Theorem 1 loosens twice.  [ours; GRIS Thm. 1]

    With S = sum w = p_hat(Y) W_Y and g = f / p_hat, Var[f(Y) W_Y] is E[g^2 S^2] - (int f)^2.  Since
    W_Y is unbiased for f^2 / p_hat, the limit is ||p_hat|| E[g^2 S] - (int f)^2.  The difference,
    E[g^2 S (S - ||p_hat||)], is by Cauchy-Schwarz at most C_f^2 sqrt(E[S^2] V), and
    E[S^2] = ||p_hat||^2 + V <= (||p_hat|| + sqrt(V))^2.
    """
    return np.asarray(C_f**2 * np.sqrt(V * (norm**2 + V)))


def proportional(C_f: Numbers, w_sum: Array) -> Array:
    """f(Y) W_Y = C_f sum w if f = C_f p_hat, whichever candidate was selected; w_sum (N,).  [GRIS Eq. 32]"""
    return np.asarray(C_f * w_sum)


def weight_bound(C: Numbers, c: Numbers, C_R: Numbers) -> Array:
    """w_i <= c_i C_i / C_R, which is C_i / |R| without confidences; C, c (M, ...).  [GRIS Thm. A.4, Eq. 39, 67]"""
    return np.asarray(c * C / C_R)


def sum_bound(C: Numbers, c: Numbers, C_R: Numbers) -> Array:
    """p_hat(Y) W_Y = sum w <= sum_i c_i C_i / C_R, the C_i of a next pass; C, c (M, ...) -> (...).  [GRIS Eq. 40]"""
    return np.asarray(weight_bound(C, c, C_R).sum(axis=0))


def popoviciu(w: Array) -> Array:
    """Var[sum w] <= sum_i w_i^2 / 4 for independent weights in [0, w_i]; w (M, ...) -> (...).  [GRIS Eq. 41]"""
    return np.asarray((w**2).sum(axis=0) / 4)


def equal_popoviciu(C: Numbers, M: Numbers, R: Numbers) -> Array:
    """Var[sum w] <= C^2 M / (4 |R|^2) where all C_i <= C.  [GRIS 5.7]"""
    return np.asarray(C**2 * M / (4 * R**2))


def covariance_bound(C: Numbers, gamma: Numbers, b: Array) -> Array:
    """sum_i sum_k Cov(w_i, w_(i+k)) <= C^2 / (4 gamma^2) mean_k b_k, |R| / M >= gamma; b (M,).  [GRIS Eq. 43]"""
    return np.asarray(C**2 / (4 * gamma**2) * b.mean())


def dependent_bound(C: Numbers, R: Numbers, b: Array) -> Array:
    """Var[sum w] <= C^2 M / (4 |R|^2) + 2 C^2 / (4 gamma^2) mean_k b_k, gamma = |R| / M; b (M,).  [GRIS Eq. 42-43]"""
    M = len(b)
    return np.asarray(equal_popoviciu(C, M, R) + 2 * covariance_bound(C, R / M, b))


def largest(program: Program[Array], n: int) -> Array:
    """The largest value, over all outcomes, of numbers g (C, lanes * n); (C, n)."""
    found = [outcome.result.reshape(len(outcome.result), -1, n).max(axis=1) for outcome in outcomes(program, n)]
    return np.asarray(np.max(found, axis=0))
