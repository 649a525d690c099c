"""Area reservoirs: the place on the film is part of a sample, and is reused with it.  [GPT 4.3.1; Zhang 2024]

What the middle of a pixel p sees was, one frame before, `by` pixels away: p as a whole saw the square S = p + by of
the film.  S overlaps up to two pixels of a row and four of an image, each by a share b of its area.  A sample at the
place u of one of these pixels moves by whole pixels to the one place of S that has the same u, and with S into p:

    u' = (u - by) mod 1,   back   u = (u' + by) mod 1,   J = 1,

whichever pixel it comes from; the rest of the sample is shifted as ever.  The place is kept, never drawn anew.
(The paper refers to Area ReSTIR for all of this: the words are ours, and so are the choices where those were free.)
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Protocol

import numpy as np

from restir_ref.batch import Array, pick
from restir_ref.chance import Chance
from restir_ref.integrals import NOWHERE, Image, Pixels, Reservoirs, Sample, Shifted
from restir_ref.mis import WEIGHTS, Weights
from restir_ref.resampling import Input, gris
from restir_ref.restir import M_CAP, capped, entering, reusing


class Film(Image, Protocol):
    """An image whose samples have a place on the film, in [0, 1) of their pixel along every axis."""

    def place(self, x: Sample) -> Array:
        """The place of x in its pixel; (film, N)."""

    def displaced(self, x: Sample, by: Array) -> Sample:
        """x with its place moved by `by` (film, N) pixels, of which whole ones are left out; x is not changed."""


@dataclass(frozen=True, eq=False)
class Displaced:
    """An image whose pixels stand `by` (film, n) pixels away from their own places, as every shift sees it.

    Everything but the shift is that of `of`.
    """

    of: Film
    by: Array

    @property
    def n(self) -> int:
        """Number of pixels."""
        return self.of.n

    def candidates(self, index: Array, chance: Chance) -> Iterator[tuple[Sample, Array]]:
        """Those of the image."""
        return self.of.candidates(index, chance)

    def target(self, index: Array, x: Sample) -> Array:
        """That of the image."""
        return self.of.target(index, x)

    def contribution(self, index: Array, x: Sample) -> Array:
        """That of the image."""
        return self.of.contribution(index, x)

    def shift(self, x: Sample, index: Array, to: Pixels) -> Shifted:
        """Move the place by the difference of displacements, then shift from image to image."""
        there: Displaced = to.of  # type: ignore[assignment]
        step = self.by[:, index % self.n] - there.by[:, to.index % there.n]
        return self.of.shift(self.of.displaced(x, step), index, Pixels(there.of, to.index))


def lattice(shape: Sequence[int]) -> tuple[Array, Array]:
    """How many pixels there are along every axis, the last one of the shape first, and how far apart their columns."""
    extents = np.array(shape[::-1])
    return extents, np.cumprod([1, *extents[:-1]])


Source = tuple[Array, Array]
"""For every column a column of the previous frame, or `NOWHERE`, and its share b of the area; (N,) each."""


def overlapped(shape: Sequence[int], by: Array, index: Array) -> list[Source]:
    """The previous pixels that the squares pixel + by of columns `index` overlap, at most two along every axis.

    shape is that of the image (rows, columns) or (n,); by (film, n) counts along the last axis first.  What is not in
    the image has no column: it was not seen, or by somebody else.
    Raises ValueError for displacements of another number of axes.
    """
    extents, strides = lattice(shape)
    if len(by) != len(extents):
        raise ValueError(f"a film of shape {tuple(shape)} has {len(extents)} axes, but displacements have {len(by)}.")
    by = by[:, index % by.shape[-1]]
    known = np.isfinite(by).all(axis=0)
    by = np.where(known, by, 0)
    corner = np.floor(by).astype(int)
    place = index // strides[:, None] % extents[:, None]
    found = []
    for each in product((0, 1), repeat=len(by)):
        step = corner + np.array(each)[:, None]
        share = np.where(np.array(each)[:, None] == 1, by - corner, 1 - (by - corner)).prod(axis=0)
        inside = ((place + step >= 0) & (place + step < extents[:, None])).all(axis=0)
        there = inside & known & (share > 0)
        if there.any():
            found.append((np.where(there, index + (step * strides[:, None]).sum(axis=0), NOWHERE), share))
    return found


Overlap = Callable[[Sequence[Source], Chance], Sequence[Source]]
"""Which of the overlapped pixels are asked: `every` one, or `one_by_area`."""


def every(sources: Sequence[Source], chance: Chance) -> Sequence[Source]:
    """All of them: M pixels take M (M + 1) shifts with weights that compare all, 20 in an image.  [Zhang 2024]"""
    return sources


def one_by_area(sources: Sequence[Source], chance: Chance) -> Sequence[Source]:
    """One of them, chosen by its share of the area, for all of them: 2 shifts.  [ours]

    The choice knows areas and no samples, so that whatever is unbiased for each pixel is unbiased for one of them.
    """
    if len(sources) < 2:  # nothing to choose from
        return [(columns, np.ones(len(columns))) for columns, _ in sources]
    s = chance.choose(np.stack([share * (columns != NOWHERE) for columns, share in sources]))
    chosen = pick([columns for columns, _ in sources], s)
    return [(chosen, np.ones(len(chosen)))]


Past = tuple[Film, Reservoirs]
"""The integrals of one part of the previous frame, and its reservoirs, of capped confidence."""

Inputs = Callable[[Film, Reservoirs, Sequence[Past]], list[Input]]
"""What a part of the current frame resamples, from its new samples, which come first, and its partners' past."""

Following = Callable[[Sequence[int], Array, Array, Chance], Inputs]
"""How history follows the motion: by the shape of the previous image, `by` (film, n) and columns (N,), for all parts.

`moving` it into the square, `squares.keeping` what is there, or both: `gathering.gathering`.
"""


def moving(overlap: Overlap) -> Following:
    """Samples move by whole pixels into the square, those of all parts from the same overlapped pixels."""

    def following(shape: Sequence[int], by: Array, index: Array, chance: Chance) -> Inputs:
        sources = overlap(overlapped(shape, by, index), chance)

        def inputs(of: Film, X: Reservoirs, past: Sequence[Past]) -> list[Input]:
            history = [
                shared_by(entering(Y, Pixels(there, columns)), share)
                for there, Y in ((still(before, by), Y) for before, Y in past)
                for columns, share in sources
            ]
            return [Input(X, Pixels(Displaced(of, by), index)), *history]

        return inputs

    return following


MOVED = moving(every)
"""The loop's usual way, by all overlapped pixels."""


def still(of: Film, by: Array) -> Displaced:
    """The image with pixels at their numbers: the previous frame, beside a current one displaced by `by`."""
    return Displaced(of, np.zeros((len(by), of.n)))


def area_temporal(
    X: Reservoirs,
    here: Pixels,
    Y: Reservoirs,
    before: Sequence[tuple[Pixels, Array]],
    chance: Chance,
    *,
    mis: Weights = WEIGHTS["talbot"],
    cap: float = M_CAP,
) -> Reservoirs:
    """Resample new samples X with the history Y of several overlapped pixels, of confidence b min(c, cap) each.

    here are `Displaced` pixels of the current frame; `before` holds columns of the previous one, `still`, with their
    shares b (N,).  As `restir.temporal` otherwise.
    """
    canonical, *history = reusing(X, here, capped(Y, cap), [at for at, _ in before])
    shared = [shared_by(each, share) for each, (_, share) in zip(history, before, strict=True)]
    return gris([canonical, *shared], here, mis, chance)


def shared_by(source: Input, share: Array) -> Input:
    """The input with a share of its confidence."""
    return Input(replace(source.X, c=source.X.c * share), source.at)
