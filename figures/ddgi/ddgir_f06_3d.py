"""DDGI resampling Fig. 6 in space: the geometry term bounded where a floor meets a wall.

As in flatland, with two small crops of a film: one around the crease of Crease3, half floor and half wall, and one of
its floor.  G_max has the unit 1 / area: 1 / m^2 is 9 in a room of 3 m, and 100 bounds what is nearer than a tenth of
the room's height; as printed, in a room of height 1, it bounds nearly every connection.

The crop is where fireflies can be, chosen by the geometry alone: an earlier one lay beside the crease on the wall, at
nearly equal distances from it, and had none to remove.
"""

from typing import TYPE_CHECKING

from figures.claims.figure import Arrays, Claim, Figure
from figures.ddgi.ddgir_f06 import CONDITIONS, PRINTED, chunks, combine, compute, of_fireflies, painted

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture

ROOM = "Crease3"
METRES, OURS = 9.0, 100.0
"""1 / m^2 in a room of 3 m; and connections shorter than a tenth of a room's height."""


def check(a: Arrays) -> list[Claim]:
    """The same ratios."""
    return of_fireflies(a, (METRES, OURS))


def draw(a: Arrays) -> "Picture":
    """The same panels."""
    return painted(a, "1 / room height²")


FIGURE = Figure(
    id="DDGIR-F06-3D",
    title="The geometry term bounded, where floor and wall meet",
    world="tracer3d",
    source="[DDGIR Fig. 6; 3.5]",
    claims=("DDGIR-F06",),
    conditions=CONDITIONS[:1],
    presets={
        "quick": {
            "room": ROOM,
            "bounds": [PRINTED, METRES, OURS],
            "blocks": 1,
            "replicas": 8,
            "groups": 1,
            "frames": 2,
        },
        "paper": {
            "room": ROOM,
            "bounds": [1, 9, 100, 1000],
            "blocks": 2,
            "replicas": 8,
            "groups": 8,
            "frames": 16,
        },
    },
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
    arm="G_max",
)
