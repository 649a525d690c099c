"""Whole rows under a camera that moves by a fraction of a pixel per frame."""

from collections import Counter
from dataclasses import replace

import numpy as np

from figures.experiments.flatland import displaced
from figures.experiments.gradients import Spatial, gradient_view
from figures.experiments.views import setting
from flatland2d.sensors import Pinhole
from restir_ref.gradient_loop import GradientPreset, View


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


def whole(view: View) -> View:
    """The same with motion vectors rounded to whole pixels: reuse of points that are up to half a pixel apart."""
    return {name: replace(group, by=np.rint(group.by)) for name, group in view.items()}
