"""Mutations on finite cells: exact kernels, exact moments through them, and what is done wrong.  [MCMC 3.2, 4.2, 5.2]

For one pixel a mutation is a kernel P between cells; what it makes of W is the operator A with
E[W' 1{X'=y}] = sum_x E[W 1{X=x}] A[x, y].  All are enumerated from the code that renders.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from restir_ref.batch import Array, ratio, where
from restir_ref.chance import Chance
from restir_ref.decorrelation import Blue, Move, attempt, gaussian, metropolis, mutate
from restir_ref.integrals import Pixels, Reservoirs, target
from restir_ref.oracle.cells import Frame
from restir_ref.oracle.enumeration import outcomes
from restir_ref.oracle.moments import Moments
from restir_ref.restir import shade

Mutation = Callable[[Reservoirs, Pixels, Chance], Reservoirs]


@dataclass(frozen=True)
class Kernel:
    """P[x, y] = P(X' = y | X = x), A[x, y] = E[W' 1{X' = y} | X = x, W = 1], B the same for W'^2; (K, K) each."""

    P: Array
    A: Array
    B: Array


def kernel(frame: Frame, pixel: int, mutation: Mutation = mutate) -> Kernel:
    """The kernel of a mutation in one pixel, enumerated from every cell."""
    K = frame.cells.v.shape[-1]

    def program(index: Array, chance: Chance) -> tuple[Array, Reservoirs]:
        x = chance.choose(np.ones((K, len(index))))
        X = Reservoirs(x, np.ones(len(index)), np.ones(len(index)))
        return x, mutation(X, Pixels(frame, index * frame.n + pixel), chance)

    moments = np.zeros((3, K, K))
    for outcome in outcomes(program, 1):
        x, Y = outcome.result
        for order in range(3):
            np.add.at(moments[order], (x, Y.x), K * outcome.probability * Y.W**order)
    return Kernel(*moments)


def repeated(k: int, mutation: Mutation = mutate) -> Mutation:
    """k mutations, one after the other."""

    def walk(X: Reservoirs, here: Pixels, chance: Chance) -> Reservoirs:
        for _ in range(k):
            X = mutation(X, here, chance)
        return X

    return walk


def power(each: Kernel, k: int) -> Kernel:
    """The kernel of k mutations that remember nothing of each other."""
    return Kernel(*(np.linalg.matrix_power(table, k) for table in (each.P, each.A, each.B)))


def mutated(Z: Moments, kernels: Sequence[Kernel]) -> Moments:
    """Moments of Z = (W_i 1{X_i = x}) after each pixel was mutated with its own kernel, independently."""
    K, A = len(kernels[0].A), np.zeros(Z.second.shape)
    for i, each in enumerate(kernels):
        A[i * K : (i + 1) * K, i * K : (i + 1) * K] = each.A
    second = A.T @ Z.second @ A
    for i, each in enumerate(kernels):
        block = slice(i * K, (i + 1) * K)
        second[block, block] = np.diag(np.diag(Z.second)[block] @ each.B)
    return Moments(Z.mean @ A, second)


Fold = Callable[[Array, Array, int], Array]
"""fold(x, x', K): where a step from cell x to x', which may lie outside of 0 .. K - 1, ends."""

FOLDS: Mapping[str, Fold] = MappingProxyType(
    {
        "wrapped": lambda x, x_new, K: x_new % K,
        "bounded": lambda x, x_new, K: np.where((x_new >= 0) & (x_new < K), x_new, x),
        "clamped": lambda x, x_new, K: np.clip(x_new, 0, K - 1),
    }
)
"""The steps of `decorrelation.STEPS` on cells, and the wrong one that moves back to the boundary.  [MCMC 5.2.2]"""


def steps(K: int, sigma: float, fold: Fold) -> Array:
    """Table (K, K) of proposals: Gaussian steps of sigma cells, up to K - 1 cells, folded into the domain."""
    x, by = np.arange(K)[:, None], np.arange(1 - K, K)[None]
    table = np.zeros((K, K))
    np.add.at(table, (x, fold(x, x + by, K)), np.exp(-((by / sigma) ** 2) / 2))
    return table


# ---------------------------------------------------------------- what is done wrong


def inverted(X: Reservoirs, here: Pixels, chance: Chance) -> Reservoirs:
    """W' = W p_hat(x') / p_hat(x): a mistake of print, upside down.  [MCMC 5.2.4]"""
    Y = mutate(X, here, chance)
    up = ratio(target(here, Y.x), target(here, X.x))
    return replace(Y, W=np.where(up > 0, X.W * up, X.W))


def last_accepted(k: int) -> Mutation:
    """Alg. 3 as printed: `accept` is overwritten, and the reservoir updated only if the last proposal was accepted."""

    def walk(X: Reservoirs, here: Pixels, chance: Chance) -> Reservoirs:
        base, accepted = X, np.zeros(len(here.index), dtype=bool)
        for _ in range(k):
            base, accepted = attempt(base, here, chance, metropolis)
        return where(accepted, base, X)

    return walk


def always(move: Move) -> Array:
    """a = 1: not an acceptance of Metropolis and Hastings at all."""
    return np.ones(len(move.p_hat))


def without_T(move: Move) -> Array:
    """a = min(1, p_hat(x') / p_hat(x)): right for symmetric proposals only."""
    return metropolis(replace(move, T_ratio=np.where(move.T_ratio > 0, 1, 0)))


def upside_down(move: Move) -> Array:
    """a = min(1, p_hat(x') T(x -> x') / (p_hat(x) T(x' -> x))): the ratio of transitions turned round."""
    return metropolis(replace(move, T_ratio=ratio(np.ones(len(move.T_ratio)), move.T_ratio)))


def unsymmetric(X: Reservoirs, here: Pixels, chance: Chance) -> Reservoirs:
    """A mutation that takes its proposals for symmetric."""
    return mutate(X, here, chance, without_T)


def blue(w: float) -> Mutation:
    """A mutation with w_bn = w > 0.  In grey a_bn = 1 whoever the neighbour is; here it is the pixel itself."""

    def step(X: Reservoirs, here: Pixels, chance: Chance) -> Reservoirs:
        light = shade(X, here).mean(axis=0)
        return mutate(X, here, chance, Blue(light, [np.arange(len(light))], [1.0], w))

    return step


def clamped(u: Array, sigma: float, chance: Chance) -> tuple[Array, Array]:
    """A step that is moved back to the boundary when it leaves [0, 1), and taken for symmetric."""
    return np.clip(gaussian(u, sigma, chance), 0, np.nextafter(1, 0)), np.ones(u.shape[-1])
