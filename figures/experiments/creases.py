"""Where surfaces meet: chains of frames of DDGI resampling with bounded and unbounded geometry terms.  [DDGIR 3.5]

One crop looks into the crease, another one away from it.  Neighbours, history and cap are those of
the real-time preset; as in the paper's predecessor nothing is reused between x_1 whose normals differ.  [Bitterli 2020]
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cache as once
from types import MappingProxyType
from typing import Any

import numpy as np

from figures.claims.figure import Arrays
from figures.experiments.cached import FREEZING, along_view
from figures.experiments.corners import clearance
from flatland2d.directions import MAPS as BINS
from flatland2d.probe_rooms import probes
from flatland2d.scenes import SCENES as FLAT
from flatland2d.sensors import FILM
from restir_ref.batch import Array
from restir_ref.chance import Chance, Live
from restir_ref.images import random_in_disk
from restir_ref.integrals import NOWHERE, Pixels, Reservoirs
from restir_ref.loop import REAL_TIME, Around, Preset, random_in_row
from restir_ref.transport.cache.converge import converge
from restir_ref.transport.cache.frame import frame, image
from restir_ref.transport.cache.integrals import CacheIntegrals, cache_integrals, lit, looking, unseen
from restir_ref.transport.cache.leaving import Cache, telling
from restir_ref.transport.cache.shading import plain
from restir_ref.transport.cache.update import Updating
from restir_ref.transport.cache.volume import Volume, unlit
from restir_ref.transport.paths import RECONNECTION, Sensor, Tracer, first_hit
from restir_ref.transport.scene import Scene
from restir_ref.transport.vectors import dot, norm
from tracer3d.directions import MAPS as OCTAHEDRA
from tracer3d.probe_rooms import probes as probes_in_space
from tracer3d.scenes import crease as crease_in_space
from tracer3d.sensors import Mosaic

WARMING = 3
"""Frames of a chain that are not counted."""

TOLERANCE = 0.04
QUANTILE = 0.999

ANGLE, INSET = 40.0, 128
"""Of the wedge of FS4, and pixels of the inset that looks into it."""

FLOOR = 896
"""The first pixel of the inset of FS4 that has nothing near it."""

NEAR = 0.02
"""A room's height is 1: pixels of the crease see what is closer than that to another surface."""

ALIKE = float(np.cos(np.radians(25)))
"""The least cosine between the normals of x_1 that reuse one another's samples."""

SIDE = 10
CROPS = {"crease": (955, 535), "away": (1300, 800)}
"""Crops of space, SIDE pixels wide: around the middle of the view, through which the crease goes; and floor.

Fireflies need x_1 at unequal distances from the crease, down to none: half of the crop is floor, half wall.
"""


def bare(X: Reservoirs, here: Pixels) -> Reservoirs:
    """The history is what the frame was."""
    return X


BALANCED = "balanced weights"
COUNTED = "1/M"
PRESETS: Mapping[str, Preset] = MappingProxyType(
    {BALANCED: REAL_TIME, COUNTED: replace(REAL_TIME, along="constant", across="constant")}
)
"""Weights that compare targets, with visibility; or that count inputs.  [Bitterli 2020]"""


@dataclass(frozen=True, eq=False)
class Crease:
    """A scene with a crease, how it is seen, and the light that its second vertices send.

    near (n,)  whether what a pixel sees is in the crease
    """

    cache: Cache
    sensor: Sensor
    around: Around
    near: Array


@once
def flat() -> Mapping[str, Crease]:
    """FS4, seen from the wedge's bisector, and its floor beside the furniture; a volume of 8 probes per unit."""
    setting = FLAT["crease"]()
    x = setting.eye[0]
    eye = (x, x * float(np.tan(np.radians(ANGLE / 2))))
    away = setting.pinhole(first=FLOOR)
    into = replace(away, eye=eye, towards=(0.0, 0.0), n=INSET, first=(FILM - INSET) // 2)
    cache = _cache(setting.scene, unlit(setting.scene, probes(setting, 8.0), BINS))
    views = {"crease": into, "away": away}
    return {
        name: Crease(cache, each, random_in_row, clearance(setting.scene, each) < NEAR) for name, each in views.items()
    }


@once
def solid() -> Mapping[str, Crease]:
    """Crease3 in two crops of the film, and a volume of 4 probes per unit."""
    setting = crease_in_space()
    cache = _cache(setting.scene, unlit(setting.scene, probes_in_space(setting, 4.0), OCTAHEDRA))
    return {name: _crop(cache, Mosaic(setting.pinhole(SIDE, SIDE), (each,))) for name, each in CROPS.items()}


def _crop(cache: Cache, sensor: Mosaic) -> Crease:
    t = Tracer(cache.scene, sensor, 1, RECONNECTION)
    v, _, _ = first_hit(t, np.full((t.D, sensor.n), 0.5), np.arange(sensor.n))
    return Crease(cache, sensor, random_in_disk(sensor.shape), norm(v.x[:2]) < NEAR)


ROOMS: Mapping[str, Callable[[], Mapping[str, Crease]]] = MappingProxyType({"FS4": flat, "Crease3": solid})


def _cache(scene: Scene, empty: Volume) -> Cache:
    how, chance = Updating(telling(along_view(empty))), Live(np.random.default_rng(FREEZING))
    v = converge(empty, scene, how, chance, tolerance=TOLERANCE)
    return Cache(scene, v, along_view(v))


def alike(of: CacheIntegrals, index: Array, near: Pixels) -> Pixels:
    """Those of the columns `near` (N,) whose normals are as those of columns `index` are; NOWHERE for others.

    A choice by x_1, never by samples.  [Bitterli 2020]
    """
    theirs: CacheIntegrals = near.of  # type: ignore[assignment]
    same = dot(of.v.n.take(index, axis=-1), theirs.v.n.take(near.index, axis=-1)) > ALIKE
    return Pixels(near.of, np.where(same, near.index, NOWHERE))


def on_one_surface(around: Around) -> Around:
    """The same neighbours, none where normals differ."""

    def chosen(of: Any, index: Array, count: int, radius: float, chance: Chance) -> list[Pixels]:
        return [alike(of, index, near) for near in around(of, index, count, radius, chance)]

    return chosen


def chain(of: Crease, G_max: float, weights: str, replicas: int, frames: int, chance: Chance) -> Iterator[Array]:
    """Grey images (replicas, n) of frames after WARMING, each with new x_1; 1/M looks in the end only."""
    t, n = Tracer(of.cache.scene, of.sensor, 1, RECONNECTION), of.sensor.n
    index = np.arange(replicas * n)
    history: Reservoirs | None = None
    last: list[Pixels] = []
    sight, remembered = (looking, bare) if weights == BALANCED else (unseen, lit)
    for k in range(WARMING + frames):
        first = cache_integrals(t, of.cache, chance.uniform((t.D, len(index))), index % n, G_max)
        here = Pixels(replace(first, shape=(n,), sight=sight), index)
        before = [alike(first, index, each) for each in last]
        now = frame(here, chance, PRESETS[weights], on_one_surface(of.around), history, before)
        history, last = remembered(now.X, here), [here]
        if k >= WARMING:
            yield image(replace(now, X=history), here, plain, chance).mean(axis=0).reshape(replicas, n)


@dataclass(frozen=True)
class Sizes:
    """So many images, each of the frames of so many chains."""

    replicas: int
    groups: int
    frames: int


def moments(of: Crease, G_max: float, weights: str, size: Sizes, chance: Chance) -> Arrays:
    """Mean and mean square of an image's samples (replicas, n), and their QUANTILE where it is meant to look.

    high (replicas,)  that; in the crease those pixels are near, away from it all
    """
    found = np.stack([*chain(of, G_max, weights, size.replicas * size.groups, size.frames, chance)])
    apart = found.reshape(size.frames, size.replicas, size.groups, -1).swapaxes(0, 1)
    values = apart.reshape(size.replicas, size.frames * size.groups, -1)
    shown = values[..., of.near] if of.near.any() else values
    high = np.quantile(shown.reshape(size.replicas, -1), QUANTILE, axis=1)
    return {"mean": values.mean(axis=1), "square": (values**2).mean(axis=1), "high": high, "near": of.near}


def variance(a: Arrays) -> Array:
    """Of single samples where the view is meant to look, over the squared mean of all; (replicas,)."""
    at = a["mean"].mean(axis=0)
    spread = (a["square"] - 2 * at * a["mean"] + at**2) / at**2
    return np.asarray((spread[:, a["near"]] if a["near"].any() else spread).mean(axis=1))
