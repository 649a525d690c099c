"""Shapes from triangles: quads, boxes, rooms.  Their corners go counterclockwise round the front."""

from collections.abc import Sequence

import numpy as np

from restir_ref.batch import Array
from restir_ref.transport.scene import Facet
from tracer3d.sensors import Point

FLAT = 1e-9
"""A quad's fourth corner may be off the plane of the others by this share of the quad's size."""


def quad(corners: Sequence[Sequence[float]], material: int, emission: Sequence[float] = ()) -> list[Facet]:
    """Two triangles with the diagonal from corner 0 to 2.  Raises ValueError for four corners that are not flat."""
    a, b, c, d = np.asarray(corners, dtype=float)
    n = np.cross(b - a, c - a)
    size = float(np.abs(np.stack([b, c, d]) - a).max())
    if not abs(n @ (d - a)) <= FLAT * size * np.linalg.norm(n):
        raise ValueError(f"the corners of a quad must be in one plane, but are {np.asarray(corners).tolist()}.")
    return [Facet(np.stack(three).tolist(), material, emission) for three in ((a, b, c), (a, c, d))]


def sides(low: Sequence[Point], high: Sequence[Point]) -> list[list[Point]]:
    """A quad on every side of the polygon `low`, up to `high`; fronts outside if it is counterclockwise."""
    return [[*each] for each in zip(low, [*low[1:], low[0]], [*high[1:], high[0]], high, strict=True)]


def rectangle(low: Sequence[float], high: Sequence[float], y: float) -> list[Point]:
    """Corners of the level rectangle between (x, z) = low and high, counterclockwise seen from above."""
    (x, z), (X, Z) = low, high
    return [(x, y, z), (x, y, Z), (X, y, Z), (X, y, z)]


def turned(corners: Sequence[Point], degrees: float) -> list[Point]:
    """Corners turned about the upright axis through their centre, counterclockwise seen from above."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    x = np.asarray(corners, dtype=float)
    centre = x.mean(axis=0)
    rotation = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
    return [_point(each) for each in centre + (x - centre) @ rotation.T]


def _point(x: Array) -> Point:
    return float(x[0]), float(x[1]), float(x[2])


def raised(corners: Sequence[Point], by: float) -> list[Point]:
    """The same corners higher up."""
    return [(x, y + by, z) for x, y, z in corners]


def block(base: Sequence[Point], height: float, material: int) -> list[Facet]:
    """Four sides and a lid on a level base, counterclockwise seen from above: it stands on something."""
    lid = raised(base, height)
    return joined([*sides(base, lid), lid], material)


def box(base: Sequence[Point], height: float, material: int) -> list[Facet]:
    """The same with a bottom."""
    return [*block(base, height, material), *quad(base[::-1], material)]


def walls(width: float = 1.0) -> list[list[Point]]:
    """Corners of a room of height and depth 1, fronts inside: floor, ceiling, left, front (z = 1), right and back."""
    floor = rectangle((0, 0), (width, 1), 0.0)
    ceiling = raised(floor, 1.0)
    return [floor, ceiling[::-1], *(each[::-1] for each in sides(floor, ceiling))]


def joined(quads: Sequence[Sequence[Point]], material: int, emission: Sequence[float] = ()) -> list[Facet]:
    """All quads of one material."""
    return [facet for corners in quads for facet in quad(corners, material, emission)]


def room(material: int, width: float = 1.0, emission: Sequence[float] = ()) -> list[Facet]:
    """A closed room of height and depth 1, front inside."""
    return joined(walls(width), material, emission)


def lamp(low: Sequence[float], high: Sequence[float], y: float, power: float, material: int = 0) -> list[Facet]:
    """A level white lamp between (x, z) = low and high that shines down."""
    return quad(rectangle(low, high, y)[::-1], material, (power,) * 3)
