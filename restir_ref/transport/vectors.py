"""The few vector operations there are; vectors are (d, N), scalars (N,).

Sums over the short first axis are written out: cheaper than a reduction, and the same bits on every machine.
"""

from functools import reduce
from operator import mul

import numpy as np

from restir_ref.batch import Array, total


def dot(a: Array, b: Array) -> Array:
    """a . b over the first axis, (N,)."""
    return total([x * y for x, y in zip(a, b, strict=True)])


def norm(a: Array) -> Array:
    """|a|, (N,)."""
    return np.asarray(np.sqrt(dot(a, a)))


def normalize(a: Array) -> Array:
    """a / |a|; a must not be 0."""
    return np.asarray(a / norm(a))


def reflect(w: Array, m: Array) -> Array:
    """w mirrored at the normal m: 2 (w . m) m - w."""
    return np.asarray(2 * dot(w, m) * m - w)


def power(x: Array, n: int) -> Array:
    """x^n for an integer n >= 0, by multiplication."""
    return reduce(mul, [x] * n, np.ones(1))
