"""GRIS Fig. 14: path reuse in tiles shows their borders, ReSTIR PT reuses as far and shows none.

Offline renderers in the room behind the door, all its light indirect, at equal rays: one frame of ReSTIR PT
with the reconnection shift, and as many frames of path tracing and of path reuse as it costs.  Path reuse
must have no bias either, here, where half a percent takes many frames, and in the box.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from figures import criteria, offline, style
from figures.figure import Arrays, Claim, Conditions, Figure, Setup
from restir_ref.batch import Array
from restir_ref.metrics import correlation, mape, tile_contrast
from restir_ref.transport.path_reuse import TILE

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Picture

SCENE, BOX = "ajar", "cornell"
LABELS = {"path tracing": "path tracing", "path reuse": "path reuse", "reconnection": "ReSTIR PT"}
GROUPS, EPS = 64, 0.005


def chunks(preset: Any) -> Sequence[dict[str, str]]:
    """Every method behind the door, and path reuse in the box."""
    return [*offline.chunks((SCENE,), list(LABELS)), *offline.chunks((BOX,), ("path reuse",))]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """Images and rays."""
    count = preset["box"] if chunk["scene"] == BOX else preset[chunk["method"]]
    return offline.render(offline.METHODS[chunk["method"]], chunk["scene"], count, rng)


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """Images, rays and references."""
    return offline.combine_chunks(chunks(preset), results) | {"eps": np.array(preset["eps"])}


def at_equal_rays(a: Arrays, method: str) -> Array:
    """Means of as many frames as cost no less than one frame of ReSTIR PT, (groups, n)."""
    price = float(a[f"{SCENE}.reconnection.rays"]) / float(a[f"{SCENE}.{method}.rays"])
    return offline.after(a, SCENE, method, int(np.ceil(price)))


def check(a: Arrays) -> list[Claim]:
    """Errors at equal rays, what tiles leave behind, and no bias."""
    truth = a[f"{SCENE}.reference"]
    images = {method: at_equal_rays(a, method) for method in LABELS}
    error = {method: mape(image, truth) for method, image in images.items()}
    tiles = {method: tile_contrast(image - truth, TILE) for method, image in images.items()}
    ours = criteria.ratio_below(*offline.paired(error["reconnection"], error["path reuse"]), 0.6)
    theirs = criteria.ratio_below(*offline.paired(error["path reuse"], error["path tracing"]), 1)
    edges = criteria.above(tiles["path reuse"], 0.2)
    return [
        Claim("GRIS-F14", ours, "MAPE, ReSTIR PT / path reuse", reason=SETTING),
        Claim("GRIS-F14", theirs, "MAPE, path reuse / path tracing"),
        Claim("GRIS-F14", edges, "path reuse: correlation inside minus across borders"),
        Claim("GRIS-F14", criteria.between(tiles["reconnection"], -0.05, 0.05), "ReSTIR PT: the same"),
        Claim("COM-B02", unbiased(a, SCENE, float(a["eps"])), "image behind the door", caveat=caveat(float(a["eps"]))),
        Claim("COM-B02", unbiased(a, BOX, EPS), "image of the box"),
        Claim("COM-B02", edges, "correlation inside tiles minus across borders"),
    ]


SETTING = (
    "Offline at equal rays, in a row of pixels; the paper's renderers are real-time, at equal time, with tiles of "
    "16 pixels and direct light by ReSTIR DI, of which there is none here."
)


def caveat(eps: float) -> str:
    """What is weaker than the claim."""
    return f"A standard error of {eps:.0%} behind the door; the paper preset has .5%." if eps > EPS else ""


def unbiased(a: Arrays, scene: str, eps: float) -> criteria.Outcome:
    """The image's mean over groups of frames of path reuse against the reference."""
    means = a[f"{scene}.path reuse.images"].mean(axis=1)
    groups = means[: len(means) // GROUPS * GROUPS].reshape(GROUPS, -1).mean(axis=1)
    return criteria.unbiased(groups, float(a[f"{scene}.reference"].mean()), eps)


def draw(a: Arrays) -> "Picture":
    """One image of each, next neighbours' error correlation along the row, and errors."""
    picture, axes = style.panels(1, 3, width=4.0, height=3.2)
    images = {method: at_equal_rays(a, method) for method in LABELS}
    draw_images(axes[0, 0], images, a[f"{SCENE}.reference"])
    draw_borders(axes[0, 1], images, a[f"{SCENE}.reference"])
    draw_errors(axes[0, 2], images, a[f"{SCENE}.reference"])
    return picture


def look(k: int) -> dict[str, Any]:
    """Colour and marker of the k-th method."""
    return {"color": style.COLOURS[k], "marker": style.MARKERS[k], "markevery": 1}


def draw_images(axis: "Axes", images: dict[str, Array], truth: Array) -> None:
    """One image of each method as a strip above the reference."""
    rows = [image[0] for image in images.values()]
    place = (0, len(truth), len(rows) + 1, 0)
    shown = axis.imshow([*rows, truth], vmin=0, vmax=2 * truth.max(), aspect="auto", extent=place)
    axis.figure.colorbar(shown, ax=axis, label="radiance", extend="max")
    axis.set_yticks(np.arange(len(rows) + 1) + 0.5, [*LABELS.values(), "reference"])
    axis.set_xticks(range(0, len(truth) + 1, TILE))
    axis.grid(visible=False)
    axis.set(xlabel="pixel (ticks at borders of tiles)", title="One image each, at equal rays")


def draw_borders(axis: "Axes", images: dict[str, Array], truth: Array) -> None:
    """Correlation of the errors of pixels x - 1 and x."""
    for method, image in images.items():
        error = image - truth
        pairs = [float(correlation(error[:, x - 1], error[:, x])) for x in range(1, len(truth))]
        axis.plot(np.arange(1, len(truth)), pairs, label=LABELS[method])
    axis.set_xticks(range(0, len(truth) + 1, TILE))
    axis.set(xlabel="pixel $x$ (ticks at borders of tiles)", ylabel="error correlation of $x - 1$ and $x$")
    axis.set(title="Next neighbours", ylim=(-0.65, 1.05))
    axis.legend(loc="lower left", ncols=2)


def draw_errors(axis: "Axes", images: dict[str, Array], truth: Array) -> None:
    """MAPE with the spread over images."""
    for k, each in enumerate(mape(image, truth) for image in images.values()):
        axis.errorbar(k, each.mean(), each.std(ddof=1), capsize=4, **look(k))
        axis.annotate(f"{each.mean():.3f}", (k, each.mean()), (8, -3), textcoords="offset points")
    axis.set_xticks(range(len(images)), list(LABELS.values()))
    axis.set(ylabel="MAPE of one image, ± its spread", ylim=(0, None), xlim=(-0.4, 2.7), title="Errors at equal rays")


FIGURE = Figure(
    id="GRIS-F14",
    title="Path reuse in tiles and ReSTIR PT",
    world="flatland2d",
    source="[GRIS Fig. 14; 9.3]",
    claims=("GRIS-F14", "COM-B02"),
    conditions=(
        Conditions(
            ("GRIS-F14",),
            "Fig. 14; 9.3",
            Setup("real time", "moving", "direct by ReSTIR DI", "Kitchen, equal time"),
            Setup("real time", "moving", "direct by ReSTIR DI", "the inset of FS3, equal rays"),
        ),
        Conditions(
            ("COM-B02",),
            "9.3",
            Setup("one pass", "still", "all", "tiles of 16 pixels"),
            Setup("one pass", "still", "all", "the insets of FS3 and FS1, tiles of 16 pixels"),
        ),
    ),
    arm="method",
    presets={
        "quick": {"path tracing": 2048, "path reuse": 3328, "reconnection": 256, "box": 256, "eps": 0.01},
        "paper": {"path tracing": 16384, "path reuse": 16384, "reconnection": 2048, "box": 1024, "eps": EPS},
    },
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)
