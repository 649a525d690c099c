"""Flatland scenes, each with the property that makes it matter."""

from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType

from flatland2d.space import PLANE
from restir_ref.transport.materials import Layer, Material
from restir_ref.transport.scene import Facet, Scene, scene

Point = tuple[float, float]


def matte(albedo: float) -> Material:
    """Lambert."""
    return Material([Layer("lambert", (albedo,))])


def mixed(albedo: float, roughness: float, gloss: float) -> Material:
    """A Lambert base and a GGX lobe of the given perceptual roughness."""
    return Material([Layer("lambert", (albedo,), weight=albedo), Layer("ggx", (gloss,), roughness, weight=gloss)])


def chain(points: Sequence[Point], material: int, emission: float = 0.0) -> list[Facet]:
    """Segments along a polyline, front on its left."""
    light = (emission,) if emission else ()
    return [Facet((a, b), material, light) for a, b in zip(points, points[1:], strict=False)]


def block(low: Point, high: Point, material: int) -> list[Facet]:
    """A rectangle, front outside."""
    (x, y), (X, Y) = low, high
    return chain([(x, y), (x, Y), (X, Y), (X, y), (x, y)], material)


def room(material: int) -> list[Facet]:
    """The unit square, front inside."""
    return chain([(0, 0), (1, 0), (1, 1), (0, 1), (0, 0)], material)


def cornell(roughness: float = 0.5, room_gloss: float = 0.2) -> Scene:
    """FS1: a square room, a light below the ceiling, two boxes; Lambert and GGX mixed, no extreme."""
    walls, boxes = mixed(0.5, 0.5, room_gloss), mixed(0.3, roughness, 0.5)
    light = chain([(0.65, 0.995), (0.35, 0.995)], 0, 8.0)
    return scene(
        PLANE,
        [walls, boxes],
        [*room(0), *block((0.15, 0.0), (0.4, 0.5), 1), *block((0.62, 0.0), (0.85, 0.28), 1), *light],
    )


def glossy_cornell() -> Scene:
    """FS2: the same with glossy boxes of roughness .15, alpha .0225: reconnection fails on them."""
    return cornell(roughness=0.15)


def matte_cornell() -> Scene:
    """FS1, all Lambert, for which radiosity is a reference."""
    light = chain([(0.65, 0.995), (0.35, 0.995)], 0, 8.0)
    boxes = [*block((0.15, 0.0), (0.4, 0.5), 1), *block((0.62, 0.0), (0.85, 0.28), 1)]
    return scene(PLANE, [matte(0.6), matte(0.7)], [*room(0), *boxes, *light])


SCENES: Mapping[str, Callable[[], Scene]] = MappingProxyType(
    {"cornell": cornell, "glossy_cornell": glossy_cornell, "matte_cornell": matte_cornell}
)
