"""Toys of differences between pixels: a pair (i, j) of pixels estimates int f_i - int f_j.  [GPT 3-4]"""

from collections.abc import Sequence

import numpy as np

from restir_ref.batch import Array
from toy1d.line import Chart, Function, Line


def shared_peak() -> Line:
    """TD: two pixels on [-2, 2] with the same tall peak at 0 and one small peak each elsewhere.  [GPT Fig. 3]

    f_1 = 5 exp(-(x/.3)^2) + .6 exp(-((x - 1.2)/.15)^2) + .05,
    f_2 = 5 exp(-(x/.3)^2) + .4 exp(-((x + 1.3)/.15)^2) + .05.  Only the small peaks differ.

    >>> from toy1d import shared_peak
    >>> shared_peak().n
    2
    """

    def f(pixel: Array, x: Array) -> Array:
        return 5 * bump(x, 0.3) + own_bump(pixel, x, [(0.6, 1.2), (0.4, -1.3)], 0.15) + 0.05

    return Line(f, np.full(2, -2.0), np.full(2, 2.0))


def bare_peaks() -> Line:
    """As `shared_peak` with narrower peaks and nothing between them.

    With g(m, s) = exp(-(x - m)^2 / (2 s^2)):  f_1 = 3 g(0, .2) + .5 g(1.2, .15),  f_2 = 3 g(0, .2) + .3 g(-1.2, .15).

    >>> from toy1d import bare_peaks
    >>> bare_peaks().n
    2
    """
    root = np.sqrt(2)

    def f(pixel: Array, x: Array) -> Array:
        return 3 * bump(x, 0.2 * root) + own_bump(pixel, x, [(0.5, 1.2), (0.3, -1.2)], 0.15 * root)

    return Line(f, np.full(2, -2.0), np.full(2, 2.0))


def partial_shift() -> Line:
    """Two pixels with T_01(x) = x^2, J = 2x, and parts of either that the shift does not reach.

    f_0 = 1.5 - x on [0, 1), f_1 = .4 + x on [.16, 1.96): T_01 is defined on [.4, 1), T_10 on [.16, 1).

    >>> import numpy as np
    >>> from restir_ref import Pixels
    >>> from toy1d import partial_shift
    >>> line = partial_shift()
    >>> line.shift(np.array([0.75]), np.array([0]), Pixels(line, np.array([1]))).J  # 2 x
    array([1.5])
    """
    return Line(straight([1.5, 0.4], [-1, 1]), np.array([0, 0.16]), np.array([1, 1.96]), powers([1, 0.5]))


def two_pairs() -> Line:
    """Pairs (0, 1) and (2, 3) with inner shifts T(x) = x^(2/3), linked by the outer shift tau(x) = x^2.

    f = 3 + x, 1 + x/2, 4 - 2x, (1 + x)/2: both differences are positive everywhere.

    >>> from toy1d import two_pairs
    >>> two_pairs().n
    4
    """
    e = [1, 1.5, 0.5, 0.75]
    return Line(straight([3, 1, 4, 0.5], [1, 0.5, -2, 0.5]), 0.2 ** (1 / np.array(e)), np.ones(4), powers(e))


def bump(x: Array, width: float) -> Array:
    """exp(-(x / width)^2)."""
    return np.asarray(np.exp(-((x / width) ** 2)))


def own_bump(pixel: Array, x: Array, places: Sequence[tuple[float, float]], width: float) -> Array:
    """h exp(-((x - m) / width)^2) with each pixel's own (h, m)."""
    h, m = np.array(places).T
    return np.asarray(h[pixel] * bump(x - m[pixel], width))


def straight(at_zero: Sequence[float], slope: Sequence[float]) -> Function:
    """f_i(x) = at_zero_i + slope_i x."""
    a, b = np.array(at_zero), np.array(slope)
    return lambda pixel, x: a[pixel] + b[pixel] * x


def powers(exponents: Sequence[float]) -> Chart:
    """z = x^e_i, so that T_ij(x) = x^(e_i / e_j)."""
    e = np.array(exponents)
    return Chart(
        to=lambda pixel, x: x ** e[pixel],
        back=lambda pixel, z: z ** (1 / e[pixel]),
        slope=lambda pixel, x: e[pixel] * x ** (e[pixel] - 1),
    )
