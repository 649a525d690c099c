"""Finite integrals whose samples have a place on the film: what area reservoirs and frames of pairs are judged on.

Cell x = a S + s is the a-th of A equal places of its pixel, with suffix s; A = S = 2.  [GPT 4.3.1]
"""

from dataclasses import dataclass, field

import numpy as np

from restir_ref.batch import Array
from restir_ref.integrals import Pixels, Shifted
from restir_ref.oracle.cells import Frame, cells
from restir_ref.oracle.enumeration import scattered
from restir_ref.oracle.scenes import Scene

PLACES, SUFFIXES = 2, 2
CELLS = PLACES * SUFFIXES

RING = np.array([[1, 0], [0, 1]])
"""Ends of the pairs of a row of two pixels that goes around: as many as pixels, which enumeration asks for."""

HALVES = np.array([[0.5, -0.5]])
"""Motion of a row of two pixels by which either overlaps both, by halves."""


@dataclass(frozen=True, eq=False)
class FilmFrame(Frame):
    """A frame whose cells have places; x + CELLS (a' + 1) is cell x displaced to a', until the next shift.

    labels (I, PLACES, SUFFIXES): shifts keep the label of a suffix, at every place; -1 where they are undefined.
    """

    labels: Array = field(default_factory=lambda: np.zeros((0, PLACES, SUFFIXES), dtype=int))

    def place(self, x: Array) -> Array:
        """The middle of its place, (1, N)."""
        return np.asarray((self.part(x) + 0.5) / PLACES)[None]

    def part(self, x: Array) -> Array:
        """Which of the places x lies in, or has been displaced to; (N,)."""
        return np.where(x < CELLS, x % CELLS // SUFFIXES, x // CELLS - 1)

    def displaced(self, x: Array, by: Array) -> Array:
        """x with its place moved by `by` (1, N) pixels, whole ones left out."""
        return np.asarray(x + CELLS * (1 + (x // SUFFIXES + np.rint(by[0] * PLACES).astype(int)) % PLACES))

    def shift(self, x: Array, index: Array, to: Pixels) -> Shifted:
        """To the suffix of the same label, at the place where x has been displaced to; J is the ratio of volumes."""
        there: FilmFrame = to.of  # type: ignore[assignment]
        i, j, cell = self.ids(index), there.ids(to.index), x % CELLS
        a, place = cell // SUFFIXES, self.part(x)
        label = self.labels[i, a, cell % SUFFIXES]
        y = place * SUFFIXES + (self.labels[j, place] == label[:, None]).argmax(axis=1)
        stays = (i == j) & (a == place)
        y = np.where(stays, cell, y)
        defined = stays | ((label >= 0) & (self.labels[j, place, y % SUFFIXES] == label))
        return Shifted(y, np.where(defined, self.cells.v[j, y] / self.cells.v[i, cell], 0))


def table(I: int, call: int) -> Array:
    """Fixed numbers in [0, 1) that look random, (I, CELLS)."""
    return scattered(np.arange(I * CELLS), call).reshape(I, CELLS)


def film_scene(seed: int, n: int = 2) -> Scene:
    """Two frames of n pixels with holes in their shifts, dark cells, and unequal volumes."""
    I = 2 * n
    volumes, light, dark, order, hole, density = (table(I, 6 * seed + call) for call in range(6))
    v, f = 0.3 + 1.7 * volumes, (0.2 + 1.8 * light) * (dark < 0.85)
    labels = np.argsort(order.reshape(I, PLACES, SUFFIXES), axis=-1)
    labels = np.where(hole.reshape(labels.shape) < 0.85, labels, -1)
    pdf, nowhere = (0.3 + 0.7 * density)[None], np.full((I, I, CELLS), -1)
    tables = cells(v, f, pdf / (pdf * v).sum(axis=-1, keepdims=True), nowhere)
    return Scene([FilmFrame(tables, n, t, labels) for t in range(2)])


# ---------------------------------------------------------------- colour


@dataclass(frozen=True, eq=False)
class Coloured(FilmFrame):
    """The same brightness in three channels, tinted by place and pixel: tint (3, I, CELLS), with mean 1."""

    tint: Array = field(default_factory=lambda: np.ones((3, 0, CELLS)))

    def contribution(self, index: Array, x: Array) -> Array:
        """f in three channels, (3, N)."""
        return np.asarray(self.target(index, x) * self.tint[:, self.ids(index), x])


def tinted(frame: FilmFrame) -> Coloured:
    """The frame in colour."""
    hues = np.array([0.5, 1.0, 1.5])  # whose mean is 1 without rounding
    order = np.argsort([table(len(frame.cells.f), -1 - channel) for channel in range(3)], axis=0)
    return Coloured(frame.cells, frame.n, frame.t, frame.labels, hues[order])


def grey_but_for_hue(scene: Scene) -> Coloured:
    """Equally bright everywhere, so that no difference of any two paths has a mean."""
    one, labels = np.ones((2 * scene.now.n, CELLS)), np.tile(np.arange(SUFFIXES), (2 * scene.now.n, PLACES, 1))
    tables = cells(one, one, one[None] / CELLS, scene.now.cells.shifts)
    return tinted(FilmFrame(tables, scene.now.n, 1, labels))


def light_of(frame: Coloured) -> Array:
    """int f of every pixel, (3, n)."""
    found = (frame.cells.f * frame.cells.v * frame.tint)[:, frame.ids(np.arange(frame.n))].sum(axis=-1)
    return np.asarray(found)
