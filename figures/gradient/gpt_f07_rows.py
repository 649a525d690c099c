"""GPT Fig. 7 on rows of flatland: differences at equal rays, of a camera at rest and of one that moves.

The rows are those of the other real-time figures, their inset alone is told.  In motion, history that lies in the
square of a pixel stays where it is (`restir_ref.squares`), and samples that move by a pixel are beside it.
"""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims.figure import Arrays, Claim, Conditions, Figure, Setup
from figures.experiments.following import in_place
from figures.experiments.gradients import (
    ADAPTIVE,
    MAP_FRAMES,
    METHODS,
    averaged,
    gradient_view,
    inner,
    sensors_of,
    spread,
)
from figures.experiments.realtime import FRAMES
from figures.experiments.replicas import told
from figures.report import style
from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.gradient_loop import GRADIENT, View

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture

TRACED = "path tracing"
"""The method that has no history, and needs one frame."""

SCENES = ("occluders", "checker", "rack", "cornell")
SHARES: Mapping[str, int] = MappingProxyType({"with": 1, "after": 2, "path tracing": 4})
"""Images of each method that are averaged; errors are multiplied by their rays."""


def last_views(scene: str, asked: Counter[str], frames: int) -> list[View]:
    """The last frames of a camera that moves, each after the one before."""
    sensors = sensors_of(f"{scene} row")[-frames:]
    pairs = zip(sensors, [sensors[0], *sensors], strict=False)
    return [gradient_view(scene, each, asked, GRADIENT, ADAPTIVE) for each in pairs]


def still(views: Sequence[View]) -> list[View]:
    """The last frame of a camera that moves, over and over, seen from where it was before."""
    by = {name: np.zeros_like(group.by) for name, group in views[-1].items()}
    return [{name: replace(group, by=by[name]) for name, group in views[-1].items()}] * min(MAP_FRAMES, len(views))


def kept(views: Sequence[View]) -> list[View]:
    """A moving camera whose history stays where it is."""
    return [in_place(view) for view in views]


CAMERAS: Mapping[str, Callable[[Sequence[View]], Sequence[View]]] = MappingProxyType(
    {"at rest": still, "moving, kept in place": kept, "moving, moved": list}
)


def chunks(preset: Any) -> Sequence[dict[str, str]]:
    """One per row, camera and method."""
    return [{"scene": s, "camera": c, "method": m} for s in SCENES for c in CAMERAS for m in METHODS]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """Differences of the inset, (replicas, n), and rays per pixel."""
    asked, row, method = Counter[str](), f"{chunk['scene']} row", chunk["method"]
    views = CAMERAS[chunk["camera"]](last_views(chunk["scene"], asked, 1 if method == TRACED else preset["frames"]))
    found = METHODS[method](views, asked, preset["replicas"] * SHARES[method], Live(rng))
    return {"dx": inner(row, "dx", found["dx"]), "rays": found["rays"]}


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """Everything by "scene.camera.method.name"."""
    named = zip(chunks(preset), results, strict=True)
    return {
        f"{at['scene']}.{at['camera']}.{at['method']}.{key}": each for at, part in named for key, each in part.items()
    }


def error(a: Arrays, scene: str, camera: str, method: str) -> Array:
    """Variance of dx times rays, of every replica of averaged images; (R,)."""
    at, count = f"{scene}.{camera}.{method}", SHARES[method]
    return spread([averaged(a[f"{at}.dx"], count)]) * float(a[f"{at}.rays"]) * count


def check(a: Arrays) -> list[Claim]:
    """Pair reuse against both others, reported: the claim is about images and judged there."""
    claims = []
    for scene in SCENES:
        for camera in CAMERAS:
            ours, after, traced = (error(a, scene, camera, method) for method in METHODS)
            claims.append(told("GPT-F07", (ours, after), f"{scene}, {camera}, with / after"))
            claims.append(told("GPT-F07", (ours, traced), f"{scene}, {camera}, with / path tracing"))
    return claims


def draw(a: Arrays) -> "Picture":
    """Bars of every method, by scene and camera."""
    picture, axes = style.panels(1, len(SCENES), width=2.9, height=3.0)
    for axis, scene in zip(axes[0], SCENES, strict=True):
        for k, camera in enumerate(CAMERAS):
            for j, method in enumerate(METHODS):
                height = error(a, scene, camera, method).mean()
                axis.bar(k + 0.25 * (j - 1), height, 0.23, **style.bar(method, label=method if k == 0 else "_"))
        axis.set_xticks(
            range(len(CAMERAS)), [camera.removesuffix(" in place").replace(", ", ",\n") for camera in CAMERAS]
        )
        axis.set(yscale="log", title=f"row of {scene}", ylabel="variance of dx x rays (radiance$^2$)")
        heights = [bar.get_height() for bar in axis.patches]
        axis.set_ylim(10 ** np.floor(np.log10(min(heights) / 2)), 10 ** np.ceil(np.log10(max(heights))))
        axis.minorticks_off()
        axis.grid(axis="x", visible=False)
    style.below(axes[0, -1], ncols=3)
    return picture


FIGURE = Figure(
    id="GPT-F07-ROWS",
    title="Differences of rows, at rest and in motion",
    world="flatland2d",
    source="[GPT Fig. 7; 4.3.1, 5.1]",
    claims=("GPT-F07",),
    conditions=(
        Conditions(
            ("GPT-F07",),
            "[GPT Fig. 7; 5]",
            Setup("real time", "moving", "all", "Classroom, Veach-Ajar"),
            Setup("real time", "moving", "all", "insets of rows (FS5, FS6, FS7, FS1); a camera at rest beside"),
        ),
    ),
    arm="method",
    presets={"quick": {"replicas": 2, "frames": 2}, "paper": {"replicas": 64, "frames": FRAMES}},
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)
