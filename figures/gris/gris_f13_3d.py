"""GRIS Fig. 13, bottom, in space: the highlight of a small distant window, mirrored by a small panel onto a wall.

The last of twenty frames of a moving camera is judged, of indirect light, in a square crop in the middle of the
highlight; the crop follows what its centre sees.  The truth is path tracing of the same pixels by lattices.
"""

import math
from collections import Counter
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims import criteria
from figures.claims.figure import Arrays, Claim, Conditions, Figure, Setup
from figures.experiments import corners, realtime
from figures.experiments.following import followed
from figures.experiments.indirect import METHODS
from figures.experiments.rendering import lattice_tracing
from figures.experiments.replicas import few
from figures.report import style
from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.transport.baselines.restir_di import indirect_light
from restir_ref.transport.counting import counted
from restir_ref.transport.paths import Sensor, Tracer
from tracer3d.scenes import distant_caustic
from tracer3d.sensors import Mosaic

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture

TRUTH, SHIFTS = "reference", ("hybrid", "reconnection")
"""What chunks of the truth are called, and the shifts that are compared."""


def chunks(preset: Any) -> Sequence[dict[str, Any]]:
    """Blocks of frames of every shift, then blocks of lattices."""
    frames = [{"method": method, "block": block} for method in SHIFTS for block in range(preset["blocks"])]
    return frames + [{"method": TRUTH, "block": block} for block in range(preset["truths"])]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """Images (count, n) of one shift with its rays per pixel, or of the truth."""
    s, asked, name = distant_caustic(), Counter[str](), chunk["method"]
    method = METHODS["hybrid" if name == TRUTH else name]
    scene = counted(s.scene, asked)
    views = [method.integrals(Tracer(scene, each, s.depth, method.rule)) for each in crops(preset)]
    if name == TRUTH:
        of, count = views[-1], preset["lattices"]
        images = lattice_tracing(indirect_light)(of, np.arange(count * of.n), Live(rng))  # type: ignore[arg-type]
        return {"images": images.reshape(count, -1)}
    *_, (images, cost) = realtime.costed(views, asked, preset["replicas"], Live(rng))
    return {"images": images, "rays": np.array(cost)}


def crops(preset: Any) -> list[Sensor]:
    """The crop of every frame."""
    every = followed(distant_caustic(), preset["side"], realtime.FRAMES)
    return [Mosaic(each, ((each.left, each.top),)) for each in every]


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """Images by method, rays as their mean, and the truth (n,)."""
    found: dict[str, list[Arrays]] = {}
    for chunk, part in zip(chunks(preset), results, strict=True):
        found.setdefault(chunk["method"], []).append(part)
    images = {name: np.concatenate([part["images"] for part in parts]) for name, parts in found.items()}
    rays = {f"{name}.rays": np.asarray(np.mean([part["rays"] for part in found[name]])) for name in SHIFTS}
    return images | rays | {TRUTH: images[TRUTH].mean(axis=0)}


def errors(a: Arrays, method: str) -> Array:
    """relMSE of every image over the pixels more than half as bright as the brightest, (R,)."""
    caustic = a[TRUTH] > a[TRUTH].max() / 2
    return np.asarray(corners.relative(a[method], a[TRUTH])[:, caustic].mean(axis=1))


def check(a: Arrays) -> list[Claim]:
    """Frame against frame, which favours the hybrid shift: it costs more rays."""
    distant, part = (errors(a, "reconnection"), errors(a, "hybrid")), "Window3, caustic pixels, frame against frame: "
    prices = " and ".join(f"{float(a[f'{method}.rays']):.1f}" for method in reversed(SHIFTS))
    if few(distant[0]):
        return [Claim("GRIS-F13b", None, f"{part}relMSE, reconnection / hybrid", reason=few(distant[0]))]
    return [
        Claim(
            "GRIS-F13b",
            criteria.ratio_below(*distant, 0.8),
            f"{part}relMSE, reconnection / hybrid",
            criteria.ratio_above(*distant, 1),
        ),
        Claim("GRIS-F13b", criteria.reported(prices), "Window3, rays per pixel, reconnection and hybrid"),
    ]


def draw(a: Arrays) -> "Picture":
    """The truth and one frame of each shift; the error of every frame."""
    picture, axes = style.panels(1, 2, width=4.4, height=3.4)
    images = {TRUTH: a[TRUTH], **{method: a[method][0] for method in SHIFTS}}
    style.crops(
        axes[0, 0], images, side=math.isqrt(len(a[TRUTH])), title=f"Window3, frame {realtime.FRAMES} of a moving camera"
    )
    axis = axes[0, 1]
    for method in SHIFTS:
        found = np.sort(errors(a, method))
        axis.plot(found, (np.arange(len(found)) + 0.5) / len(found), markevery=0.1, **style.look(method))
    axis.set(xscale="log", xlabel="relMSE of the caustic, frame by frame", ylabel="share of frames below", ylim=(0, 1))
    style.below(axis, ncols=2)
    return picture


FIGURE = Figure(
    id="GRIS-F13-3D",
    title="The highlight of a small distant mirror, in space",
    world="tracer3d",
    source="[GRIS Fig. 13; 9.3]",
    claims=("GRIS-F13b",),
    conditions=(
        Conditions(
            ("GRIS-F13b",),
            "[GRIS Fig. 13 bottom; 9.3]",
            Setup("real time", "moving", "indirect", "reflection of a lamp, San Miguel"),
            Setup("real time", "moving", "indirect", "window mirrored by a small panel (Window3), 24 x 24 pixels"),
        ),
    ),
    arm="method",
    presets={
        "quick": {"side": 12, "blocks": 1, "replicas": 2, "truths": 1, "lattices": 4},
        "paper": {"side": 24, "blocks": 16, "replicas": 8, "truths": 12, "lattices": 12},
    },
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)
"""One figure of the report."""
