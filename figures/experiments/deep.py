"""True images of rooms in which light bounces until it is gone, as caches have it."""

from collections.abc import Callable, Mapping
from functools import cache as once
from pathlib import Path
from types import MappingProxyType

from figures.experiments.references import reference
from flatland2d.probe_rooms import PROBE_ROOMS
from flatland2d.radiosity import render
from flatland2d.scenes import SCENES, Setting
from restir_ref.batch import Array

ROOMS: Mapping[str, Callable[[], Setting]] = MappingProxyType({**SCENES, **PROBE_ROOMS})

PATH = Path(__file__).with_suffix(".npz")
ALL_BOUNCES = "all bounces"
"""The key of stored references of all light, for rooms that have no radiosity."""

BOUNCES = 48
"""After so many .75^48 is left of the light, a millionth."""

PANELS, FILM = 30, 8
"""Panels per segment, and points per part of a pixel: errors of some .1%."""

TRACED = ("glossy_cornell",)
"""Rooms with other lobes than Lambert's."""


def truth(name: str, bounces: int = BOUNCES) -> Array:
    """The room's inset after so many bounces, (n,); stored ones of the rooms in TRACED know all bounces only."""
    return reference(name, ALL_BOUNCES, PATH).mean if name in TRACED else radiosity(name, bounces)


@once
def radiosity(name: str, bounces: int) -> Array:
    """The same of rooms of Lambert surfaces."""
    setting = ROOMS[name]()
    return render(setting.scene, setting.pinhole(), bounces, PANELS, FILM)
