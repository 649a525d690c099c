"""Finite scenes and the loops that the oracle enumerates on them.

A scene must contain unequal volumes, holes in the shifts, zero targets that samplers reach and
samplers that do not cover, or it cannot see the bugs that matter.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from restir_ref.batch import Array
from restir_ref.chance import Chance
from restir_ref.integrals import Image, Pixels, Reservoirs
from restir_ref.mis import WEIGHTS, Weights
from restir_ref.oracle.cells import Frame, cells
from restir_ref.restir import initial, spatial, temporal

Loop = Callable[[Array, Chance], Reservoirs]
Edit = Callable[[Reservoirs, Pixels], Reservoirs]
Draw = Callable[[Pixels, Chance], Reservoirs]
Neighbours = Callable[[Image, Array, Reservoirs, Chance], Sequence[Pixels]]
"""Whom each column of `index` reuses from, in an image that holds the reservoirs X."""

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
        return np.asarray(self.p_hat > 0)

    @property
    def p_hat(self) -> Array:
        """Targets of the current frame, (n, K)."""
        return self.now.cells.p_hat[self.now.ids(np.arange(self.now.n))]

    def made_of(self, kind: type[Frame]) -> "Scene":
        """The same scene in frames of another kind, a zoo bug for example."""
        return Scene([kind(each.cells, each.n, each.t) for each in self.frames])


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


class Temporal(Protocol):
    """A pass like `restir.temporal`."""

    def __call__(
        self,
        X: Reservoirs,
        here: Pixels,
        Y: Reservoirs,
        before: Sequence[Pixels],
        chance: Chance,
        /,
        *,
        mis: Weights,
        cap: float,
    ) -> Reservoirs:
        """The new samples X resampled with the history Y."""


class Spatial(Protocol):
    """A pass like `restir.spatial`."""

    def __call__(
        self, X: Reservoirs, here: Pixels, neighbours: Sequence[Pixels], chance: Chance, /, *, mis: Weights
    ) -> Reservoirs:
        """The samples X resampled with their neighbours."""


def next_pixel(of: Image, index: Array, X: Reservoirs, chance: Chance) -> Sequence[Pixels]:
    """The neighbour to the right, whatever its sample."""
    return [offset(of, index, 1)]


def the_same(chance: Chance) -> Chance:
    """Independent decisions all along."""
    return chance


def two_frames(parts: "Parts", scene: Scene) -> Loop:
    """Two frames of ReSTIR: spatial reuse, motion by one pixel, temporal and again spatial reuse."""
    before, now = scene.made_of(parts.here).frames
    past, near = scene.made_of(parts.near).frames
    edit = parts.edit

    def loop(index: Array, chance: Chance) -> Reservoirs:
        there, here, dice = Pixels(before, index), Pixels(now, index), parts.dice(chance)
        Y = edit(parts.draw(there, chance), there)
        Y = edit(parts.spatial(Y, there, parts.neighbours(past, index, Y, chance), chance, mis=parts.across), there)
        X = edit(parts.draw(here, chance), here)
        X = edit(parts.temporal(X, here, Y, [offset(past, index, 1)], dice, mis=parts.along, cap=parts.cap), here)
        return parts.spatial(X, here, parts.neighbours(near, index, X, chance), dice, mis=parts.across)

    return loop


def one_frame(parts: "Parts", scene: Scene) -> Loop:
    """New samples and one round of spatial reuse."""
    now, near = scene.made_of(parts.here).now, scene.made_of(parts.near).now

    def loop(index: Array, chance: Chance) -> Reservoirs:
        here = Pixels(now, index)
        X = parts.edit(parts.draw(here, chance), here)
        neighbours = parts.neighbours(near, index, X, chance)
        return parts.spatial(X, here, neighbours, parts.dice(chance), mis=parts.across)

    return loop


def new_samples(parts: "Parts", scene: Scene) -> Loop:
    """New samples and nothing else."""
    now = scene.made_of(parts.here).now

    def loop(index: Array, chance: Chance) -> Reservoirs:
        here = Pixels(now, index)
        return parts.edit(parts.draw(here, chance), here)

    return loop


def temporal_only(parts: "Parts", scene: Scene) -> Loop:
    """New samples of two frames, merged once: no spatial reuse; pixels move by one."""
    before, now = scene.made_of(parts.here).frames
    past = scene.made_of(parts.near).frames[0]

    def loop(index: Array, chance: Chance) -> Reservoirs:
        there, here = Pixels(before, index), Pixels(now, index)
        Y, X = parts.edit(parts.draw(there, chance), there), parts.edit(parts.draw(here, chance), here)
        source, dice = [offset(past, index, 1)], parts.dice(chance)
        return parts.temporal(X, here, Y, source, dice, mis=parts.along, cap=parts.cap)

    return loop


def two_rounds(parts: "Parts", scene: Scene) -> Loop:
    """New samples and two rounds of spatial reuse."""
    now, near = scene.made_of(parts.here).now, scene.made_of(parts.near).now

    def loop(index: Array, chance: Chance) -> Reservoirs:
        here, dice = Pixels(now, index), parts.dice(chance)
        X = parts.edit(parts.draw(here, chance), here)
        X = parts.edit(parts.spatial(X, here, parts.neighbours(near, index, X, chance), dice, mis=parts.across), here)
        return parts.spatial(X, here, parts.neighbours(near, index, X, chance), dice, mis=parts.across)

    return loop


def no_motion(parts: "Parts", scene: Scene) -> Loop:
    """Two frames of temporal reuse from the same pixel, then spatial reuse."""
    before, now = scene.made_of(parts.here).frames
    past, near = scene.made_of(parts.near).frames

    def loop(index: Array, chance: Chance) -> Reservoirs:
        there, here, dice = Pixels(before, index), Pixels(now, index), parts.dice(chance)
        Y, X = parts.edit(parts.draw(there, chance), there), parts.edit(parts.draw(here, chance), here)
        source = [offset(past, index, 0)]
        X = parts.edit(parts.temporal(X, here, Y, source, dice, mis=parts.along, cap=parts.cap), here)
        return parts.spatial(X, here, parts.neighbours(near, index, X, chance), dice, mis=parts.across)

    return loop


@dataclass(frozen=True)
class Parts:
    """What a loop is made of; `parts(scene)` assembles it, and a zoo bug replaces one part.

    `here` is the kind of frame whose pixels a pass is for: its shift goes *back*, for the MIS
    weights.  `near` is the kind that history and neighbours are: its shift brings their samples.
    Weights `along` time and `across` space; `edit` runs after every step but the last; `dice` is
    the chance of the current frame's passes.  History arrives with confidence 2 and is capped.
    """

    steps: Callable[["Parts", Scene], Loop] = two_frames
    here: type[Frame] = Frame
    near: type[Frame] = Frame
    along: Weights = TALBOT
    across: Weights = DEFENSIVE
    cap: float = 1
    draw: Draw = initial
    edit: Edit = keep
    neighbours: Neighbours = next_pixel
    temporal: Temporal = temporal
    spatial: Spatial = spatial
    dice: Callable[[Chance], Chance] = the_same

    def __call__(self, scene: Scene) -> Loop:
        """The loop on a scene."""
        return self.steps(self, scene)


def two_frame_loop(
    scene: Scene, along: Weights = TALBOT, across: Weights = DEFENSIVE, cap: float = 1, edit: Edit = keep
) -> Loop:
    """The loop of `two_frames`, with these weights, this cap and this edit."""
    return Parts(along=along, across=across, cap=cap, edit=edit)(scene)


def reference_scene(of: type[Frame] = Frame) -> Scene:
    """Two frames of two pixels with four cells each; `of` makes the frames, a zoo bug for example.

    Every pixel has a cell of zero target that its sampler reaches, or one that it does not cover;
    every shift but the identity has a hole; volumes differ by up to 4.

    >>> from restir_ref.oracle.scenes import reference_scene
    >>> scene = reference_scene()
    >>> scene.now.n, scene.support
    (2, array([[ True, False,  True,  True],
           [ True,  True,  True,  True]]))
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


def two_technique_scene(of: type[Frame] = Frame) -> Scene:
    """One frame of two pixels with three cells each, drawn by two techniques that miss different cells."""
    v = np.array([[1.0, 0.5, 2.0], [0.5, 1.0, 1.0]])
    techniques = ([[1, 2, 0], [1, 1, 1]], [[1, 1, 3], [0, 2, 1]])
    tables = cells(
        v=v,
        f=np.array([[2.0, 1.0, 1.0], [1.0, 3.0, 0.5]]),
        pdf=np.concatenate([normalised(weights, v) for weights in techniques]),
        shifts=paired(2, 3, {(0, 1): (1, 0, -1)}),
    )
    return Scene([of(tables, 2)])


def normalised(weights: ArrayLike, v: ArrayLike) -> Array:
    """One technique per pixel with densities in proportion to weights (I, K): pdf (1, I, K)."""
    w, volumes = np.asarray(weights, dtype=float), np.asarray(v, dtype=float)
    return np.asarray((w / (w * volumes).sum(axis=-1, keepdims=True))[None])


def paired(I: int, K: int, maps: Mapping[tuple[int, int], Iterable[int]]) -> Array:
    """Shift tables (I, I, K) from maps[i, j][x] = T_ij(x) or -1, i < j; the inverses follow."""
    shifts = np.full((I, I, K), -1)
    shifts[np.arange(I), np.arange(I)] = np.arange(K)
    for (i, j), image in maps.items():
        for x, y in enumerate(image):
            if y >= 0:
                shifts[i, j, x], shifts[j, i, y] = y, x
    return shifts


def random_scene(like: Scene, *, rng: np.random.Generator) -> Scene:
    """A scene of the same size with random volumes, targets, samplers and shifts.

    A fourth of the targets is zero, a seventh of the cells is not covered, a third of the shifts has
    no image, and every pixel has a cell with light that its samplers reach.
    """
    old, count = like.now.cells, len(like.frames) * like.now.n
    K, every = old.v.shape[-1], np.arange(count)
    v = rng.choice([0.25, 0.5, 1.0, 2.0], (count, K))
    f = rng.choice([0.0, 0.5, 1.0, 3.0], (count, K))
    weights = rng.choice([0.0, 1.0, 2.0, 4.0], (len(old.pdf), count, K), p=[1 / 7, 3 / 7, 2 / 7, 1 / 7])
    lit = rng.integers(K, size=count)
    f[every, lit], weights[:, every, lit] = 1.0, 2.0
    maps = {(i, j): np.where(rng.random(K) < 1 / 3, -1, rng.permutation(K)) for j in range(count) for i in range(j)}
    pdf = np.concatenate([normalised(each, v) for each in weights])
    tables = cells(v, f, pdf, paired(count, K, maps), proposal=np.ones((K, K)))
    return Scene([Frame(tables, like.now.n, t) for t in range(len(like.frames))])
