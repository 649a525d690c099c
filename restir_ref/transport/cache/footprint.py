"""How wide a path has spread: when a cache may be asked instead of tracing on.  [DDGIR 3.3; Bekaert 2003]

    a(x_1 .. x_n) = ( sum_i ( |x_i - x_(i+1)|^(d-1) / (p_i cos_(i+1)) )^(1/(d-1)) )^(d-1)        [DDGIR Eq. 7]
    a_0           = |x_0 - x_1|^(d-1) / (|S^(d-1)| cos_1)                                        [DDGIR Eq. 8]

p_i is the density of the direction leaving x_i, at x_1 of all lobes, later of the glossy ones.  One segment is the area
around x_(i+1) per density 1, and its (d-1)-th root a length: lengths add.  A path may end where a > c a_0.
"""

import numpy as np

from restir_ref.batch import Array
from restir_ref.transport.space import sphere_area
from restir_ref.transport.vectors import power

C_IN_SPACE = 0.2
"""The paper's c, in three dimensions."""


def widening(r: Array, p: Array, cos: Array, d: int) -> Array:
    """(r^(d-1) / (p cos))^(1/(d-1)) (N,), a length: what a segment adds; 0 where p is 0, as of delta lobes."""
    spread = p > 0
    area = power(r, d - 1) / np.where(spread, p * cos, 1)
    return np.where(spread, area ** (1 / (d - 1)), 0.0)


def footprint(lengths: Array, d: int) -> Array:
    """a = (sum_i lengths_i)^(d-1) of segments' `widening`s (n - 1, N), an area; (N,).  [DDGIR Eq. 7]"""
    return power(lengths.sum(axis=0), d - 1)


def pixel_footprint(r: Array, cos: Array, d: int) -> Array:
    """a_0 = r^(d-1) / (|S^(d-1)| cos_1) (N,): x_1 at distance r (N,) under cos_1 = <n_1, -w_0>.  [DDGIR Eq. 8]

    # erratum: the printed index of w is not bound; it is the camera ray's direction.
    """
    return np.asarray(power(r, d - 1) / (sphere_area(d) * cos))


def as_wide_as_in_space(d: int) -> float:
    """The c for which a path has widened, as a length, just as far as with the paper's c = .2 in space.

    (c r^(d-1) / |S^(d-1)|)^(1/(d-1)) = (.2 r^2 / (4 pi))^(1/2) for cos_1 = 1; .79 in flatland.
    """
    return float(sphere_area(d) * (C_IN_SPACE / sphere_area(3)) ** ((d - 1) / 2))
