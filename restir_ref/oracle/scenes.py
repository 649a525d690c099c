"""Finite scenes and the loops that the oracle enumerates on them.

A scene must contain unequal volumes, holes in the shifts, zero targets that samplers reach and
samplers that do not cover, or it cannot see the bugs that matter.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from restir_ref.batch import Array
from restir_ref.chance import Chance
from restir_ref.integrals import Image, Pixels, Reservoirs
from restir_ref.mis import WEIGHTS, Weights
from restir_ref.oracle.cells import Frame, cells
from restir_ref.restir import initial, spatial, temporal

Loop = Callable[[Array, Chance], Reservoirs]
Edit = Callable[[Reservoirs, Pixels], Reservoirs]

TALBOT, DEFENSIVE = WEIGHTS["talbot"], WEIGHTS["defensive"]


@dataclass(frozen=True)
class Scene:
    """Consecutive frames of one scene; the last one is `now`."""

    frames: Sequence[Frame]

    @property
    def now(self) -> Frame:
        """The frame whose estimates are judged."""
        return self.frames[-1]

    @property
    def v(self) -> Array:
        """Volumes of the current frame's cells, (n, K)."""
        return self.now.cells.v[self.now.ids(np.arange(self.now.n))]

    @property
    def support(self) -> Array:
        """supp p_hat of the current frame, (n, K)."""
        return np.asarray(self.now.cells.p_hat[self.now.ids(np.arange(self.now.n))] > 0)


def offset(of: Image, index: Array, by: int) -> Pixels:
    """The pixels `by` further to the right, cyclically, within each column's own lane."""
    return Pixels(of, index - index % of.n + (index + by) % of.n)


def keep(X: Reservoirs, here: Pixels) -> Reservoirs:
    """The edit that changes nothing."""
    return X


def spatial_loop(scene: Scene, mis: Weights, passes: int, edit: Edit = keep) -> Loop:
    """Initial samples, then `passes` rounds of reuse from all other pixels; `edit` runs after each step."""

    def loop(index: Array, chance: Chance) -> Reservoirs:
        here = Pixels(scene.now, index)
        X = edit(initial(here, chance), here)
        neighbours = [offset(scene.now, index, by) for by in range(1, scene.now.n)]
        for _ in range(passes):
            X = edit(spatial(X, here, neighbours, chance, mis=mis), here)
        return X

    return loop


def two_frame_loop(
    scene: Scene, along: Weights = TALBOT, across: Weights = DEFENSIVE, cap: float = 1, edit: Edit = keep
) -> Loop:
    """Two frames of ReSTIR: spatial reuse, motion by one pixel, temporal and again spatial reuse.

    Weights `along` time and `across` space.  The history arrives with confidence 2 and is capped.
    """
    before, now = scene.frames

    def loop(index: Array, chance: Chance) -> Reservoirs:
        there, here = Pixels(before, index), Pixels(now, index)
        Y = edit(initial(there, chance), there)
        Y = edit(spatial(Y, there, [offset(before, index, 1)], chance, mis=across), there)
        X = edit(initial(here, chance), here)
        X = edit(temporal(X, here, Y, [offset(before, index, 1)], chance, mis=along, cap=cap), here)
        return spatial(X, here, [offset(now, index, 1)], chance, mis=across)

    return loop


def reference_scene(of: type[Frame] = Frame) -> Scene:
    """Two frames of two pixels with four cells each; `of` makes the frames, a zoo bug for example.

    Every pixel has a cell of zero target that its sampler reaches, or one that it does not cover;
    every shift but the identity has a hole; volumes differ by up to 4.
    """
    v = [[1.0, 0.5, 2.0, 1.0], [0.5, 1.0, 1.0, 2.0], [1.0, 2.0, 0.5, 1.0], [0.5, 1.0, 2.0, 0.5]]
    shifts = {
        (0, 1): (1, 0, 3, -1),
        (0, 2): (0, 1, -1, 3),
        (0, 3): (3, 2, 1, -1),
        (1, 2): (2, -1, 0, 1),
        (1, 3): (0, 3, -1, 2),
        (2, 3): (2, 0, 1, -1),
    }
    tables = cells(
        v=np.array(v),
        f=np.array([[2.0, 1.0, 0.0, 3.0], [1.0, 3.0, 0.5, 1.0], [1.0, 0.0, 4.0, 2.0], [2.0, 0.5, 1.0, 3.0]]),
        pdf=normalised([[2, 1, 1, 1], [1, 1, 0, 1], [1, 1, 2, 1], [3, 1, 1, 2]], v),
        shifts=paired(4, 4, shifts),
        proposal=np.ones((4, 4)),
    )
    return Scene([of(tables, 2, 0), of(tables, 2, 1)])


def three_pixel_scene(of: type[Frame] = Frame) -> Scene:
    """One frame of three pixels with three cells each, so that a pixel can choose between neighbours."""
    v = [[1.0, 0.5, 2.0], [0.5, 1.0, 1.0], [1.0, 2.0, 0.5]]
    tables = cells(
        v=np.array(v),
        f=np.array([[2.0, 1.0, 0.0], [1.0, 3.0, 0.5], [1.0, 0.0, 4.0]]),
        pdf=normalised([[2, 1, 1], [1, 1, 1], [1, 1, 2]], v),
        shifts=paired(3, 3, {(0, 1): (1, 0, 2), (0, 2): (0, -1, 2), (1, 2): (2, 0, -1)}),
    )
    return Scene([of(tables, 3)])


def normalised(weights: Sequence[Sequence[float]], v: Sequence[Sequence[float]]) -> Array:
    """One technique per pixel with densities in proportion to weights (I, K): pdf (1, I, K)."""
    w, volumes = np.asarray(weights, dtype=float), np.asarray(v, dtype=float)
    return np.asarray((w / (w * volumes).sum(axis=-1, keepdims=True))[None])


def paired(I: int, K: int, maps: Mapping[tuple[int, int], Sequence[int]]) -> Array:  # noqa: E741
    """Shift tables (I, I, K) from maps[i, j][x] = T_ij(x) or -1, i < j; the inverses follow."""
    shifts = np.full((I, I, K), -1)
    shifts[np.arange(I), np.arange(I)] = np.arange(K)
    for (i, j), image in maps.items():
        for x, y in enumerate(image):
            if y >= 0:
                shifts[i, j, x], shifts[j, i, y] = y, x
    return shifts
