"""Flatland scenes for volumes of probes, each with what makes it hard or easy for them, and grids of probes.

Lengths are in units of a room's height, as in `scenes`.
"""

from collections.abc import Callable, Mapping
from types import MappingProxyType

import numpy as np

from flatland2d.scenes import LAMP, Point, Setting, block, chain, matte, room
from flatland2d.space import PLANE
from restir_ref.transport.cache.grid import Grid, over
from restir_ref.transport.scene import scene

PER_UNIT = 16.0
"""Probes per unit length."""


def probes(setting: Setting, per_unit: float = PER_UNIT) -> Grid:
    """A grid over all of a scene's map, so many probes per unit length along each axis, as far as whole ones fit."""
    counts = [max(round((b - a) * per_unit), 1) for a, b in zip(setting.low, setting.high, strict=True)]
    return over(setting.low, setting.high, counts)


def sunlit(lamp: float = 1.0) -> Setting:
    """FS11: a dim room whose outer walls are one facet thick, a strong sun outside: probes beyond the wall leak.

    Without its `lamp`, all light in the room has leaked.
    """
    sun = chain([(-0.5, 1.2), (-0.5, -0.2)], 0, 40.0)
    facets = [*room(0), *chain(LAMP, 0, lamp), *sun]
    return Setting(
        scene(PLANE, [matte(0.75)], facets), (0.8, 0.5), (0.0, 0.4), crop=896, low=(-0.25, -0.25), high=(1.25, 1.25)
    )


def lamp_beside_probe() -> Setting:
    """FS12: a small light that is closer to probes (4 per unit) than to the table and the floor that it lights."""
    facets = [*room(0), *block((0.2, 0.001), (0.6, 0.2), 0), *chain([(0.41, 0.46), (0.39, 0.46)], 0, 40.0)]
    return Setting(scene(PLANE, [matte(0.5)], facets), (0.85, 0.6), (0.4, 0.2), crop=896)


def octagon(centre: Point, radius: float) -> list[Point]:
    """Nine corners, clockwise, so that fronts are outside; the last is the first."""
    turn = -np.arange(9) % 8 / 8 * 2 * np.pi
    x, y = centre
    return [(float(x + radius * np.cos(a)), float(y + radius * np.sin(a))) for a in turn]


def open_room() -> Setting:
    """FS13: a convex room under a broad light, one obstacle in it: probes know nearly all about it."""
    lamp = chain([(0.8, 0.995), (0.2, 0.995)], 0, 3.0)
    obstacle = chain(octagon((0.5, 0.3), 0.12), 1)
    return Setting(
        scene(PLANE, [matte(0.7), matte(0.4)], [*room(0), *obstacle, *lamp]), (0.12, 0.6), (0.55, 0.2), crop=960
    )


PROBE_ROOMS: Mapping[str, Callable[[], Setting]] = MappingProxyType(
    {each.__name__: each for each in (sunlit, lamp_beside_probe, open_room)}
)
