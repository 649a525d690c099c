"""Space as figures see it: scenes of tracer3d by their names in the claims, seen through crops of the papers' film.

Crops stand where a low-discrepancy sequence puts them, in the middle half of the film's width: nobody chose them.
Those of a moving camera follow what their centres see, so that nearly all of a crop has a history, as in the interior
of a film; only what turns up behind edges has none.
"""

from collections.abc import Callable, Mapping
from types import MappingProxyType

import numpy as np

from restir_ref.transport.rays import arrive
from tracer3d import scenes
from tracer3d.scenes import Setting
from tracer3d.sensors import FILM, Mosaic, Pinhole

SIDE, COUNT = 24, 5
"""Columns and rows of a crop, and how many there are."""

GENERATORS = 0.7548776662466927, 0.5698402909980532
"""Steps of Roberts' R2 sequence: 1/p and 1/p^2, where p^3 = p + 1."""

SCENES: Mapping[str, Callable[[], Setting]] = MappingProxyType(
    {
        "CB3": scenes.cornell,
        "CB3-glossy": scenes.glossy_cornell,
        "Ajar3": scenes.ajar,
        "Crease3": scenes.crease,
        "GlassBall3": scenes.glass_ball,
        "ManyLights3": scenes.many_lights,
    }
)


WIDE = 36
"""Columns and rows of an inset."""

INSETS: Mapping[str, tuple[str, tuple[int, int]]] = MappingProxyType(
    {
        "CB3, box": ("CB3", (960, 700)),
        "CB3-glossy, box": ("CB3-glossy", (960, 700)),
        "CB3-glossy, foot": ("CB3-glossy", (1076, 1022)),
    }
)
"""Scenes seen through an inset of their own, with the film's pixel in its middle: the low box's upright edge, with the
tall one behind it; and its foot in front, where it stands on the floor.
"""


def inset(name: str, wide: int = WIDE) -> Mosaic:
    """One of the insets, square."""
    scene, (x, y) = INSETS[name]
    return Mosaic(SCENES[scene]().pinhole(wide, wide), ((x - wide // 2, y - wide // 2),))


def crops(setting: Setting) -> Mosaic:
    """COUNT crops at places of the R2 sequence, in the middle half of the film's columns, on all of its rows."""
    at = (0.5 + np.outer(np.arange(1, COUNT + 1), GENERATORS)) % 1
    free = np.array(FILM) * (0.5, 1) - SIDE
    corners = np.rint(at * free + np.array(FILM) * (0.25, 0)).astype(int)
    return Mosaic(setting.pinhole(SIDE, SIDE), tuple((int(x), int(y)) for x, y in corners))


def approach(setting: Setting, frames: int) -> list[Mosaic]:
    """The crops of a camera that slides and arrives at the standard ones with the last frame.

    In each frame before, a crop is where the film showed what the last crop's centre sees.
    """
    last = crops(setting)
    return [_following(setting, last, k - frames + 1) for k in range(frames)]


def _following(setting: Setting, last: Mosaic, frame: int) -> Mosaic:
    now = setting.at(frame).pinhole(SIDE, SIDE)
    return Mosaic(now, tuple(_corner(setting, crop, now) for crop in last.crops()))


def _corner(setting: Setting, crop: Pinhole, now: Pinhole) -> tuple[int, int]:
    """Where a crop of another camera begins whose centre sees what this crop's does; it stays on the film."""
    half = SIDE // 2
    x, w, _ = crop.through(np.array([crop.left + half]), np.array([crop.top + half]))
    v, _, met = arrive(setting.scene, x, w)
    place = now.project(np.where(met, v.x, x + w))[:, 0] + np.array([now.left, now.top])
    left, top = np.clip(np.rint(place) - half, 0, np.array(FILM) - SIDE)
    return int(left), int(top)
