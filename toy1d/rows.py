"""Rows of pixels that change slowly from one to the next, as images do."""

import numpy as np

from restir_ref.batch import Array
from toy1d.line import Line


def image_of_64() -> Line:
    """T64: a row of 64 pixels on [0, 1], each with a narrow bump that moves along the row.  [GRIS Fig. 9, 10]

    f_i = amp_i (.05 + exp(-((x - mu_i)/.04)^2)), mu_i = .15 ... .85, amp_i = 1 + .6 sin(4 pi i / 63), uniform
    samples: the ten pixels within radius 5 overlap enough to share, the rest do not.

    >>> from toy1d import image_of_64
    >>> image_of_64().n
    64
    """
    i = np.arange(64)
    mu, amp = 0.15 + 0.7 * i / 63, 1 + 0.6 * np.sin(4 * np.pi * i / 63)

    def f(pixel: Array, x: Array) -> Array:
        return np.asarray(amp[pixel] * (0.05 + np.exp(-(((x - mu[pixel]) / 0.04) ** 2))))

    return Line(f, np.zeros(64), np.ones(64))


def ring_of_8() -> Line:
    """Eight pixels in a ring, small enough for exact moments of temporal and spatial reuse.  [GRIS Fig. 9]

    f_i = .02 + exp(-(x - .5 - .2 sin(2 pi i / 8))^2 / (2 * .12^2)) on [0, 1], uniform samples.

    >>> from toy1d import ring_of_8
    >>> ring_of_8().n
    8
    """
    centre = 0.5 + 0.2 * np.sin(2 * np.pi * np.arange(8) / 8)

    def f(pixel: Array, x: Array) -> Array:
        return np.asarray(0.02 + np.exp(-((x - centre[pixel]) ** 2) / (2 * 0.12**2)))

    return Line(f, np.zeros(8), np.ones(8))
