"""A finite model of values that travel with samples, and how they may go wrong; all of it enumerated.  [DDGIR 3.6]

A sample is a cell with a value in two channels that its own pixel has looked up; pixels disagree about the values.
Selection may use the values, weights may only see the cell.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from restir_ref.batch import Array, ratio
from restir_ref.chance import Chance
from restir_ref.integrals import Pixels, Reservoirs, Shifted
from restir_ref.mis import WEIGHTS
from restir_ref.oracle.laws import bias_of, expected_sum
from restir_ref.restir import initial, spatial, temporal

PIXELS, CELLS = 2, 4


@dataclass(frozen=True)
class Valued:
    """A cell (N,) and the value (2, N) that was looked up for it."""

    cell: Array
    value: Array


Rule = Callable[[Array, Array], Array]
"""f, value (2, N) -> the target (N,)."""


def mean_times_mean(f: Array, value: Array) -> Array:
    """A product of what depends on the pixel, and of what is kept."""
    return np.asarray(f.mean(axis=0) * value.mean(axis=0))


def mean_of_products(f: Array, value: Array) -> Array:
    """A mistake: MIS weights then depend on the value, about which pixels disagree."""
    return np.asarray((f * value).mean(axis=0))


@dataclass(frozen=True, eq=False)
class Cells:
    """f (2, n, K) from each pixel, values (2, n, K) as each pixel knows them, densities pdf (n, K); volumes are 1."""

    f: Array
    values: Array
    pdf: Array
    rule: Rule = mean_times_mean
    n: int = PIXELS

    def candidates(self, index: Array, chance: Chance) -> Iterator[tuple[Valued, Array]]:
        """One cell, with the value that this pixel looks up."""
        pixel = index % self.n
        cell = chance.choose(self.pdf[pixel].T)
        yield Valued(cell, self.values[:, pixel, cell]), ratio(np.ones(len(index)), self.pdf[pixel, cell])

    def target(self, index: Array, x: Valued) -> Array:
        """By the rule, of the value that is kept."""
        return self.rule(self.f[:, index % self.n, x.cell], x.value)

    def contribution(self, index: Array, x: Valued) -> Array:
        """The target, (1, N)."""
        return self.target(index, x)[None]

    def shift(self, x: Valued, index: Array, to: Pixels) -> Shifted:
        """The identity: what is kept travels."""
        return Shifted(x, np.ones(len(to.index)))


PDF = [[0.0, 0.96, 0.32, 0.96], [0.45, 0.0, 0.86, 0.53]]
F = [[[0.0, 0.59, 0.66, 0.09], [6.05, 0.0, 0.72, 2.17]], [[0.0, 0.57, 2.66, 0.73], [0.72, 0.0, 1.58, 0.91]]]
VALUES = [[[7.7, 0.08, 1.52, 0.57], [0.64, 0.81, 0.13, 0.79]], [[0.42, 27.74, 1.25, 0.7], [0.75, 0.51, 0.35, 0.68]]]
"""Densities up to a factor, f of both channels, and what each pixel looks up; pixels see nothing of one cell each."""


def cells(rule: Rule = mean_times_mean) -> Cells:
    """Each pixel sees nothing of one cell, and its candidates do not cover that one."""
    pdf = np.array(PDF)
    return Cells(np.array(F), np.array(VALUES), pdf / pdf.sum(axis=1, keepdims=True), rule)


def lost() -> Cells:
    """A mistake: one pixel has looked up 0 where the other one sees light."""
    right = cells()
    values = right.values.copy()
    values[:, 0, 2] = 0
    return replace(right, values=values)


After = Callable[[Cells, Pixels, Reservoirs], Reservoirs]
"""What becomes of reservoirs after a pass."""


def untouched(of: Cells, here: Pixels, X: Reservoirs) -> Reservoirs:
    """Nothing."""
    return X


def looked_up_again(of: Cells, here: Pixels, X: Reservoirs) -> Reservoirs:
    """A mistake: W is divided by what this pixel looks up, not by what the sample was selected with."""
    anew = Valued(X.x.cell, of.values[:, here.index % of.n, X.x.cell])
    return replace(X, W=X.W * ratio(of.target(here.index, X.x), of.target(here.index, anew)))


def bias_of_frames(of: Cells, mis: str = "talbot", after: After = untouched) -> Array:
    """Exact relative bias per cell (n, K), over two frames with a neighbour."""

    def program(index: Array, chance: Chance) -> Reservoirs:
        here, near = Pixels(of, index), [Pixels(of, index - index % PIXELS + (index + 1) % PIXELS)]
        X = after(of, here, spatial(initial(here, chance), here, near, chance, mis=WEIGHTS[mis]))
        X = after(of, here, temporal(initial(here, chance), here, X, near, chance, mis=WEIGHTS[mis]))
        return replace(X, x=X.x.cell)

    return bias_of(program, np.ones((PIXELS, CELLS)), of.f.mean(axis=0) > 0)


Shown = Callable[[Cells, Array, Valued], Array]
"""The value (2, N) that a pixel shades with."""


def own(of: Cells, index: Array, x: Valued) -> Array:
    """What the pixel itself looks up."""
    return np.asarray(of.values[:, index % of.n, x.cell])


def as_kept(of: Cells, index: Array, x: Valued) -> Array:
    """A mistake: what was looked up for another pixel."""
    return x.value


def bias_of_shading(of: Cells, value: Shown) -> Array:
    """Exact relative bias of the image (2, n), after reuse between the pixels."""

    def program(index: Array, chance: Chance) -> Array:
        here, near = Pixels(of, index), [Pixels(of, index - index % PIXELS + (index + 1) % PIXELS)]
        X = spatial(initial(here, chance), here, near, chance)
        return np.asarray(of.f[:, index % of.n, X.x.cell] * value(of, index, X.x) * X.W)

    return np.asarray(expected_sum(program, PIXELS) / (of.f * of.values).sum(axis=-1) - 1)
