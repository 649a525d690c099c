"""Checks of what users hand in; a failure names the value, its place and the remedy."""

from collections.abc import Mapping
from numbers import Integral, Real
from typing import Any, TypeVar

import numpy as np

from restir_ref.batch import Array, Batch, in_memory

Member = TypeVar("Member")


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
    """Return `values` (n,), or one number () to broadcast.

    Raises ValueError naming both shapes.
    """
    if values.shape in ((n,), ()):
        return values
    raise ValueError(
        f"{what} has shape {values.shape}, but this batch has {n} columns: the last axis must be {n}, and the only one."
    )


def aligned(batch: Batch, n: int, what: str) -> Batch:
    """Return `batch` if all its leaves have n columns, or a reference's index and own fields.

    Raises ValueError naming the shape of one that has not: it would be broadcast without a word.
    """

    def checked(leaf: Array) -> Array:
        if leaf.shape[-1:] != (n,):
            raise ValueError(
                f"{what} have a part of shape {leaf.shape}, but this batch has {n} columns: every array of a sample "
                f"ends in the batch axis, {n} long."
            )
        return leaf

    in_memory(checked, batch)
    return batch


def read_only(batch: Batch) -> Batch:
    """The same memory, into which nobody can write by these arrays."""

    def locked(leaf: Array) -> Array:
        view = leaf.view()
        view.flags.writeable = False
        return view

    return in_memory(locked, batch)


def apart(one: Batch, other: Batch, what: str) -> None:
    """Raise ValueError if two results are, array by array, the same memory that may still be written into."""
    if _writeable(one) == _writeable(other):
        raise ValueError(
            f"two {what} are the same memory, so that the second one has overwritten the first: return new arrays "
            "each time, or read-only ones."
        )


def _writeable(batch: Batch) -> list[Any]:
    """Where the arrays of a batch begin; what cannot be written into is nowhere."""
    found: list[Any] = []

    def noted(leaf: Array) -> Array:
        found.append(leaf.__array_interface__["data"][0] if leaf.flags.writeable and leaf.size else object())
        return leaf

    in_memory(noted, batch)
    return found


def positive(value: object, what: str, remedy: str) -> None:
    """Raise ValueError, naming it, for a value that is no number > 0."""
    if not (isinstance(value, Real) and float(value) > 0):
        raise ValueError(f"{what} must be one positive number, but is {value!r}; {remedy}")


def named(family: Mapping[str, Member], name: str, what: str) -> Member:
    """family[name]; raises ValueError listing the names there are."""
    if name in family:
        return family[name]
    raise ValueError(f"there is no {what} {name!r}, only {', '.join(map(repr, family))}.")


def whole(value: object, least: int, what: str, remedy: str) -> None:
    """Raise ValueError, naming it, for a value that is no integer >= `least`."""
    if not (isinstance(value, Integral) and int(value) >= least):
        raise ValueError(f"{what} must be a whole number >= {least}, but is {value!r}. {remedy}")
