"""Structs of arrays: a batch is an array, or a (nested) frozen dataclass or tuple of arrays.

Every leaf ends in the batch axis, so a scalar per sample has shape (N,), a point (d, N) and a
spectrum (C, N).  Scalars per sample then broadcast against vectors without `[:, None]`, and sums
over the small leading axes stay fast.

Of wide samples most columns are weighed and never kept: a `Block` is lazy.  `take` of it is a reference, the block
and an index, and a field is gathered when it is first read.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import is_dataclass, replace
from functools import reduce
from operator import add
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]
Batch = TypeVar("Batch")


class Block:
    """Base of dataclasses that are gathered lazily: what `take` returns is of the same class, and reads the same.

    It is a reference: a block, an index into its columns, and the fields that it has of its own (`changed`).
    """

    if not TYPE_CHECKING:  # which would take every name for a field

        def __getattr__(self, name: str) -> Any:
            """A field that nobody has read yet."""
            if "_of" not in self.__dict__ or name not in names(type(self)):
                raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
            leaf = self.__dict__[name] = _taken(getattr(self._of, name), self._index)
            return leaf


def names(kind: type) -> tuple[str, ...]:
    """The fields of a dataclass."""
    return tuple(kind.__dataclass_fields__)  # type: ignore[attr-defined]  # `fields` is 10 times as slow


def map_leaves(f: Callable[..., Any], *batches: Any, refer: Callable[..., Any] | None = None) -> Any:
    """Apply `f` to corresponding leaves of batches of one structure; `None` leaves stay `None`.

    Blocks are given to `refer`, if there is one, and are not looked into.
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
        return tuple(map_leaves(f, *parts, refer=refer) for parts in zip(*batches, strict=True))
    if refer is not None and isinstance(first, Block):
        return refer(*batches)
    if is_dataclass(first) and not isinstance(first, type):
        parts = {name: [getattr(b, name) for b in batches] for name in names(type(first))}
        return type(first)(**{name: map_leaves(f, *leaves, refer=refer) for name, leaves in parts.items()})
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
    """Gather columns `index` (N,), integers >= 0, of every leaf; of a `Block`, name them.

    `ndarray.take` keeps C order; `leaf[:, index]` would return Fortran order and silently turn
    the struct of arrays into an array of structs, which slows down everything after it.

    >>> import numpy as np
    >>> from restir_ref import Reservoirs
    >>> from restir_ref.batch import take
    >>> X = Reservoirs(np.array([0.1, 0.2, 0.3]), W=np.ones(3), c=np.ones(3))
    >>> take(X, np.array([2, 0])).x
    array([0.3, 0.1])
    """
    columns(index)
    return _taken(batch, index)


def _taken(batch: Batch, index: Array) -> Batch:
    """`take` of an index that is known to number columns."""

    def refer(x: Block) -> Block:
        of, at, own = reference(x)
        return referring(of, at.take(index), {name: _taken(field, index) for name, field in own.items()})

    taken: Batch = map_leaves(lambda leaf: leaf.take(index, axis=-1), batch, refer=refer)
    return taken


def part(batch: Batch, columns: slice) -> Batch:
    """Neighbouring columns, in the same memory."""
    return in_memory(lambda leaf: leaf[..., columns], batch)


def in_memory(f: Callable[[Array], Array], batch: Batch) -> Batch:
    """Apply f to what there is of a batch: to its leaves, or to a reference's index and to fields that were read."""

    def refer(x: Block) -> Block:
        if not is_reference(x):
            whole: Block = map_leaves(f, x)
            return whole
        of, index, own = reference(x)
        mapped = referring(of, f(index), {name: in_memory(f, field) for name, field in own.items()})
        read = x.__dict__.keys() & names(type(x)) - own.keys()
        mapped.__dict__.update({name: in_memory(f, x.__dict__[name]) for name in read})
        return mapped

    mapped: Batch = map_leaves(f, batch, refer=refer)
    return mapped


def is_reference(x: object) -> bool:
    """Whether x names columns of a block."""
    return isinstance(x, Block) and "_of" in x.__dict__


def reference(x: Block) -> tuple[Block, Array, Mapping[str, Any]]:
    """The block that x refers to, the index (N,) of its columns, and the fields that x has of its own.

    A block refers to all of itself; its first field says how many columns it has.
    """
    if is_reference(x):
        return x.__dict__["_of"], x.__dict__["_index"], {name: x.__dict__[name] for name in x.__dict__["_own"]}
    return x, np.arange(getattr(x, names(type(x))[0]).shape[-1]), {}


def referring(of: Block, index: Array, own: Mapping[str, Any]) -> Block:
    """The reference made of the three."""
    x: Block = object.__new__(type(of))
    x.__dict__.update(own, _of=of, _index=index, _own=tuple(own))
    return x


def rows(x: Block, name: str, which: slice) -> Array:
    """Some rows of a field (.., N): of a reference only these are gathered."""
    if not is_reference(x) or name in x.__dict__:
        leaf: Array = getattr(x, name)
        return leaf[which]
    of, index, _ = reference(x)
    return _taken(rows(of, name, which), index)


def entries(x: Block, name: str, i: Array) -> Array:
    """Row i[n] of a field (D, N) in every column n, (N,): of a reference only these numbers are gathered."""
    if not is_reference(x) or name in x.__dict__:
        return entry(getattr(x, name), i)
    of, index, _ = reference(x)
    stack: Array = getattr(of, name)
    return np.asarray(stack.take(i * stack.shape[-1] + index))


def changed(x: Batch, **own: Any) -> Batch:
    """`x` with new fields instead of its own: what a shift decides, while a reference stays one."""
    if isinstance(x, Block) and is_reference(x):
        of, index, before = reference(x)
        return referring(of, index, {**before, **own})  # type: ignore[return-value]
    anew: Batch = replace(x, **own)  # type: ignore[type-var]
    return anew


def gathered(batch: Batch) -> Batch:
    """The same with nothing left to gather: reading every leaf does it."""
    whole: Batch = map_leaves(lambda leaf: leaf, batch)
    return whole


def joined(batches: Sequence[Batch]) -> Batch:
    """All columns of the first, then of the second ..; references to one block stay one."""
    if len(batches) == 1:
        return batches[0]

    def join(*leaves: Array) -> Array:
        return np.concatenate(leaves, axis=-1)

    def refer(*xs: Block) -> Block:
        (of, *others), index, own = zip(*map(reference, xs), strict=True)
        if any(other is not of for other in others) or any(each.keys() != own[0].keys() for each in own):
            whole: Block = map_leaves(join, *xs)
            return whole
        return referring(of, join(*index), {name: joined([each[name] for each in own]) for name in own[0]})

    all_columns: Batch = map_leaves(join, *batches, refer=refer)
    return all_columns


def where(mask: Array, a: Batch, b: Batch) -> Batch:
    """Column n of `a` where mask[n], else of `b`; mask (N,).

    >>> import numpy as np
    >>> from restir_ref import Shifted
    >>> from restir_ref.batch import where
    >>> a, b = Shifted(np.zeros(2), np.ones(2)), Shifted(np.ones(2), np.zeros(2))
    >>> where(np.array([True, False]), a, b)
    Shifted(x=array([0., 1.]), J=array([1., 0.]))
    """
    merged: Batch = map_leaves(lambda x, y: np.where(mask, x, y), a, b)
    return merged


def put(batch: Batch, columns: Array, values: Batch) -> None:
    """Write values into columns (n,) of a batch whose memory is the caller's own.

    Row by row: `leaf[..., columns] = anew` goes through the columns, and takes 4 times as long.
    """

    def write(leaf: Array, anew: Array) -> Array:
        for row in np.ndindex(leaf.shape[:-1]):
            leaf[row][columns] = anew[row]
        return leaf

    map_leaves(write, batch, values)


def pick(batches: Sequence[Batch], s: Array) -> Batch:
    """Column n of batches[s[n]], gathered; s (N,) integers below len(batches).

    One `take` from leaves side by side: twice as fast as a chain of `where` for three and more of 8000 columns, and
    slower for few columns.
    """
    n = len(s)
    column = s.astype(int) * n + np.arange(n)

    def picked(*leaves: Array) -> Array:
        spread = [leaf if leaf.shape[-1:] == (n,) else np.broadcast_to(leaf, (*leaf.shape[:-1], n)) for leaf in leaves]
        return np.concatenate(spread, axis=-1).take(column, axis=-1)

    def refer(*xs: Block) -> Block:
        (of, *others), index, own = zip(*map(reference, xs), strict=True)
        if any(other is not of for other in others):
            whole: Block = map_leaves(picked, *xs)
            return whole
        anew = {name for each in own for name in each}
        winner = referring(
            of, picked(*index), {name: map_leaves(picked, *[getattr(x, name) for x in xs]) for name in anew}
        )
        return gathered(winner)

    merged: Batch = map_leaves(picked, *batches, refer=refer)
    return merged


def entry(stack: Array, i: Array) -> Array:
    """stack[i[n], .., n] for every column n; a flat `take`, which is 4 times as fast as `take_along_axis`."""
    one = np.arange(stack[0].size).reshape(stack[0].shape)
    return stack.take(i * one.size + one)


def ratio(a: Array, b: Array) -> Array:
    """a / b with x / 0 = 0, the convention 0/0 = 0 of MIS weights and null samples.

    >>> import numpy as np
    >>> from restir_ref.batch import ratio
    >>> ratio(np.array([1.0, 0.0]), np.array([4.0, 0.0]))
    array([0.25, 0.  ])
    """
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
