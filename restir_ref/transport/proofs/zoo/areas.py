"""History that is reused with its place on the film, and how that may go wrong; all of it enumerated.  [GPT 4.3.1]"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from restir_ref.area import Displaced, Source, every, one_by_area, overlapped, shared_by
from restir_ref.batch import Array
from restir_ref.chance import Chance
from restir_ref.integrals import Pixels, Reservoirs, Shifted
from restir_ref.mis import WEIGHTS
from restir_ref.oracle.film import HALVES, SUFFIXES, film_scene
from restir_ref.oracle.laws import bias_of
from restir_ref.resampling import Input, gris
from restir_ref.restir import capped, initial, reusing

SEED = 0
"""Of the scene."""

Share = Callable[[Input, Array], Input]
"""What an input is made of its share of the area."""

Choice = Callable[[Sequence[Source], Chance, Reservoirs], Sequence[Source]]
"""Which of the overlapped pixels are asked, whatever they hold."""


class IgnoredOneWay(Displaced):
    """A mistake: on the way there the square is ignored, on the way back, for the weights, it is not."""

    def shift(self, x: Array, index: Array, to: Pixels) -> Shifted:
        """Without the displacement where it is forth."""
        if self.by.any():
            return Displaced.shift(self, x, index, to)
        there: Displaced = to.of  # type: ignore[assignment]
        return self.of.shift(x, index, Pixels(there.of, to.index))


class DrawnAnew(Displaced):
    """A mistake: the place is drawn anew, here always the first one, with no density for it."""

    def shift(self, x: Array, index: Array, to: Pixels) -> Shifted:
        """At the first place where it is forth."""
        y = Displaced.shift(self, x, index, to)
        return y if self.by.any() else Shifted(y.x % SUFFIXES, y.J)


def share_of_weight(source: Input, share: Array) -> Input:
    """A mistake: W is multiplied by the share, while the confidence stays whole."""
    return Input(replace(source.X, W=source.X.W * share), source.at)


def no_share(source: Input, share: Array) -> Input:
    """No mistake, only confidence that nobody earned: the share is left out, of weights and counts alike."""
    return source


def all_of_them(sources: Sequence[Source], chance: Chance, Y: Reservoirs) -> Sequence[Source]:
    """Every overlapped pixel."""
    return every(sources, chance)


def one_of_them(sources: Sequence[Source], chance: Chance, Y: Reservoirs) -> Sequence[Source]:
    """One, by area."""
    return one_by_area(sources, chance)


def the_bright_one(sources: Sequence[Source], chance: Chance, Y: Reservoirs) -> Sequence[Source]:
    """A mistake: the one whose sample weighs more."""
    (one, share), (other, _) = sources
    return [(np.where(Y.W.take(one) >= Y.W.take(other), one, other), np.ones(len(share)))]


def bias_of_history(kind: type[Displaced] = Displaced, share: Share = shared_by, choice: Choice = all_of_them) -> Array:
    """Exact relative bias per cell (2, 4) of new samples with the history of two overlapped pixels."""
    scene = film_scene(SEED)
    before, now = scene.frames
    here_of, there_of = (kind(of, by) for of, by in ((now, HALVES), (before, 0 * HALVES)))  # type: ignore[arg-type]

    def loop(index: Array, chance: Chance) -> Reservoirs:
        Y, here = initial(Pixels(before, index), chance), Pixels(here_of, index)
        asked = choice(overlapped((2,), HALVES, index), chance, Y)
        at = [Pixels(there_of, columns) for columns, _ in asked]
        canonical, *history = reusing(initial(Pixels(now, index), chance), here, capped(Y, 2.0), at)
        shared = [share(each, part) for each, (_, part) in zip(history, asked, strict=True)]
        return gris([canonical, *shared], here, WEIGHTS["talbot"], chance)

    return bias_of(loop, scene.v, scene.support)
