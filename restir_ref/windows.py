"""Frames in bounded memory: passes run over windows of columns and give, bit for bit, what they give as a whole.

Columns do not know of each other: what a pass does in one follows from its inputs there and from the numbers it
draws there.  So a window is the pass itself on a few columns, if it draws what the whole pass would draw in these:
every window begins where the pass begins, and of each row of numbers takes its own columns.
"""

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from copy import deepcopy
from itertools import pairwise

import numpy as np

from restir_ref.batch import Array, Batch, map_leaves, part
from restir_ref.chance import ROWS, Chance, Columns, Live, skip
from restir_ref.guards import whole
from restir_ref.integrals import Pixels, Reservoirs
from restir_ref.loop import Passes
from restir_ref.mis import WEIGHTS, Weights
from restir_ref.resampling import Input, gris
from restir_ref.restir import M_CAP, capped, initial, reusing


def windowed(size: int) -> Passes:
    """The passes of `restir` over windows of `size` columns: the same reservoirs, memory for a window beside them.

    They ask for a `Live` chance, and for integrals whose columns do not know of each other.

    >>> import numpy as np
    >>> from restir_ref import Live, Pixels
    >>> from restir_ref.loop import REAL_TIME, frame, random_in_row
    >>> from restir_ref.windows import windowed
    >>> from toy1d import image_of_64
    >>> here = Pixels(image_of_64(), np.arange(640))
    >>> whole = frame(here, Live(np.random.default_rng(1)), REAL_TIME, random_in_row)
    >>> parts = frame(here, Live(np.random.default_rng(1)), REAL_TIME, random_in_row, passes=windowed(100))
    >>> bool((whole.W == parts.W).all())
    True
    """

    def first(here: Pixels, chance: Chance, M: int = 1) -> Reservoirs:
        return over_windows(lambda at, of_it: initial(_cut(here, at), of_it, M), len(here.index), chance, size)

    def merged(inputs: Sequence[Input], here: Pixels, mis: Weights, chance: Chance) -> Reservoirs:
        def merge(at: slice, of_it: Chance) -> Reservoirs:
            there = _cut(here, at)
            some = [Input(part(each.X, at), there if each.at is here else _cut(each.at, at)) for each in inputs]
            return gris(some, there, mis, of_it)

        return over_windows(merge, len(here.index), chance, size)

    def temporal(
        X: Reservoirs,
        here: Pixels,
        Y: Reservoirs,
        before: Sequence[Pixels],
        chance: Chance,
        *,
        mis: Weights = WEIGHTS["talbot"],
        cap: float = M_CAP,
    ) -> Reservoirs:
        return merged(reusing(X, here, capped(Y, cap), before), here, mis, chance)

    def spatial(
        X: Reservoirs,
        here: Pixels,
        neighbours: Sequence[Pixels],
        chance: Chance,
        *,
        mis: Weights = WEIGHTS["defensive"],
    ) -> Reservoirs:
        return merged(reusing(X, here, X, neighbours), here, mis, chance)

    whole(size, 2, "the size of a window", "A few thousand columns fill the cache; a lone one is summed otherwise.")
    return Passes(first, temporal, spatial)


def over_windows(work: Callable[[slice, Chance], Batch], n: int, chance: Chance, size: int, step: int = 1) -> Batch:
    """work(slice(0, n), chance), a batch of n columns, from windows of it; the generator ends up where it would.

    Windows begin at multiples of `step`: for columns that do know of each other, such as those of a tile.
    Raises TypeError for a chance that is not `Live`, ValueError for windows that draw unlike numbers of rows, or rows
    of another width than their own.
    """
    parts = list(windows(n, size, step))
    if len(parts) == 1:
        return work(parts[0], chance)
    if not (isinstance(chance, Live) and isinstance(chance.rng, np.random.Generator)):
        raise TypeError(f"windows jump in the numbers of a generator, so their chance is a Live one, not {chance!r}.")
    found, rows = None, []
    for at in parts:
        row = Columns(deepcopy(chance.rng), at, n, drawn := Counter[str]())
        some = _counted_from(at, work, Live(row))
        rows.append(drawn[ROWS])
        found = _room(some, n) if found is None else found
        _write(found, some, at)
    if min(rows) < max(rows):
        raise ValueError(f"windows drew {rows} rows of numbers, but every column must make the same calls.")
    skip(chance.rng, rows[0] * n)
    return found  # type: ignore[return-value]


def windows(n: int, size: int, step: int = 1) -> Iterator[slice]:
    """Slices of n columns, `size` wide or a little more: one if there are less than twice as many."""
    parts = max(n // max(size, step), 1)
    cuts = [n // step * k // parts * step for k in range(parts)]
    yield from (slice(*ends) for ends in pairwise([*cuts, n]))


def _cut(pixels: Pixels, at: slice) -> Pixels:
    return Pixels(pixels.of, pixels.index[at])


def _counted_from(at: slice, work: Callable[[slice, Chance], Batch], chance: Chance) -> Batch:
    """work(at, chance), whose complaints say from where columns are counted."""
    try:
        return work(at, chance)
    except (ValueError, IndexError) as error:
        error.add_note(f"Columns are counted from {at.start}, where a window of the pass begins.")
        raise


def _room(some: Batch, n: int) -> Batch:
    """Memory for n columns like those of a window."""
    room: Batch = map_leaves(lambda leaf: np.empty((*leaf.shape[:-1], n), leaf.dtype), some)
    return room


def _write(room: Batch, some: Batch, at: slice) -> None:
    def write(leaf: Array, anew: Array) -> Array:
        leaf[..., at] = anew
        return leaf

    map_leaves(write, room, some)
