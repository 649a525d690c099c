"""True images of rooms in which light bounces until it is gone, as caches have it."""

from collections.abc import Callable, Mapping
from functools import cache as once
from pathlib import Path
from types import MappingProxyType

import numpy as np

from figures.experiments.references import INDIRECT, reference
from flatland2d.probe_rooms import PROBE_ROOMS
from flatland2d.radiosity import POINTS_AT_ONCE, Panels, cut, film_points, gather, shares
from flatland2d.scenes import SCENES, Setting
from flatland2d.sensors import Pinhole
from restir_ref.batch import Array
from restir_ref.transport.materials import albedo
from restir_ref.transport.scene import Scene
from restir_ref.transport.vectors import dot

ROOMS: Mapping[str, Callable[[], Setting]] = MappingProxyType({**SCENES, **PROBE_ROOMS})

PATH = Path(__file__).with_suffix(".npz")
ALL_BOUNCES = "all bounces"
"""The key of stored references of all light, for rooms that have no radiosity."""

DEPTH = 12
"""Scattering events of path tracing in the same rooms; the rest, 3% at most, is missing there."""

DEEP = 24
"""The depth of the truth where that is traced: after so many bounces a fifth of a thousandth is left."""

PANELS, FILM = 48, 8
"""Panels per segment, and points per part of a pixel: the mean errs by .05% at most, behind the door ajar."""

TRACED = ("glossy_cornell",)
"""Rooms with other lobes than Lambert's."""


def truth(name: str) -> Array:
    """The room's inset after all bounces, (n,)."""
    return reference(name, ALL_BOUNCES, PATH).mean if name in TRACED else radiosities(name)[0]


def direct(name: str) -> Array:
    """Light that comes from lights by way of x_1 alone, (n,)."""
    return reference(name).mean - reference(name, INDIRECT).mean if name in TRACED else radiosities(name)[1]


def truth_of_trees(name: str) -> Array:
    """What path tracing of `depth_of` bounces converges to, (n,)."""
    return truth(name) if name in TRACED else radiosities(name)[2]


def depth_of(name: str) -> int:
    """The depth of path trees; where the truth is traced, its own."""
    return DEEP if name in TRACED else DEPTH


@once
def radiosities(name: str) -> Array:
    """Of a room of Lambert surfaces: all bounces, one, and DEPTH of them; (3, n).  B = (1 - F)^-1 L_e, F kept."""
    setting = ROOMS[name]()
    scene, sensor = setting.scene, setting.pinhole()
    p = cut(scene, PANELS)
    middle, blocks = (p.a + p.b) / 2, np.array_split(np.arange(len(p.prim)), -(-len(p.prim) // POINTS_AT_ONCE))
    F = np.concatenate([shares(scene, p, middle.take(k, axis=-1), p.n.take(k, axis=-1)) for k in blocks])
    F *= albedo(scene.materials).mean(axis=0)[scene.material[p.prim]][:, None]
    B = [np.linalg.solve(np.eye(len(F)) - F, p.emission), p.emission, p.emission]
    for _ in range(DEPTH - 1):
        B[2] = p.emission + F @ B[2]
    return np.stack([_seen(scene, sensor, p, each) for each in B])


def _seen(scene: Scene, sensor: Pinhole, p: Panels, B: Array) -> Array:
    """One more bounce, and what of it the sensor sees, (n,)."""
    pixel, u, weight = film_points(scene, sensor, FILM)
    x, w, _ = sensor.ray(pixel, u[None])
    t, prim = scene.intersect(x, w)
    normal = scene.normals.take(prim, axis=-1)
    front = dot(normal, w) < 0
    L = gather(scene, p, B, x + t * w, prim, np.where(front, normal, -normal)) + scene.emission[0, prim] * front
    return np.bincount(pixel, weight * L, sensor.n)
