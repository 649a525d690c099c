"""GRIS Figs. 13 and 15 in space: the last of twenty frames of a moving camera, at equal rays.

ReSTIR PT against path tracing in a room with rough boxes, and below a ball of glass, whose caustic only replay follows.
All add the same direct light by ReSTIR DI.  Errors are those of five crops of the film of 1920 x 1080 pixels.
"""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims import criteria
from figures.claims.figure import Arrays, Claim, Conditions, Figure, Setup
from figures.experiments import corners, indirect, realtime, split_light
from figures.experiments.references import reference
from figures.gris.gris_f15 import LEAST
from figures.report import style
from restir_ref.batch import Array
from restir_ref.metrics import mape

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Picture

ROUGH, GLASS = "CB3", "GlassBall3"
PT, DIRECT = "path tracing", "direct by ReSTIR DI"
RENDERED: Mapping[str, tuple[str, ...]] = {
    ROUGH: ("hybrid",),
    GLASS: ("hybrid", "reconnection"),
}


def chunks(preset: Any) -> Sequence[dict[str, str]]:
    """One per scene and renderer of indirect light, path tracing included, and direct light of every scene."""
    compared = [{"scene": scene, "method": each} for scene, methods in RENDERED.items() for each in (*methods, PT)]
    return compared + [{"scene": scene, "light": DIRECT} for scene in RENDERED]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """Images (count, n) of one part, and rays per pixel of those that are compared."""
    scene = chunk["scene"]
    if "light" in chunk:
        return split_light.direct(scene, preset["replicas"], rng)
    if chunk["method"] == PT:
        return split_light.indirect_trees(scene, preset[PT], rng)
    count = preset["replicas"] * (1 + (chunk["method"] in AT_EQUAL_RAYS))  # two frames may be as cheap as one of ours
    return realtime.moved(indirect.METHODS[chunk["method"]], scene, count, rng)


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """MAPE (replicas,), one image and the mean per renderer, and rays, by "scene.renderer.name"."""
    found = {tuple(chunk.values()): part for chunk, part in zip(chunks(preset), results, strict=True)}
    arrays: Arrays = {}
    for scene, methods in RENDERED.items():
        expected, light, price = reference(scene).mean, found[scene, DIRECT]["images"], found[scene, "hybrid"]["rays"]
        arrays |= {f"{scene}.reference": expected, f"{scene}.rays": np.array([price, found[scene, PT]["rays"]])}
        for name in (*methods, PT):
            rest = realtime.at_equal_rays(found[scene, name], float(price)) if name in AT_EQUAL_RAYS else None
            whole = np.add(*realtime.paired(found[scene, name]["images"] if rest is None else rest, light))
            arrays |= {
                f"{scene}.{name}.error": mape(whole, expected),
                f"{scene}.{name}.caustic": caustic(whole, expected),
                f"{scene}.{name}.image": whole[0],
                f"{scene}.{name}.mean": whole.mean(axis=-1) / expected.mean(),
            }
    return arrays


AT_EQUAL_RAYS = (PT, "reconnection")
"""Renderers that get as many images as cost at least the rays of one frame of the hybrid shift."""


def caustic(images: Array, truth: Array) -> Array:
    """relMSE over the pixels more than half as bright as the brightest, (R,): of `gris_f13.errors`."""
    bright = truth > truth.max() / 2
    return np.asarray(corners.relative(images, truth)[:, bright].mean(axis=1))


def check(a: Arrays) -> list[Claim]:
    """Rough boxes against path tracing; the caustic against both others."""
    rough = pair(a, ROUGH, PT)
    less, more = criteria.ratio_below(*rough, 1 - LEAST), criteria.ratio_above(*rough, 1)
    below = {other: pair(a, GLASS, other, "caustic") for other in ("reconnection", PT)}
    return [
        Claim("GRIS-F15", less, f"{ROUGH}: MAPE, ReSTIR PT / path tracing", counter=more),
        *(
            Claim(
                "GRIS-F13t",
                criteria.ratio_below(*below[other], limit),
                f"{GLASS}, caustic pixels, equal rays: relMSE, hybrid / {other}",
                criteria.ratio_above(*below[other], 1),
            )
            for other, limit in (("reconnection", 0.7), (PT, 0.8))
        ),
    ]


def pair(a: Arrays, scene: str, other: str, what: str = "error") -> tuple[Array, Array]:
    """Errors of the hybrid shift and of another renderer, (replicas,) each."""
    return realtime.paired(a[f"{scene}.hybrid.{what}"], a[f"{scene}.{other}.{what}"])


NAMES = {"hybrid": "ReSTIR PT", "reconnection": "reconnection", PT: "path tracing"}


def draw(a: Arrays) -> "Picture":
    """One frame of every renderer, scene by scene, and MAPE of all."""
    picture, axes = style.panels(1, 3, width=4.2, height=3.4)
    for axis, scene in zip(axes.ravel().tolist(), RENDERED, strict=False):
        images = {"reference": a[f"{scene}.reference"]}
        images |= {NAMES[name]: a[f"{scene}.{name}.image"] for name in (*RENDERED[scene], PT)}
        style.crops(axis, images, title=f"{scene}, frame {realtime.FRAMES} of a moving camera")
    _bars(axes[0, 2], a)
    return picture


def _bars(axis: "Axes", a: Arrays) -> None:
    for k, name in enumerate(NAMES):
        x = {scene: i + 0.25 * (k - 1) for i, scene in enumerate(RENDERED) if f"{scene}.{name}.error" in a}
        errors = [a[f"{scene}.{name}.error"] for scene in x]
        spread = [1.96 * e.std(ddof=1) / np.sqrt(len(e)) for e in errors]
        bars = {"yerr": spread, "error_kw": {"lw": 0.8}, **style.bar(NAMES[name])}
        axis.bar(list(x.values()), [e.mean() for e in errors], 0.24, **bars)
    labels = [f"{scene}\n{a[f'{scene}.rays'][0]:.0f} rays, {a[f'{scene}.rays'][1]:.1f} a tree" for scene in RENDERED]
    axis.set_xticks(np.arange(len(RENDERED)), labels)
    axis.grid(visible=False, axis="x")
    axis.set(ylabel="MAPE", title="Error at equal rays (bars: 95%)")
    axis.margins(y=0.35)
    axis.legend(ncols=1, loc="upper left")


FIGURE = Figure(
    id="GRIS-F15-3D",
    title="Real-time frames in space: rough boxes, and a caustic",
    world="tracer3d",
    source="[GRIS Figs. 13, 15; 8.3, 9.3]",
    claims=("GRIS-F15", "GRIS-F13t"),
    conditions=(
        Conditions(
            ("GRIS-F15",),
            "[GRIS Fig. 15; 9.3]",
            Setup("real time", "moving", "direct by ReSTIR DI", "whole images of large scenes, equal time"),
            Setup("real time", "moving", "direct by ReSTIR DI", "CB3, five crops of the film, equal rays"),
        ),
        Conditions(
            ("GRIS-F13t",),
            "[GRIS Fig. 13 top; 9.3]",
            Setup("real time", "moving", "direct by ReSTIR DI", "caustic of a glass bunny, equal time"),
            Setup("real time", "moving", "direct by ReSTIR DI", "caustic below a glass ball, five crops, equal rays"),
        ),
    ),
    arm="method",
    presets={
        "quick": {"replicas": 8, PT: 72},
        "paper": {"replicas": 24, PT: 288},
    },
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)
