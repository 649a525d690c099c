"""The toys by name; each says which property makes it matter."""

from collections.abc import Callable, Mapping
from types import MappingProxyType

import numpy as np

from restir_ref.batch import Array
from toy1d.gradient_toy import bare_peaks, partial_shift, shared_peak, two_pairs
from toy1d.line import Line, Technique
from toy1d.neighbours import degrading_neighbours, overlapping_supports, overstating_neighbours
from toy1d.rows import image_of_64, ring_of_8


def two_pixels() -> Line:
    """T2: two smooth integrands on [0, 1] that share samples and nothing else.  [GRIS Fig. 2]

    f_1 = 1 + .9 sin(2 pi x),  f_2 = .2 + 3 exp(-((x - .6)/.15)^2).  Each frame brings two new
    samples; without a cap on confidence all others are duplicates.

    >>> import numpy as np
    >>> from toy1d import two_pixels
    >>> line = two_pixels()
    >>> line.n, line.low, line.high
    (2, array([0., 0.]), array([1., 1.]))
    """

    def f(pixel: Array, x: Array) -> Array:
        bump = 0.2 + 3 * np.exp(-(((x - 0.6) / 0.15) ** 2))
        return np.where(pixel == 0, wave(x), bump)

    return Line(f, np.zeros(2), np.ones(2))


def known_densities() -> Line:
    """T1: a wave and two bumps on [0, 1], each sampled by three techniques of known density.  [GRIS Eq. 5]

    f_1 = 1 + .9 sin(2 pi x),  f_2 = .1 + exp(-((x - .3)/.08)^2) + exp(-((x - .75)/.05)^2) / 2;
    p_1 = 1, p_2 = 2 x, and p_3 = 2 on [.5, 1), which does not cover: weights 1/M lose a third of the left half.

    >>> import numpy as np
    >>> from restir_ref import Pixels
    >>> from restir_ref.chance import Live
    >>> from toy1d import known_densities
    >>> line = known_densities()
    >>> len(list(line.candidates(np.zeros(1, dtype=int), Live(np.random.default_rng(1)))))  # one per technique
    3
    """

    def f(pixel: Array, x: Array) -> Array:
        bumps = 0.1 + np.exp(-(((x - 0.3) / 0.08) ** 2)) + np.exp(-(((x - 0.75) / 0.05) ** 2)) / 2
        return np.where(pixel == 0, wave(x), bumps)

    rising = Technique(lambda pixel, u: np.sqrt(u), lambda pixel, s: 2 * s)
    right = Technique(lambda pixel, u: (1 + u) / 2, lambda pixel, s: np.where(s >= 0.5, 2.0, 0.0))
    return Line(f, np.zeros(2), np.ones(2), techniques=(Technique(), rising, right))


def three_channels() -> Line:
    """TC: one pixel of colour f = (1 + sin 2 pi x, 1 + cos 2 pi x, .5 + x) on [0, 1].  [GRIS Eq. 46-47]

    The target is the brightness |f|, the mean of the channels, which knows nothing of the chroma f / |f|.

    >>> import numpy as np
    >>> from toy1d import three_channels
    >>> line = three_channels()
    >>> line.contribution(np.array([0]), np.array([0.5])).shape
    (3, 1)
    """

    def colour(x: Array) -> Array:
        return np.stack([1 + np.sin(2 * np.pi * x), 1 + np.cos(2 * np.pi * x), 0.5 + x])

    def brightness(pixel: Array, x: Array) -> Array:
        return np.asarray(colour(x).mean(axis=0))

    def chroma(pixel: Array, x: Array) -> Array:
        return np.asarray(colour(x) / colour(x).mean(axis=0))

    return Line(brightness, np.zeros(1), np.ones(1), chroma=chroma)


def wave(x: Array) -> Array:
    """1 + .9 sin(2 pi x)."""
    return np.asarray(1 + 0.9 * np.sin(2 * np.pi * x))


TOYS: Mapping[str, Callable[[], Line]] = MappingProxyType(
    {
        toy.__name__: toy
        for toy in (
            two_pixels,
            known_densities,
            three_channels,
            overlapping_supports,
            degrading_neighbours,
            overstating_neighbours,
            image_of_64,
            ring_of_8,
            shared_peak,
            bare_peaks,
            partial_shift,
            two_pairs,
        )
    }
)
