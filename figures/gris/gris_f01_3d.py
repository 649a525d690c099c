"""GRIS Fig. 1 in space: a frame of a moving camera by path tracing, ReSTIR GI and ReSTIR PT, with glossy boxes.

Twenty frames with one path tree per pixel, and the last one judged: in an inset of two boxes that mirror each other,
and in five crops of the film that nobody chose.  As in flatland, all renderers add the same direct light by ReSTIR DI,
and path tracing gets as many trees as cost at least the rays of one frame of ours.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims import criteria
from figures.claims.figure import Arrays, Claim, Conditions, Figure, Setup
from figures.experiments import arriving, indirect, realtime, solid
from figures.gris import gris_f01
from figures.gris.gris_f01 import DIRECT, GI, NAMES, PT, TRUTH, judged, part_of
from figures.report import style
from restir_ref.batch import Array
from restir_ref.metrics import SMALL, mape

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Picture

BOX, ROOM = "CB3-glossy, box", "CB3-glossy"
VIEWS = (BOX, ROOM)
METHODS = ("hybrid", GI, PT)


def chunks(preset: Any) -> Sequence[dict[str, str]]:
    """One per view of the preset and renderer; direct light of every view, and its truth."""
    compared = [{"scene": view, "method": method} for view in preset["views"] for method in METHODS]
    return compared + [{"scene": view, "light": light} for view in preset["views"] for light in (DIRECT, TRUTH)]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """Indirect light of one renderer, (count, n), and its rays per pixel; or direct light, or its truth."""
    scene = chunk["scene"]
    last = arriving.seen(scene, preset["wide"])
    if chunk.get("light") == TRUTH:
        return arriving.direct_truth(scene, last, rng)
    if chunk.get("light") == DIRECT:
        return arriving.direct(scene, last, preset["replicas"], rng)
    if chunk["method"] == PT:
        return arriving.trees(scene, last, preset[PT], rng)
    return arriving.last_frame(indirect.METHODS[chunk["method"]], scene, last, preset["replicas"], rng)


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """MAPE (replicas,), image means and one image per renderer, and rays, by "view.renderer.name"."""
    found = {tuple(chunk.values()): part for chunk, part in zip(chunks(preset), results, strict=True)}
    arrays: Arrays = {}
    for view in preset["views"]:
        expected = arriving.truth(view, preset["wide"], found[view, TRUTH]["images"])
        cost = float(found[view, "hybrid"]["rays"])
        arrays |= {f"{view}.reference": expected}
        arrays |= {f"{view}.{method}.rays": found[view, method]["rays"] for method in METHODS}
        for method in METHODS:
            part = found[view, method]
            rest = realtime.at_equal_rays(part, cost) if method == PT else part["images"]
            whole = np.add(*realtime.paired(rest, found[view, DIRECT]["images"]))
            arrays |= {
                f"{view}.{method}.error": mape(whole, expected),
                f"{view}.{method}.mean": whole.mean(axis=-1) / expected.mean(),
                f"{view}.{method}.image": whole[0],
                f"{view}.{method}.crops": by_crop(whole, expected, crops(view)),
            }
    return arrays


def crops(view: str) -> int:
    """How many crops make an image of the view."""
    return 1 if view == BOX else solid.COUNT


def by_crop(images: Array, truth: Array, count: int) -> Array:
    """The part of each crop in MAPE, times their number, (replicas, count)."""
    error = abs(images - truth) / (SMALL * truth.mean() + truth)
    return np.asarray(error.reshape(len(images), count, -1).mean(axis=-1))


def check(a: Arrays) -> list[Claim]:
    """Against path tracing in both views; against ReSTIR GI where boxes mirror, and where they only throw light."""
    return [
        compared(a, BOX, PT, 0.76),
        replace(compared(a, BOX, GI, 1.0), caveat=EXCEPT),
        compared(a, ROOM, PT, 0.76),
        thrown(a),
        Claim("GRIS-F01", criteria.reported(prices(a)), f"{BOX}: rays per pixel"),
    ]


def compared(a: Arrays, view: str, other: str, limit: float) -> Claim:
    """As in flatland, if the preset renders the view."""
    if f"{view}.reference" in a:
        return judged(a, view, other, limit)
    return Claim("GRIS-F01", None, part_of(view, other), reason=LATER)


def thrown(a: Arrays) -> Claim:
    """Against ReSTIR GI in crops that nobody chose; nothing is refuted where hardly any glossy surface is seen."""
    part = part_of(ROOM, GI)
    if f"{ROOM}.reference" not in a:
        return Claim("GRIS-F01", None, part, reason=LATER)
    ours, its = (a[f"{ROOM}.{method}.crops"].mean(axis=0) for method in ("hybrid", GI))
    each = ", ".join(f"{ratio:.2f}" for ratio in ours / its)
    below = criteria.ratio_below(*gris_f01.pair(a, ROOM, GI), 1)
    return Claim("GRIS-F01", below, part, reason=f"Crop by crop {each}. {THROWN}{gris_f01.bias(a, ROOM)}")


EXCEPT = "Not where glossy boxes only throw light onto rough walls: there ReSTIR GI has the lower error (below)."
THROWN = (
    "The opposite holds. Four of these crops see rough surfaces only; the fourth one sees a face of a glossy box, of "
    "whose light 2% leaves by the glossy lobe (GRIS-F06-3D), and there both are alike. The difference is that of walls "
    "onto which the boxes throw light: such paths replay, and ReSTIR GI reconnects them, as in FS9 [GRIS 9.2]. "
)
LATER = "One view fits the time of the quick preset; the paper preset judges the other."


def prices(a: Arrays) -> str:
    """Rays per pixel of every renderer."""
    each = {method: float(a[f"{BOX}.{method}.rays"]) for method in METHODS}
    return f"ReSTIR PT {each['hybrid']:.1f}, ReSTIR GI {each[GI]:.1f}, a path tree {each[PT]:.1f}"


def draw(a: Arrays) -> "Picture":
    """One frame of every renderer, view by view, and MAPE."""
    views = [view for view in VIEWS if f"{view}.reference" in a]
    picture, axes = style.panels(1, len(views) + 1, width=4.1, height=4.2)
    for axis, view in zip(axes[0], views, strict=False):
        images = {"reference": a[f"{view}.reference"]}
        images |= {NAMES[method].replace(", ", ",\n"): a[f"{view}.{method}.image"] for method in (PT, GI, "hybrid")}
        wide = int(np.sqrt(len(images["reference"]) // crops(view)))
        style.crops(axis, images, side=wide, title=f"{view}, frame {realtime.FRAMES}")
    _bars(axes[0, -1], a, views)
    return picture


def _bars(axis: "Axes", a: Arrays, views: Sequence[str]) -> None:
    for k, method in enumerate((PT, GI, "hybrid")):
        errors = [a[f"{view}.{method}.error"] for view in views]
        spread = [1.96 * e.std(ddof=1) / np.sqrt(len(e)) for e in errors]
        name = "ReSTIR PT" if method == "hybrid" else method
        look = {"yerr": spread, "error_kw": {"lw": 0.8}, **style.bar(name, label=NAMES[method])}
        axis.bar([i + 0.27 * (k - 1) for i in range(len(views))], [e.mean() for e in errors], 0.25, **look)
    axis.set_xticks(range(len(views)), [view.replace(", ", ",\n") for view in views])
    axis.grid(visible=False, axis="x")
    axis.set(ylabel="MAPE", title="Error of that frame (bars: 95%)")
    style.below(axis, ncols=1)


FIGURE = Figure(
    id="GRIS-F01-3D",
    title="Path tracing, ReSTIR GI and ReSTIR PT in real time, in space",
    world="tracer3d",
    source="[GRIS Fig. 1; 8.3, 9.3]",
    claims=("GRIS-F01",),
    conditions=(
        Conditions(
            ("GRIS-F01",),
            "[GRIS Fig. 1; 9.3]",
            Setup("real time", "moving", "direct by ReSTIR DI", "whole images of two large glossy scenes, equal time"),
            Setup("real time", "moving", "direct by ReSTIR DI", "CB3-glossy, an inset and five crops, equal rays"),
        ),
    ),
    arm="method",
    presets={
        "quick": {"views": [BOX], "wide": 20, "replicas": 8, PT: 96},
        "paper": {"views": [BOX, ROOM], "wide": 36, "replicas": 32, PT: 384},
    },
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)
