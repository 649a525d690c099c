"""When reuse pays: the variance of one pass of spatial reuse, split by what more initial trees make smaller.

A reservoir holds one path X with W, chosen among M trees, and a = p_hat(X) W is the mean of their estimates.  Shaded
after a pass, a pixel is sum_i g_i a_i, where g_i = m_i p_hat(T_i X_i) J_i / p_hat_i(X_i) depends on the chosen path
alone.  Trees are independent and a path is chosen in proportion to what it carries, so that E[g^2 a] does not depend on
M, and for fixed neighbours

    V(M) = S + Q / M,     S = sum_i (E[a_i] E[g_i^2 a_i] - E[g_i a_i]^2),

where Q is what is left.  S is the noise of choosing: a neighbour hands over one of its paths, and where the ratio
g_i differs from path to path, no number of trees makes that smaller.  Without reuse V_0(M) = sigma^2 / M, so reuse
pays with fewer trees than M* = (sigma^2 - Q) / S, and with more it makes the pixel worse.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from restir_ref.batch import Array, ratio
from restir_ref.chance import Chance
from restir_ref.integrals import Image, Pixels, Reservoirs, target
from restir_ref.loop import OFFLINE, Around
from restir_ref.mis import WEIGHTS
from restir_ref.resampling import Input, weigh
from restir_ref.restir import initial, reusing, shade, spatial

TRIES = 8
"""Times as many neighbours are tried as are wanted."""

ACROSS = WEIGHTS[OFFLINE.across]
"""MIS weights of spatial reuse."""


Of = Callable[[Array, Array], Array]
"""(pixels, samples) -> a number each, (N,)."""


@dataclass(frozen=True)
class Split:
    """Of every pixel, (n,): sigma^2 of one tree, and S and Q of a pass with fixed neighbours."""

    sigma2: Array
    S: Array
    Q: Array

    def without(self, M: float) -> Array:
        """Variance of M trees."""
        return self.sigma2 / M

    def with_reuse(self, M: float) -> Array:
        """Variance of M trees and a pass."""
        return self.S + self.Q / M

    @property
    def break_even(self) -> Array:
        """M*: reuse pays with fewer trees; infinite where it always does."""
        return np.where(self.S > 0, ratio(np.maximum(self.sigma2 - self.Q, 0), self.S), np.inf)


def split(of: Image, near: Sequence[Array], M: int, replicas: int, chance: Chance) -> Split:
    """What `replicas` passes over M trees say, whose neighbours `near` (n,) are the same in all of them."""
    X, here, inputs = _pass(of, near, M, replicas, chance)
    S, V = np.zeros(of.n), np.zeros(of.n)
    for source, y in zip(inputs, weigh(inputs, here, ACROSS), strict=True):
        w, a = y.p_hat * y.mW, target(source.at, source.X.x) * source.X.W
        of_w, of_a, of_g2a = (each.reshape(replicas, of.n) for each in (w, a, ratio(w**2, a)))
        S += of_a.mean(axis=0) * of_g2a.mean(axis=0) - of_w.mean(axis=0) ** 2
        V += of_w.var(axis=0, ddof=1)
    alone = (target(here, X.x) * X.W).reshape(replicas, of.n).var(axis=0, ddof=1)
    return Split(M * alone, S, M * (V - S))


def exact(of: Image, near: Sequence[Array], x: Array, pdf: Of, volume: Of) -> Split:
    """The same without noise, of samples drawn with one technique, as sums over all samples x (K,) of every pixel."""
    pixels = zip(*(each.tolist() for each in near), strict=True)
    rows = [_exact(of, (i, *others), x, pdf, volume) for i, others in enumerate(pixels)]
    return Split(*np.array(rows).T)


def _exact(of: Image, pixels: Sequence[int], x: Array, pdf: Of, volume: Of) -> tuple[float, float, float]:
    at, one = [Pixels(of, np.full(len(x), i)) for i in pixels], np.ones(len(x))
    inputs = [Input(Reservoirs(x, one, one), each) for each in at]
    S, V_1 = 0.0, 0.0
    for each, y in zip(at, weigh(inputs, at[0], ACROSS), strict=True):
        f, p, v = (part(each.index, x) for part in (of.target, pdf, volume))
        g = ratio(y.p_hat * y.mW, f)
        mean = (g * f * v).sum()
        S += (f * v).sum() * (g**2 * f * v).sum() - mean**2
        V_1 += (g**2 * ratio(f, p) * f * v).sum() - mean**2
    f, p, v = (part(at[0].index, x) for part in (of.target, pdf, volume))
    return float((ratio(f, p) * f * v).sum() - (f * v).sum() ** 2), S, V_1 - S


def distinct(of: Image, around: Around, radius: float, chance: Chance, count: int = OFFLINE.neighbours) -> list[Array]:
    """Neighbours of every pixel, (n,) each: so many that differ from each other and from the pixel, the first found."""
    tried = around(of, np.arange(of.n), TRIES * count, radius, chance)
    table = np.stack([each.index for each in tried])
    fresh = np.array([(table[k] != np.arange(of.n)) & (table[:k] != table[k]).all(axis=0) for k in range(len(table))])
    order = np.argsort(~fresh, axis=0, kind="stable")
    if not np.take_along_axis(fresh, order[count - 1 : count], axis=0).all():
        raise ValueError(f"{count} different neighbours were not found within {radius:g} pixels: take fewer.")
    return list(np.take_along_axis(table, order[:count], axis=0))


def images(of: Image, near: Sequence[Array], M: int, replicas: int, chance: Chance, rounds: int = 1) -> list[Array]:
    """Images without reuse, after one pass, and so on, grey, (replicas, n): `split` predicts their first variances."""
    X, here, inputs = _pass(of, near, M, replicas, chance)
    found = [shade(X, here)]
    for _ in range(rounds):
        X = spatial(X, here, [source.at for source in inputs[1:]], chance, mis=ACROSS)
        found.append(shade(X, here))
    return [each.mean(axis=0).reshape(replicas, of.n) for each in found]


def _pass(
    of: Image, near: Sequence[Array], M: int, replicas: int, chance: Chance
) -> tuple[Reservoirs, Pixels, list[Input]]:
    index = np.arange(replicas * of.n)
    here = Pixels(of, index)
    X = initial(here, chance, M)
    sources = [Pixels(of, index - index % of.n + each[index % of.n]) for each in near]
    return X, here, reusing(X, here, X, sources)
