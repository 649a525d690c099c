"""Motion vectors of a moving pinhole: where the previous film showed what a pixel's centre sees now.  [GRIS 6.3]

They are functions of pixel centres and geometry, never of samples; the scene stands still.
"""

from dataclasses import dataclass

import numpy as np

from flatland2d.sensors import Pinhole
from restir_ref.batch import Array
from restir_ref.transport.rays import arrive
from restir_ref.transport.scene import Scene
from restir_ref.transport.vectors import norm

SAME = 1e-9
"""Points nearer than this share of the scene's extent are one."""


@dataclass(frozen=True, eq=False)
class Motion:
    """Motion of every pixel of the current crop.

    x (2, n)     what its centre sees
    place (n,)   where the previous crop showed x, pixel + u; inf where that was behind the eye
    source (n,)  the previous pixel to take history from: that of `place`, or the nearest one of the crop
    seen (n,)    whether the previous film showed x itself at `place`, and the crop holds it; else x is disoccluded
    """

    x: Array
    place: Array
    source: Array
    seen: Array


def centres(scene: Scene, sensor: Pinhole) -> Array:
    """What pixel centres see, (2, n)."""
    pixel = np.arange(sensor.n)
    v, _, _ = arrive(scene, *sensor.ray(pixel, np.full((1, sensor.n), 0.5))[:2])
    return v.x


def motion(scene: Scene, now: Pinhole, before: Pinhole) -> Motion:
    """From the current crop back to the previous one; both may differ in everything."""
    x = centres(scene, now)
    place = before.project(x)
    source = np.clip(np.floor(place), 0, before.n - 1).astype(int)
    v, _, _ = arrive(scene, *before.ray(source, (np.where(np.isfinite(place), place, 0) - source)[None])[:2])
    inside = (place >= 0) & (place < before.n)
    return Motion(x, place, source, inside & (norm(v.x - x) <= SAME * scene.extent))


def sources(m: Motion, index: Array) -> Array:
    """The previous frame's columns (N,) for columns `index` of the current one: replica * n + source."""
    n = len(m.source)
    return np.asarray(index - index % n + m.source[index % n])
