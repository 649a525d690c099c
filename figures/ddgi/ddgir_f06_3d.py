"""DDGI resampling Fig. 6 in space: the geometry term bounded where a floor meets a wall.

As in flatland, with two small crops of a film, of the crease of Crease3 and of its floor.  G_max has the unit 1 / area:
in a room of height 1 the printed 1 bounds nearly every connection, and the ray that makes up for it has all the noise.
"""

from typing import TYPE_CHECKING

from figures.claims.figure import Arrays, Claim, Figure
from figures.ddgi.ddgir_f06 import CONDITIONS, DISPUTED, chunks, combine, compute, of_fireflies, painted
from figures.experiments.withheld import withheld_where

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture

ROOM = "Crease3"
PRINTED, OURS, NARROW = 1.0, 100.0, 1000.0
"""As printed; and connections shorter than a tenth of a room's height, or a thirtieth."""


NO_FIREFLIES = (
    "DDGIR-F06",
    "in the crease",
    "without a bound the variance of this crop is a hundredth of its mean squared: it holds no fireflies to remove.",
)


def check(a: Arrays) -> list[Claim]:
    """The same ratios."""
    return withheld_where(of_fireflies(a, (PRINTED, OURS, NARROW)), (*DISPUTED, NO_FIREFLIES))


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
            "bounds": [PRINTED, OURS, NARROW],
            "blocks": 1,
            "replicas": 8,
            "groups": 1,
            "frames": 2,
        },
        "paper": {
            "room": ROOM,
            "bounds": [1, 10, 100, 1000],
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
