"""Motion vectors of a moving pinhole: where the previous film showed what a pixel's centre sees now.  [GRIS 6.3]

They are functions of pixel centres and geometry, never of samples; the scene stands still.
"""

from dataclasses import dataclass

import numpy as np

from restir_ref.batch import Array
from restir_ref.integrals import NOWHERE
from restir_ref.transport.rays import arrive
from restir_ref.transport.scene import Scene
from restir_ref.transport.vectors import norm
from tracer3d.sensors import Mosaic, Pinhole

SAME = 1e-9
"""Points nearer than this share of the scene's extent are one."""


@dataclass(frozen=True, eq=False)
class Motion:
    """Motion of every pixel of the current crop.

    x (3, n)       what its centre sees
    place (2, n)   column and row where the previous crop showed x; inf where that was behind the eye
    source (n,)    the previous pixel to take history from: that of `place`, or the nearest one of the crop
    seen (n,)      whether the previous film showed x itself at `place`, and the crop holds it; else x is disoccluded
    shape          rows and columns of the previous crop
    """

    x: Array
    place: Array
    source: Array
    seen: Array
    shape: tuple[int, int]


def motion(scene: Scene, now: Pinhole, before: Pinhole) -> Motion:
    """From the current crop back to the previous one; both may differ in everything."""
    pixel = np.arange(now.n)
    v, _, met = arrive(scene, *now.ray(pixel, np.full((2, now.n), 0.5))[:2])
    place = before.project(v.x)
    most = np.array([[before.width], [before.height]])
    cell = np.clip(np.floor(place), 0, most - 1)
    source = (cell[1] * before.width + cell[0]).astype(int)
    u = np.where(np.isfinite(place), place - cell, 0.5)
    w, _, _ = arrive(scene, *before.ray(source, u)[:2])
    inside = ((place >= 0) & (place < most)).all(axis=0)
    return Motion(v.x, place, source, met & inside & (norm(w.x - v.x) <= SAME * scene.extent), before.shape)


def mosaic_sources(scene: Scene, now: Mosaic, before: Mosaic) -> Array:
    """The previous pixel to take history from, (n,), crop by crop: `Motion.source` of each."""
    pairs = zip(now.crops(), before.crops(), strict=True)
    return np.concatenate([motion(scene, *pair).source + k * before.pinhole.n for k, pair in enumerate(pairs)])


def sources(m: Motion, index: Array) -> Array:
    """The previous frame's columns (N,) for columns `index` of the current one: replica * n + source."""
    return _columns(m, index, m.source)


def overlaps(m: Motion, index: Array) -> list[tuple[Array, Array]]:
    """The four previous columns that a pixel-sized square around `place` overlaps, with the area of each.  [Zhang 2024]

    Columns and areas (N,) each; `NOWHERE` and 0 beyond the previous crop's borders.  Areas sum to 1 inside.
    """
    rows, columns = m.shape
    corner = np.where(np.isfinite(m.place), m.place, -2.0) - 0.5
    low = np.floor(corner).astype(int)
    share = corner - low
    found = []
    for down in (0, 1):
        for aside in (0, 1):
            x, y = low[0] + aside, low[1] + down
            area = np.abs(1 - aside - share[0]) * np.abs(1 - down - share[1])
            inside = (x >= 0) & (x < columns) & (y >= 0) & (y < rows) & (area > 0)
            source = np.where(inside, y * columns + x, NOWHERE)
            found.append((_columns(m, index, source), np.where(inside, area, 0.0)[index % len(area)]))
    return found


def _columns(m: Motion, index: Array, source: Array) -> Array:
    """Sources of pixels as columns of the same replica; `NOWHERE` stays what it is."""
    pixel = index % len(source)
    n = m.shape[0] * m.shape[1]
    there = source[pixel]
    return np.asarray(np.where(there == NOWHERE, NOWHERE, index // len(source) * n + there))
