"""GRIS 7.5: a least distance of reconnections, in the corner of a wedge.

Between points that nearly touch, the geometry term of a connection is unbounded; replay knows no geometry term.
But two pixels of which one is nearer to the other surface than the threshold and one is not share nothing: the test
takes noise out of the corner, and puts some of it beside the corner.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims import criteria
from figures.claims.figure import Arrays, Claim, Conditions, Figure, Setup
from figures.experiments import corners, offline, realtime
from figures.experiments.realtime import Method
from figures.experiments.rendering import offline as one_frame
from figures.experiments.split_light import IndirectIntegrals
from figures.experiments.views import HYBRID
from figures.report import style
from flatland2d import SCENES
from flatland2d.sensors import FILM, Pinhole
from restir_ref.batch import Array
from restir_ref.loop import OFFLINE
from restir_ref.transport.paths import Connectability

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Picture

SCENE, ANGLE, INSET = "crease", 40.0, 256
DISTANCES = (0.0, 0.01, 0.05)
LOOPS = ("offline, still camera", "real time, still camera", "real time, moving camera")
COUNTED, GAP = "connections", "gap below furniture"


def wedge() -> Pinhole:
    """The middle of a film that looks into the wedge's corner, from its bisector, below the scene's own eye."""
    own = SCENES[SCENE]()
    x = own.eye[0]
    eye = (x, x * float(np.tan(np.radians(ANGLE / 2))))
    return replace(own.pinhole(), eye=eye, towards=(0.0, 0.0), n=INSET, first=(FILM - INSET) // 2)


def least(d: float) -> Method:
    """Hybrid shifts of indirect light with a least distance of connections."""
    return Method(Connectability(HYBRID.roughness, d), IndirectIntegrals)


def frames(d: float, count: int, rng: np.random.Generator, sensor: Pinhole) -> Array:
    """Relative squared error of independent offline frames, (count, n)."""
    renderer = offline.Method(one_frame, OFFLINE.trees, least(d).rule, IndirectIntegrals)
    return corners.relative(offline.render(renderer, SCENE, count, rng, sensor)["images"], truth(sensor))


def late_frames(d: float, count: int, rng: np.random.Generator, sensor: Pinhole) -> Array:
    """The same of a still camera's chain, mean over its last half."""
    images = realtime.still(least(d), SCENE, count, rng, sensor)["images"][1:]
    return np.asarray(corners.relative(images, truth(sensor)).mean(axis=0))


def last_frames(d: float, count: int, rng: np.random.Generator, sensor: Pinhole) -> Array:
    """The same of a moving camera's last frame."""
    return corners.relative(realtime.moved(least(d), SCENE, count, rng, sensor)["images"], truth(sensor))


RENDERED = dict(zip(LOOPS, (frames, late_frames, last_frames), strict=True))


def truth(sensor: Pinhole) -> Array:
    """Indirect light by radiosity, (n,)."""
    return corners.indirect_light(SCENES[SCENE](), sensor)


def chunks(preset: Any) -> Sequence[dict[str, Any]]:
    """One per loop and distance; connections counted; the gap below furniture."""
    return [*compared(preset), {"view": COUNTED}, {"view": GAP}]


def compared(preset: Any) -> list[dict[str, Any]]:
    """One per distance and part of the frames of a loop."""
    parts = [(loop, part) for loop in LOOPS for part in range(preset[loop][1])]
    return [{"loop": loop, "part": part, "distance": d} for loop, part in parts for d in DISTANCES]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """Errors of pixels, (count, n); or how many connections are shorter than the distances."""
    if "loop" in chunk:
        loop = chunk["loop"]
        return {"error": RENDERED[loop](chunk["distance"], preset[loop][0], rng, wedge())}
    sensor = {COUNTED: wedge(), GAP: SCENES[SCENE]().pinhole()}[chunk["view"]]
    counted = corners.connections(least(0), SCENE, DISTANCES[1:], preset[COUNTED], rng, sensor)
    return counted if chunk["view"] == COUNTED else counted | gap(preset[GAP], sensor, int(rng.integers(2**63)))


def gap(count: int, sensor: Pinhole, seed: int) -> Arrays:
    """Errors of offline frames without and with the largest distance, on the same random numbers, (2, count, n)."""
    ends = (DISTANCES[0], DISTANCES[-1])
    return {"error": np.stack([frames(d, count, np.random.default_rng(seed), sensor) for d in ends])}


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """Errors by "loop.distance", counts and clearances by "wedge.name" and "gap.name"."""
    *errors, counted, beside = results
    parts: dict[str, list[Array]] = {}
    for chunk, found in zip(compared(preset), errors, strict=True):
        parts.setdefault(f"{chunk['loop']}.{chunk['distance']:g}", []).append(found["error"])
    arrays = {name: np.concatenate(each) for name, each in parts.items()}
    arrays |= {f"wedge.{name}": each for name, each in counted.items()}
    arrays |= {f"gap.{name}": each for name, each in beside.items()}
    scene = SCENES[SCENE]()
    clear = {"wedge": wedge(), "gap": scene.pinhole()}
    return arrays | {f"{name}.clearance": corners.clearance(scene.scene, each) for name, each in clear.items()}


def regions(a: Arrays, d: float) -> dict[str, Array]:
    """Pixels of the corner, where connections shorter than d are; beside it; and away from it, out of reach, (n,)."""
    corner = a["wedge.clearance"] < d
    reached = corners.around(corner)
    return {"corner": corner, "beside": reached & ~corner, "both": reached, "away": ~reached}


def pair(a: Arrays, loop: str, d: float, region: str) -> tuple[Array, Array]:
    """relMSE over a region with a least distance and without, (count,) each."""
    mask = regions(a, d)[region]
    first, second = (a[f"{loop}.{each:g}"][:, mask].mean(axis=1) for each in (d, 0))
    return first, second


def check(a: Arrays) -> list[Claim]:
    """The corner gains and what is away does not change, at both ends of the paper's range; the rest is reported."""
    claims = [claim for loop in LOOPS for d in DISTANCES[1:] for claim in judged(a, loop, d)]
    return [*claims, *(cost(a, loop) for loop in LOOPS), *counted(a)]


def judged(a: Arrays, loop: str, d: float) -> list[Claim]:
    """Noise in the corner is less, by a fifth; and away from it unchanged."""
    rule = f"{loop}, d = {d:.0%} / d = 0"
    names = {"order": f"corner, order: {rule}", "fifth": f"corner, by a fifth: {rule}", "away": f"away: {rule}"}
    if f"{loop}.0" not in a:
        return [Claim("GRIS-C10", None, part, reason=ABSENT) for part in names.values()]
    corner, far = pair(a, loop, d, "corner"), pair(a, loop, d, "away")
    more = criteria.ratio_above(*corner, 1)
    fifth = criteria.ratio_below(*corner, 0.8) if len(corner[0]) >= ENOUGH else None
    beside = criteria.ratio_interval(*pair(a, loop, d, "beside"))[2]
    but = f"Within 20 pixels of the corner's, which share paths with them, it is {beside}."
    return [
        Claim("GRIS-C10", criteria.ratio_below(*corner, 1), names["order"], counter=more, caveat=but),
        Claim("GRIS-C10", fifth, names["fifth"], counter=more, reason="" if fifth else FEW, caveat=but),
        Claim("GRIS-C10", criteria.ratio_within(*far, 0.9, 1.1), names["away"]),
    ]


def cost(a: Arrays, loop: str) -> Claim:
    """Ratios of relMSE in the pixels beside the corner's, and in both, reported."""
    part, texts = f"{loop}: within 20 pixels of the corner's", []
    if f"{loop}.0" not in a:
        return Claim("GRIS-C10", None, part, reason=ABSENT)
    for d in DISTANCES[1:]:
        beside, both = (criteria.ratio_interval(*pair(a, loop, d, region))[2] for region in ("beside", "both"))
        texts.append(f"d = {d:.0%}: {beside}, together with the corner {both}")
    return Claim("GRIS-C10", criteria.reported("; ".join(texts)), part, reason=COST)


def counted(a: Arrays) -> list[Claim]:
    """Connections that are shorter, in the corner and in the gap below furniture; and what d does there, reported."""
    claims = []
    for k, d in enumerate(DISTANCES[1:]):
        mask = regions(a, d)["corner"]
        inside = corners.share(a["wedge.short"][k], a["wedge.shifts"], mask)
        whole = corners.share(a["gap.short"][k], a["gap.shifts"], np.ones(len(a["gap.clearance"]), dtype=bool))
        text = f"{inside:.1%} into {mask.sum()} pixels of the corner, {whole:.1%} in the gap below furniture"
        claims.append(Claim("GRIS-C10", criteria.reported(text), f"shifts that connect over less than {d:.0%}"))
    ratio = criteria.ratio_interval(*(each.mean(axis=1) for each in a["gap.error"][::-1]))[2]
    return [*claims, Claim("GRIS-C10", criteria.reported(ratio), "gap below furniture: d = 5% / d = 0", reason=FAR)]


ENOUGH = 500
"""Replicas that tell a fifth from a quarter."""
FEW = "So few frames do not tell a fifth from a quarter: the paper preset judges."
ABSENT = "A few bright frames decide; the paper preset has enough of a moving camera."
COST = (
    "A pixel nearer to the other surface than d and one that is farther share little: where a path reconnects in "
    "one of them, it must not in the other."
)
FAR = "All connections across the gap are between 3% and 5% long; they are not noisy, and nothing is gained."


def draw(a: Arrays) -> "Picture":
    """Error per pixel in every loop, and in the gap."""
    loops = [loop for loop in LOOPS if f"{loop}.0" in a]
    picture, axes = style.panels(1, len(loops) + 1, width=4.2, height=3.6)
    for axis, loop in zip(axes[0], loops, strict=False):
        curves = {d: a[f"{loop}.{d:g}"] for d in DISTANCES}
        _profile(axis, curves, a["wedge.clearance"])
        axis.set(xlabel="pixel: floor, then slope", title=f"Wedge, {loop}")
    ends = (DISTANCES[0], DISTANCES[-1])
    curves = dict(zip(ends, a["gap.error"], strict=True))
    _profile(axes[0, -1], curves, a["gap.clearance"])
    axes[0, -1].set(xlabel="pixel of the standard inset", title="Gap below furniture, offline, still camera")
    return picture


def _profile(axis: "Axes", curves: dict[float, Array], clear: Array) -> None:
    """relMSE of four pixels each."""
    for d, shade in ((DISTANCES[-1], 0.2), (DISTANCES[1], 0.6)):
        places = np.flatnonzero(clear < d)
        if len(places):
            name = f"nearer than {d:.0%}"
            axis.axvspan(places[0], places[-1] + 1, color=style.GREY, alpha=shade, lw=0, zorder=0, label=name)
    for d, error in curves.items():
        k, x = DISTANCES.index(d), np.arange(2, len(clear), 4)
        look = style.nth(k)
        axis.semilogy(x, error.mean(axis=0).reshape(-1, 4).mean(axis=1), label=f"least distance {d:.0%}", **look)
    axis.set(ylabel="relMSE of 4 pixels")
    style.below(axis)


VIEW = "corner of slope and floor (FS4), 256 pixels; all three loops, and a gap below furniture beside them"

FIGURE = Figure(
    id="GRIS-C10",
    title="A least distance of reconnections",
    world="flatland2d",
    source="[GRIS 7.5]",
    claims=("GRIS-C10",),
    conditions=(
        Conditions(
            ("GRIS-C10",),
            "[GRIS 7.5], which names no loop and no scene; light as in 9.1 and 9.2",
            Setup("real time", "still", "indirect", "corners"),
            Setup("real time", "still", "indirect", VIEW),
        ),
    ),
    arm="distance",
    presets={
        "quick": {**dict(zip(LOOPS, ([128, 1], [96, 1], [0, 0]), strict=True)), COUNTED: 128, GAP: 64},
        "paper": {**dict(zip(LOOPS, ([512, 4], [256, 8], [256, 4]), strict=True)), COUNTED: 1024, GAP: 512},
    },
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)
