"""Undersampled light becomes splotches: reuse spreads the few samples that found it.  [GRIS 10.1]

A small mirror throws the light of a small window onto the wall that is looked at.  Errors of path tracing are
independent from pixel to pixel; with reuse they are alike over as many pixels as share samples.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims import criteria
from figures.claims.figure import Arrays, Claim, Conditions, Figure, Setup
from figures.experiments import realtime
from figures.experiments.references import reference
from figures.report import style
from restir_ref.metrics import neighbour_correlation

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Picture

SCENE, REACH = "distant_caustic", 48
REUSED = ("hybrid", "reconnection")
PT = "path tracing"


def chunks(preset: Any) -> Sequence[dict[str, str]]:
    """One per shift, and path tracing."""
    return [{"method": method} for method in (*REUSED, PT)]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """Images and rays; of a still camera's chain the first and the last frame, (2, replicas, n)."""
    if chunk["method"] == PT:
        return realtime.trees(SCENE, preset["trees"], rng)
    found = realtime.still(realtime.METHODS[chunk["method"]], SCENE, preset["replicas"], rng)
    return {"images": found["images"][[0, -1]], "rays": found["rays"]}


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """Correlations of relative errors over 1 .. REACH pixels, and six images of each, by name."""
    truth = reference(SCENE).mean
    *reused, trees = results
    images = {PT: realtime.at_equal_rays(trees, float(reused[0]["rays"]))}
    for method, part in zip(REUSED, reused, strict=True):
        images |= {f"{method}, frame 1": part["images"][0], method: part["images"][1]}
    arrays = {"reference": truth}
    for name, each in images.items():
        correlation = neighbour_correlation(each / truth - 1, REACH)
        arrays |= {f"{name}.correlation": correlation, f"{name}.images": each[:6]}
    return arrays


def check(a: Arrays) -> list[Claim]:
    """Next pixels' errors are alike with reuse, and not without."""
    claims = [
        Claim(
            "GRIS-C16", criteria.above(a[f"{method}.correlation"][:3].min(), 0.3), f"{method}: least at 1 to 3 pixels"
        )
        for method in REUSED
    ]
    independent = criteria.below(np.abs(a[f"{PT}.correlation"][:3]).max(), 0.05)
    return [*claims, Claim("GRIS-C16", independent, f"{PT}: largest at 1 to 3 pixels, absolute")]


def draw(a: Arrays) -> "Picture":
    """Images of several replicas, and correlations over distance."""
    picture, axes = style.panels(1, 3, width=4.0, height=3.6)
    _rows(axes[0, 0], a, PT, f"{PT}, equal rays")
    _rows(axes[0, 1], a, "hybrid", f"ReSTIR PT, frame {realtime.FRAMES}")
    curves, distance = axes[0, 2], np.arange(1, REACH + 1)
    for name, label in NAMES.items():
        curves.plot(
            distance,
            a[f"{name}.correlation"],
            **style.look(label.partition(",")[0], **LOOKS.get(name, {}), label=label),
        )
    for level, what, ls in ((0.3, "alike: above", (0, (1, 1))), (0.05, "independent: below", (0, (6, 1)))):
        curves.axhline(level, color=style.GREY, lw=1, ls=ls, marker="", label=f"{what} {level}")
    curves.set(
        xlabel="distance (pixels)", ylabel="correlation of errors", title="How alike the errors are", ylim=(-0.1, 1)
    )
    style.below(curves)
    return picture


NAMES = {
    PT: PT,
    "hybrid, frame 1": "hybrid, frame 1",
    "hybrid": f"hybrid, frame {realtime.FRAMES}",
    "reconnection": f"reconnection, frame {realtime.FRAMES}",
}


LOOKS = {"hybrid, frame 1": {"marker": "v", "ls": ":"}}


def _rows(axis: "Axes", a: Arrays, name: str, title: str) -> None:
    """Six replicas below the reference."""
    rows = [a["reference"], *a[f"{name}.images"]]
    names = ["reference", *(f"run {k}" for k in range(1, len(rows)))]
    style.strips(axis, rows, names, 2 * a["reference"].max(), len(rows[0]))
    axis.set(xlabel="pixel of the inset", title=title)


FIGURE = Figure(
    id="GRIS-C16",
    title="Undersampled light becomes splotches",
    world="flatland2d",
    source="[GRIS 10.1]",
    claims=("GRIS-C16",),
    conditions=(
        Conditions(
            ("GRIS-C16",),
            "[GRIS 10.1], which names no loop; screen-space reuse, sharp caustics",
            Setup("real time", "still", "all", "light that few samples find"),
            Setup("real time", "still", "all", "window mirrored by a small segment (FS9); first and twentieth frame"),
        ),
    ),
    arm="method",
    presets={"quick": {"replicas": 64, "trees": 1280}, "paper": {"replicas": 256, "trees": 5120}},
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)
