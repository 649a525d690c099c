"""Lines for the laws of the continuous toys: the toys, one with charts and holes, wrong ones, and their integrals."""

from functools import cache

import numpy as np
from scipy.integrate import quad

from restir_ref.batch import Array
from restir_ref.integrals import Shifted
from toy1d import TOYS, Chart, Line


def bent() -> Line:
    """Seven pixels whose charts z = x^(1 + .12 d), d = pixel - 3, stretch one another, with holes around z = .5."""

    def e(pixel):
        return 1 + 0.12 * (pixel - 3)

    def f(pixel, x):
        return 0.1 + np.exp(-((x - 0.5 - 0.04 * (pixel - 3)) ** 2) / (2 * 0.12**2))

    chart = Chart(
        to=lambda pixel, x: x ** e(pixel),
        back=lambda pixel, z: z ** (1 / e(pixel)),
        slope=lambda pixel, x: e(pixel) * x ** (e(pixel) - 1),
    )
    low = 0.1 ** (1 / e(np.arange(7)))
    return Line(f, low, np.ones(7), chart, lambda i, j, z: (i != j) & (abs(z - 0.5) < 0.02 * abs(i - j)))


LINES = {**TOYS, "bent": bent}


@cache
def integral(name: str, pixel: int) -> float:
    """int f of one pixel, by quadrature."""
    line = LINES[name]()

    def f(x: float) -> float:
        return float(line.f(np.array(pixel), np.array(x)))

    return quad(f, line.low[pixel], line.high[pixel], epsabs=1e-12, epsrel=1e-12)[0]


def truth(name: str) -> Array:
    return np.array([integral(name, pixel) for pixel in range(LINES[name]().n)])


class Slack(Line):
    """A mistake: J = 1 whatever the charts."""

    def shift(self, x, index, to):
        y = super().shift(x, index, to)
        return Shifted(y.x, 1.0 * (y.J > 0))


class Inverted(Line):
    """A mistake: the Jacobian of the way back."""

    def shift(self, x, index, to):
        y = super().shift(x, index, to)
        return Shifted(y.x, np.where(y.J > 0, 1 / np.where(y.J > 0, y.J, 1), 0))


class Rounding(Line):
    """A mistake: samples that pass through single precision."""

    def shift(self, x, index, to):
        return super().shift(np.float64(np.float32(x)), index, to)


class Spilling(Line):
    """A mistake: domains are not asked."""

    def shift(self, x, index, to):
        z = self.chart.to(index, x)
        return Shifted(self.chart.back(to.index, z), self.chart.slope(index, x) / self.chart.slope(to.index, x))


def made(kind: type[Line], line: Line) -> Line:
    return kind(line.f, line.low, line.high, line.chart, line.holes)
