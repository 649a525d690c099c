"""The passes of `restir_ref` as one writes them by hand for a single system, to time the generic code against.

The system is `Band`: an image of bumps on intervals whose samples scale from pixel to pixel.  `Band.line`
states it for the protocol.  `spatial` and `temporal` know everything by heart: the weights, how many
neighbours, that nothing is replicated.  They compute the same targets and shifts, not one more or less,
either with Band's inlined formulas and tables gathered once per neighbour, or, as `Called`, with the methods
of its Line; what is then left is the price of the resampler alone.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from restir_ref import Pixels
from toy1d import Chart, Line

Array = NDArray[Any]
Uniform = Callable[[int], Array]

State = tuple[Array, Array, Array]
"""Samples x, weights W and confidences c, each (N,)."""


class World(Protocol):
    """One pixel per column."""

    def at(self, index: Array) -> "World":
        """The pixels `index` of this image."""

    def target(self, x: Array) -> Array:
        """p_hat (N,) of samples inside their domains."""

    def moved(self, x: Array, home: Any) -> tuple[Array, Array]:
        """y = T(x) from the pixels `home` to ours and J, 0 where undefined; (N,) each."""


@dataclass(frozen=True, eq=False)
class Band:
    """Pixel i integrates max(exp(-(x - centre)^2 / .03) - .1, 0) over [low, high); shifts keep slope x.

    Domains are wider than the bump and end in different places: null samples and undefined shifts occur.
    """

    low: Array
    high: Array
    slope: Array
    centre: Array

    def at(self, index: Array) -> "Band":
        """The pixels `index` of this image."""
        return Band(*(table.take(index) for table in (self.low, self.high, self.slope, self.centre)))

    def target(self, x: Array) -> Array:
        """p_hat of samples that lie inside their domains, or that J = 0 rules out."""
        p_hat = x - self.centre
        np.multiply(p_hat, p_hat, out=p_hat)
        np.multiply(p_hat, -1 / 0.03, out=p_hat)
        np.exp(p_hat, out=p_hat)
        np.subtract(p_hat, 0.1, out=p_hat)
        return np.maximum(p_hat, 0, out=p_hat)

    def moved(self, x: Array, home: "Band") -> tuple[Array, Array]:
        """y = J x, J = slope there / slope here inside our domain."""
        J = home.slope / self.slope
        y = x * J
        return y, np.multiply(J, (y >= self.low) & (y < self.high), out=J)

    def line(self, of: Callable[..., Line] = Line) -> Line:
        """The same image for the protocol; `of` makes it."""
        slope, centre = self.slope, self.centre
        chart = Chart(
            to=lambda i, x: x * slope.take(i),
            back=lambda i, z: z / slope.take(i),
            slope=lambda i, x: slope.take(i),
        )
        return of(lambda i, x: bump(x - centre.take(i)), self.low, self.high, chart)


def bump(d: Array) -> Array:
    """max(exp(-d^2 / .03) - .1, 0)."""
    return np.maximum(np.exp(d * d * (-1 / 0.03)) - 0.1, 0)


@dataclass(frozen=True, eq=False)
class Called:
    """Pixels of a Line whose own methods are called."""

    line: Line
    index: Array

    def at(self, index: Array) -> "Called":
        """The pixels `index` of this image."""
        return Called(self.line, index)

    def target(self, x: Array) -> Array:
        """p_hat."""
        return self.line.target(self.index, x)

    def moved(self, x: Array, home: "Called") -> tuple[Array, Array]:
        """T(x) and J."""
        y = home.line.shift(x, home.index, Pixels(self.line, self.index))
        return y.x, y.J


def band(n: int, phase: float = 0.0) -> Band:
    """An image of n pixels; `phase` moves it on by a frame."""
    t = 2 * np.pi * (np.arange(n) / 64 + phase)
    slope, centre = 1 + 0.2 * np.cos(t), 0.5 + 0.1 * np.sin(t)
    return Band(centre - 0.35 - 0.1 * np.cos(3 * t), centre + 0.35 + 0.1 * np.sin(5 * t), slope, centre)


def spatial(here: World, X: State, neighbours: Sequence[Array], uniform: Uniform) -> State:
    """Reuse from the neighbours (N,) with defensive pairwise weights.  [GRIS Eq. 38]"""
    (x, W, c), M = X, len(neighbours)
    x_near, W_near, c_near = ([values.take(j) for j in neighbours] for values in X)
    C_N = sum(c_near[1:], c_near[0])
    C = c + C_N

    p, w = np.empty((M + 1, len(x))), np.empty((M + 1, len(x)))
    p[0], y = here.target(x), [x]
    share = np.ones(len(x))
    for k in range(M):
        there = here.at(neighbours[k])
        back, J = there.moved(x, here)
        D = c * p[0] + C_N * (there.target(back) * J)
        share += c_near[k] * p[0] / np.where(D > 0, D, 1)

        x_k, J = here.moved(x_near[k], there)
        p[k + 1], p_there = here.target(x_k), there.target(x_near[k])
        D = (c * p[k + 1] * J + C_N * p_there) * C  # = D_k J C, for q_k = p_there / J and J may be 0
        w[k + 1] = p[k + 1] * C_N * c_near[k] * p_there * W_near[k] * J / np.where(D > 0, D, 1)
        y.append(x_k)
    w[0] = p[0] * c * share * W / C
    return selected(y, p, w, uniform, C)


def temporal(here: World, X: State, before: World, Y: State, source: Array, uniform: Uniform, *, cap: float) -> State:
    """Resample with one pixel of the previous frame each, Talbot weights.  [GRIS Eq. 36]"""
    (x, W, c), (x_old, W_old, c_old) = X, (values.take(source) for values in Y)
    there, c_old = before.at(source), np.minimum(c_old, cap)

    p, w = np.empty((2, len(x))), np.empty((2, len(x)))
    p[0] = here.target(x)
    back, J = there.moved(x, here)
    D = c * p[0] + c_old * (there.target(back) * J)
    w[0] = p[0] * c * p[0] * W / np.where(D > 0, D, 1)

    y, J = here.moved(x_old, there)
    p[1], p_there = here.target(y), there.target(x_old)
    D = c * p[1] * J + c_old * p_there
    w[1] = p[1] * c_old * p_there * W_old * J / np.where(D > 0, D, 1)
    return selected([x, y], p, w, uniform, c + c_old)


def selected(y: Sequence[Array], p: Array, w: Array, uniform: Uniform, c: Array) -> State:
    """Choose y[k] (N,) in proportion to w[k]; W = sum w / p_hat(y); p and w (K, N).  [GRIS Eq. 22]"""
    total = w.sum(axis=0)
    t = uniform(len(total)) * total
    x, p_hat, upto = y[0], p[0], w[0].copy()
    for k in range(1, len(y)):
        beyond = t > upto
        x, p_hat = np.where(beyond, y[k], x), np.where(beyond, p[k], p_hat)
        upto += w[k]
    return x, total / np.where(p_hat > 0, p_hat, 1), c
