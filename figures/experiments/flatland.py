"""Flatland as figures see it: which scenes, and by which camera."""

from dataclasses import replace

import numpy as np

from flatland2d import SCENES
from flatland2d.sensors import Pinhole
from restir_ref.batch import Array

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
