"""GPT Fig. 7 in space after three caps of frames at rest, in crops and in whole views.

A camera that stands is judged at its 60th frame, three times the cap of confidence: a chain that is judged sooner, as
the one of GPT-F07-3D at its 21st, still has its start in it.  It sees the same crops of the virtual 1920 x 1080 film,
and beside each the whole film of its scene, in 32 x 18 pixels; that is also seen in motion.

Reuse in space has its radius in units of the film, 20 of 1920 pixels.  On the coarse film that is a third of a pixel,
so that neighbours are the nearest ones there are, at three times the distance; 20 coarse pixels would be more than its
height, and no renderer reuses across all that it shows (CROPS-2D says what that costs).

A camera in a room cannot go on for 20 frames by half a coarse pixel each, 10 of 32 pixels: it would leave through a
wall.  So it goes round a square that stands on its tip, one pixel wide: it slides by half a pixel along either axis in
every frame, what moves by so much meets the squares of four pixels, and nearly all of the film has a history.
"""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims import criteria
from figures.claims.figure import Arrays, Claim, Conditions, Figure, Setup
from figures.experiments.following import in_place, views_of
from figures.experiments.gradients import (
    ADAPTIVE,
    METHODS,
    Method,
    after_restir,
    averaged,
    whole_trees,
    with_restir,
)
from figures.experiments.replicas import few, told
from figures.experiments.scenewise import Pair, in_enough
from figures.gradient.gpt_f07_3d import (
    OPTIONS,
    SCENES,
    SHARES,
    STILL,
    against,
    among,
    as_averaged,
    dearer,
    least,
    moving,
    of_differences,
    on_most,
    resting,
    scenes_of,
    smallest,
)
from figures.gradient.gpt_f07_rows import LONG, TRACED
from figures.report import style
from restir_ref.batch import Array, ratio
from restir_ref.chance import Live
from restir_ref.gradient_loop import GRADIENT, PRIMAL, GradientPreset, View, forward
from restir_ref.transport.edges import Seen, edges, seen
from tracer3d.scenes import Setting
from tracer3d.sensors import FILM, Pinhole

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Picture

WHOLE = "whole view, still"
"""The camera at rest that sees the whole film; `STILL` sees the crop."""

HALVES = "whole view, moving by halves"
"""The pace of the one that moves; its history follows by either option of Area ReSTIR."""

MOVING = tuple(moving(HALVES, option) for option in OPTIONS)
RESTING = (STILL, WHOLE)

ROUND = ((0.0, 0.0), (0.5, 0.5), (1.0, 0.0), (0.5, -0.5))
"""Where the moving camera is, in pixels to the right and up from its last place, frame by frame."""


# ---------------------------------------------------------------- cameras


def crop(s: Setting, size: Sequence[int], frames: int) -> list[Pinhole]:
    """The crop of GPT-F07-3D, `size` columns and rows, in all frames."""
    return resting(s, size[0], frames)


def whole(s: Setting, size: Sequence[int], frames: int) -> list[Pinhole]:
    """The whole film in `size` columns and rows, in all frames."""
    return [s.view(size[0], size[1])] * frames


def around(s: Setting, size: Sequence[int], frames: int) -> list[Pinhole]:
    """The whole film of a camera that goes round and arrives at its place, by half a pixel of the film per frame."""
    return [slid(s, size, ROUND[k % len(ROUND)]).view(size[0], size[1]) for k in range(1 - frames, 1)]


def slid(s: Setting, size: Sequence[int], by: tuple[float, float]) -> Setting:
    """The setting so many pixels of the coarse film to the right and up, as measured where the target is."""
    pixel = FILM[1] / size[1]
    return replace(s, pace=(by[0] * pixel, by[1] * pixel)).at(1)


@dataclass(frozen=True)
class Camera:
    """Sensors of all frames, the names of their size and of their number in a preset, and how history follows."""

    sensors: Callable[[Setting, Sequence[int], int], list[Pinhole]]
    size: str
    frames: str
    history: Callable[[View], View] = in_place


CAMERAS: Mapping[str, Camera] = MappingProxyType(
    {
        STILL: Camera(crop, "crop", "still"),
        WHOLE: Camera(whole, "film", "still"),
        **{moving(HALVES, option): Camera(around, "film", "moving", how) for option, how in OPTIONS.items()},
    }
)


def reuse_on(film: Sequence[int]) -> GradientPreset:
    """The gradient renderer's parameters with its radius in units of a film (columns, rows), one pixel at least."""
    pixels, pairs = (
        replace(each, radius=max(1.0, each.radius * film[0] / FILM[0])) for each in (GRADIENT.pixels, GRADIENT.pairs)
    )
    return replace(GRADIENT, pixels=pixels, pairs=pairs)


def methods(chosen: GradientPreset) -> Mapping[str, Method]:
    """The three methods by those parameters; path tracing reuses nothing."""
    return {
        "with": partial(with_restir, preset=chosen),
        "after": partial(after_restir, preset=chosen),
        TRACED: whole_trees,
    }


# ---------------------------------------------------------------- computing


def chunks(preset: Any) -> Sequence[dict[str, Any]]:
    """One per camera, scene, method and block of replicas."""
    return [
        {"camera": camera, "scene": scene, "method": method, "block": block}
        for camera in CAMERAS
        for scene in preset["scenes"]
        for method in METHODS
        for block in range(preset["blocks"])
    ]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """Averages of image and differences, (replicas, n), and rays per pixel."""
    camera, method, s, asked = CAMERAS[chunk["camera"]], chunk["method"], SCENES[chunk["scene"]](), Counter[str]()
    frames, share = 1 if method == TRACED else preset[camera.frames], SHARES[method]
    sensors = camera.sensors(s, preset[camera.size], frames)
    chosen = reuse_on(sensors[-1].film)
    views = [camera.history(view) for view in views_of(s, sensors, chosen, ADAPTIVE, asked)]
    found = methods(chosen)[method](views, asked, share * preset["replicas"], Live(rng))
    return {name: averaged(found[name], share) for name in (PRIMAL, "dx", "dy")} | {"rays": found["rays"] * share}


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """All blocks by "camera.scene.method.name", rays as their mean; and the sizes of both films."""
    found: dict[str, list[Array]] = {}
    for at, part in zip(chunks(preset), results, strict=True):
        for key, each in part.items():
            found.setdefault(f"{at['camera']}.{at['scene']}.{at['method']}.{key}", []).append(each)
    joined = {
        key: np.concatenate(parts) if parts[0].ndim else np.asarray(np.mean(parts)) for key, parts in found.items()
    }
    return joined | {size: np.array(preset[size]) for size in ("crop", "film")}


# ---------------------------------------------------------------- judging


def check(a: Arrays) -> list[Claim]:
    """Crops and whole views at rest at equal rays, whole views in motion at the paper's counts; all else reported."""
    claims = [at_rest(a, STILL, f"{STILL}, three caps", FEW), at_rest(a, WHOLE, f"{WHOLE}, three caps", COARSE)]
    claims += [in_motion(a), smallest(a, HALVES)]
    for scene in scenes_of(a):
        claims += [*ratios(a, scene), *otherwise(a, scene), *where(a, scene)]
    return claims


FEW = "Crops of 32 pixels with few edges (below)."

COARSE = "32 x 18 pixels of the whole film: its pairs are 60 pixels of the virtual film apart."


def at_rest(a: Arrays, camera: str, part: str, why: str) -> Claim:
    """dx and dy at equal rays, below .8 of both others, in two of three scenes: the rule of GPT-F07-3D."""
    scenes = {scene: rest_pairs(a, f"{camera}.{scene}") for scene in scenes_of(a)}
    return in_enough("GPT-F07", scenes, (0.8, least(a)), f"{part}, equal rays, dx and dy", why)


def rest_pairs(a: Arrays, view: str) -> list[Pair]:
    """Errors of pair reuse beside those of either other at equal rays."""
    return list(against(a, view).values())[:2]


def in_motion(a: Arrays) -> Claim:
    """dx and dy at the paper's counts, in two of three scenes by one option: the rule of GPT-F07-3D."""
    claim = on_most(a, HALVES, "GPT-F07", "dx and dy", of_differences)
    return claim if claim.outcome is None else replace(claim, reason=COARSE)


def ratios(a: Arrays, scene: str) -> list[Claim]:
    """Scene by scene, at equal rays by every camera, and at the paper's counts in motion."""
    claims = [
        told("GPT-F07", pair, f"{camera}, {scene}, equal rays, {name}")
        for camera in CAMERAS
        for name, pair in against(a, f"{camera}.{scene}").items()
    ]
    return claims + [
        told("GPT-F07", (each.ours, each.theirs), f"{camera}, {scene}, the paper's counts, {each.name}")
        for camera in MOVING
        for each in of_differences(a, f"{camera}.{scene}")
    ]


def otherwise(a: Arrays, scene: str) -> list[Claim]:
    """At edge pairs and elsewhere, at equal rays where the camera is at rest, and at the paper's counts in motion."""
    claims = []
    for camera in CAMERAS:
        edge, view = edge_of(a, camera, scene), f"{camera}.{scene}"
        counted, cost = ("equal rays", dearer) if camera in RESTING else ("the paper's counts", as_averaged)
        for name, at in (("edge pairs", edge), ("other pairs", {key: ~each for key, each in edge.items()})):
            ours, *others = (among(a, view, method, at) * cost(a, view, method) for method in METHODS)
            for theirs, other in zip(others, OTHERS, strict=True):
                claims.append(told("GPT-F07", (ours, theirs), f"{camera}, {scene}, {counted}, {name}, with / {other}"))
    return claims


OTHERS = ("after", TRACED)
"""The methods that pair reuse is compared with."""


def where(a: Arrays, scene: str) -> list[Claim]:
    """The share of edge pairs among those that see a surface, and what they carry of the variance of dx and dy."""
    claims = []
    for camera in CAMERAS:
        edge, view, part = edge_of(a, camera, scene), f"{camera}.{scene}", f"{camera}, {scene}, edge pairs"
        share = f"{edge_pairs(a, camera, scene):.1%} of the pairs that see a surface"
        claims.append(Claim("GPT-F07", criteria.reported(share), f"{part}, how many"))
        carried, why = f"{part}, their share of the variance of dx and dy", few(a[f"{view}.with.dx"])
        text = "" if why else ", ".join(f"{method} {at_edges(a, view, method, edge):.0%}" for method in METHODS)
        claims.append(Claim("GPT-F07", criteria.reported(text) if text else None, carried, reason=why))
    return claims


def edge_of(a: Arrays, camera: str, scene: str) -> dict[str, Array]:
    """Which pairs of the last frame are edges, by direction."""
    g, ends = last_seen(a, camera, scene)
    return {name: edges(g, each) for name, each in ends.items()}


def edge_pairs(a: Arrays, camera: str, scene: str) -> float:
    """The share of edge pairs among all pairs of which either end sees a surface."""
    g, ends = last_seen(a, camera, scene)
    met = {name: np.isfinite(g.t[each]).any(axis=0) for name, each in ends.items()}
    found = sum(int((edges(g, each) & met[name]).sum()) for name, each in ends.items())
    return found / sum(int(each.sum()) for each in met.values())


def last_seen(a: Arrays, camera: str, scene: str) -> tuple[Seen, dict[str, Array]]:
    """What a camera's last frame sees, and the ends (2, E) of its pairs by direction."""
    s = SCENES[scene]()
    (sensor,) = CAMERAS[camera].sensors(s, a[CAMERAS[camera].size].tolist(), 1)
    return seen(s.scene, sensor), {name: ends for name, (ends, _) in forward(sensor.shape).items()}


def at_edges(a: Arrays, view: str, method: str, edge: Mapping[str, Array]) -> float:
    """What edge pairs carry of a method's variance of dx and dy, all pairs counted alike."""
    variance = {name: a[f"{view}.{method}.{name}"].var(axis=0) for name in edge}
    return sum(float(variance[name][at].sum()) for name, at in edge.items()) / sum(
        float(each.sum()) for each in variance.values()
    )


# ---------------------------------------------------------------- drawing

ROWS: Mapping[str, str] = MappingProxyType(
    {STILL: "crop,\nat rest", WHOLE: "whole view,\nat rest"}
    | {moving(HALVES, option): f"in motion,\n{option}" for option in OPTIONS}
)
"""Cameras, in the order of the lines."""


def draw(a: Arrays) -> "Picture":
    """What whole views and crops show, and the ratios of variances by camera, with the limits that are asked for."""
    scenes = scenes_of(a)
    picture, axes = style.panels(len(scenes), 3, width=3.6, height=2.5)
    for row, scene in zip(axes, scenes, strict=True):
        shown(row[0], a, f"{WHOLE}.{scene}", "whole view (circle: crop)", "film")
        shown(row[1], a, f"{STILL}.{scene}", "crop", "crop")
        mark(row[0], a, scene)
        bars(row[2], a, scene)
    style.below(axes[-1, 2], ncols=2, borderaxespad=0.5)
    return picture


def shown(axis: "Axes", a: Arrays, view: str, what: str, size: str) -> None:
    """The mean image of a view by pair reuse."""
    columns, rows = a[size].tolist()
    image = a[f"{view}.with.{PRIMAL}"].mean(axis=0).reshape(rows, columns)
    found = axis.imshow(image, vmin=0, vmax=float(np.quantile(image, 0.97)) * 1.2)
    axis.set(title=f"{view.split('.')[1]}, {what}", xlabel="pixel", ylabel="pixel")
    axis.grid(visible=False)
    axis.figure.colorbar(found, ax=axis, label="radiance", extend="max", shrink=0.8)


def mark(axis: "Axes", a: Arrays, scene: str) -> None:
    """Where the crop lies on the whole film: it is smaller than one of its pixels."""
    (sensor,) = CAMERAS[STILL].sensors(SCENES[scene](), a["crop"].tolist(), 1)
    x, y = ((at + length / 2) for at, length in ((sensor.left, sensor.width), (sensor.top, sensor.height)))
    columns, rows = a["film"].tolist()
    place = (x / FILM[0] * columns - 0.5, y / FILM[1] * rows - 0.5)
    for colour, width in ((style.PAPER, 3.5), (style.INK, 1.5)):
        axis.plot(*place, marker="o", markevery=1, ms=9, mfc="none", mec=colour, mew=width)


TICKS, FEWER, WIDE = (0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20), (0.001, 0.01, 0.1, 0.3, 1, 3, 10, 30, 100), 40.0
"""Ratios that an axis names, those of one whose ends are further apart than by a factor, and the factor."""


def bars(axis: "Axes", a: Arrays, scene: str) -> None:
    """Ratios by camera, at equal rays at rest and at the paper's counts in motion, as bars that begin at 1."""
    ends = [1.0]
    for k, camera in enumerate(ROWS):
        for j, (method, pair) in enumerate(zip(OTHERS, pairs(a, camera, scene), strict=True)):
            at, middle, (low, high) = k + 0.36 * (j - 0.5), *interval(*pair)
            look = style.bar(method, label=f"over {method}" if k == 0 else "_")
            axis.barh(at, middle - 1, 0.34, left=1, **look)
            axis.plot([low, high], [at, at], color=style.INK, lw=1.2, marker="|", markevery=1, ms=5)
            ends += [low, high]
    axis.axvline(0.8, color=style.INK, lw=1.0, ls=":", label="0.8, what is asked")
    axis.set_yticks(range(len(ROWS)), list(ROWS.values()))
    low, high = min(ends) / 1.3, max(ends) * 1.3
    axis.set(xscale="log", xlim=(low, high), ylim=(len(ROWS) - 0.4, -0.6), title=f"{scene}, dx and dy")
    axis.minorticks_off()
    named = [each for each in (FEWER if high > WIDE * low else TICKS) if low < each < high]
    axis.set_xticks(named, [f"{each:g}" for each in named])
    axis.set(xlabel="variance of pair reuse, over others'")
    axis.grid(axis="y", visible=False)


def interval(ours: Array, theirs: Array) -> tuple[float, tuple[float, float]]:
    """The ratio of the means and its 95% interval, no longer than a point for too few replicas; 1 for 0 / 0."""
    if not few(ours):
        low, high, _ = criteria.ratio_interval(ours, theirs)
        return float(ours.mean() / theirs.mean()), (low, high)
    middle = float(ratio(ours.mean(), theirs.mean())) or 1.0
    return middle, (middle, middle)


def pairs(a: Arrays, camera: str, scene: str) -> list[Pair]:
    """What is judged by a camera."""
    view = f"{camera}.{scene}"
    if camera in RESTING:
        return rest_pairs(a, view)
    return [(each.ours, each.theirs) for each in of_differences(a, view)]


FIGURE = Figure(
    id="GPT-F07-REST-3D",
    title="Differences in space, at rest for three caps, and whole views",
    world="tracer3d",
    source="[GPT Fig. 7; 4.3.1, 5.1]",
    claims=("GPT-F07",),
    conditions=(
        Conditions(
            ("GPT-F07",),
            "[GPT Fig. 7; 5]",
            Setup("real time", "moving", "all", "Classroom, Veach-Ajar"),
            Setup("real time", "still", "all", "insets and whole views of CB3, Ajar3, Checker3; whole views move, too"),
            "In motion the outcome hangs on how history follows; at rest a camera shows what reuse comes to.",
        ),
    ),
    arm="method",
    presets={
        "quick": {
            "scenes": ["CB3", "Ajar3", "Checker3"],
            "replicas": 2,
            "blocks": 1,
            "crop": [4, 4],
            "film": [12, 7],
            "still": 2,
            "moving": 2,
        },
        "paper": {
            "scenes": ["CB3", "Ajar3", "Checker3"],
            "replicas": 8,
            "blocks": 8,
            "crop": [32, 32],
            "film": [32, 18],
            "still": LONG,
            "moving": 21,
        },
    },
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)
