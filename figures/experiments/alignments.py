"""Volumes whose grids stand anywhere: how much probes leak depends on how a grid stands to walls.

A replicate is a grid at a random place with rays of its own, so that an interval over replicates is one over grids.
Rooms have walls or furniture of a given size: what matters is that size over the spacing of probes.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cache as once
from functools import partial
from types import MappingProxyType

import numpy as np

from figures.claims.figure import Arrays
from figures.experiments.volumes import (
    Arriving,
    Seen,
    View,
    along_view,
    arriving,
    at_first,
    at_second,
    film,
    leaking,
    off_surface,
    on_floor,
    view,
)
from flatland2d import radiosity
from flatland2d.directions import MAPS
from flatland2d.probe_rooms import couch, probes, sunlit_slabs, wedge_of_slab
from flatland2d.scenes import Setting
from restir_ref.batch import Array
from restir_ref.chance import Chance
from restir_ref.transport.cache.converge import converge
from restir_ref.transport.cache.grid import Grid
from restir_ref.transport.cache.leaks import leaked
from restir_ref.transport.cache.leaving import Cache, Displacement, diffuse_albedo, displacement, telling
from restir_ref.transport.cache.rules import AUGMENTED, ORIGINAL, Rule
from restir_ref.transport.cache.update import Updating
from restir_ref.transport.cache.volume import Volume, unlit
from restir_ref.transport.materials import albedo
from restir_ref.transport.rays import arrive

PANELS = 30
"""Per segment, of the truth: errors of .1 %."""

ANGLE = 30.0
"""Of the wedge, degrees."""


@dataclass(frozen=True)
class Room:
    """A room by its name, and a size in it, in scene units: of a gap, or of a wall."""

    name: str
    size: float = 0.0


ROOMS: Mapping[str, Callable[[float], View]] = MappingProxyType(
    {
        "gap": lambda size: View(couch(size), partial(film, (0.5, 0.1), (0.75, 0.0)), on_floor(0.6, 0.9)),
        "wedge": lambda size: View(
            wedge_of_slab(ANGLE, size), partial(film, (0.55, 0.1), (0.15, 0.0)), on_floor(0.0, 0.45)
        ),
        "sun": lambda size: replace(view("FS11"), setting=sunlit_slabs(size)),
    }
)
"""FS4 with a gap of that size below its furniture; FS4's wedge of 30 degrees and FS11 with slabs of that thickness.

A thickness of 0 is a facet.  All are seen as `volumes` sees FS4 and FS11.
"""


@once
def room(of: Room) -> View:
    """The room."""
    return ROOMS[of.name](of.size)


def shifted(setting: Setting, per_unit: float, u: Array) -> Grid:
    """`probes`, whose outermost ones on the low sides are u (d,) in (0, 1) spacings inside, and not half a one."""
    g = probes(setting, per_unit)
    places = zip(setting.low, u, g.spacing, strict=True)
    return replace(g, origin=tuple(float(low + part * h) for low, part, h in places))


def settled(of: Room, grid: Grid, how: Updating, tolerance: float, chance: Chance) -> Volume:
    """The converged volume of such a grid."""
    s = room(of).setting.scene
    return converge(unlit(s, grid, MAPS), s, how, chance, tolerance=tolerance)


def updating(per_unit: float, rule: Rule = AUGMENTED, attenuation: float = 1.0) -> Updating:
    """Updates look back along their rays."""
    return Updating(telling(along_view(1 / per_unit)), rule, attenuation=attenuation)


def points(of: Room, u: Array) -> Seen:
    """One point on each pixel of the room's film, from places u (n,) in [0, 1) on them."""
    seen_in, n = room(of), len(u)
    x, w, _ = seen_in.sensor(n).ray(np.arange(n), u[None])
    v, r, _ = arrive(seen_in.setting.scene, x, w)
    return Seen(v, r, seen_in.region(v.x))


@once
def panels(of: Room) -> tuple[radiosity.Panels, Array]:
    """The room's panels, and what they send on of light: B less emission."""
    s = room(of).setting.scene
    p = radiosity.cut(s, PANELS)
    F = radiosity.shares(s, p, (p.a + p.b) / 2, p.n) * albedo(s.materials).mean(axis=0)[s.material[p.prim]][:, None]
    return p, np.linalg.solve(np.eye(len(F)) - F, p.emission) - p.emission


def scattered_twice(of: Room, x: Seen) -> Array:
    """Indirect light of first vertices by radiosity, (N,)."""
    p, B = panels(of)
    return radiosity.gather(room(of).setting.scene, p, B, x.v.x, x.v.prim, x.v.n)


def leaking_first(c: Cache, v: Volume, x: Seen) -> Array:
    """The part of `at_first`, (N,), that probes tell that do not see x_1."""
    E = leaked(v, c.scene, x.v.x, x.v.n, displacement(c, x.v, x.r))
    return np.asarray((diffuse_albedo(c.scene.materials, x.v) / 2 * E)[0])


# ---------------------------------------------------------------- queries at x_1 and at x_2

OFF = "secondary, off the surface"
PLAIN = "secondary, not attenuated"
METHODS = ("primary", "secondary", OFF, PLAIN)


def compared(of: Room, per_unit: float, preset: Mapping[str, float], chance: Chance) -> Arrays:
    """Of one grid: indirect light by METHODS and its truth, what of it leaks, and whether it is in the region; (n,)."""
    s, x = room(of).setting.scene, points(of, chance.uniform((int(preset["pixels"]),)))
    rays, grid = arriving(s, x, int(preset["rays"]), chance), shifted(room(of).setting, per_unit, chance.uniform((2,)))
    rules = (updating(per_unit, ORIGINAL), updating(per_unit), updating(per_unit, attenuation=0.0))
    original, augmented, plain = (settled(of, grid, how, preset["tolerance"], chance) for how in rules)
    off, along = off_surface(1 / per_unit), along_view(1 / per_unit)
    first, second = Cache(s, original, off), Cache(s, augmented, along)
    return {
        "inside": x.inside,
        "truth": scattered_twice(of, x),
        "primary": at_first(first, x),
        "secondary": at_second(second, rays, chance),
        OFF: at_second(Cache(s, augmented, off), rays, chance),
        PLAIN: at_second(Cache(s, plain, along), rays, chance),
        "primary leak": leaking_first(first, original, x),
        "secondary leak": leaking(second, augmented, rays),
    }


def excess(told: Array, truth: Array, inside: Array) -> Array:
    """sum max(told - truth, 0) / sum truth over the pixels inside: light that is not there; (R, n) each -> (R,)."""
    return np.asarray((np.maximum(told - truth, 0) * inside).sum(axis=1) / (truth * inside).sum(axis=1))


def error(told: Array, truth: Array, inside: Array | float = 1.0) -> Array:
    """sum |told - truth| / sum truth over the pixels inside; (R, n) each -> (R,)."""
    return np.asarray((abs(told - truth) * inside).sum(axis=1) / (truth * inside).sum(axis=1))


# ---------------------------------------------------------------- displacements


def unmoved(per_unit: float) -> Displacement:
    """Queries at the surface itself."""
    return lambda n, o, r: 0 * o


WAYS: Mapping[str, Callable[[float], Displacement]] = MappingProxyType(
    {"off the surface": off_surface, "along the path": along_view, "not displaced": unmoved}
)
"""Displacements by the spacing: the default, the paper's, and the control."""


def displaced(of: Room, per_unit: float, preset: Mapping[str, float], chance: Chance) -> Arrays:
    """Of one grid, by way: light of x_2 and what of it leaks, its truth (n,), and the share of queries moved through.

    caused (n,)  what is told to queries that were moved through a surface, and leaks
    """
    s, x = room(of).setting.scene, points(of, chance.uniform((int(preset["pixels"]),)))
    rays, grid = arriving(s, x, int(preset["rays"]), chance), shifted(room(of).setting, per_unit, chance.uniform((2,)))
    volume = settled(of, grid, updating(per_unit), preset["tolerance"], chance)
    found: Arrays = {"truth": scattered_twice(of, x)}
    for way, displacing in WAYS.items():
        c = Cache(s, volume, displacing(1 / per_unit))
        moved = through(c, rays)
        found |= {
            f"{way} leak": leaking(c, volume, rays),
            f"{way} caused": told_where(moved, c, volume, rays),
            f"{way} all": at_second(c, rays, chance),
            f"{way} through": np.array(moved.mean()),
        }
    return found


def through(c: Cache, rays: Arriving) -> Array:
    """Whether queries (R N,) are moved through a surface."""
    z = rays.at.z
    return np.asarray(~c.scene.visible(z.x, z.x + displacement(c, z, rays.at.r)))


def told_where(mask: Array, c: Cache, v: Volume, rays: Arriving) -> Array:
    """The part of what leaks, (N,), that masked queries (R N,) are told."""
    return leaking(c, v, replace(rays, at=replace(rays.at, wanted=rays.at.wanted * mask)))
