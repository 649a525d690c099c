"""Golden vectors of paths in space.

python -m tracer3d.golden             write tracer3d/data/golden_paths.json anew
python -m tracer3d.golden FILE        write it somewhere else
python -m tracer3d.golden --check     is the file that ships with the package what would be written?
"""

import sys
from collections.abc import Sequence
from pathlib import Path

from restir_ref.transport.materials import Layer, Material
from restir_ref.transport.paths import Connectability
from restir_ref.transport.proofs.golden.make import main
from restir_ref.transport.proofs.golden.sketch import Sketch
from restir_ref.transport.scene import Ball, Facet
from tracer3d.space import SOLID

SHIPPED = Path(__file__).parent / "data" / "golden_paths.json"

WHITE = Material([Layer("lambert", (0.75, 0.75, 0.75))])
RED = Material([Layer("lambert", (0.625, 0.125, 0.125))])
MIXED = Material(
    [Layer("lambert", (0.125, 0.5, 0.25), weight=0.5), Layer("ggx", (0.375, 0.375, 0.375), 0.375, weight=0.25)]
)
SHINY = Material(
    [Layer("lambert", (0.25, 0.25, 0.25), weight=0.5), Layer("ggx", (0.75, 0.625, 0.5), 0.125, weight=1.0)]
)
MIRROR = Material([Layer("mirror", (0.875, 0.875, 0.875))])

Point = tuple[float, float, float]


def quad(corners: Sequence[Point], material: int, emission: Sequence[float] = ()) -> list[Facet]:
    """Two triangles; the front is where the corners run counterclockwise."""
    a, b, c, d = corners
    return [Facet([a, b, c], material, emission), Facet([a, c, d], material, emission)]


LOW: Sequence[Point] = [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 1.0, 0.0), (0.0, 1.0, 0.0)]
HIGH: Sequence[Point] = [(0.0625, 0.0625, 1.0), (0.9375, 0.0625, 1.0), (0.9375, 0.9375, 1.0), (0.0625, 0.9375, 1.0)]
"""Walls lean, for the frame of a vertical one depends on the sign of its n_z = 0."""


def wall(k: int, material: int) -> list[Facet]:
    """The wall between corners k and k + 1, front inside."""
    a, b = k, (k + 1) % 4
    return quad([LOW[b], LOW[a], HIGH[a], HIGH[b]], material)


def room(left: int) -> list[Facet]:
    """A room, open nowhere; its left wall of another material."""
    return [*quad(LOW, 0), *quad(HIGH[::-1], 0), *wall(0, 0), *wall(1, 1), *wall(2, 0), *wall(3, left)]


LAMPS = [
    *quad(
        [(0.25, 0.375, 0.9375), (0.25, 0.75, 0.9375), (0.625, 0.75, 0.9375), (0.625, 0.375, 0.9375)], 0, (4.0, 3.0, 2.0)
    ),
    Facet([(0.125, 0.875, 0.5), (0.25, 0.9375, 0.5), (0.1875, 0.9375, 0.75)], 0, (2.0, 2.0, 8.0)),
]
SCREEN = [Facet([(0.5, 0.5, 0.25), (0.75, 0.5, 0.375), (0.625, 0.75, 0.5)], 1)]
EYES = [((0.5, 0.125, 0.5), (0.25 + k % 3 / 8, 0.5 + k // 3 / 8, 0.0)) for k in range(6)]

SKETCHES = (
    Sketch(
        "matte",
        "a room with two lamps and a screen; vertices connect from a quarter of the room on, and one pixel sees a lamp",
        [WHITE, RED, WHITE],
        room(2) + LAMPS + SCREEN,
        [*EYES[:5], ((0.5, 0.125, 0.5), (0.375, 0.5, 0.9375))],
        rule=Connectability(0.1875, 0.25),
    ),
    Sketch(
        "glossy",
        "the same room with two lobes at a wall and the screen, and a wall too shiny to be connected to",
        [WHITE, MIXED, SHINY],
        room(2) + LAMPS + SCREEN,
        EYES,
    ),
    Sketch(
        "mirror ball",
        "a room with a mirroring sphere, behind which paths are replayed",
        [WHITE, MIXED, MIRROR],
        room(0) + LAMPS,
        [((0.5, 0.125, 0.5), (0.4375 + k / 32, 0.625, 0.25)) for k in range(6)],
        [Ball((0.5, 0.625, 0.25), 0.1875, 2)],
        depth=4,
    ),
    Sketch(
        "open",
        "the glossy room without its right wall, so that paths leave it",
        [WHITE, MIXED, SHINY],
        [*quad(LOW, 0), *quad(HIGH[::-1], 0), *wall(0, 0), *wall(2, 0), *wall(3, 2), *LAMPS, *SCREEN],
        EYES,
    ),
)

if __name__ == "__main__":
    sys.exit(main(SKETCHES, SOLID, SHIPPED))
