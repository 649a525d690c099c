"""Flatland scenes for volumes of probes, each with what makes it hard or easy for them, and grids of probes.

Lengths are in units of a room's height, as in `scenes`.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace
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


def couch(gap: float) -> Setting:
    """FS4 with a gap of that height below its furniture, which ends at .3."""
    slope = chain([(0.0, 0.0), (0.45, 0.45 * float(np.tan(np.radians(40))))], 0)
    facets = [*room(0), *slope, *block((0.6, gap), (0.9, 0.3), 0), *chain(LAMP, 0, 8.0)]
    return Setting(scene(PLANE, [matte(0.7)], facets), (0.55, 0.6), (0.45, 0.0), crop=512)


def wedge_of_slab(degrees: float, thickness: float) -> Setting:
    """FS4 with a wedge of that many degrees below a slab so thick, a hair from the wall; one facet if that is 0."""
    slope, near, far = float(np.tan(np.radians(degrees))), 0.001, 0.45
    up = thickness / float(np.cos(np.radians(degrees)))
    below = [(far, far * slope), (near, near * slope)]
    above = [(near, near * slope + up), (far, far * slope + up)]
    slab = chain([below[1], *above, *below] if thickness else [(0.0, 0.0), below[0]], 0)
    facets = [*room(0), *slab, *block((0.6, 0.03), (0.9, 0.3), 0), *chain(LAMP, 0, 8.0)]
    return Setting(scene(PLANE, [matte(0.7)], facets), (0.55, 0.6), (0.45, 0.0), crop=512)


def sunlit_slabs(thickness: float, lamp: float = 1.0) -> Setting:
    """FS11 with outer walls so thick, outside the same room; as it is if that is 0."""
    thin = sunlit(lamp)
    if not thickness:
        return thin
    sun = chain([(-0.5, 1.2), (-0.5, -0.2)], 0, 40.0)
    outside = block((-thickness, -thickness), (1 + thickness, 1 + thickness), 0)
    return replace(thin, scene=scene(PLANE, [matte(0.75)], [*room(0), *outside, *chain(LAMP, 0, lamp), *sun]))


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
