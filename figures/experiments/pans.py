"""Cameras that move by a fraction of a pixel per frame: over whole rows of flatland, and over a floor in space."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from figures.experiments.flatland import displaced
from figures.experiments.gradients import Spatial, around, gradient_view, reusing
from figures.experiments.views import HYBRID, setting
from flatland2d.sensors import Pinhole
from restir_ref.batch import Array
from restir_ref.gradient_loop import PRIMAL, GradientPreset, Group, View, forward, nearer, pairs_of
from restir_ref.transport.counting import counted
from restir_ref.transport.edges import seen
from restir_ref.transport.paths import Tracer
from restir_ref.transport.restir_pt import PathIntegrals
from tracer3d.motion import motion
from tracer3d.scenes import checker as floor
from tracer3d.sensors import Pinhole as Pinhole3


def panned(scene: str, film: int, step: float, frames: int) -> list[Pinhole]:
    """A film of so many pixels, whole, seen by a camera that moves sideways and arrives at the scene's own place."""
    last: Pinhole = replace(setting(scene).pinhole(), first=0, n=film, film=film)
    forward = np.subtract(last.towards, last.eye) / np.linalg.norm(np.subtract(last.towards, last.eye))
    side = step * np.array([forward[1], -forward[0]])
    return [displaced(last, (k - frames + 1) * side) for k in range(frames)]


def views_along(
    scene: str, sensors: list[Pinhole], preset: GradientPreset, spatial: Spatial, asked: Counter[str]
) -> list[View]:
    """The frame of every sensor after that of the one before."""
    moves = zip(sensors, [sensors[0], *sensors], strict=False)
    return [gradient_view(scene, each, asked, preset, spatial) for each in moves]


SIZE, SMALL, CORNER, SIDEWAYS = 32, (320, 180), (144, 74), 0.0009
"""Pixels along a side of the crop, the film, where it begins, and units of length that the camera moves per frame."""


def floor_views(frames: int, preset: GradientPreset, spatial: Spatial, asked: Counter[str]) -> list[View]:
    """Frames of the middle of Checker3's floor; the camera arrives at the scene's own place."""
    s = floor()
    last = replace(s.pinhole(SIZE, SIZE), film=SMALL, left=CORNER[0], top=CORNER[1])
    _, right, _ = last.axes()
    moves = [(k - frames + 1) * SIDEWAYS * right[:, 0] for k in range(frames)]
    sensors = [replace(last, eye=_moved(last.eye, by), towards=_moved(last.towards, by)) for by in moves]
    views = []
    for sensor, before in zip(sensors, [sensors[0], *sensors], strict=False):
        views.append(paired(s, (sensor, before), asked, preset, spatial))
    return views


def _moved(point: Sequence[float], by: Array) -> tuple[float, float, float]:
    x, y, z = (float(each) for each in np.add(point, by))
    return x, y, z


def paired(
    s: Any, moves: tuple[Pinhole3, Pinhole3], asked: Counter[str], preset: GradientPreset, spatial: Spatial
) -> View:
    """The frame of the first sensor after that of the second, with its pairs along rows and columns."""
    sensor, before = moves
    image = PathIntegrals(Tracer(counted(s.scene, asked), sensor, s.depth, HYBRID))
    pixel, depth = np.arange(image.n), seen(s.scene, sensor).t
    by = motion(s.scene, sensor, before).place - np.stack([pixel % sensor.width, pixel // sensor.width]) - 0.5
    by = np.zeros_like(by) if sensor == before else by
    view = {PRIMAL: Group({PRIMAL: image}, image.shape, by, around(image.shape), np.ones(image.n, dtype=bool))}
    for name, (ends, shape) in forward(image.shape).items():
        active, choice = reusing(s.scene, sensor, (ends, shape), spatial)
        view[name] = Group(pairs_of(image, ends, preset.partners), shape, nearer(by, depth, ends), choice, active)
    return view


def whole(view: View) -> View:
    """The same with motion vectors rounded to whole pixels: reuse of points that are up to half a pixel apart."""
    return {name: replace(group, by=np.rint(group.by)) for name, group in view.items()}
