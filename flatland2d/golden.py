"""Golden vectors of paths in the plane.

python -m flatland2d.golden             write flatland2d/data/golden_paths.json anew
python -m flatland2d.golden FILE        write it somewhere else
python -m flatland2d.golden --check     is the file that ships with the package what would be written?
"""

import sys
from pathlib import Path

from flatland2d.space import PLANE
from restir_ref.transport.materials import Layer, Material
from restir_ref.transport.paths import Connectability
from restir_ref.transport.proofs.golden.make import main
from restir_ref.transport.proofs.golden.sketch import Sketch
from restir_ref.transport.scene import Ball, Facet

SHIPPED = Path(__file__).parent / "data" / "golden_paths.json"

WHITE = Material([Layer("lambert", (0.75,))])
MIXED = Material([Layer("lambert", (0.5,), weight=0.5), Layer("ggx", (0.375,), 0.375, weight=0.25)])
SHINY = Material([Layer("lambert", (0.25,), weight=0.5), Layer("ggx", (0.75,), 0.125, weight=1.0)])
MIRROR = Material([Layer("mirror", (0.875,))])

ROOM = [
    Facet([(0.0, 0.0), (1.0, 0.0)], 0),
    Facet([(1.0, 0.0), (1.0, 1.0)], 1),
    Facet([(1.0, 1.0), (0.0, 1.0)], 0),
    Facet([(0.0, 1.0), (0.0, 0.0)], 2),
]
LAMPS = [
    Facet([(0.75, 0.9375), (0.375, 0.9375)], 0, (4.0,)),
    Facet([(0.125, 0.75), (0.125, 0.875)], 0, (2.0,)),
]
SCREEN = [Facet([(0.5, 0.5), (0.625, 0.5625)], 1)]
EYES = [((0.5, 0.25), (0.25 + k / 16, 0.0)) for k in range(6)]

SKETCHES = (
    Sketch(
        "matte",
        "a room with two lamps and a screen; vertices connect from a quarter of the room on, and one pixel sees a lamp",
        [WHITE, WHITE, WHITE],
        ROOM + LAMPS + SCREEN,
        [*EYES[:5], ((0.5, 0.25), (0.625, 0.9375))],
        rule=Connectability(0.1875, 0.25),
    ),
    Sketch(
        "glossy",
        "the same room with two lobes at a wall and the screen, and a wall too shiny to be connected to",
        [WHITE, MIXED, SHINY],
        ROOM + LAMPS + SCREEN,
        EYES,
    ),
    Sketch(
        "mirror ball",
        "a room with a mirroring circle, behind which paths are replayed",
        [WHITE, MIXED, MIRROR],
        [*ROOM[:3], Facet(ROOM[3].corners, 0), *LAMPS],
        [((0.5, 0.5), (0.25 + k / 32, 0.25)) for k in range(6)],
        [Ball((0.3125, 0.25), 0.125, 2)],
        depth=4,
    ),
    Sketch(
        "open",
        "the glossy room without its right wall, so that paths leave it",
        [WHITE, MIXED, SHINY],
        [ROOM[0], ROOM[2], ROOM[3], *LAMPS, *SCREEN],
        EYES,
    ),
)

if __name__ == "__main__":
    sys.exit(main(SKETCHES, PLANE, SHIPPED))
