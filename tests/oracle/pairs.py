"""Pairs of pixels for the laws of gradients: their finite domains, shared candidates, and quadrature."""

from dataclasses import replace

import numpy as np
from scipy.integrate import quad

from restir_ref.batch import Array
from restir_ref.chance import Chance
from restir_ref.gradient import SIGNS, Pairs
from restir_ref.integrals import Pixels, Reservoirs
from restir_ref.oracle.cells import Frame
from restir_ref.oracle.laws import bias_per_cell, expected_weight
from restir_ref.oracle.scenes import Scene
from restir_ref.restir import resample
from toy1d import Line

ENDS = np.array([[0, 1], [1, 2]])  # two pairs of three pixels
ONE_PAIR = ENDS[:, :1]


def both_signs(frame: Frame, ends: Array, kind: type[Pairs] = Pairs) -> list[Pairs]:
    return [kind(frame, ends, part) for part in SIGNS.values()]


def shared(signs: list[Pairs], index: Array, chance: Chance, M: int = 1) -> list[Reservoirs]:
    """M sets of candidates, drawn once, feed the reservoirs of both signs."""
    drawn = [(x, mW / M) for _ in range(M) for x, mW in signs[0].candidates(index, chance)]
    return [resample(drawn, Pixels(sign, index), chance) for sign in signs]


def labelled(X: Reservoirs, K: int) -> Reservoirs:
    """Samples of the paired domain as one cell number k K + x."""
    return replace(X, x=X.x.k * K + X.x.x)


def largest_bias(loop, pairs: Pairs, scene: Scene) -> float:
    """Of labelled samples, per cell of the paired domain (E, 2 K)."""
    E, K = pairs.n, scene.v.shape[-1]
    cell = np.arange(2 * K)
    every = [np.full(2 * K, e) for e in range(E)]
    support = np.stack([pairs.target(e, pairs.paired(e, cell % K, cell // K)) > 0 for e in every])
    v = np.concatenate([scene.v[pairs.ends[0]], scene.v[pairs.ends[1]]], axis=-1)
    return float(abs(bias_per_cell(expected_weight(loop, v), v, support)).max())


def nodes(line: Line, pixel: int, *cuts: float) -> tuple[Reservoirs, Pixels]:
    """Gauss-Legendre nodes of a pixel, in panels between the cuts; W is their weight, so sums are integrals."""
    t, w = np.polynomial.legendre.leggauss(60)
    edges = np.array([line.low[pixel], *cuts, line.high[pixel]])[:, None]
    half = np.diff(edges, axis=0) / 2
    x, W = (edges[:-1] + half * (1 + t)).ravel(), (half * w).ravel()
    return Reservoirs(x, W, np.ones(len(x))), Pixels(line, np.full(len(x), pixel))


def delta(line: Line, i: int = 0, j: int = 1) -> float:
    """int f_i - int f_j by quadrature that knows nothing of our code."""
    I = [
        quad(lambda x, k=k: float(line.f(np.array(k), np.array(x))), line.low[k], line.high[k], limit=200)[0]
        for k in (i, j)
    ]
    return I[0] - I[1]


def true_means(scene: Scene) -> Array:
    return (scene.now.cells.f * scene.now.cells.v)[scene.now.ids(np.arange(scene.now.n))].sum(axis=-1)
