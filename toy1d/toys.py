"""The toys by name; each says which property makes it matter."""

from collections.abc import Callable, Mapping
from types import MappingProxyType

import numpy as np

from restir_ref.batch import Array
from toy1d.line import Line


def two_pixels() -> Line:
    """T2: two smooth integrands on [0, 1] that share samples and nothing else.  [GRIS Fig. 2]

    f_1 = 1 + .9 sin(2 pi x),  f_2 = .2 + 3 exp(-((x - .6)/.15)^2).  Each frame brings two new
    samples; without a cap on confidence all others are duplicates.
    """

    def f(pixel: Array, x: Array) -> Array:
        wave = 1 + 0.9 * np.sin(2 * np.pi * x)
        bump = 0.2 + 3 * np.exp(-(((x - 0.6) / 0.15) ** 2))
        return np.where(pixel == 0, wave, bump)

    return Line(f, np.zeros(2), np.ones(2))


def overlapping_supports() -> Line:
    """T7: seven pixels whose domains overlap; the centre pixel 3 has a part of its own.  [GRIS Fig. 4, 7]

    At distance d = pixel - 3 the integrand is .1 + exp(-(x - .5 - .08 d)^2 / (2 * .12^2)) on
    [.2 + .08 |d|, .8 + .08 d), so the number Z(y) of pixels that can realise y climbs from 1 at
    y = .2 to 7: weights that assume all seven everywhere lose energy.
    """
    d = np.arange(-3, 4)

    def f(pixel: Array, x: Array) -> Array:
        return 0.1 + np.exp(-((x - 0.5 - 0.08 * (pixel - 3)) ** 2) / (2 * 0.12**2))

    return Line(f, 0.2 + 0.08 * np.abs(d), 0.8 + 0.08 * d)


TOYS: Mapping[str, Callable[[], Line]] = MappingProxyType(
    {"two_pixels": two_pixels, "overlapping_supports": overlapping_supports}
)
