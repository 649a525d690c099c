"""GRIS Fig. 17 in space: rays to the error of 1024 path trees, by path reuse and by ReSTIR PT with both shifts.

As in flatland, by the same code: offline frames, indirect light.  Views are five crops of the film in three scenes,
and an inset of two glossy boxes that mirror each other.  Behind the measured frames errors go on like T^(-1/2), also
those of path tracing, as a control.
"""

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims import criteria
from figures.claims.figure import Arrays, Claim, Conditions, Figure, Setup
from figures.experiments import arriving, offline
from figures.experiments.references import INDIRECT, reference
from figures.gris.gris_f17 import METHODS, SAME_TIME, SHIFTS, TARGET, curve, in_words, rays_to
from figures.report import style
from restir_ref.batch import Array
from restir_ref.metrics import mape

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Picture

VIEWS = ("CB3", "CB3-glossy, box", "Ajar3", "GlassBall3")
STORED = VIEWS[:2]
"""Views whose indirect light has a reference; of the others, that of all light and direct light's truth say it."""

ONE_MAP = ("Ajar3",)
"""Views in which both shifts are the same map, where all is matt and nothing near: one of them is rendered."""

TRUTH = "truth of direct light"


def chunks(preset: Any) -> Sequence[dict[str, str]]:
    """Every view of the preset and method; and direct light where it is needed."""
    views = preset["views"]
    traced = [{"scene": each, "method": method} for each in views for method in METHODS if not same(each, method)]
    return traced + [{"scene": each, "light": TRUTH} for each in views if each not in STORED]


def same(view: str, method: str) -> bool:
    """Whether hybrid frames stand for those of the method."""
    return view in ONE_MAP and method == SHIFTS[0]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """Independent images (count, n) and rays per pixel of one; or direct light (n,)."""
    scene = chunk["scene"]
    sensor = arriving.seen(scene, preset["wide"])
    if "light" in chunk:
        return arriving.direct_truth(scene, sensor, rng)
    return offline.render(offline.METHODS[chunk["method"]], scene, preset[chunk["method"]], rng, sensor)


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """Rays and MAPE of means over frames, "view.method.curve" (2, T); of TARGET trees, "view.target" (2,)."""
    found = {tuple(chunk.values()): part for chunk, part in zip(chunks(preset), results, strict=True)}
    arrays: Arrays = {}
    for view in preset["views"]:
        images: Arrays = {f"{view}.reference": truth(preset, view, found)}
        for method in METHODS:
            rendered = SHIFTS[1] if same(view, method) else method
            images |= {f"{view}.{method}.{key}": value for key, value in found[view, rendered].items()}
            arrays[f"{view}.{method}.curve"] = np.stack(curve(images, view, method))
        error = mape(offline.traced(images, view, TARGET), images[f"{view}.reference"]).mean()
        arrays[f"{view}.target"] = np.array([TARGET * float(found[view, PT]["rays"]) / offline.UNIT, error])
    return arrays


PT = METHODS[0]


def truth(preset: Any, view: str, found: Mapping[tuple[str, ...], Arrays]) -> Array:
    """Indirect light, (n,)."""
    if view in STORED:
        return arriving.middle(view, reference(view, INDIRECT).mean, preset["wide"])
    return reference(view).mean - found[view, TRUTH]["images"]


# ---------------------------------------------------------------- verdicts


def speedups(a: Arrays, method: str) -> dict[str, float]:
    """Rays of TARGET path trees over those of a method with the same MAPE, by view."""
    found = {}
    for view in (each for each in VIEWS if f"{each}.target" in a):
        cost, error = a[f"{view}.target"]
        found[view] = float(cost) / rays_to(float(error), *a[f"{view}.{method}.curve"])
    return found


def check(a: Arrays) -> list[Claim]:
    """Best speedups, as in flatland, and beside them those of every view."""
    all_of = {method: speedups(a, method) for method in METHODS[1:]}
    itself = in_words(speedups(a, PT))
    return [
        *(claim for method in SHIFTS for claim in fastest(all_of, method)),
        *(
            Claim("GRIS-F17", criteria.reported(in_words(each)), f"{method}: speedup view by view")
            for method, each in all_of.items()
        ),
        Claim("GRIS-F17", criteria.reported(itself), "path tracing, continued: speedup view by view", reason=CONTINUED),
    ]


CONTINUED = (
    "A control. Above 1 the error to be reached holds what T^(-1/2) does not know, noise of the reference and few "
    "bright pixels, and methods whose measured frames end before it look faster by about as much: path reuse in every "
    "view, ReSTIR PT with a glossy box and below glass. The best views of ReSTIR PT are measured."
)


def fastest(all_of: Mapping[str, Mapping[str, float]], method: str) -> Iterator[Claim]:
    """The best speedup of one shift, by itself and over that of path reuse; of all views only."""
    best = {name: max(found, key=found.__getitem__) for name, found in all_of.items()}
    ours, reused = all_of[method][best[method]], all_of[REUSE][best[REUSE]]
    whole = len(all_of[method]) == len(VIEWS)
    alike = " There both shifts are one map." if best[method] in ONE_MAP else ""
    why = f"In {best[method]}; path reuse: {reused:.3g} in {best[REUSE]}.{alike}" if whole else LATER
    for outcome, what in ((criteria.above(ours, 3), TRACED), (criteria.above(ours / reused, 1), OVER_REUSE)):
        yield Claim("GRIS-F17", outcome if whole else None, f"{method}: best speedup {what}", reason=why)


REUSE = METHODS[1]
TRACED, OVER_REUSE = "in rays of path tracing", "over that of path reuse"
LATER = "The best of one view says nothing: the paper preset has them all."


# ---------------------------------------------------------------- picture


def draw(a: Arrays) -> "Picture":
    """MAPE over rays in every view, and speedups."""
    views = [each for each in VIEWS if f"{each}.target" in a]
    columns = (len(views) + 2) // 2 if len(views) > 1 else 2
    rows = -(-(len(views) + 1) // columns)
    picture, axes = style.panels(rows, columns, width=3.4, height=3.0)
    for axis, view in zip(axes.ravel(), views, strict=False):
        for method in METHODS:
            axis.loglog(*a[f"{view}.{method}.curve"], **style.look(method))
        axis.axvline(same_time(a, view), color=style.GREY, lw=1, ls=":", marker="", label=SAME_TIME)
        axis.set(xlabel="rays per pixel", ylabel="MAPE", title=view)
        axis.tick_params(axis="x", which="minor", labelbottom=False)
    picture.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=3)
    _bars(axes.ravel()[len(views)], a, views)
    for axis in axes.ravel()[len(views) + 1 :]:
        axis.set_axis_off()
    return picture


def same_time(a: Arrays, view: str) -> float:
    """Rays of as many path trees as take the time of a frame."""
    return offline.equal_time(1) * float(a[f"{view}.target"][0]) / TARGET


SHORT = {"CB3-glossy, box": "glossy\nbox", "GlassBall3": "Glass-\nBall3"}


def _bars(axis: "Axes", a: Arrays, views: Sequence[str]) -> None:
    for k, method in enumerate(METHODS[1:]):
        axis.bar(np.arange(len(views)) + 0.27 * (k - 1), list(speedups(a, method).values()), 0.25, **style.bar(method))
    axis.axhline(1, color=style.INK, lw=1, ls=":", label="as path tracing")
    axis.set_yscale("log")
    axis.set_xticks(range(len(views)), [SHORT.get(view, view) for view in views])
    axis.set(ylabel="rays of path tracing / rays", title=f"To the MAPE of {TARGET} trees")
    axis.grid(visible=False, axis="x")
    style.below(axis, ncols=2)


FIGURE = Figure(
    id="GRIS-F17-3D",
    title="Offline renderers to equal error, in space",
    world="tracer3d",
    source="[GRIS Fig. 17; 9.3]",
    claims=("GRIS-F17",),
    conditions=(
        Conditions(
            ("GRIS-F17",),
            "Fig. 17; 9.3",
            Setup("offline", "still", "indirect", "production scenes, equal time"),
            Setup("offline", "still", "indirect", "five crops of three scenes and an inset of CB3-glossy, equal rays"),
        ),
    ),
    arm="method",
    presets={
        "quick": {
            "views": ["CB3-glossy, box"],
            "wide": 20,
            "path tracing": 256,
            "path reuse": 32,
            "reconnection": 16,
            "hybrid": 16,
        },
        "paper": {
            "views": list(VIEWS),
            "wide": 36,
            "path tracing": 256,
            "path reuse": 48,
            "reconnection": 16,
            "hybrid": 16,
        },
    },
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)
