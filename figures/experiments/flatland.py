"""Flatland as figures see it: which scenes, by which rule of connections, and by which camera."""

from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from flatland2d import SCENES
from flatland2d.sensors import Pinhole
from restir_ref.batch import Array
from restir_ref.transport.counting import counted
from restir_ref.transport.paths import RECONNECTION, Connectability, Tracer
from restir_ref.transport.restir_pt import PathIntegrals

HYBRID = Connectability(0.2, 0.02)
"""Roughness .2, and 2% of the rooms' height, the unit of length: 1% of the width where that is 2.

[GRIS 8.3] has 1% to 5% of the scene's size.
"""

RULES: Mapping[str, Connectability] = MappingProxyType({"reconnection": RECONNECTION, "hybrid": HYBRID})

TEN = (
    "cornell",
    "glossy_cornell",
    "ajar",
    "crease",
    "occluders",
    "checker",
    "rack",
    "glass_disc",
    "distant_caustic",
    "clear_coat",
)
"""Scenes FS1 to FS10."""


def view(
    scene: str,
    rule: Connectability,
    asked: Counter[str],
    sensor: Pinhole | None = None,
    integrals: Callable[[Tracer], PathIntegrals] = PathIntegrals,
) -> PathIntegrals:
    """The scene's standard inset, or another view of it, which counts its rays."""
    setting = SCENES[scene]()
    return integrals(Tracer(counted(setting.scene, asked), sensor or setting.pinhole(), setting.depth, rule))


def moving(scene: str, frames: int, step: float) -> list[Pinhole]:
    """A camera that moves sideways by `step` per frame and arrives at the standard inset with the last one."""
    last = SCENES[scene]().pinhole()
    forward = np.subtract(last.towards, last.eye) / np.linalg.norm(np.subtract(last.towards, last.eye))
    side = step * np.array([forward[1], -forward[0]])
    return [displaced(last, (k - frames + 1) * side) for k in range(frames)]


def displaced(sensor: Pinhole, by: Array) -> Pinhole:
    """The sensor moved, looking in the same direction."""
    eye, towards = np.add(sensor.eye, by), np.add(sensor.towards, by)
    return replace(sensor, eye=(float(eye[0]), float(eye[1])), towards=(float(towards[0]), float(towards[1])))
