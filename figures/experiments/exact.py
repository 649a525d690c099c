"""Exact means and variances for figures: one pass by quadrature, the real-time loop by moments on cells."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np
from scipy.linalg import block_diag

from restir_ref.batch import Array, ratio
from restir_ref.integrals import Pixels, Reservoirs
from restir_ref.mis import WEIGHTS, Weights
from restir_ref.oracle.cells import Frame
from restir_ref.oracle.moments import Moments, Operator, Source, drawn, independent, mapped, operator, resampled
from restir_ref.resampling import LARGEST_CONFIDENCE, Input, weigh
from toy1d import Line


def integral(line: Line, pixel: int, nodes: int = 20_000) -> float:
    """int f of a smooth pixel over its domain, by the midpoint rule."""
    x, dx = _nodes(line.low[pixel], line.high[pixel], nodes)
    return float(line.f(np.full(nodes, pixel), x).sum() * dx)


def true_image(line: Line) -> Array:
    """The integrals of all pixels, (n,)."""
    return np.array([integral(line, i) for i in range(line.n)])


def second_moment(line: Line, pixel: int, nodes: int = 20_000) -> float:
    """E[(f(X) / p(X))^2] of one sample, int f^2 / p, by the midpoint rule."""
    x, dx = _nodes(line.low[pixel], line.high[pixel], nodes)
    index = np.full(nodes, pixel)
    return float(ratio(line.f(index, x) ** 2, line.pdf(index, x)).sum() * dx)


def _nodes(low: float, high: float, n: int) -> tuple[Array, float]:
    """Middles and size of n cells."""
    size = (high - low) / n
    return low + size * (np.arange(n) + 0.5), size


# ---------------------------------------------------------------- one pass over independent inputs


def sum_of_weights(line: Line, copies: Sequence[tuple[int, float]], mis: Weights, nodes: int = 2100) -> Array:
    """(E, Var) of sum w, which is f(Y) W_Y where p_hat = f, for a pass over independent samples; (2,).

    `copies` names a pixel and its number of samples, the canonical pixel first; they enter as one input of
    that confidence, and averaging n copies divides its variance by n.  Midpoint rule over all domains.
    """
    x, dx = _nodes(line.low.min(), line.high.max(), nodes)
    at = [Pixels(line, np.full(nodes, pixel)) for pixel, _ in copies]
    p = [line.pdf(pixels.index, x) for pixels in at]
    X = [Reservoirs(x, ratio(np.ones(nodes), p_i), np.full(nodes, n)) for p_i, (_, n) in zip(p, copies, strict=True)]
    inputs = [Input(X_i, pixels) for X_i, pixels in zip(X, at, strict=True)]
    total = np.zeros(2)
    for y, p_i, (_, n) in zip(weigh(inputs, at[0], mis), p, copies, strict=True):
        w = y.p_hat * y.mW
        mean = (p_i * w).sum() * dx
        total += [mean, ((p_i * w**2).sum() * dx - mean**2) / n]
    return total


# ---------------------------------------------------------------- frames of temporal and spatial reuse


@dataclass(frozen=True, eq=False)
class Loop:
    """Temporal reuse with Talbot weights, spatial reuse from the pixels `offsets` away, cyclically, defensive weights.

    Its state is Z = (history (n K), extra entries) and the confidence c of the history.
    """

    frame: Frame
    cap: float
    offsets: tuple[int, ...]

    @property
    def size(self) -> int:
        """Entries n K of the history."""
        return int(self.frame.n * self.frame.cells.v.shape[-1])

    @cached_property
    def fresh(self) -> Moments:
        """One new sample per pixel."""
        return drawn(self.frame)

    @cached_property
    def light(self) -> Array:
        """The linear map from the history to the shaded pixels, (n, n K)."""
        return np.asarray(block_diag(*self.frame.cells.f))


def start(loop: Loop, extra: int) -> Moments:
    """No history yet, and `extra` zeros."""
    D = loop.size + extra
    return Moments(np.zeros(D), np.zeros((D, D)))


def step(loop: Loop, Z: Moments, c: float) -> tuple[Moments, float]:
    """The next frame's history; extra entries stay."""
    D, history = len(Z.mean), min(c, loop.cap)
    kept = np.arange(loop.size, D)
    Z = resampled(independent([Z, loop.fresh]), along_time(loop, D, history), kept)
    if loop.offsets:
        Z = resampled(Z, across_space(loop, D, 1 + history), kept)
    return Z, min((1 + len(loop.offsets)) * (1 + history), LARGEST_CONFIDENCE)


@cache
def along_time(loop: Loop, D: int, c: float) -> tuple[Operator, ...]:
    """Every pixel merges its new sample with its history of confidence c; Z = (history, extra, new)."""
    K, frame = loop.size // loop.frame.n, loop.frame
    pairs = [[Source(D + i * K, frame, i, 1.0), Source(i * K, frame, i, c)] for i in range(frame.n)]
    return tuple(operator(pair, D + loop.size, WEIGHTS["talbot"]) for pair in pairs)


@cache
def across_space(loop: Loop, D: int, c: float) -> tuple[Operator, ...]:
    """Every pixel merges its sample with those of its neighbours, all of confidence c; Z = (samples, extra)."""
    K, frame = loop.size // loop.frame.n, loop.frame
    near = [[(i + by) % frame.n for by in (0, *loop.offsets)] for i in range(frame.n)]
    groups = [[Source(j * K, frame, j, c) for j in pixels] for pixels in near]
    return tuple(operator(group, D, WEIGHTS["defensive"]) for group in groups)


def shaded(loop: Loop, Z: Moments) -> Moments:
    """Moments of the shaded pixels, (n,)."""
    return mapped(Z, np.pad(loop.light, ((0, 0), (0, len(Z.mean) - loop.size))))


def accumulated(loop: Loop, Z: Moments) -> Moments:
    """Add the shaded pixels to the n extra entries."""
    return mapped(Z, _lower(loop, np.eye(loop.frame.n)))


def copied(loop: Loop, Z: Moments) -> Moments:
    """Replace the n extra entries by the shaded pixels."""
    return mapped(Z, _lower(loop, np.zeros((loop.frame.n, loop.frame.n))))


def shaded_beside(loop: Loop, Z: Moments) -> Moments:
    """The shaded pixels and, after them, the n extra entries; (2 n,)."""
    return mapped(Z, block_diag(loop.light, np.eye(loop.frame.n)))


def _lower(loop: Loop, corner: Array) -> Array:
    """The history stays; the extra entries become light history + corner extra."""
    history = np.eye(loop.size, loop.size + loop.frame.n)
    return np.concatenate([history, np.concatenate([loop.light, corner], axis=1)])


def integrals(frame: Frame) -> Array:
    """The integrals on cells, (n,)."""
    return np.asarray((frame.cells.f * frame.cells.v).sum(axis=-1)[frame.ids(np.arange(frame.n))])
