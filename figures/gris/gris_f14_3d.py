"""GRIS Fig. 14 in space: path reuse in tiles of 4 x 4 pixels shows their borders, ReSTIR PT shows none.

Rough boxes under a moving camera, at equal rays, as in flatland and by the same code: the last of twenty real-time
frames of ReSTIR PT with the reconnection shift, and as many images of path tracing and of path reuse as cost its rays.
All add the same direct light by ReSTIR DI.  Errors are those of five crops of the film.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims.figure import Arrays, Claim, Conditions, Figure, Setup
from figures.experiments import indirect, offline, realtime, split_light
from figures.experiments.references import reference
from figures.experiments.rendering import means, samples_of_equal_cost
from figures.experiments.solid import SIDE
from figures.experiments.views import SIDE as TILE
from figures.gris.gris_f14 import CORRELATION, LABELS, draw_errors, of_tiles, ranks
from figures.report import style
from restir_ref.batch import Array
from restir_ref.metrics import correlation, mape, tile_contrast

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Picture

SCENE, DIRECT = "CB3", "direct"
PLANE = (-2, -1)
"""Rows and columns of a crop, among the axes of (images, crops, rows, columns)."""


def chunks(preset: Any) -> Sequence[dict[str, str]]:
    """Every method, and direct light."""
    return [*({"scene": SCENE, "method": method} for method in LABELS), {"scene": SCENE, "what": DIRECT}]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """Images (count, n), and rays per pixel of those that are compared."""
    if "what" in chunk:
        return split_light.direct(SCENE, preset[DIRECT], rng)
    method = chunk["method"]
    if method == "reconnection":
        return realtime.moved(indirect.METHODS[method], SCENE, preset[method], rng)
    if method == "path reuse":
        return offline.render(offline.METHODS[method], SCENE, preset[method], rng)
    return split_light.indirect_trees(SCENE, preset[method], rng)


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """Images of every method at equal rays, by its name, direct light included."""
    *parts, direct = results
    found = dict(zip(LABELS, parts, strict=True))
    arrays: Arrays = {"reference": reference(SCENE).mean}
    for method, part in found.items():
        T = samples_of_equal_cost(float(found["reconnection"]["rays"]), float(part["rays"]))
        rest, light = offline.paired(means(part["images"], T), direct["images"])
        arrays |= {method: rest + light, f"{method}.rays": np.array(T * part["rays"])}
    return arrays


def check(a: Arrays) -> list[Claim]:
    """Errors at equal rays, and what tiles leave behind."""
    truth = a["reference"]
    error = {method: mape(a[method], truth) for method in LABELS}
    tiles = {method: tile_contrast(in_plane(ranks(a[method] - truth)), TILE, PLANE) for method in LABELS}
    return of_tiles(error, tiles)


def in_plane(errors: Array) -> Array:
    """Crops as images, (R, crops, rows, columns)."""
    return errors.reshape(len(errors), -1, SIDE, SIDE)


def draw(a: Arrays) -> "Picture":
    """One image of each, next neighbours' error correlation across a crop, and errors."""
    picture, axes = style.panels(1, 3, width=4.0, height=3.6)
    images = {method: a[method] for method in LABELS}
    named = {LABELS[method]: image[0] for method, image in images.items()}
    style.crops(axes[0, 0], {"reference": a["reference"], **named}, title=f"{SCENE}: one image each, equal rays")
    _borders(axes[0, 1], images, a["reference"])
    draw_errors(axes[0, 2], images, a["reference"])
    return picture


def _borders(axis: "Axes", images: dict[str, Array], truth: Array) -> None:
    for method, image in images.items():
        e = in_plane(ranks(image - truth))
        pairs = [float(correlation(e[..., x - 1].ravel(), e[..., x].ravel())) for x in range(1, SIDE)]
        axis.plot(np.arange(1, SIDE), pairs, **style.look(LABELS[method]), markevery=4)
    axis.set_xticks(range(0, SIDE + 1, TILE))
    axis.set(xlabel="column $x$ of a crop (ticks at borders of tiles)", ylabel=CORRELATION, title="Next neighbours")
    axis.set_ylim(-0.25, 1.05)
    style.below(axis, ncols=2)


FIGURE = Figure(
    id="GRIS-F14-3D",
    title="Path reuse in tiles and ReSTIR PT, in space",
    world="tracer3d",
    source="[GRIS Fig. 14; 9.3]",
    claims=("GRIS-F14",),
    conditions=(
        Conditions(
            ("GRIS-F14",),
            "Fig. 14; 9.3",
            Setup("real time", "moving", "direct by ReSTIR DI", "Kitchen, equal time"),
            Setup("real time", "moving", "direct by ReSTIR DI", "CB3, five crops of the film, equal rays"),
        ),
    ),
    arm="method",
    presets={
        "quick": {"path tracing": 64, "path reuse": 16, "reconnection": 8, DIRECT: 8},
        "paper": {"path tracing": 256, "path reuse": 64, "reconnection": 32, DIRECT: 32},
    },
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)
