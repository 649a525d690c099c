"""GRIS Fig. 13: two kinds of caustics, and the shift that suits each.

Through glass nothing connects, and only replay follows the light.  A small distant mirror is missed by most
replayed paths, whereas a reconnection turns the light on it by very little.  The last of twenty frames of a moving
camera is judged, where the light is gathered.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims import criteria
from figures.claims.figure import Arrays, Claim, Conditions, Figure, Setup
from figures.experiments import corners, realtime, split_light
from figures.experiments.indirect import METHODS
from figures.experiments.references import INDIRECT, reference
from figures.report import style
from restir_ref.batch import Array

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture

GLASS, DISTANT = "glass_disc", "distant_caustic"
PT, DIRECT = "path tracing", "direct light"
RENDERED = {GLASS: ("hybrid", "reconnection", PT), DISTANT: ("hybrid", "reconnection")}
TITLES = {GLASS: "contact caustic below glass", DISTANT: "highlight of a distant mirror"}


def chunks(preset: Any) -> Sequence[dict[str, str]]:
    """One per scene and method; and direct light, which all methods below glass share."""
    compared = [{"scene": scene, "method": method} for scene, methods in RENDERED.items() for method in methods]
    return [*compared, {"scene": GLASS, "light": DIRECT}]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """Images and rays per pixel of one renderer of indirect light; or images of direct light by ReSTIR DI."""
    scene, counts = chunk["scene"], preset[chunk["scene"]]
    if "light" in chunk:
        return split_light.direct(scene, counts[DIRECT], rng)
    method = chunk["method"]
    if method == PT:
        return split_light.indirect_trees(scene, counts[PT], rng)
    return realtime.moved(METHODS[method], scene, counts[method], rng)


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """Images by "scene.method" with direct light added below glass, those of equal rays too; references; rays."""
    *parts, direct = results
    found = {f"{c['scene']}.{c['method']}": part for c, part in zip(chunks(preset), parts, strict=False)}
    a: Arrays = {name: part["images"] for name, part in found.items()}
    cost = float(found[f"{GLASS}.hybrid"]["rays"])
    a[f"{GLASS}.{PT}"] = realtime.at_equal_rays(found[f"{GLASS}.{PT}"], cost)
    a[f"{GLASS}.reconnection at equal rays"] = realtime.at_equal_rays(found[f"{GLASS}.reconnection"], cost)
    for name in (name for name in a if name.startswith(GLASS)):
        a[name] = np.add(*realtime.paired(a[name], direct["images"]))
    rays = {f"{name}.rays": part["rays"] for name, part in found.items()}
    return a | rays | {f"{GLASS}.reference": reference(GLASS).mean, f"{DISTANT}.reference": indirect(DISTANT)}


def indirect(scene: str) -> Array:
    """The reference of indirect light, (n,)."""
    return reference(scene, INDIRECT).mean


def errors(a: Arrays, scene: str, method: str) -> Array:
    """relMSE of every image over the pixels more than half as bright as the brightest, (R,)."""
    truth = a[f"{scene}.reference"]
    caustic = truth > truth.max() / 2
    return np.asarray(corners.relative(a[f"{scene}.{method}"], truth)[:, caustic].mean(axis=1))


def check(a: Arrays) -> list[Claim]:
    """Below glass at equal rays; of the distant highlight frame against frame, which favours the hybrid shift."""
    glass = {method: errors(a, GLASS, method) for method in ("hybrid", "reconnection at equal rays", PT)}
    against = {method: realtime.paired(glass["hybrid"], glass[method]) for method in glass if method != "hybrid"}
    distant = errors(a, DISTANT, "reconnection"), errors(a, DISTANT, "hybrid")
    return [
        Claim(
            "GRIS-F13t",
            criteria.ratio_below(*against["reconnection at equal rays"], 0.7),
            "caustic pixels, equal rays: relMSE, hybrid / reconnection",
            criteria.ratio_above(*against["reconnection at equal rays"], 1),
        ),
        Claim(
            "GRIS-F13t",
            criteria.ratio_below(*against[PT], 0.8),
            "caustic pixels, equal rays: relMSE, hybrid / path tracing",
            criteria.ratio_above(*against[PT], 1),
        ),
        Claim(
            "GRIS-F13b",
            criteria.ratio_below(*distant, 0.8),
            "caustic pixels, frame against frame: relMSE, reconnection / hybrid",
            criteria.ratio_above(*distant, 1),
        ),
        Claim("GRIS-F13b", criteria.reported(prices(a)), "rays per pixel, reconnection and hybrid"),
    ]


def prices(a: Arrays) -> str:
    """Rays of a frame of both shifts."""
    return " and ".join(f"{float(a[f'{DISTANT}.{method}.rays']):.1f}" for method in ("reconnection", "hybrid"))


def draw(a: Arrays) -> "Picture":
    """One frame of every method, and the error per pixel."""
    picture, axes = style.panels(2, 2, width=4.4, height=3.2)
    for row, (scene, methods) in zip(axes, RENDERED.items(), strict=True):
        truth = a[f"{scene}.reference"]
        row[0].plot(truth, **style.look("reference"), lw=2, zorder=3)
        for method in sorted(methods, reverse=True):
            images = a[f"{scene}.{method}"]
            look = style.look(method, label=f"{method}, equal rays" if method == PT else method)
            row[0].plot(images[0], lw=0.9, markevery=8, **look)
            error = corners.relative(images, truth).mean(axis=0)
            row[1].semilogy(np.arange(4, 124), np.convolve(error, np.ones(9) / 9, mode="valid"), **look)
        row[0].set(xlabel="pixel of the inset", ylabel="radiance", title=f"{TITLES[scene]}: one frame")
        row[0].set_ylim(0, 2.5 * truth.max())
        row[1].set(xlabel="pixel of the inset", ylabel="relative squared error", title="Mean over frames, 9 pixels")
        for axis in row:
            style.below(axis, ncols=3)
    return picture


FIGURE = Figure(
    id="GRIS-F13",
    title="Caustics through glass and from a distant highlight",
    world="flatland2d",
    source="[GRIS Fig. 13; 9.2, 9.3]",
    claims=("GRIS-F13t", "GRIS-F13b"),
    conditions=(
        Conditions(
            ("GRIS-F13t",),
            "[GRIS Fig. 13 top; 9.3]",
            Setup("real time", "moving", "direct by ReSTIR DI", "caustic of a glass bunny, equal time"),
            Setup("real time", "moving", "direct by ReSTIR DI", "caustic below a glass disc (FS8), equal rays"),
        ),
        Conditions(
            ("GRIS-F13b",),
            "[GRIS Fig. 13 bottom; 9.3]",
            Setup("real time", "moving", "indirect", "reflection of a lamp, San Miguel"),
            Setup("real time", "moving", "indirect", "window mirrored by a small segment (FS9)"),
        ),
    ),
    arm="method",
    presets={
        "quick": {
            GLASS: {"hybrid": 16, "reconnection": 32, PT: 160, DIRECT: 16},
            DISTANT: {"hybrid": 256, "reconnection": 256},
        },
        "paper": {
            GLASS: {"hybrid": 96, "reconnection": 192, PT: 960, DIRECT: 96},
            DISTANT: {"hybrid": 1024, "reconnection": 1024},
        },
    },
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)
