"""Renderings as figures compare them, in any world: at equal rays, against references that are not ReSTIR.

A *renderer* makes one independent estimate of the image per replica; a *film* is a chain of frames
with history.  Rays are counted by the scene, so costs do not depend on the machine.
"""

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from figures.experiments.views import Traced, at_random, evenly
from restir_ref.batch import Array
from restir_ref.chance import Chance
from restir_ref.integrals import Pixels, Reservoirs
from restir_ref.loop import OFFLINE, REAL_TIME, Around, Preset, frame
from restir_ref.restir import shade
from restir_ref.transport.counting import rays
from restir_ref.transport.paths import Tree, radiance, trace
from restir_ref.transport.restir_pt import PathIntegrals

COLUMNS = 2**14
"""Columns rendered at once: what fits the cache."""

POINTS, GENERATOR = 1021, 76
"""Points of a lattice of path trees, a prime, and its generator."""

Renderer = Callable[[PathIntegrals, Array, Chance], Array]
"""(image, columns, chance) -> one estimate per column, grey, (N,)."""

Light = Callable[[Tree], Array]
"""What counts of a path tree, (C, N): `radiance`, or `indirect_light`."""


Sources = Callable[[Traced, Traced], Array]
"""Motion vectors: (this frame, the previous one) -> the previous frame's pixel of every pixel, (n,)."""


@dataclass(frozen=True, eq=False)
class Estimates:
    """Independent images (R, n) and what they cost: rays per pixel and image."""

    images: Array
    rays: float


def path_tracing(samples: int, light: Light = radiance) -> Renderer:
    """The mean of so many path trees."""

    def render(of: PathIntegrals, index: Array, chance: Chance) -> Array:
        total = np.zeros(len(index))
        for _ in range(samples):
            total += light(trace(of.tracer, chance.uniform((of.tracer.D, len(index))), index % of.n)).mean(axis=0)
        return total / samples

    return render


def lattice_tracing(light: Light = radiance) -> Renderer:
    """The mean of POINTS path trees on Korobov's lattice x_k = (a^j k mod N)_j / N, moved at random for each column.

    Each tree's numbers are uniform, so the mean is unbiased, with about a tenth of independent trees' variance.
    """

    def render(of: PathIntegrals, index: Array, chance: Chance) -> Array:
        t, total = of.tracer, np.zeros(len(index))
        powers = np.array([pow(GENERATOR, j, POINTS) for j in range(t.D)])[:, None]
        by = chance.uniform((t.D, len(index)))
        for some in np.array_split(np.arange(POINTS), -(-POINTS * len(index) // COLUMNS)):
            points = (powers * some % POINTS / POINTS)[:, :, None] + by[:, None]
            tree = trace(t, (points % 1).reshape(t.D, -1), np.tile(index % of.n, len(some)))
            for found in light(tree).mean(axis=0).reshape(len(some), -1):
                total += found
        return total / POINTS

    return render


def spatial_only(preset: Preset, around: Around = evenly) -> Renderer:
    """One frame of a preset without history, its neighbours from a low-discrepancy sequence unless told otherwise."""

    def render(of: PathIntegrals, index: Array, chance: Chance) -> Array:
        here = Pixels(of, index)
        return np.asarray(shade(frame(here, chance, preset, around), here).mean(axis=0))

    return render


offline = spatial_only(OFFLINE)


def estimates(render: Renderer, of: PathIntegrals, asked: Counter[str], count: int, chance: Chance) -> Estimates:
    """`count` independent images and their cost, rendered in blocks."""
    before, at_once = rays(asked), max(1, COLUMNS // of.n)
    parts = [min(at_once, count - start) for start in range(0, count, at_once)]
    images = [render(of, np.arange(part * of.n), chance).reshape(part, of.n) for part in parts]
    return Estimates(np.concatenate(images), (rays(asked) - before) / (count * of.n))


def means(images: Array, T: int) -> Array:
    """Means of groups of T independent images, (R // T, n)."""
    groups = len(images) // T
    return np.asarray(images[: groups * T].reshape(groups, T, -1).mean(axis=1))


def film(
    views: Sequence[Traced],
    replicas: int,
    chance: Chance,
    preset: Preset = REAL_TIME,
    sources: Sources | None = None,
) -> Iterator[Array]:
    """Frames of a preset with history, one per view, (replicas, n) each; still views need no `sources`."""
    history: Reservoirs | None = None
    before: list[Pixels] = []
    for k, of in enumerate(views):
        index = np.arange(replicas * of.n)
        if k:
            there = index % of.n if sources is None else sources(of, views[k - 1])[index % of.n]
            before = [Pixels(views[k - 1], index - index % of.n + there)]
        here = Pixels(of, index)
        history = frame(here, chance, preset, at_random, history, before)
        yield np.asarray(shade(history, here).mean(axis=0).reshape(replicas, of.n))


def samples_of_equal_cost(rays_ours: float, rays_per_tree: float) -> int:
    """Path trees that cost at least as many rays: the comparison never favours us."""
    return max(1, int(np.ceil(rays_ours / rays_per_tree)))
