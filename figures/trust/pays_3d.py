"""When reuse pays, in space: at the edge of a box, rough and glossy; and where it costs, in a corner of the room.

That corner is at one of the points of thirds of the film and in view of the lamp: each of its trees is good, and
neighbours on the other wall see the room otherwise.  As in flatland, by the same code (`experiments.reuse`).  The quick
preset has too few replicas to tell single tiles of the glossy box; the sums over pixels are what it shows.
"""

from collections import Counter
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims.figure import Arrays, Figure
from figures.experiments import reuse, solid
from figures.experiments.views import HYBRID, at_random, view
from figures.trust.pays_2d import check, measured, pictured
from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.transport.restir_pt import PathIntegrals
from tracer3d.sensors import Mosaic

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture

CORNER, PLACE = "CB3, corner", (1268, 708)
"""An inset, and column and row of the film at which it begins."""

SCENES, RADII = ("CB3, box", "CB3-glossy, box", CORNER), (3, 10)
WIDE, SIDE = 24, 6
"""Columns and rows of the insets, and of the squares of pixels whose variances are averaged."""


def chunks(preset: Any) -> Sequence[dict[str, Any]]:
    """One per scene and radius."""
    return [{"scene": scene, "radius": radius} for scene in SCENES for radius in RADII]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """`measured` of an inset."""
    of = seen(chunk["scene"])
    return measured(of, reuse.distinct(of, at_random, chunk["radius"], Live(rng)), preset["replicas"], rng)


def seen(inset: str) -> PathIntegrals:
    """The pixels of an inset."""
    if inset == CORNER:
        return view("CB3", HYBRID, Counter(), Mosaic(solid.SCENES["CB3"]().pinhole(WIDE, WIDE), (PLACE,)))
    return view(inset, HYBRID, Counter(), solid.inset(inset, WIDE))


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """Everything by "scene.radius.name"."""
    named = zip(chunks(preset), results, strict=True)
    return {f"{c['scene']}.{c['radius']}.{name}": array for c, part in named for name, array in part.items()}


def in_squares(pixels: Array) -> Array:
    """Means of squares of SIDE x SIDE pixels."""
    n = WIDE // SIDE
    return np.asarray(pixels.reshape(n, SIDE, n, SIDE).mean(axis=(1, 3)).ravel())


def draw(a: Arrays) -> "Picture":
    """As in flatland."""
    return pictured(a, SCENES, RADII, in_squares)


FIGURE = Figure(
    id="PAYS-3D",
    title="When reuse pays, in space",
    world="tracer3d",
    source="of this project, about [GRIS 8.3, 9.1]",
    claims=(),
    presets={"quick": {"replicas": 6}, "paper": {"replicas": 128}},
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)
