"""Gradient renderers of crops in space that follow what their centre sees, while the camera slides."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from figures.experiments.gradients import Spatial
from figures.experiments.pans import paired
from restir_ref.area import moving, one_by_area
from restir_ref.gathering import gathering
from restir_ref.gradient_loop import GradientPreset, View
from restir_ref.squares import keeping
from restir_ref.transport.rays import arrive
from tracer3d.scenes import INSET, Setting
from tracer3d.sensors import FILM, Pinhole


def followed(setting: Setting, side: int, frames: int) -> list[Pinhole]:
    """A square crop in the middle of the setting's own inset, and what it was while the camera approached.

    In each frame before, the crop is where the film showed what the last crop's centre sees.
    """
    left, top = (corner + (INSET - side) // 2 for corner in setting.crop)
    last, half = setting.pinhole(side, side, (left, top)), side // 2
    x, w, _ = last.through(np.array([left + half]), np.array([top + half]))
    centre, _, _ = arrive(setting.scene, x, w)
    crops = []
    for frame in range(1 - frames, 1):
        camera = setting.at(frame).pinhole(side, side, (0, 0))
        corner = np.clip(np.rint(camera.project(centre.x)[:, 0]) - half, 0, np.array(FILM) - side)
        crops.append(replace(camera, left=int(corner[0]), top=int(corner[1])))
    return crops


def views_of(
    s: Setting, sensors: Sequence[Pinhole], preset: GradientPreset, spatial: Spatial, asked: Counter[str]
) -> list[View]:
    """The frame of every sensor after that of the one before, with pairs along rows and columns."""
    moves = zip(sensors, [sensors[0], *sensors], strict=False)
    return [paired(s, each, asked, preset, spatial) for each in moves]


def frugal(view: View) -> View:
    """The same with one of the overlapped previous pixels, chosen by its share of the area."""
    return {name: replace(group, follow=moving(one_by_area)) for name, group in view.items()}


def in_place(view: View) -> View:
    """The same with what lies in the square, of all overlapped pixels, kept where it is."""
    return {name: replace(group, follow=keeping) for name, group in view.items()}


def gathered(view: View) -> View:
    """The same with what lies in the square kept where it is, and what lies elsewhere moved into it."""
    return {name: replace(group, follow=gathering) for name, group in view.items()}
