"""Scenes in space for volumes of probes, and grids of probes for a scene."""

from collections.abc import Callable, Mapping
from types import MappingProxyType

from restir_ref.transport.cache.grid import Grid, over
from restir_ref.transport.scene import scene
from tracer3d.scenes import Setting, crease, furnace, grey, matte
from tracer3d.shapes import box, lamp, rectangle, room
from tracer3d.space import SOLID

PER_UNIT = 8.0
"""Probes per unit length."""


def probes(setting: Setting, per_unit: float = PER_UNIT) -> Grid:
    """A grid over the box around a scene, so many probes per unit length along each axis, as far as whole ones fit."""
    corners = setting.scene.corners
    low, high = corners.min(axis=(0, 2)).tolist(), corners.max(axis=(0, 2)).tolist()
    return over(low, high, [max(round((b - a) * per_unit), 1) for a, b in zip(low, high, strict=True)])


def lamp_beside_probe() -> Setting:
    """SmallLight3: a small light that is closer to probes (4 per unit) than to the table and the floor it lights."""
    table = box(rectangle((0.2, 0.2), (0.6, 0.6), 0.001), 0.2, 0)
    facets = [*room(0), *table, *lamp((0.37, 0.37), (0.43, 0.43), 0.46, 40.0)]
    return Setting(scene(SOLID, [matte(grey(0.5))], facets), (0.85, 0.6, 0.85), (0.4, 0.2, 0.4), (928, 508))


PROBE_ROOMS: Mapping[str, Callable[[], Setting]] = MappingProxyType(
    {each.__name__: each for each in (lamp_beside_probe, furnace, crease)}
)
