"""Exact first and second moments through whole chains of passes.

Let Z collect W_i 1{X_i = x} over all reservoirs i and cells x.  Given Z, a pass has

    E[W_Y 1{Y=y} | Z] = L Z,    sum w = u Z,    E[W_Y^2 1{Y=y} | Z] = (Q Z) (u Z),

so the mean of Z and its second moments E[Z Z^T] determine those of the result: variances without
any noise.  L, u and Q are read off the same `weigh` that renders, fed with every cell and W = 1.
Needs confidences and neighbours that do not depend on sample values.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from restir_ref.batch import Array, ratio
from restir_ref.integrals import Pixels, Reservoirs
from restir_ref.mis import Weights
from restir_ref.oracle.cells import Frame
from restir_ref.resampling import Input, weigh

NONE = np.arange(0)


@dataclass(frozen=True)
class Moments:
    """E[Z] (D,) and E[Z Z^T] (D, D)."""

    mean: Array
    second: Array


@dataclass(frozen=True)
class Source:
    """An input of a pass: where its K entries of Z start, whose pixel it is, and its confidence."""

    start: int
    frame: Frame
    pixel: int
    c: float


@dataclass(frozen=True)
class Operator:
    """L (K, D), u (D,) and Q (K, D) of one pixel's pass, as in the module's formulas."""

    L: Array
    u: Array
    Q: Array


def independent(parts: Sequence[Moments]) -> Moments:
    """Moments of independent collections, stacked."""
    mean = np.concatenate([part.mean for part in parts])
    second = np.outer(mean, mean)
    start = 0
    for part in parts:
        stop = start + len(part.mean)
        second[start:stop, start:stop] = part.second
        start = stop
    return Moments(mean, second)


def drawn(frame: Frame) -> Moments:
    """Moments of one initial sample per pixel, W = 1/p, null where p_hat = 0; frames with one technique."""
    if len(frame.cells.pdf) != 1:
        raise ValueError(f"drawn() knows one technique per pixel, but this scene has {len(frame.cells.pdf)}.")
    ids = frame.ids(np.arange(frame.n))
    pdf = np.where(frame.cells.p_hat[ids] > 0, frame.cells.pdf[0, ids], 0)
    v = frame.cells.v[ids]
    pixels = [Moments(np.where(p > 0, w, 0), np.diag(ratio(w, p))) for p, w in zip(pdf, v, strict=True)]
    return independent(pixels)


def operator(sources: Sequence[Source], D: int, mis: Weights) -> Operator:
    """The operator of one pixel's pass over `sources`, the canonical one first, on Z of size D."""
    K = sources[0].frame.cells.v.shape[-1]
    x, one = np.arange(K), np.ones(K)
    at = [Pixels(source.frame, np.full(K, source.pixel)) for source in sources]
    inputs = [Input(Reservoirs(x, one, source.c * one), pixels) for source, pixels in zip(sources, at, strict=True)]
    L, u, Q = np.zeros((K, D)), np.zeros(D), np.zeros((K, D))
    for source, y in zip(sources, weigh(inputs, at[0], mis), strict=True):
        r = one if y.c_over_m is None else y.c_over_m
        entry = source.start + x
        u[entry] += y.p_hat * y.mW
        np.add.at(L, (y.x, entry), np.where(y.p_hat > 0, r * y.mW, 0))  # null samples are never chosen
        np.add.at(Q, (y.x, entry), ratio(r**2 * y.mW, y.p_hat))
    return Operator(L, u, Q)


def resampled(Z: Moments, passes: Sequence[Operator], kept: Array = NONE) -> Moments:
    """Moments of what independent selections in `passes` make of Z, one block each, then of the entries `kept`."""
    D, K = len(Z.mean), len(passes[0].L)
    L = np.concatenate([*(each.L for each in passes), np.eye(D)[kept]])
    second = L @ Z.second @ L.T
    for i, each in enumerate(passes):
        block = slice(i * K, (i + 1) * K)
        second[block, block] = np.diag(each.Q @ (Z.second @ each.u))
    return Moments(L @ Z.mean, second)


def mapped(Z: Moments, A: Array) -> Moments:
    """Moments of the linear map A Z, such as shading, A (D', D)."""
    return Moments(A @ Z.mean, A @ Z.second @ A.T)


def variance(Z: Moments) -> Array:
    """Var[Z] per entry (D,)."""
    return np.asarray(np.diag(Z.second) - Z.mean**2)


def copies(one: Moments, n: Array) -> Moments:
    """Moments of the average of n independent copies of Z; n (D,) may differ between its independent parts."""
    mean = np.outer(one.mean, one.mean)
    return Moments(one.mean, mean + (one.second - mean) / n[:, None])


def reused(frame: Frame, pixel: int, n: Array, mis: Weights) -> Operator:
    """The operator of a pixel's pass over n[i] samples of every pixel i, (frame.n,), n[pixel] > 0.

    They enter as their average, of confidence n[i]; Z holds one average per pixel, see `copies`.
    """
    K = frame.cells.v.shape[-1]
    pixels = [pixel, *(i for i in range(frame.n) if i != pixel and n[i] > 0)]
    return operator([Source(i * K, frame, i, n[i]) for i in pixels], frame.n * K, mis)
