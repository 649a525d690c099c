"""Flatland scenes by name, each with the property that makes it matter.

Roughness is perceptual (alpha = roughness^2); lengths are in units of the unit square's side.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from itertools import chain as joined
from itertools import pairwise
from types import MappingProxyType

import numpy as np

from flatland2d.sensors import FluenceMap, Pinhole, check_view
from flatland2d.space import PLANE
from restir_ref.guards import whole
from restir_ref.transport.materials import Layer, Material
from restir_ref.transport.scene import Ball, Facet, Scene, scene

Point = tuple[float, float]

INSET = 128
"""Pixels of the standard inset."""


@dataclass(frozen=True, eq=False)
class Setting:
    """A scene with the place to look from, and the inset that shows why it matters: `crop`, its first film pixel.

    Raises ValueError for a depth that is no whole number >= 1, and for an eye or a map in a solid or out of
    doors; so does `dataclasses.replace`, the way to move an eye.

    >>> from dataclasses import replace
    >>> from flatland2d import setting
    >>> room = setting("ajar")
    >>> replace(room, eye=(0.4, 0.4)).pinhole(64).n, room.fluence(30, 20).shape
    (64, (20, 30))
    """

    scene: Scene
    eye: Point
    towards: Point
    depth: int = 3
    crop: int = 896
    half: float = 0.6
    low: Point = (0.0, 0.0)
    high: Point = (1.0, 1.0)

    def __post_init__(self) -> None:
        whole(self.depth, 1, "the path depth", "It counts scattering vertices; 1 is direct light.")
        check_view(self.scene, Pinhole(self.eye, self.towards, 64, self.half, film=64))
        check_view(self.scene, self.fluence(8, 8))

    def pinhole(self, n: int = INSET, first: int | None = None) -> Pinhole:
        """n pixels of the virtual film, from pixel `first` on; the scene's inset unless told otherwise."""
        return Pinhole(self.eye, self.towards, n, self.half, self.crop if first is None else first)

    def fluence(self, columns: int, rows: int) -> FluenceMap:
        """A map of the whole scene."""
        return FluenceMap(self.low, self.high, columns, rows)


def matte(albedo: float) -> Material:
    """Lambert."""
    return Material([Layer("lambert", (albedo,))])


def mixed(albedo: float, roughness: float, gloss: float) -> Material:
    """A Lambert base and a GGX lobe."""
    return Material([Layer("lambert", (albedo,), weight=albedo), Layer("ggx", (gloss,), roughness, weight=gloss)])


def chain(points: Sequence[Point], material: int, emission: float = 0.0) -> list[Facet]:
    """Segments along a polyline, front on its left."""
    light = (emission,) if emission else ()
    return [Facet((a, b), material, light) for a, b in pairwise(points)]


def block(low: Point, high: Point, material: int) -> list[Facet]:
    """A rectangle, front outside."""
    (x, y), (X, Y) = low, high
    return chain([(x, y), (x, Y), (X, Y), (X, y), (x, y)], material)


def room(material: int, width: float = 1.0, emission: float = 0.0) -> list[Facet]:
    """A rectangle of height 1, front inside."""
    return chain([(0, 0), (width, 0), (width, 1), (0, 1), (0, 0)], material, emission)


def boxes(material: int) -> list[Facet]:
    """The two boxes of the Cornell room, a hair above the floor."""
    return [*block((0.15, 0.001), (0.4, 0.5), material), *block((0.62, 0.001), (0.85, 0.28), material)]


LAMP: list[Point] = [(0.65, 0.995), (0.35, 0.995)]
CORNELL_VIEW = ((0.5, 0.7), (0.45, 0.2))
BOX_EDGE = 960
"""The inset with the floor and a side of the left box."""


def cornell(roughness: float = 0.5) -> Setting:
    """FS1: a square room, a light below the ceiling, two boxes; Lambert and GGX mixed, no extreme."""
    materials = [mixed(0.5, 0.5, 0.2), mixed(0.3, roughness, 0.5)]
    facets = [*room(0), *boxes(1), *chain(LAMP, 0, 8.0)]
    return Setting(scene(PLANE, materials, facets), *CORNELL_VIEW, crop=BOX_EDGE)


def glossy_cornell() -> Setting:
    """FS2: the same with glossy boxes, roughness .15: reconnection fails on them."""
    return cornell(roughness=0.15)


def matte_cornell() -> Setting:
    """FS1 and FS2 all Lambert, for which radiosity is a reference."""
    facets = [*room(0), *boxes(1), *chain(LAMP, 0, 8.0)]
    return Setting(scene(PLANE, [matte(0.6), matte(0.7)], facets), *CORNELL_VIEW, crop=BOX_EDGE)


def ajar(gap: float = 0.06) -> Setting:
    """FS3: two rooms joined by a slit, the light in the other one: rare, valuable paths.

    Raises ValueError for a gap that does not fit between .3 and the ceiling.
    """
    if not 0 < gap < 0.7:
        raise ValueError(f"the gap of the door must be in (0, 0.7), but is {gap}.")
    wall = [*chain([(1, 0), (1, 0.3)], 0), *chain([(1, 0.3 + gap), (1, 1)], 0)]
    facets = [*room(0, 2.0), *wall, *chain([(1.9, 0.995), (1.5, 0.995)], 0, 30.0)]
    return Setting(scene(PLANE, [matte(0.75)], facets), (0.5, 0.7), (0.35, 0.1), high=(2.0, 1.0))


def nearly_closed() -> Setting:
    """FS3 with the door more closed."""
    return ajar(0.02)


def crease() -> Setting:
    """FS4: a wedge of 40 degrees and a gap below furniture: short reconnections, the geometry term's singularity."""
    slope = [(0.0, 0.0), (0.45, 0.45 * float(np.tan(np.radians(40))))]
    facets = [*room(0), *chain(slope, 0), *block((0.6, 0.03), (0.9, 0.3), 0), *chain(LAMP, 0, 8.0)]
    return Setting(scene(PLANE, [matte(0.7)], facets), (0.55, 0.6), (0.45, 0.0), crop=512)


def occluders() -> Setting:
    """FS5: posts at different depths before a lit wall: depth edges, shadow edges, occluded shifts."""
    posts = [block((x, y), (x + 0.03, y + 0.12), 1) for x, y in ((0.35, 0.2), (0.5, 0.45), (0.62, 0.7), (0.75, 0.3))]
    light = chain([(0.6, 0.995), (0.4, 0.995)], 0, 10.0)
    return Setting(
        scene(PLANE, [matte(0.6), matte(0.4)], [*room(0), *joined.from_iterable(posts), *light]),
        (0.03, 0.5),
        (1.0, 0.5),
        crop=384,
    )


def checker() -> Setting:
    """FS6: a floor of light and dark squares under smooth light: sparse gradients."""
    tiles = [f for i in range(16) for f in chain([(i / 16, 0), ((i + 1) / 16, 0)], i % 2)]
    walls = chain([(1, 0), (1, 1), (0, 1), (0, 0)], 2)
    light = chain([(0.9, 0.99), (0.1, 0.99)], 2, 3.0)
    materials = [matte(0.8), matte(0.2), matte(0.5)]
    return Setting(scene(PLANE, materials, [*tiles, *walls, *light]), (0.5, 0.8), (0.5, 0.0))


def rack() -> Setting:
    """FS7: bars lit from both sides: gradients of both signs at one pair."""
    bars = [block((0.15 + 0.1 * i, 0.3), (0.18 + 0.1 * i, 0.6), 1) for i in range(7)]
    lights = [*chain([(0.005, 0.8), (0.005, 0.5)], 0, 8.0), *chain([(0.995, 0.5), (0.995, 0.8)], 0, 8.0)]
    return Setting(
        scene(PLANE, [matte(0.5), matte(0.7)], [*room(0), *joined.from_iterable(bars), *lights]),
        (0.5, 0.95),
        (0.5, 0.0),
        crop=960,
    )


def glass_disc() -> Setting:
    """FS8: a glass disc above the floor: a contact caustic."""
    glass = Material([Layer("glass reflection", (1.0,), 0.0), Layer("glass transmission", (1.0,), 0.0)], eta=1.5)
    facets = [*room(0), *chain([(0.56, 0.99), (0.44, 0.99)], 0, 20.0)]
    balls = [Ball((0.5, 0.25), 0.14, 1)]
    return Setting(scene(PLANE, [matte(0.6), glass], facets, balls), (0.12, 0.45), (0.6, 0.0), depth=5, crop=1072)


def distant_caustic() -> Setting:
    """FS9: a small glossy segment mirrors a small distant window onto the middle of the view."""
    shiny = Material([Layer("ggx", (0.95,), 0.12)])
    mirror = chain([(0.62, 0.0734), (0.50, 0.0866)], 1)
    window = chain([(1.995, 0.60), (1.995, 0.66)], 0, 80.0)
    return Setting(
        scene(PLANE, [matte(0.5), shiny], [*room(0, 2.0), *mirror, *window]), (0.7, 0.6), (0.0, 0.45), high=(2.0, 1.0)
    )


def clear_coat() -> Setting:
    """FS10: a floor of two lobes, a Lambert base under a sharp coat."""
    coated = Material([Layer("lambert", (0.5,), weight=0.6), Layer("ggx", (0.3,), 0.1, weight=0.4)])
    floor, walls = chain([(0, 0), (1, 0)], 1), chain([(1, 0), (1, 1), (0, 1), (0, 0)], 0)
    facets = [*floor, *walls, *block((0.6, 0.15), (0.8, 0.45), 0), *chain(LAMP, 0, 8.0)]
    return Setting(scene(PLANE, [matte(0.6), coated], facets), (0.2, 0.7), (0.55, 0.0), crop=1216)


FURNACE_ALBEDO = 0.5


def furnace() -> Setting:
    """FS14: closed and uniform; L = L_e / (1 - albedo) everywhere, here cut off at the depth."""
    return Setting(scene(PLANE, [matte(FURNACE_ALBEDO)], room(0, emission=1.0)), (0.4, 0.6), (0.5, 0.0), depth=8)


def many_lights() -> Setting:
    """FS15: 64 small lights behind occluders: direct light is the problem."""
    power = 2 + 18 * np.abs(np.sin(np.arange(64) * 2.4))
    lamps = [chain([((i + 0.6) / 64, 0.99), ((i + 0.4) / 64, 0.99)], 0, float(p)) for i, p in enumerate(power)]
    slats = [chain([(x, 0.8), (x + 0.05, 0.8)], 1) for x in np.linspace(0.05, 0.9, 9)]
    facets = [*room(0), *joined.from_iterable(lamps), *joined.from_iterable(slats), *block((0.4, 0.001), (0.6, 0.2), 1)]
    return Setting(scene(PLANE, [matte(0.5), matte(0.3)], facets), (0.5, 0.6), (0.3, 0.0), crop=768)


SCENES: Mapping[str, Callable[[], Setting]] = MappingProxyType(
    {
        each.__name__: each
        for each in (
            cornell,
            glossy_cornell,
            matte_cornell,
            ajar,
            nearly_closed,
            crease,
            occluders,
            checker,
            rack,
            glass_disc,
            distant_caustic,
            clear_coat,
            furnace,
            many_lights,
        )
    }
)


def setting(name: str) -> Setting:
    """The scene of that name.  Raises ValueError for an unknown one, with the nearest.

    >>> from flatland2d import setting
    >>> setting("cornell").depth
    3
    >>> setting("cornel")
    Traceback (most recent call last):
    ...
    ValueError: there is no scene 'cornel': did you mean 'cornell'?
    """
    if name not in SCENES:
        near = get_close_matches(name, SCENES, n=1)
        hint = f"did you mean {near[0]!r}?" if near else f"there are {', '.join(SCENES)}."
        raise ValueError(f"there is no scene {name!r}: {hint}")
    return SCENES[name]()
