"""Scenes in space by name, each with the property that makes it matter.

Roughness is perceptual (alpha = roughness^2); lengths are in units of a room's height.  x is to the
right, y up, z towards the viewer.  All light has three channels: red, green and blue.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from restir_ref.guards import whole
from restir_ref.transport.materials import Layer, Material
from restir_ref.transport.scene import Ball, Facet, Scene, scene
from tracer3d.names import known
from tracer3d.sensors import FILM, UP, Pinhole, Point, check_view
from tracer3d.shapes import block, box, joined, lamp, quad, rectangle, room, turned, walls
from tracer3d.space import SOLID

INSET = 64
"""Columns and rows of the standard inset."""


PACE = 2.5, 0.5
"""The usual pace of a moving camera, pixels of the film."""


@dataclass(frozen=True, eq=False)
class Setting:
    """A scene with the place to look from, and the inset that shows why it matters.

    crop  column and row of the film at which the inset begins;  half  tangent of half the film's field of view
    pace  pixels of the film, to the right and up, by which a moving camera slides from frame to frame
    Raises ValueError for a depth that is no whole number >= 1, and for an eye in a solid or one that sees nothing.

    >>> from tracer3d import setting
    >>> room = setting("cornell")
    >>> room.pinhole(16, 8).n, room.view(32, 18).shape
    (128, (18, 32))
    """

    scene: Scene
    eye: Point
    towards: Point
    crop: tuple[int, int]
    depth: int = 4
    half: float = 0.8
    up: Point = UP
    pace: tuple[float, float] = PACE

    def __post_init__(self) -> None:
        whole(self.depth, 1, "the path depth", "It counts scattering vertices; 1 is direct light.")
        check_view(self.scene, self.view(32, 18))

    def pinhole(self, width: int = INSET, height: int = INSET, corner: tuple[int, int] | None = None) -> Pinhole:
        """width x height pixels of the virtual film, from column and row `corner` on; the inset unless told otherwise.

        Raises ValueError for a crop off the film.
        """
        left, top = self.crop if corner is None else corner
        return Pinhole(self.eye, self.towards, width, height, self.half, left, top, up=self.up)

    def view(self, width: int = INSET, height: int = INSET) -> Pinhole:
        """A coarse film of its own, width x height pixels, as high as the virtual one and as wide as they make it."""
        half = self.half * FILM[1] / FILM[0] * width / height
        return Pinhole(self.eye, self.towards, width, height, half, film=(width, height), up=self.up)

    def at(self, frame: float) -> "Setting":
        """The setting seen by a moving camera: it slides by its pace per frame, measured where the target is."""
        _, right, up = self.pinhole().axes()
        pixel = 2 * self.half / FILM[0] * np.linalg.norm(np.subtract(self.towards, self.eye))
        x, y, z = (frame * pixel * (self.pace[0] * right + self.pace[1] * up))[:, 0].tolist()
        eye, towards = ((p[0] + x, p[1] + y, p[2] + z) for p in (self.eye, self.towards))
        return replace(self, eye=eye, towards=towards)


# ---------------------------------------------------------------- materials


def grey(albedo: float) -> tuple[float, float, float]:
    """The same in all channels."""
    return albedo, albedo, albedo


def matte(colour: Sequence[float]) -> Material:
    """Lambert."""
    return Material([Layer("lambert", colour)])


def mixed(colour: Sequence[float], roughness: float, gloss: float) -> Material:
    """A Lambert base and a grey GGX lobe, chosen by their mean colours."""
    base = Layer("lambert", colour, weight=float(np.mean(colour)))
    return Material([base, Layer("ggx", grey(gloss), roughness, weight=gloss)])


WHITE, RED, GREEN = grey(0.5), (0.5, 0.08, 0.06), (0.1, 0.4, 0.09)

# ---------------------------------------------------------------- the Cornell box


def cornell_box(materials: Sequence[Material]) -> Setting:
    """A room without front wall, seen from outside, with a lamp below its ceiling and two turned boxes.

    Materials of the white walls, the red one on the left, the green one on the right, and the boxes.  32 triangles.
    """
    floor, ceiling, left, _, right, back = walls()
    tall = block(turned(rectangle((0.19, 0.22), (0.49, 0.52), 0.0), 17), 0.6, 3)
    low = block(turned(rectangle((0.51, 0.55), (0.81, 0.85), 0.0), -17), 0.3, 3)
    shell = [*joined([floor, ceiling, back], 0), *quad(left, 1), *quad(right, 2)]
    facets = [*shell, *tall, *low, *lamp((0.38, 0.4), (0.62, 0.6), 0.995, 12.0)]
    return Setting(scene(SOLID, materials, facets), (0.5, 0.5, 2.4), (0.5, 0.5, 0.0), CORNELL_INSET, half=0.64)


CORNELL_INSET = 928, 668
"""The inset with an upright edge of the low box, the tall one behind it, and the floor before both."""


def cornell(roughness: float = 0.5) -> Setting:
    """CB3: Lambert and GGX mixed, no extreme."""
    shell = [mixed(colour, 0.5, 0.2) for colour in (WHITE, RED, GREEN)]
    return cornell_box([*shell, mixed(grey(0.3), roughness, 0.5)])


def glossy_cornell() -> Setting:
    """CB3-glossy: the same with glossy boxes, roughness .15: reconnection fails on them."""
    return cornell(roughness=0.15)


def matte_cornell() -> Setting:
    """CB3 all Lambert."""
    return cornell_box([matte(WHITE), matte(RED), matte(GREEN), matte(grey(0.6))])


# ---------------------------------------------------------------- closed rooms


LAMP = lamp((0.35, 0.35), (0.65, 0.65), 0.995, 8.0)


def two_rooms(gap: float = 0.06) -> Scene:
    """Two rooms joined by a door that stands ajar: an upright slit of the given width, .9 high; the lamp is beyond it.

    Raises ValueError for a gap that is not between 0 and .5.
    """
    if not 0 < gap < 0.5:
        raise ValueError(f"the gap of the door must be in (0, 0.5), but is {gap}.")
    parts = [((0.0, 0.0), (1.0, 0.5)), ((0.0, 0.5 + gap), (1.0, 1.0)), ((0.9, 0.5), (1.0, 0.5 + gap))]
    wall = [[(1.0, y, z), (1.0, y, Z), (1.0, Y, Z), (1.0, Y, z)] for (y, z), (Y, Z) in parts]
    facets = [*room(0, 2.0), *joined(wall, 0), *lamp((1.5, 0.3), (1.9, 0.7), 0.995, 30.0)]
    return scene(SOLID, [matte(grey(0.75))], facets)


def ajar(gap: float = 0.06) -> Setting:
    """Ajar3: two rooms joined by a slit, the light in the other one: rare, valuable paths."""
    return Setting(two_rooms(gap), (0.08, 0.6, 0.92), (0.9, 0.3, 0.3), (1110, 830))


def ajar_ceiling() -> Setting:
    """Ajar3 from below: light through the slit fans out over the ceiling."""
    return Setting(two_rooms(), (0.5, 0.25, 0.5), (0.6, 1.0, 0.5), (936, 516), up=(0.0, 0.0, 1.0))


def checker() -> Setting:
    """Checker3: a floor of light and dark squares with a step, under smooth light: sparse gradients."""
    step, n = 0.1, 8
    tiles = [
        facet
        for i in range(n)
        for j in range(n)
        for facet in quad(rectangle((i / n, j / n), ((i + 1) / n, (j + 1) / n), step * (i >= n // 2)), (i + j) % 2)
    ]
    riser = quad([(0.5, 0.0, 0.0), (0.5, 0.0, 1.0), (0.5, step, 1.0), (0.5, step, 0.0)], 2)
    facets = [*tiles, *riser, *joined(walls()[1:], 2), *lamp((0.1, 0.1), (0.9, 0.9), 0.99, 3.0)]
    materials = [matte(grey(0.8)), matte(grey(0.2)), matte(grey(0.5))]
    return Setting(scene(SOLID, materials, facets), (0.4, 0.8, 0.85), (0.5, 0.0, 0.45), (928, 508))


def crease() -> Setting:
    """Crease3: where floor and wall meet at a right angle: short connections, the geometry term's singularity."""
    facets = [*room(0), *LAMP]
    return Setting(scene(SOLID, [matte(grey(0.7))], facets), (0.6, 0.4, 0.8), (0.0, 0.0, 0.5), (928, 508))


FURNACE_ALBEDO = 0.5


def furnace() -> Setting:
    """Furnace3: closed and uniform; L = L_e / (1 - albedo) everywhere, here cut off at the depth."""
    facets = room(0, emission=grey(1.0))
    inside = scene(SOLID, [matte(grey(FURNACE_ALBEDO))], facets)
    return Setting(inside, (0.4, 0.6, 0.8), (0.5, 0.2, 0.0), (928, 508), depth=8)


def glass_ball() -> Setting:
    """GlassBall3: a ball of glass that hangs low over the floor: a contact caustic."""
    glass = [Layer("glass reflection", grey(1.0), 0.0), Layer("glass transmission", grey(1.0), 0.0)]
    facets = [*room(0), *lamp((0.44, 0.44), (0.56, 0.56), 0.99, 40.0)]
    inside = scene(SOLID, [matte(grey(0.6)), Material(glass, eta=1.5)], facets, [Ball((0.5, 0.25, 0.5), 0.14, 1)])
    return Setting(inside, (0.5, 0.45, 0.95), (0.5, 0.1, 0.4), (928, 774), depth=5)


def distant_caustic() -> Setting:
    """Window3: a window pane across the room mirrors a lamp, which stands before it, onto a small ball in view.

    Pixels of a ball look to all sides: one direction, replayed from another pixel, leaves the lamp's image on the pane.
    """
    pane = [(1.45, 0.4, 0.25), (1.45, 0.4, 0.75), (1.45, 0.9, 0.75), (1.45, 0.9, 0.25)]
    light = [(1.2, 0.78, 0.43), (1.2, 0.92, 0.43), (1.2, 0.92, 0.57), (1.2, 0.78, 0.57)]
    facets = [*joined(walls(1.5), 0), *quad(pane, 2), *quad(light, 0, grey(40.0))]
    materials = [matte(grey(0.2)), matte(grey(0.6)), Material([Layer("ggx", grey(0.95), 0.12)])]
    inside = scene(SOLID, materials, facets, [Ball((0.3, 0.5, 0.5), 0.07, 1)])
    return Setting(inside, (0.9, 0.5, 0.97), (0.356, 0.5105, 0.5406), (928, 508))


def many_lights() -> Setting:
    """ManyLights3: 64 small lights above slats: direct light is the problem."""
    power = 4 + 36 * np.abs(np.sin(np.arange(64) * 2.4))
    lamps: list[Facet] = []
    for i, p in enumerate(power):
        x, z = (i % 8 + 0.5) / 8, (i // 8 + 0.5) / 8
        lamps += lamp((x - 0.015, z - 0.015), (x + 0.015, z + 0.015), 0.99, float(p))
    slats = [rectangle((x, 0.0), (x + 0.05, 1.0), 0.8) for x in np.linspace(0.05, 0.9, 9)]
    facets = [*room(0), *lamps, *joined(slats, 1), *box(rectangle((0.4, 0.4), (0.6, 0.6), 0.001), 0.2, 1)]
    materials = [matte(grey(0.5)), matte(grey(0.3))]
    return Setting(scene(SOLID, materials, facets), (0.5, 0.6, 0.95), (0.5, 0.1, 0.4), (720, 640))


SCENES: Mapping[str, Callable[[], Setting]] = MappingProxyType(
    {
        each.__name__: each
        for each in (
            cornell,
            glossy_cornell,
            matte_cornell,
            ajar,
            ajar_ceiling,
            checker,
            crease,
            furnace,
            glass_ball,
            distant_caustic,
            many_lights,
        )
    }
)


def setting(name: str) -> Setting:
    """The scene of that name.  Raises ValueError for an unknown one, with the nearest.

    >>> from tracer3d import SCENES, setting
    >>> setting("cornell").depth, "furnace" in SCENES
    (4, True)
    """
    return known(SCENES, name, "scene")()
