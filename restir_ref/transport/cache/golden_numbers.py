"""Numbers for golden vectors of caches: even, the same in float32, and moved by one rounding for tolerances.

Tolerances are OPERATIONS times what moving all inputs by one rounding of float32 does.
"""

from collections.abc import Iterable, Mapping

import numpy as np

from restir_ref.batch import Array

OPERATIONS = 128
"""So many roundings are allowed for."""

UNIT = 2.0**-24
"""Relative error of one operation in float32."""

PATTERNS = range(8)
"""Ways of moving numbers up and down."""


def lattice(rows: int, N: int, first: int) -> Array:
    """Numbers (rows, N) in [0, 1) that fill their cube evenly, multiples of 2^-16; other rows for another `first`."""
    steps = np.sqrt(np.array([2.0, 3.0, 5.0, 7.0, 11.0, 13.0, 17.0, 19.0, 23.0])[first : first + rows])[:, None]
    return np.asarray(np.floor(np.arange(1, N + 1) * steps % 1 * 2**16) / 2**16)


def single(values: Array) -> Array:
    """As float32 has them."""
    return np.asarray(values, dtype=np.float32).astype(float)


def nudged(values: Array, k: int, salt: int) -> Array:
    """Numbers times 1 + UNIT or 1 - UNIT, by patterns that differ with k and `salt`."""
    sign = np.where(np.arange(values.size) * (2 * k + 1 + salt) % 7 < 3, 1.0, -1.0)
    return np.asarray(values * (1 + UNIT * sign.reshape(values.shape)))


def tolerances(want: Mapping[str, Array], moved: Iterable[Mapping[str, Array]]) -> dict[str, float]:
    """By term, for |got - want| <= tolerance (|want| + mean |want|), from terms of inputs that were `moved`."""
    size = {name: np.abs(each) + np.abs(each).mean() for name, each in want.items()}
    found = dict.fromkeys(want, UNIT)
    for got in moved:
        for name, each in want.items():
            found[name] = max(found[name], float((np.abs(got[name] - each) / size[name]).max()))
    return {name: OPERATIONS * each for name, each in found.items()}
