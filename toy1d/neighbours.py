"""A centre pixel and neighbours that are, each toy in its own way, less than perfect to reuse from."""

import numpy as np
from scipy.special import betaincinv

from restir_ref.batch import Array
from toy1d.line import Line, Technique


def overlapping_supports() -> Line:
    """T7: seven pixels whose domains overlap; the centre pixel 3 has a part of its own.  [GRIS Fig. 4, 7]

    At distance d = pixel - 3 the integrand is .1 + exp(-(x - .5 - .08 d)^2 / (2 * .12^2)) on
    [.2 + .08 |d|, .8 + .08 d), so the number Z(y) of pixels that can realise y climbs from 1 at
    y = .2 to 7: weights that assume all seven everywhere lose energy.

    >>> from toy1d import overlapping_supports
    >>> line = overlapping_supports()
    >>> line.n, line.low.round(2), line.high.round(2)
    (7, array([0.44, 0.36, 0.28, 0.2 , 0.28, 0.36, 0.44]), array([0.56, 0.64, 0.72, 0.8 , 0.88, 0.96, 1.04]))
    """
    d = np.arange(-3, 4)

    def f(pixel: Array, x: Array) -> Array:
        return 0.1 + np.exp(-((x - 0.5 - 0.08 * (pixel - 3)) ** 2) / (2 * 0.12**2))

    return Line(f, 0.2 + 0.08 * np.abs(d), 0.8 + 0.08 * d)


def degrading_neighbours() -> Line:
    """T8: 65 pixels around a centre, ever worse matches with distance.  [GRIS Fig. 8]

    Pixel 32 + d integrates max(1 - s^2, 0)^2 with s = (x - .5 - .0125 d) / .1 over [0, 1].  The others sample
    exactly in proportion to their own integrand, so each of their samples is perfect at home; the centre
    samples half its integrand and half uniformly.  Wide windows crowd out its one sample where only it can look.

    >>> from toy1d import degrading_neighbours
    >>> degrading_neighbours().n
    65
    """
    radius, count = 0.1, 65

    def offset(pixel: Array, x: Array) -> Array:
        return np.asarray((x - 0.5 - 0.0125 * (pixel - count // 2)) / radius)

    def f(pixel: Array, x: Array) -> Array:
        return np.asarray(np.maximum(1 - offset(pixel, x) ** 2, 0) ** 2)

    def own(pixel: Array, u: Array) -> Array:
        """x of density 15/16 f / radius: s = 2 b - 1 with b of the beta distribution (3, 3)."""
        return np.asarray(0.5 + 0.0125 * (pixel - count // 2) + radius * (2 * betaincinv(3, 3, u) - 1))

    def sample(pixel: Array, u: Array) -> Array:
        half = np.where(u < 0.5, 2 * u, own(pixel, np.maximum(2 * u - 1, 0)))
        return np.where(pixel == count // 2, half, own(pixel, u))

    def pdf(pixel: Array, s: Array) -> Array:
        p = 15 / 16 * f(pixel, s) / radius
        return np.where(pixel == count // 2, (1 + p) / 2, p)

    return Line(f, np.zeros(count), np.ones(count), techniques=(Technique(sample, pdf),))


def overstating_neighbours(share: float = 0.01) -> Line:
    """Seven equal pixels; all but the centre 3 rarely sample the middle fifth that their target promises.  [GRIS 5.6]

    f = .1 + exp(-(x - .5)^2 / (2 * .12^2)) on [0, 1] for all.  The centre samples uniformly; the others have
    `share` of that density on [.4, .6), the rest evenly elsewhere: p_hat overstates their sampler there.

    >>> from toy1d import overstating_neighbours
    >>> overstating_neighbours(share=0.1).n
    7
    """
    outside = (1 - 0.2 * share) / 0.8
    masses = np.cumsum([0, 0.4 * outside, 0.2 * share, 0.4 * outside])

    def f(pixel: Array, x: Array) -> Array:
        return np.asarray(0.1 + np.exp(-((x - 0.5) ** 2) / (2 * 0.12**2)))

    def sample(pixel: Array, u: Array) -> Array:
        return np.where(pixel == 3, u, np.interp(u, masses, [0, 0.4, 0.6, 1]))

    def pdf(pixel: Array, s: Array) -> Array:
        inside = (s >= 0.4) & (s < 0.6)
        return np.where(pixel == 3, 1.0, np.where(inside, share, outside))

    return Line(f, np.zeros(7), np.ones(7), techniques=(Technique(sample, pdf),))
