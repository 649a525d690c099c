"""Checks of what users hand in; a failure names the value, its place and the remedy."""

from numbers import Integral

import numpy as np

from restir_ref.batch import Array


def nonnegative(values: Array, what: str, remedy: str) -> Array:
    """Return `values` (..., N) if all are finite and >= 0.

    Raises ValueError naming the first offending value and its column.
    """
    if not values.size or (values.dtype != object and values.min() >= 0 and values.max() < np.inf):
        return values
    with np.errstate(invalid="ignore"):
        bad = np.atleast_1d(~((values >= 0) & (values < np.inf)))
    if not bad.any():  # of exact numbers, among which min() may overlook a NaN
        return values
    where = tuple(int(k) for k in np.argwhere(bad)[0])
    raise ValueError(
        f"{what} must be finite and non-negative, but is {np.atleast_1d(values)[where]!s} in column {where[-1]} "
        f"({int(bad.sum())} of {values.size} values are bad). {remedy}"
    )


def per_column(values: Array, n: int, what: str) -> Array:
    """Return `values` (n,), or one value to broadcast.

    Raises ValueError naming both shapes.
    """
    if values.shape in ((n,), (1,), ()):
        return values
    raise ValueError(
        f"{what} has shape {values.shape}, but this batch has {n} columns: the last axis must be {n}, and the only one."
    )


def whole(value: object, least: int, what: str, remedy: str) -> None:
    """Raise ValueError, naming it, for a value that is no integer >= `least`."""
    if not (isinstance(value, Integral) and int(value) >= least):
        raise ValueError(f"{what} must be a whole number >= {least}, but is {value!r}. {remedy}")
