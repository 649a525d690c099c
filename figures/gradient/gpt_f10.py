"""GPT Fig. 6 and 10: which pairs reuse in space, and whom they ask.

The whole floor of squares in 480 pixels, so that it has borders to align with, and the whole row of posts, under a
camera that moves by a third of a pixel per frame.  Arms differ in the spatial reuse of pairs: none; all pairs with
random neighbours; edge pairs alone, with neighbours that are edges of the same kind.  All are unbiased, so that the
variance of dx over replicas is their squared error.  Radii are those of a film of 1920 pixels, 20 of which are 5 here;
the paper leaves the window of the search for alike pairs open, which is 64 pixels here.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims import criteria
from figures.claims.figure import Arrays, Claim, Conditions, Figure, Setup
from figures.experiments.flatland import displaced
from figures.experiments.gradients import ADAPTIVE, DENSE, NONE, Spatial, gradient_view, spread, with_restir
from figures.experiments.pans import panned
from figures.experiments.replicas import few, smaller
from figures.experiments.views import setting
from figures.report import style
from flatland2d.sensors import Pinhole
from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.gradient_loop import GRADIENT, GradientPreset, forward
from restir_ref.transport.edges import edges, like_pairs, seen

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture

EDGE, INTERIOR = "edge pairs", "interior pairs"
SCENES = ("checker", "occluders")
ARMS: Mapping[str, Spatial] = MappingProxyType(
    {"no neighbours": NONE, "random neighbours": DENSE, "adaptive": ADAPTIVE}
)
FILM, FRAMES, STEP = 480, 8, 0.0006
"""Pixels of the film, frames, and units of length that the camera moves in each."""

RADIUS, WINDOW = 5, 64
"""Pixels within which neighbours are chosen at random, and within which alike pairs are sought."""


def chunks(preset: Any) -> Sequence[dict[str, str]]:
    """One per scene and kind of reuse."""
    return [{"scene": scene, "reuse": arm} for scene in SCENES for arm in ARMS]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """dx of the last frame (replicas, n), which pairs are edges, and rays per pixel."""
    asked, spatial, own = Counter[str](), ARMS[chunk["reuse"]], preset_of(ARMS[chunk["reuse"]])
    last: Pinhole = replace(setting(chunk["scene"]).pinhole(), first=0, n=FILM, film=FILM)
    eye, towards = np.array(last.eye), np.array(last.towards)
    forward = (towards - eye) / np.linalg.norm(towards - eye)
    side = STEP * np.array([forward[1], -forward[0]])
    sensors = [displaced(last, (k - FRAMES + 1) * side) for k in range(FRAMES)]
    moves = zip(sensors, [sensors[0], *sensors], strict=False)
    views = [gradient_view(chunk["scene"], each, asked, own, spatial) for each in moves]
    found = with_restir(views, asked, preset["replicas"], Live(rng), own)
    edge = gradient_view(chunk["scene"], (last, last), Counter(), own, ADAPTIVE)["dx"].active
    return {"dx": found["dx"], "rays": found["rays"], "edge": edge}


def preset_of(spatial: Spatial) -> GradientPreset:
    """Alike pairs are sought in a window, all others within the radius."""
    far = WINDOW if spatial.whom == "aligned" else RADIUS
    pixels, pairs = replace(GRADIENT.pixels, radius=RADIUS), replace(GRADIENT.pairs, radius=far)
    return replace(GRADIENT, pixels=pixels, pairs=pairs)


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """Everything by "scene.reuse.name"."""
    named = zip(chunks(preset), results, strict=True)
    return {f"{at['scene']}.{at['reuse']}.{key}": each for at, part in named for key, each in part.items()}


def error(a: Arrays, scene: str, arm: str, where: str) -> Array:
    """Variance of dx at edge pairs, or at interior pairs, of every replica; (R,)."""
    edge = a[f"{scene}.{arm}.edge"]
    return spread([a[f"{scene}.{arm}.dx"][:, edge if where == EDGE else ~edge]])


def check(a: Arrays) -> list[Claim]:
    """Adaptive reuse against none and against random neighbours, at edges and elsewhere, and what it saves."""
    claims = []
    for scene in SCENES:
        none, random, ours = (error(a, scene, arm, EDGE) for arm in ARMS)
        id_ = "GPT-F10"
        everywhere = [spread([a[f"{scene}.{arm}.dx"]]) for arm in ARMS]
        claims += [
            smaller(id_, (everywhere[2], everywhere[1]), 1.05, f"{scene}, adaptive / random neighbours, all pairs"),
            in_a_row(id_, (ours, none), f"{scene}, adaptive / no neighbours, edge pairs"),
            Claim(id_, criteria.above(saved(a, scene), 0.25), f"{scene}, rays of spatial reuse of pairs saved"),
            Claim(id_, criteria.reported(of_all(a, scene)), f"{scene}, of all rays of a frame", reason=EDGES_DECIDE),
        ]
        if scene == "checker":
            claims += [
                in_a_row("GPT-F06", (ours, none), f"{scene}, aligned / no neighbours, edge pairs"),
                in_a_row("GPT-F06", (ours, random), f"{scene}, aligned / random neighbours, edge pairs"),
                unchanged(a, scene),
            ]
    return claims


def in_a_row(id_: str, pair: tuple[Array, Array], part: str) -> Claim:
    """Reported, not judged: what aligned neighbours are good for is not in a row, whose edges are single points."""
    why = f"A row has no neighbours on the same edge: {alike_in(part.partition(',')[0])}.  GPT-F10-3D judges in space."
    if few(pair[0]):
        return Claim(id_, None, part, reason=f"{few(pair[0])} {why}")
    return Claim(id_, criteria.reported(criteria.ratio_interval(*pair)[2]), part, reason=why)


def alike_in(scene: str) -> str:
    """How far apart the nearest two edge pairs of the last frame are that see alike, in words."""
    (sensor,), ends = panned(scene, FILM, STEP, 1), forward((FILM,))["dx"][0]
    g = seen(setting(scene).scene, sensor)
    edge = np.flatnonzero(edges(g, ends))
    i, j = (edge[each] for each in np.triu_indices(len(edge), 1))
    apart = (j - i)[like_pairs(g, ends)(i, j)]
    if not len(apart):
        return f"no two of its {len(edge)} edge pairs see alike"
    return f"the nearest two of its {len(edge)} edge pairs that see alike are {apart.min()} pairs apart"


def unchanged(a: Arrays, scene: str) -> Claim:
    """Interior pairs reuse in space in neither arm, but in time from pairs that were edges."""
    ours, none = (error(a, scene, arm, INTERIOR) for arm in ("adaptive", "no neighbours"))
    part = f"{scene}, aligned / no neighbours, interior pairs"
    if few(ours):
        return Claim("GPT-F06", None, part, reason=few(ours))
    return Claim("GPT-F06", criteria.ratio_within(ours, none, 0.9, 1.1), part, reason=BESIDE_EDGES)


BESIDE_EDGES = "What is interior now was an edge some frames ago: it has the history of pairs that did reuse in space."
EDGES_DECIDE = "What is saved is the share of pairs that are no edges; of a whole frame it is less."


def of_all(a: Arrays, scene: str) -> float:
    """The share of all rays of a frame with dense reuse that adaptive reuse does not spend."""
    _, dense, ours = (float(a[f"{scene}.{arm}.rays"]) for arm in ARMS)
    return (dense - ours) / dense


def saved(a: Arrays, scene: str) -> float:
    """The share of the rays of dense spatial reuse that adaptive reuse does not spend."""
    none, dense, ours = (float(a[f"{scene}.{arm}.rays"]) for arm in ARMS)
    return (dense - ours) / (dense - none)


def draw(a: Arrays) -> "Picture":
    """Variance of dx along the row, and its means at edges and elsewhere."""
    picture, axes = style.panels(len(SCENES), 2, width=4.2, height=2.7)
    for (left, right), scene in zip(axes, SCENES, strict=True):
        for k, arm in enumerate(ARMS):
            dx = a[f"{scene}.{arm}.dx"]
            left.semilogy(
                np.arange(dx.shape[1]), dx.var(axis=0, ddof=1) + FLOOR, lw=0.8, **style.nth(k, marker="", label=arm)
            )
            means = [error(a, scene, arm, where).mean() for where in (EDGE, INTERIOR)]
            look = {"color": style.nth(k)["color"], "hatch": style.HATCHES[k], "edgecolor": style.PAPER}
            right.bar(np.arange(2) + 0.27 * (k - 1), means, 0.25, label=arm, **look)
        left.set(xlabel="pair of pixels", ylabel="variance of dx (radiance$^2$)", title=f"{scene}, moving")
        right.set_xticks([0, 1], [EDGE, INTERIOR])
        right.set(xlabel="pairs", ylabel="variance of dx (radiance$^2$)", title=f"{scene}: means, {len(dx)} replicas")
        right.grid(axis="x", visible=False)
        right.legend()
    return picture


FLOOR = 1e-12
"""What a logarithmic axis shows of no variance at all."""

FIGURE = Figure(
    id="GPT-F10",
    title="Adaptive spatial reuse of pairs",
    world="flatland2d",
    source="[GPT Fig. 6, 10; 4.3.2, 5.1]",
    claims=("GPT-F10", "GPT-F06"),
    conditions=(
        Conditions(
            ("GPT-F10", "GPT-F06"),
            "[GPT Fig. 6, 10; 4.3.2, 5]",
            Setup("real time", "moving", "all", "a dark and white grid; Fig. 10 does not name its scene"),
            Setup("real time", "moving", "all", "checker floor (FS6) and posts before a wall (FS5), whole rows"),
        ),
    ),
    arm="reuse",
    presets={"quick": {"replicas": 2}, "paper": {"replicas": 128}},
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)
