"""GRIS Fig. 13: two kinds of caustics, and the shift that suits each.

Through glass nothing connects, and only replay follows the light.  A small distant mirror is missed by most
replayed paths, whereas a reconnection turns the light on it by very little.  The last of twenty frames of a moving
camera is judged, where the light is gathered.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims import criteria
from figures.claims.figure import Arrays, Claim, Conditions, Figure, Setup
from figures.experiments import corners, kept_light, realtime, replicas, split_light
from figures.experiments.indirect import METHODS
from figures.experiments.references import INDIRECT, reference
from figures.experiments.views import view
from figures.report import style
from restir_ref.batch import Array
from restir_ref.chance import Live

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture


@dataclass(frozen=True)
class Caustics:
    """The names of a scene with a caustic below glass, and of one with the highlight of a distant mirror."""

    glass: str
    distant: str


FLAT = Caustics("glass_disc", "distant_caustic")
PT, DIRECT, KEPT = "path tracing", "direct light", "kept light"
SHIFTS = ("hybrid", "reconnection")


def rendered(scenes: Caustics) -> dict[str, tuple[str, ...]]:
    """The renderers that are compared, scene by scene."""
    return {scenes.glass: (*SHIFTS, PT), scenes.distant: SHIFTS}


def chunks(preset: Any) -> Sequence[dict[str, str]]:
    """Of flatland."""
    return chunks_of(FLAT)


def chunks_of(scenes: Caustics) -> list[dict[str, str]]:
    """One per scene and method; direct light, which all methods below glass share; and what shifts keep."""
    compared = [{"scene": scene, "method": each} for scene, methods in rendered(scenes).items() for each in methods]
    keeping = [{"scene": scene, "what": KEPT, "method": shift} for scene in rendered(scenes) for shift in SHIFTS]
    return [*compared, {"scene": scenes.glass, "light": DIRECT}, *keeping]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """Images and rays per pixel of one renderer of indirect light; images of direct light by ReSTIR DI; light kept."""
    scene, counts = chunk["scene"], preset[chunk["scene"]]
    if "light" in chunk:
        return split_light.direct(scene, counts[DIRECT], rng)
    method = chunk["method"]
    if "what" in chunk:
        shift = METHODS[method]
        of = shift.integrals(view(scene, shift.rule, Counter()).tracer)
        return kept_light.kept(of, counts[KEPT], Live(rng))
    if method == PT:
        return split_light.indirect_trees(scene, counts[PT], rng)
    return realtime.moved(METHODS[method], scene, counts[method], rng)


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """Of flatland, with its references."""
    found = {name_of(chunk): part for chunk, part in zip(chunks(preset), results, strict=True)}
    truths = {
        f"{FLAT.glass}.reference": reference(FLAT.glass).mean,
        f"{FLAT.distant}.reference": indirect(FLAT.distant),
    }
    return combined(found, FLAT) | truths


def name_of(chunk: Mapping[str, str]) -> str:
    """What a chunk's arrays are called: "scene.method", "scene.direct light", or "scene.kept light.method"."""
    return ".".join(chunk.values())


def combined(found: Mapping[str, Arrays], scenes: Caustics) -> Arrays:
    """Images by "scene.method" with direct light added below glass, those of equal rays too; rays; light kept."""
    names = [f"{scene}.{method}" for scene, methods in rendered(scenes).items() for method in methods]
    a: Arrays = {name: found[name]["images"] for name in names}
    glass, direct = scenes.glass, found[f"{scenes.glass}.{DIRECT}"]["images"]
    cost = float(found[f"{glass}.hybrid"]["rays"])
    a[f"{glass}.{PT}"] = realtime.at_equal_rays(found[f"{glass}.{PT}"], cost)
    a[f"{glass}.reconnection at equal rays"] = realtime.at_equal_rays(found[f"{glass}.reconnection"], cost)
    for name in [name for name in a if name.startswith(f"{glass}.")]:
        a[name] = np.add(*realtime.paired(a[name], direct))
    keeping = {name: part for name, part in found.items() if KEPT in name}
    a |= {f"{name}.{key}": part[key] for name, part in keeping.items() for key in part}
    return a | {f"{name}.rays": found[name]["rays"] for name in names}


def indirect(scene: str) -> Array:
    """The reference of indirect light, (n,)."""
    return reference(scene, INDIRECT).mean


# ---------------------------------------------------------------- verdicts


def errors(a: Arrays, scene: str, method: str) -> Array:
    """relMSE of every image over the pixels more than half as bright as the brightest, (R,)."""
    truth = a[f"{scene}.reference"]
    caustic = truth > truth.max() / 2
    return np.asarray(corners.relative(a[f"{scene}.{method}"], truth)[:, caustic].mean(axis=1))


def check(a: Arrays) -> list[Claim]:
    """Of flatland."""
    return judged(a, FLAT)


def judged(a: Arrays, scenes: Caustics) -> list[Claim]:
    """Both caustics; only reported where the scene does not hold what the paper gives as the reason."""
    lost = {"GRIS-F13t": (scenes.glass, "reconnection", "hybrid"), "GRIS-F13b": (scenes.distant, *SHIFTS)}
    why = {id_: not_held(a, *each) for id_, each in lost.items()}
    claims = [only_told(each, why[each.id]) if why[each.id] else each for each in compared(a, scenes)]
    return [*claims, *(held(a, id_, scene) for id_, (scene, _, _) in lost.items())]


def only_told(claim: Claim, why: str) -> Claim:
    """The number that would have been judged, whether it passes or fails."""
    if claim.outcome is None or claim.outcome.passed is None:
        return claim
    return Claim(claim.id, criteria.reported(claim.outcome.measured), claim.part, reason=f"Not judged: {why}")


def compared(a: Arrays, scenes: Caustics) -> list[Claim]:
    """Below glass at equal rays; of the distant highlight frame against frame, which favours the hybrid shift."""
    glass = {method: errors(a, scenes.glass, method) for method in ("hybrid", "reconnection at equal rays", PT)}
    against = {method: realtime.paired(glass["hybrid"], glass[method]) for method in glass if method != "hybrid"}
    distant = errors(a, scenes.distant, "reconnection"), errors(a, scenes.distant, "hybrid")
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
        replicas.smaller(
            "GRIS-F13b", distant, 0.8, "caustic pixels, frame against frame: relMSE, reconnection / hybrid"
        ),
        Claim("GRIS-F13b", criteria.reported(prices(a, scenes)), "rays per pixel, reconnection and hybrid"),
    ]


def prices(a: Arrays, scenes: Caustics) -> str:
    """Rays of a frame of both shifts."""
    return " and ".join(f"{float(a[f'{scenes.distant}.{method}.rays']):.1f}" for method in reversed(SHIFTS))


# ---------------------------------------------------------------- does the scene hold the effect?

HALF = 0.5
"""A shift loses a caustic if it keeps less of its light than this; said before anything was compared."""


def keeps(a: Arrays, scene: str, shift: str) -> float:
    """The share of the caustic's light that a shift keeps on the way to a neighbour."""
    return kept_light.share(a, f"{scene}.{KEPT}.{shift}")


def not_held(a: Arrays, scene: str, loses: str, finds: str) -> str:
    """Why nothing is judged in a scene: it takes a shift that loses the caustic and another that does not; or ""."""
    lost, found = (keeps(a, scene, shift) for shift in (loses, finds))
    if lost < HALF < found:
        return ""
    return (
        f"the scene does not hold the effect: {loses} was to keep less than half of the caustic's light "
        f"and {finds} more, but they keep {lost:.2f} and {found:.2f}."
    )


def held(a: Arrays, id_: str, scene: str) -> Claim:
    """What shifts keep, reported."""
    said = ", ".join(f"{shift} {keeps(a, scene, shift):.3f}" for shift in SHIFTS)
    paths = min(int(a[f"{scene}.{KEPT}.{shift}.paths"]) for shift in SHIFTS)
    why = f"Of {paths} paths by way of glass or a mirror. Judged is what one shift keeps less than half of, one more."
    return Claim(id_, criteria.reported(said), "share of the caustic's light that a shift keeps", reason=why)


# ---------------------------------------------------------------- picture

TITLES = {FLAT.glass: "contact caustic below glass", FLAT.distant: "highlight of a distant mirror"}


def draw(a: Arrays) -> "Picture":
    """One frame of every method, and the error per pixel."""
    picture, axes = style.panels(2, 2, width=4.4, height=3.2)
    for row, (scene, methods) in zip(axes, rendered(FLAT).items(), strict=True):
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
            FLAT.glass: {"hybrid": 16, "reconnection": 32, PT: 160, DIRECT: 16, KEPT: 400},
            FLAT.distant: {"hybrid": 256, "reconnection": 256, KEPT: 400},
        },
        "paper": {
            FLAT.glass: {"hybrid": 96, "reconnection": 192, PT: 960, DIRECT: 96, KEPT: 1600},
            FLAT.distant: {"hybrid": 1024, "reconnection": 1024, KEPT: 1600},
        },
    },
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)
