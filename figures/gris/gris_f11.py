"""GRIS Fig. 11: convergence offline with rough and with glossy boxes, for both shifts.

Frames are independent, so the error of their mean falls like 1/T from wherever one frame starts; the shift
decides where.  On rough boxes the two shifts nearly always connect the same vertices.  The image is the whole film in
indirect light, and the reference path tracing with trees of its own.
"""

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims import criteria
from figures.claims.figure import Arrays, Claim, Conditions, Figure, Setup
from figures.experiments import offline
from figures.experiments.rendering import lattice_tracing
from figures.report import style
from flatland2d.scenes import SCENES as SCENES_BY_NAME
from flatland2d.sensors import FILM
from restir_ref.batch import Array
from restir_ref.metrics import rel_mse
from restir_ref.transport.baselines.restir_di import indirect_light

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Picture


@dataclass(frozen=True)
class Boxes:
    """The names of a scene with rough boxes and of the same with glossy ones."""

    rough: str
    glossy: str


FLAT = Boxes("cornell", "glossy_cornell")
TITLES = Boxes("rough boxes (r = .5)", "glossy boxes (r = .15)")
METHODS = ("path tracing", "reconnection", "hybrid")


TRUTH = offline.Method(lattice_tracing(indirect_light), 0)
"""Many path trees per image; what they cost is not asked."""


def chunks(preset: Any) -> Sequence[dict[str, str]]:
    """Every scene and method, and the truth, whose random numbers are its own."""
    scenes = FLAT.rough, FLAT.glossy
    return [*offline.chunks(scenes, METHODS), *({"scene": scene, "what": "truth"} for scene in scenes)]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """Independent images of the film (count, 1920) and rays per pixel; or one image of the truth, (1920,)."""
    whole = SCENES_BY_NAME[chunk["scene"]]().pinhole(FILM, 0)
    if "method" in chunk:
        count = preset["path tracing" if chunk["method"] == "path tracing" else chunk["scene"]]
        return offline.render(offline.METHODS[chunk["method"]], chunk["scene"], count, rng, whole)
    return {"image": offline.render(TRUTH, chunk["scene"], preset["truth"], rng, whole)["images"].mean(axis=0)}


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """All images and rays by "scene.method.name", the truth by "scene.truth.image"."""
    named = zip(chunks(preset), results, strict=True)
    return {
        f"{chunk['scene']}.{chunk.get('method', 'truth')}.{key}": part[key] for chunk, part in named for key in part
    }


def errors(a: Arrays, scene: str, images: Array) -> Array:
    """relMSE of every image, (R,)."""
    return rel_mse(images, a[f"{scene}.truth.image"])


def check(a: Arrays) -> list[Claim]:
    """Of flatland."""
    return judged(a, FLAT)


def judged(a: Arrays, boxes: Boxes) -> list[Claim]:
    """At one frame and at the longest mean that leaves eight groups, at equal samples; equal rays beside it."""
    spans = {"one frame": 1, "a mean of frames": longest(a, boxes)}
    return [claim for name, T in spans.items() for claim in at(a, boxes, name, T)]


def at(a: Arrays, boxes: Boxes, name: str, T: int) -> list[Claim]:
    """Claims on means of T frames."""
    rough, glossy = ({m: groups(a, scene, m, T) for m in METHODS} for scene in (boxes.rough, boxes.glossy))
    caveat = SHORT.format(T) if T > 1 else ""
    claims = []
    for method in METHODS[1:]:
        pair = offline.paired(rough[method], rough["path tracing"])
        less, more = criteria.ratio_below(*pair, 0.5), criteria.ratio_above(*pair, 1)
        part = f"rough: {method} / path tracing, equal samples, {name}"
        claims.append(Claim("GRIS-F11a", of(less, T), part, counter=more, caveat=caveat))
    alike = criteria.ratio_within(rough["hybrid"], rough["reconnection"], 0.7, 1.3)
    claims.append(
        Claim("GRIS-F11a", of(alike, T), f"rough: hybrid / reconnection, equal samples, {name}", caveat=caveat)
    )
    better, worse = (
        rule(glossy["hybrid"], glossy["reconnection"], limit)
        for rule, limit in ((criteria.ratio_below, 0.85), (criteria.ratio_above, 1))
    )
    part = f"glossy: hybrid / reconnection, equal samples, {name}"
    claims.append(Claim("GRIS-F11b", of(better, T), part, counter=worse, caveat=caveat))
    return claims


SHORT = "Means of {} frames, where the plots go to hundreds; frames are independent, so errors fall like 1/T (picture)."


def of(found: criteria.Outcome, T: int) -> criteria.Outcome:
    """The outcome with the number of frames."""
    return replace(found, measured=f"{criteria.show(found.measured)}, T = {T}")


def groups(a: Arrays, scene: str, method: str, T: int) -> Array:
    """relMSE of every mean of T frames of a method, or of as many path trees; (groups,)."""
    if method == "path tracing":
        return errors(a, scene, offline.traced(a, scene, offline.equal_samples(T)))
    return errors(a, scene, offline.after(a, scene, method, T))


def longest(a: Arrays, boxes: Boxes) -> int:
    """Frames in a mean, with at least eight groups of them."""
    return min(len(a[f"{scene}.hybrid.images"]) for scene in (boxes.rough, boxes.glossy)) // 8


def draw(a: Arrays) -> "Picture":
    """relMSE over frames; path tracing at equal samples, rays and time; error by pixel."""
    picture, axes = style.panels(1, 3, width=3.9, height=3.9)
    convergence(axes[0, :2], a, FLAT, tuple(PRICES))
    by_pixel(a, axes[0, 2])
    return picture


def convergence(panels: "Sequence[Axes] | Array", a: Arrays, boxes: Boxes, shown: Collection[str]) -> None:
    """relMSE of means of frames, rough boxes on the left; path tracing at the prices that are `shown`."""
    T = 2 ** np.arange(int(np.log2(longest(a, boxes))) + 1)
    for axis, scene, title in zip(panels, (boxes.rough, boxes.glossy), (TITLES.rough, TITLES.glossy), strict=True):
        prices: dict[str, Callable[[int], float]] = {
            "equal samples": offline.equal_samples,
            "equal rays": partial(offline.equal_rays, a, scene, "hybrid"),
            "equal time": offline.equal_time,
        }
        for name, trees in ((name, prices[name]) for name in shown):
            curve = [errors(a, scene, offline.traced(a, scene, trees(int(t)))).mean() for t in T]
            axis.loglog(
                T, curve, **style.look("path tracing", **PRICES[name], label=f"path tracing, {name}"), markevery=1
            )
        for method in METHODS[1:]:
            after = [errors(a, scene, offline.after(a, scene, method, int(t))).mean() for t in T]
            axis.loglog(T, after, **style.look(method), markevery=1)
        axis.set_xticks([], minor=True)
        axis.set_xticks(T[:: 1 + len(T) // 8], T[:: 1 + len(T) // 8])
        axis.margins(x=0.1)
        axis.set(xlabel="frames T in the mean", ylabel="relMSE of the mean", title=title)
        style.below(axis, ncols=1)


PRICES: dict[str, dict[str, Any]] = {
    "equal samples": {"marker": "s", "ls": "-."},
    "equal rays": {"marker": "^", "ls": "--"},
    "equal time": {"marker": "v", "ls": ":"},
}
"""Path tracing at three prices: one colour, three markers and dashes."""


def by_pixel(a: Arrays, axis: Any) -> None:
    """Relative squared error of one frame along the film with rough boxes."""
    truth = a["cornell.truth.image"]
    shown = {
        "path tracing, equal samples": offline.traced(a, "cornell", offline.equal_samples(1)),
        **{method: offline.after(a, "cornell", method, 1) for method in METHODS[1:]},
    }
    for name, images in shown.items():
        error = ((images / truth - 1) ** 2).mean(axis=0).reshape(-1, 16).mean(axis=1)
        axis.semilogy(np.arange(len(error)) * 16 + 8, error, **style.look(name.partition(",")[0], label=name))
    axis.set(xlabel="pixel of the film", ylabel="relative squared error", title="One frame, rough boxes")
    axis.set_xticks(range(0, 1921, 480))
    style.below(axis, ncols=1)


FIGURE = Figure(
    id="GRIS-F11",
    title="Offline convergence with rough and glossy boxes",
    world="flatland2d",
    source="[GRIS Fig. 11; 8.3, 9.1]",
    claims=("GRIS-F11a", "GRIS-F11b"),
    conditions=(
        Conditions(
            ("GRIS-F11a",),
            "Fig. 11a; 9.1, 9.2",
            Setup("offline", "still", "indirect", "Cornell box, rough"),
            Setup("offline", "still", "indirect", "FS1, the whole film"),
        ),
        Conditions(
            ("GRIS-F11b",),
            "Fig. 11b; 9.1, 9.2",
            Setup("offline", "still", "indirect", "Cornell box with two glossy boxes"),
            Setup("offline", "still", "indirect", "FS2, the whole film"),
        ),
    ),
    arm="method",
    presets={
        "quick": {"path tracing": 144, "cornell": 64, "glossy_cornell": 16, "truth": 1},
        "paper": {"path tracing": 1152, "cornell": 512, "glossy_cornell": 128, "truth": 4},
    },
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)
