"""GPT Fig. 6 and 10 in space: which pairs reuse in space, and whom they ask, frame by frame.

A floor of squares with a step, under a camera that moves by about a third of a pixel per frame.  Its edges are lines,
so that an edge pair has neighbours on the same edge, which no row of pixels has.  Arms differ in the spatial reuse of
pairs: none; all pairs with random neighbours; edge pairs alone, with neighbours that are edges of the same kind.  All
are unbiased, so that the variance of dx and dy over replicas is their squared error.  Of the film's 320 columns 3 are a
radius of 20 pixels of 1920; alike pairs are sought within 16.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims import criteria
from figures.claims.figure import Arrays, Claim, Conditions, Figure, Setup
from figures.experiments.gradients import ADAPTIVE, DENSE, NONE, Spatial, grey, spread
from figures.experiments.pans import floor_views
from figures.experiments.replicas import compared, few, inside, smaller
from figures.report import style
from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.gradient_loop import GRADIENT, PRIMAL, GradientPreset, shaded, step
from restir_ref.transport.counting import rays

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture

ARMS: Mapping[str, Spatial] = MappingProxyType(
    {"no neighbours": NONE, "random neighbours": DENSE, "adaptive": ADAPTIVE}
)
RADIUS, WINDOW = 3, 16
"""Pixels within which neighbours are chosen at random, and within which alike pairs are sought."""

EDGE, INTERIOR = "edge pairs", "interior pairs"
DIRECTIONS = ("dx", "dy")


def chunks(preset: Any) -> Sequence[dict[str, str]]:
    """One per kind of reuse."""
    return [{"reuse": arm} for arm in ARMS]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """dx and dy of some frames (replicas, n), which pairs are edges, and rays per pixel of the last frame."""
    asked, spatial, R = Counter[str](), ARMS[chunk["reuse"]], preset["replicas"]
    own, chance = preset_of(spatial), Live(rng)
    found: dict[str, Array] = {}
    views = floor_views(max(preset["frames"]), own, spatial, asked)
    spent, last = 0, None
    for k, view in enumerate(views, start=1):
        spent = rays(asked)
        last = view, step(view, chance, own, R, last)
        if k in preset["frames"]:
            found |= {f"{name}.{k}": grey(shaded(view[name], last[1][name]), R) for name in DIRECTIONS}
    edge = floor_views(1, own, ADAPTIVE, Counter())[-1]
    cost = (rays(asked) - spent) / (R * views[-1][PRIMAL].n)
    return found | {f"{name}.edge": edge[name].active for name in DIRECTIONS} | {"rays": np.array(cost)}


def preset_of(spatial: Spatial) -> GradientPreset:
    """Alike pairs are sought in a window, all others within the radius."""
    far = WINDOW if spatial.whom == "aligned" else RADIUS
    pixels, pairs = replace(GRADIENT.pixels, radius=RADIUS), replace(GRADIENT.pairs, radius=far)
    return replace(GRADIENT, pixels=pixels, pairs=pairs)


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """Everything by "reuse.name", and the frames."""
    named = {f"{arm}.{key}": each for arm, part in zip(ARMS, results, strict=True) for key, each in part.items()}
    return named | masks(preset["frames"]) | {"frames": np.array(preset["frames"])}


def masks(frames: Sequence[int]) -> Arrays:
    """Which pairs are edges to the camera of each frame, by "direction.frame"."""
    views = floor_views(max(frames), preset_of(ADAPTIVE), ADAPTIVE, Counter())
    return {f"edge.{name}.{k}": views[k - 1][name].active for k in frames for name in DIRECTIONS}


def error(a: Arrays, arm: str, frame: int, where: str) -> Array:
    """Variance of dx and dy at edge pairs, or at interior pairs, of every replica; (R,)."""
    edge = {name: a[f"edge.{name}.{frame}"] for name in DIRECTIONS}
    return spread([a[f"{arm}.{name}.{frame}"][:, at if where == EDGE else ~at] for name, at in edge.items()])


def check(a: Arrays) -> list[Claim]:
    """Aligned neighbours against none and random ones, with no history yet and with a long one."""
    first, last = int(a["frames"][0]), int(a["frames"][-1])
    none, random, ours = ({k: error(a, arm, k, EDGE) for k in (first, last)} for arm in ARMS)
    claims = []
    for id_, limit in (("GPT-F06", 1.0), ("GPT-F10", 0.9)):
        claims.append(smaller(id_, (ours[last], none[last]), limit, "aligned / no neighbours, edge pairs, last frame"))
        claims.append(beside(id_, (ours[first], none[first]), "aligned / no neighbours, edge pairs, first frame"))
    claims += [
        smaller("GPT-F06", (ours[first], random[first]), 1, "aligned / random neighbours, edge pairs, first frame"),
        smaller("GPT-F06", (ours[last], random[last]), 1, "aligned / random neighbours, edge pairs, last frame"),
        unchanged(a, last),
        Claim("GPT-F10", criteria.above(saved(a), 0.25), "rays of spatial reuse of pairs saved"),
        Claim("GPT-F10", criteria.reported(of_all(a)), "of all rays of a frame", reason=EDGES_DECIDE),
    ]
    return claims


def beside(id_: str, pair: tuple[Array, Array], part: str) -> Claim:
    """Reported beside the last frame."""
    if few(pair[0]):
        return Claim(id_, None, part, reason=few(pair[0]))
    return Claim(id_, criteria.reported(criteria.ratio_interval(*pair)[2]), part)


def unchanged(a: Arrays, frame: int) -> Claim:
    """Interior pairs reuse in space in neither arm."""
    pair = error(a, "adaptive", frame, INTERIOR), error(a, "no neighbours", frame, INTERIOR)
    return compared("GPT-F06", pair, inside(0.9, 1.1), "aligned / no neighbours, interior pairs")


def saved(a: Arrays) -> float:
    """The share of the rays of dense spatial reuse that adaptive reuse does not spend."""
    none, dense, ours = (float(a[f"{arm}.rays"]) for arm in ARMS)
    return (dense - ours) / (dense - none)


EDGES_DECIDE = "What is saved is the share of pairs that are no edges; of a whole frame it is less."


def of_all(a: Arrays) -> float:
    """The share of all rays of a frame with dense reuse that adaptive reuse does not spend."""
    _, dense, ours = (float(a[f"{arm}.rays"]) for arm in ARMS)
    return (dense - ours) / dense


def draw(a: Arrays) -> "Picture":
    """Variance over frames at edges and elsewhere."""
    picture, axes = style.panels(1, 2, width=4.2, height=3.0)
    for axis, where in zip(axes[0], (EDGE, INTERIOR), strict=True):
        for k, arm in enumerate(ARMS):
            means = [error(a, arm, int(frame), where).mean() for frame in a["frames"]]
            axis.loglog(a["frames"], means, **style.nth(k, label=arm))
        axis.set(xlabel="frame", ylabel="variance of dx and dy (radiance$^2$)", title=f"Checker3: {where}")
        axis.set_xticks(a["frames"], [str(frame) for frame in a["frames"]])
        axis.minorticks_off()
    axes[0, 0].legend()
    return picture


FIGURE = Figure(
    id="GPT-F10-3D",
    title="Adaptive spatial reuse of pairs, in space",
    world="tracer3d",
    source="[GPT Fig. 6, 10; 4.3.2, 5.1]",
    claims=("GPT-F10", "GPT-F06"),
    conditions=(
        Conditions(
            ("GPT-F10", "GPT-F06"),
            "[GPT Fig. 6, 10; 4.3.2, 5]",
            Setup("real time", "moving", "all", "a dark and white grid; Fig. 10 does not name its scene"),
            Setup("real time", "moving", "all", "a floor of squares with a step (Checker3)"),
        ),
    ),
    arm="reuse",
    presets={
        "quick": {"replicas": 2, "frames": [1, 2]},
        "paper": {"replicas": 64, "frames": [1, 2, 4]},
    },
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)
