"""Structs of arrays: a batch is an array, or a (nested) frozen dataclass or tuple of arrays.

Every leaf ends in the batch axis, so a scalar per sample has shape (N,), a point (d, N) and a
spectrum (C, N).  Scalars per sample then broadcast against vectors without `[:, None]`, and sums
over the small leading axes stay fast.
"""

from collections.abc import Callable, Sequence
from dataclasses import fields, is_dataclass
from functools import reduce
from operator import add
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]
Batch = TypeVar("Batch")


def map_leaves(f: Callable[..., Any], *batches: Any) -> Any:
    """Apply `f` to corresponding leaves of batches of one structure; `None` leaves stay `None`.

    Raises TypeError for a leaf that is neither an array, a tuple nor a dataclass of them.
    """
    first, *others = batches
    if others and any(type(each) is not type(first) for each in others):
        kinds = ", ".join(type(each).__name__ for each in batches)
        raise TypeError(f"batches to be merged must have one structure, but corresponding parts are {kinds}.")
    if first is None:
        return None
    if isinstance(first, np.ndarray):
        return f(*batches)
    if isinstance(first, tuple):
        return tuple(map_leaves(f, *parts) for parts in zip(*batches, strict=True))
    if is_dataclass(first) and not isinstance(first, type):
        parts = {each.name: [getattr(b, each.name) for b in batches] for each in fields(first)}
        return type(first)(**{name: map_leaves(f, *leaves) for name, leaves in parts.items()})
    raise TypeError(f"a batch holds arrays, tuples or dataclasses of arrays, not {type(first).__name__}: {first!r}")


def columns(index: object, least: int = 0) -> None:
    """Refuse an `index` that does not number columns by integers >= `least`, (N,).

    Raises TypeError for anything but an array (N,) of integers, IndexError naming a number that is too small.
    """
    if not (isinstance(index, np.ndarray) and index.ndim == 1 and index.dtype.kind == "i"):
        kind = f"of shape {index.shape} and type {index.dtype}" if isinstance(index, np.ndarray) else repr(index)
        raise TypeError(
            f"columns are named by an array (N,) of integers, but the index is {kind}: say np.flatnonzero(mask) for "
            "a mask, np.asarray(index, dtype=int) for a list, or for unsigned ones, whose differences wrap."
        )
    if index.size and index.min() < least:
        place = int(np.argmax(index < least))
        raise IndexError(f"columns count from 0, but the index holds {index[place]} in place {place}.")


def take(batch: Batch, index: Array) -> Batch:
    """Gather columns `index` (N,), integers >= 0, of every leaf.

    `ndarray.take` keeps C order; `leaf[:, index]` would return Fortran order and silently turn
    the struct of arrays into an array of structs, which slows down everything after it.
    """
    columns(index)
    gathered: Batch = map_leaves(lambda leaf: leaf.take(index, axis=-1), batch)
    return gathered


def where(mask: Array, a: Batch, b: Batch) -> Batch:
    """Column n of `a` where mask[n], else of `b`; mask (N,)."""
    merged: Batch = map_leaves(lambda x, y: np.where(mask, x, y), a, b)
    return merged


def pick(batches: Sequence[Batch], s: Array) -> Batch:
    """Column n of batches[s[n]]; s (N,) integers below len(batches)."""
    chosen = [s == k for k in range(1, len(batches))]

    def picked(*leaves: Array) -> Array:
        out = np.broadcast_to(leaves[0], (*leaves[0].shape[:-1], len(s)))
        for leaf, mask in zip(leaves[1:], chosen, strict=True):
            out = np.where(mask, leaf, out)
        return out

    merged: Batch = map_leaves(picked, *batches)
    return merged


def ratio(a: Array, b: Array) -> Array:
    """a / b with x / 0 = 0, the convention 0/0 = 0 of MIS weights and null samples."""
    null = np.equal(b, 0)
    if not null.any():
        return np.asarray(a / b)
    return np.asarray(a / (b + null) * ~null)


def wide(values: Array) -> Array:
    """The same numbers in 64 bits, where bytes would wrap and float32 underflow; exact types (object) stay exact."""
    return values.astype(np.promote_types(values.dtype, np.int64), copy=False)


def total(terms: Sequence[Array]) -> Array:
    """Sum of at least one array, added left to right without a zero to start from."""
    return reduce(add, terms)
