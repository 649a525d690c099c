"""Area reservoirs that stay where they are: of the overlapped pixels, what lies in the square is kept.  [Zhang 2024]

A pixel p saw the square S = p + by of the previous film (`area`).  S is cut into the parts of the pixels q that it
overlaps, and the integral over S is the sum of those over its parts.  So it has a sample in two steps of RIS,

    1.  among the samples of all overlapped q whose place lies in S, by p_hat_q W_q with m = 1 each, in the old frame;
    2.  between the one that is chosen, carried along by the motion, and the new sample of p.

m = 1 is right since a place of S lies in one q only, whose sample alone can be there; samples elsewhere are rejected.
Nothing moves but by the motion, and the price is that of one pixel: one shift there, and for the weights one back, to
the q that holds the new sample's place.  1 sample is kept on average, whatever the fraction, and often none or several,
so that of pixels that are all alike the sum of what is kept has the variance 1 - sum b^2 of its mean squared, anew in
every frame, which adds up.  (The paper refers to Area ReSTIR, one of whose two options this is; the other, its public
code's default, moves what lies elsewhere into the square by balance weights: `gathering`.  The words are ours.)
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from restir_ref.area import Displaced, Film, Following, Inputs, Past, lattice, overlapped
from restir_ref.batch import Array, total
from restir_ref.chance import Chance
from restir_ref.integrals import NOWHERE, Pixels, Reservoirs, Sample, Shifted, target
from restir_ref.mis import WEIGHTS, Weights
from restir_ref.resampling import Candidate, Input, gris, select
from restir_ref.restir import M_CAP, capped, entering


@dataclass(frozen=True)
class Held:
    """A sample x of the previous frame, and the column (N,) whose pixel holds its place."""

    x: Sample
    column: Array


@dataclass(frozen=True, eq=False)
class Squares:
    """The integrals of the previous frame over the squares pixel + by, for every pixel of the current one.

    of     the previous frame, an image of `shape` (rows, columns), or (n,)
    by     (film, n) where it showed what each pixel sees, in pixels from where it is; inf where it did not

    Their estimates are what the previous frame would have shown in pixels that are not whole.
    """

    of: Film
    shape: Sequence[int]
    by: Array

    @property
    def n(self) -> int:
        """Number of squares."""
        return int(self.by.shape[-1])

    def candidates(self, index: Array, chance: Chance) -> Iterator[tuple[Held, Array]]:
        """Those of all overlapped pixels, as far as they lie in the square: each has a part of it to itself."""
        for column, _ in overlapped(self.shape, self.by, index):
            there = np.maximum(column, 0)
            for x, mW in self.of.candidates(there, chance):
                yield Held(x, there), mW * self.within(index, x, column)

    def target(self, index: Array, x: Held) -> Array:
        """That of the pixel that holds the sample."""
        return self.of.target(x.column, x.x)

    def contribution(self, index: Array, x: Held) -> Array:
        """The same."""
        return self.of.contribution(x.column, x.x)

    def shift(self, x: Held, index: Array, to: Pixels) -> Shifted:
        """Along with the motion into the pixel whose square it is: u' = (u - by) mod 1."""
        there: Carried = to.of  # type: ignore[assignment]
        moved = self.of.displaced(x.x, -there.motion(to.index))
        return self.of.shift(moved, x.column, Pixels(there.of, to.index))

    def within(self, index: Array, x: Sample, column: Array) -> Array:
        """Whether a sample of `column`, or of nobody, lies in the square of `index`; (N,)."""
        by, _ = _known(self.by, index)
        extents, strides = (each[:, None] for each in lattice(self.shape))
        step = np.maximum(column, 0) // strides % extents - index // strides % extents
        inside = np.floor(self.of.place(x) + (step - by)) == 0
        return np.asarray(inside.all(axis=0) & (column != NOWHERE))

    def holder(self, index: Array, place: Array) -> Array:
        """The column that holds what is at `place` (film, N) of pixels `index` now, or `NOWHERE`; (N,)."""
        by, known = _known(self.by, index)
        extents, strides = (each[:, None] for each in lattice(self.shape))
        step = np.floor(place + by).astype(int)
        to = index // strides % extents + step
        there = ((to >= 0) & (to < extents)).all(axis=0) & known
        return np.where(there, index + (step * strides).sum(axis=0), NOWHERE)


@dataclass(frozen=True, eq=False)
class Carried(Displaced):
    """The current image beside `Squares` of the previous one: all but its shift into these is that of the image."""

    def motion(self, index: Array) -> Array:
        """by of columns, 0 where it is not known; (film, N)."""
        return _known(self.by, index)[0]

    def shift(self, x: Sample, index: Array, to: Pixels) -> Shifted:
        """Against the motion, u = (u' + by) mod 1, into the pixel that holds this place; J = 0 beyond the image."""
        there: Squares = to.of  # type: ignore[assignment]
        column = there.holder(to.index, self.of.place(x))
        held = np.maximum(column, 0)
        y = self.of.shift(self.of.displaced(x, self.motion(index)), index, Pixels(there.of, held))
        return Shifted(Held(y.x, held), np.where(column != NOWHERE, y.J, 0))


def _known(by: Array, index: Array) -> tuple[Array, Array]:
    """by (film, N) of columns, 0 where it is not known, and where it is."""
    by = by[:, index % by.shape[-1]]
    known = np.asarray(np.isfinite(by).all(axis=0))
    return np.where(known, by, 0), known


def area_rejection(
    X: Reservoirs,
    here: Pixels,
    Y: Reservoirs,
    before: Pixels,
    chance: Chance,
    *,
    mis: Weights = WEIGHTS["talbot"],
    cap: float = M_CAP,
) -> Reservoirs:
    """Resample new samples X with what the history Y has in their squares.  [Zhang 2024]

    here are `Carried` pixels, before the `Squares` of the same columns.  As `restir.temporal` otherwise.
    """
    return gris([Input(X, here), *in_squares(capped(Y, cap), before, chance)], here, mis, chance)


def in_squares(Y: Reservoirs, at: Pixels, chance: Chance) -> list[Input]:
    """RIS among the samples of Y that lie in the squares `at`, m = 1; none where no square overlaps the image.

    Confidence is sum_q b_q c_q, b the area shares, whatever is kept: it must not know the samples.
    """
    squares: Squares = at.of  # type: ignore[assignment]
    offered, c = [], []
    for column, share in overlapped(squares.shape, squares.by, at.index):
        source = entering(Y, Pixels(squares.of, column))
        X, inside = source.X, squares.within(at.index, source.X.x, column)
        offered.append(Candidate(Held(X.x, source.at.index), target(source.at, X.x), X.W * inside))
        c.append(X.c * share)
    return [Input(select(offered, chance, total(c)), at)] if offered else []


Collecting = Callable[[Reservoirs, Pixels, Chance], list[Input]]
"""Reservoirs of capped confidence and `Squares` of their frame: at most one input, what these have."""


def following(collect: Collecting) -> Following:
    """The loop's history in the squares of every part, collected in this way."""

    def follow(shape: Sequence[int], by: Array, index: Array, chance: Chance) -> Inputs:
        def inputs(of: Film, X: Reservoirs, past: Sequence[Past]) -> list[Input]:
            history = [collect(Y, Pixels(Squares(before, shape, by), index), chance) for before, Y in past]
            return [Input(X, Pixels(Carried(of, by), index)), *(source for each in history for source in each)]

        return inputs

    return follow


keeping = following(in_squares)
"""Samples stay, and those in the square are kept: `area.Following` of the loop.  [Zhang 2024]"""
