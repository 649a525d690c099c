"""Finite frames whose cells have places on a film of any dimension: halves of a pixel along every axis."""

from dataclasses import dataclass

import numpy as np

from restir_ref.batch import Array
from restir_ref.integrals import Pixels, Shifted
from restir_ref.oracle.cells import Frame, cells
from restir_ref.oracle.scenes import Scene

A = 2


@dataclass(frozen=True, eq=False)
class PlacedFrame(Frame):
    """Cell x = a S + s: place a of the A^d of a pixel, suffix s; x + K (a' + 1) is displaced to a'.

    Shifts keep the label of a suffix, labels (I, A^d, S), and are undefined where it is -1.
    """

    labels: Array = None

    @property
    def places(self) -> int:
        return self.labels.shape[1]

    @property
    def suffixes(self) -> int:
        return self.labels.shape[2]

    @property
    def count(self) -> int:
        return self.places * self.suffixes

    def halves(self, x: Array) -> Array:
        """Along every axis, the first one first; (d, N)."""
        a = np.where(x < self.count, x // self.suffixes, x // self.count - 1)
        return a // A ** np.arange(int(np.log2(self.places)))[:, None] % A

    def place(self, x: Array) -> Array:
        """The middle of the half."""
        return (self.halves(x) + 0.5) / A

    def displaced(self, x: Array, by: Array) -> Array:
        moved = (self.halves(x) + np.rint(by * A).astype(int)) % A
        a = (moved * A ** np.arange(len(moved))[:, None]).sum(axis=0)
        return x % self.count + self.count * (1 + a)

    def shift(self, x: Array, index: Array, to: Pixels) -> Shifted:
        there: PlacedFrame = to.of
        S, K = self.suffixes, self.count
        i, j, cell = self.ids(index), there.ids(to.index), x % K
        a, place = cell // S, np.where(x < K, cell // S, x // K - 1)
        label = self.labels[i, a, cell % S]
        y = place * S + (self.labels[j, place] == label[:, None]).argmax(axis=1)
        stays = (i == j) & (a == place)
        y = np.where(stays, cell, y)
        defined = stays | ((label >= 0) & (self.labels[j, place, y % S] == label))
        return Shifted(y, np.where(defined, self.cells.v[j, y] / self.cells.v[i, cell], 0))


def placed_scene(seed: int, n: int = 2, axes: int = 1, suffixes: int = 2, frames: int = 2, reached: float = 1) -> Scene:
    """Frames with holes in their shifts, dark cells, and unequal volumes; samplers reach a share of the cells."""
    rng = np.random.default_rng(seed)
    I, P = frames * n, A**axes
    K = P * suffixes
    v, f = rng.uniform(0.3, 2, (I, K)), rng.uniform(0.2, 2, (I, K)) * (rng.random((I, K)) < 0.85)
    labels = np.argsort(rng.random((I, P, suffixes)), axis=-1)
    labels = np.where(rng.random(labels.shape) < 0.85, labels, -1)
    pdf = rng.uniform(0.3, 1, (1, I, K))
    if reached < 1:
        pdf[0] *= np.argsort(rng.random((I, K)), axis=-1) < reached * K
    tables = cells(v, f, pdf / (pdf * v).sum(axis=-1, keepdims=True), np.full((I, I, K), -1))
    return Scene([PlacedFrame(tables, n, t, labels) for t in range(frames)])
