"""GPT Fig. 6 and 10: which pairs reuse in space, and whom they ask.

The whole floor of squares in 480 pixels, so that it has borders to align with, and the whole row of posts, under a
camera that moves by a third of a pixel per frame; and a map around the corner of a post, which stands still.  Arms
differ in the spatial reuse of pairs: none; all pairs with random neighbours; edge pairs alone, with neighbours that are
edges of the same kind.  All are unbiased, so that the variance of differences over replicas is their squared error.
Edges of a row are single points; those of the map are lines, so that edge pairs have neighbours on their own edge.
Radii are those of a film of 1920 pixels, 20 of which are 5 here, in rows of 480 pixels and in the map, whose whole room
would have as many.  The paper leaves the window of the search for alike pairs open: 64 pixels in rows; in the map 24, a
twentieth of the film as in space, which is all of the crop.  The map is judged after as many frames as the cap of
confidence, not after three times as many, which would forget its start: for time.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims import criteria
from figures.claims.figure import Arrays, Claim, Conditions, Figure, Setup
from figures.experiments.gradients import ADAPTIVE, DENSE, NONE, SIDE, Spatial, spread, views_of, with_restir
from figures.experiments.pans import panned, views_along
from figures.experiments.replicas import compared, few, inside, smaller
from figures.experiments.views import setting
from figures.report import style
from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.gradient_loop import GRADIENT, PRIMAL, GradientPreset, forward
from restir_ref.transport.edges import edges, like_pairs, seen

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture

EDGE, INTERIOR, ALL = "edge pairs", "interior pairs", "all pairs"
SCENES, MAP = ("checker", "occluders"), "occluders map"
"""Scenes whose rows move, and the view that has edges longer than a point."""

ARMS: Mapping[str, Spatial] = MappingProxyType(
    {"no neighbours": NONE, "random neighbours": DENSE, "adaptive": ADAPTIVE}
)
FILM, FRAMES, STEP = 480, 8, 0.0006
"""Pixels of the film, frames of a row, and units of length that the camera moves in each."""

RADIUS, WINDOW = 5, 64
"""Pixels within which neighbours are chosen at random, and within which alike pairs of a row are sought."""

WINDOW_OF_A_MAP = 24
"""A twentieth of the film, as in space (16 of 320 pixels): said before anything was measured."""

DIRECTIONS = ("dx", "dy")


def chunks(preset: Any) -> Sequence[dict[str, Any]]:
    """One per scene, kind of reuse and block of replicas."""
    blocks = dict.fromkeys(SCENES, 1) | {MAP: preset["map"]["blocks"]}
    return [
        {"scene": scene, "reuse": arm, "block": block}
        for scene, count in blocks.items()
        for arm in ARMS
        for block in range(count)
    ]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """Differences of the last frame (replicas, n), and rays per pixel."""
    scene, spatial, asked, chance = chunk["scene"], ARMS[chunk["reuse"]], Counter[str](), Live(rng)
    if scene == MAP:
        own, replicas = preset_of(spatial, WINDOW_OF_A_MAP), preset["map"]["replicas"]
        views = views_of(scene, own, spatial, asked)[:1] * preset["map"]["frames"]
    else:
        own, replicas = preset_of(spatial), preset["replicas"]
        views = views_along(scene, panned(scene, FILM, STEP, FRAMES), own, spatial, asked)
    found = with_restir(views, asked, replicas, chance, own)
    return {name: each for name, each in found.items() if name != PRIMAL}


def preset_of(spatial: Spatial, window: float = WINDOW) -> GradientPreset:
    """Alike pairs are sought in a window, all others within the radius."""
    far = window if spatial.whom == "aligned" else RADIUS
    pixels, pairs = replace(GRADIENT.pixels, radius=RADIUS), replace(GRADIENT.pairs, radius=far)
    return replace(GRADIENT, pixels=pixels, pairs=pairs)


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """All blocks by "scene.reuse.name", rays as their mean, and which pairs are edges by "edge.scene.direction"."""
    found: dict[str, list[Array]] = {}
    for at, part in zip(chunks(preset), results, strict=True):
        for key, each in part.items():
            found.setdefault(f"{at['scene']}.{at['reuse']}.{key}", []).append(each)
    named = {
        key: np.concatenate(parts) if parts[0].ndim else np.asarray(np.mean(parts)) for key, parts in found.items()
    }
    return named | masks()


def masks() -> Arrays:
    """Which pairs of the last frame are edges, by "edge.scene.direction"."""
    own, asked = preset_of(ADAPTIVE), Counter[str]()
    last = {scene: views_along(scene, panned(scene, FILM, STEP, 1), own, ADAPTIVE, asked)[-1] for scene in SCENES}
    last[MAP] = views_of(MAP, own, ADAPTIVE, asked)[-1]
    return {
        f"edge.{at}.{name}": each.active for at, view in last.items() for name, each in view.items() if name != PRIMAL
    }


def differences(a: Arrays, scene: str, arm: str) -> dict[str, Array]:
    """Differences of the last frame in every direction that there is, (R, n) each."""
    return {name: a[f"{scene}.{arm}.{name}"] for name in DIRECTIONS if f"{scene}.{arm}.{name}" in a}


def error(a: Arrays, scene: str, arm: str, where: str) -> Array:
    """Variance of differences at edge pairs, at interior pairs or at all, of every replica; (R,)."""
    kept = []
    for name, each in differences(a, scene, arm).items():
        edge = a[f"edge.{scene}.{name}"]
        kept.append(each[:, {EDGE: edge, INTERIOR: ~edge}.get(where, slice(None))])
    return spread([np.concatenate(kept, axis=1)])


def check(a: Arrays) -> list[Claim]:
    """Adaptive reuse against none and against random neighbours, at edges and elsewhere, and what it saves."""
    return [claim for scene in SCENES for claim in on_the_row(a, scene)] + on_the_map(a)


def on_the_row(a: Arrays, scene: str) -> list[Claim]:
    """All pairs are judged, edge pairs beside them."""
    none, random, ours = (error(a, scene, arm, EDGE) for arm in ARMS)
    claims = [
        smaller("GPT-F10", everywhere(a, scene), 1.05, f"{scene}, {OF_ALL}"),
        in_a_row("GPT-F10", (ours, none), f"{scene}, adaptive / no neighbours, edge pairs"),
        *spared(a, scene),
    ]
    if scene == "checker":
        claims += [
            in_a_row("GPT-F06", (ours, none), f"{scene}, aligned / no neighbours, edge pairs"),
            in_a_row("GPT-F06", (ours, random), f"{scene}, aligned / random neighbours, edge pairs"),
            unchanged(a, scene),
        ]
    return claims


def on_the_map(a: Arrays) -> list[Claim]:
    """Edge pairs that have neighbours on their own edge are judged, and all pairs."""
    none, random, ours = (error(a, MAP, arm, EDGE) for arm in ARMS)
    claims = [
        smaller("GPT-F10", everywhere(a, MAP), 1.05, f"{MAP}, {OF_ALL}"),
        smaller("GPT-F10", (ours, none), 0.9, f"{MAP}, adaptive / no neighbours, edge pairs"),
        *spared(a, MAP),
        smaller("GPT-F06", (ours, none), 1, f"{MAP}, aligned / no neighbours, edge pairs"),
        smaller("GPT-F06", (ours, random), 1, f"{MAP}, aligned / random neighbours, edge pairs"),
        unchanged(a, MAP),
    ]
    return [under_a_still_camera(claim) for claim in claims]


def under_a_still_camera(claim: Claim) -> Claim:
    """Other conditions than the paper's: a pass has a caveat, and nothing is refuted."""
    judged = claim.outcome is not None and claim.outcome.passed is not None
    return replace(claim, caveat=STILL, counter=None) if judged else claim


STILL = "A map stands still, under a paper's moving camera."
OF_ALL = "adaptive / random neighbours, all pairs"


def everywhere(a: Arrays, scene: str) -> tuple[Array, Array]:
    """Variance over all pairs, of adaptive reuse and of random neighbours."""
    return error(a, scene, "adaptive", ALL), error(a, scene, "random neighbours", ALL)


def spared(a: Arrays, scene: str) -> list[Claim]:
    """The rays that adaptive reuse does not spend."""
    return [
        Claim("GPT-F10", criteria.above(saved(a, scene), 0.25), f"{scene}, rays of spatial reuse of pairs saved"),
        Claim("GPT-F10", criteria.reported(of_all(a, scene)), f"{scene}, of all rays of a frame", reason=EDGES_DECIDE),
    ]


def in_a_row(id_: str, pair: tuple[Array, Array], part: str) -> Claim:
    """Reported, not judged: what aligned neighbours are good for is not in a row, whose edges are single points."""
    scene = part.partition(",")[0]
    why = f"A row has no neighbours on the same edge: {alike_in(scene)}.  The map judges, and GPT-F10-3D in space."
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
    """Interior pairs reuse in space in neither arm, but under a moving camera in time from pairs that were edges."""
    pair = error(a, scene, "adaptive", INTERIOR), error(a, scene, "no neighbours", INTERIOR)
    claim = compared("GPT-F06", pair, inside(0.9, 1.1), f"{scene}, aligned / no neighbours, interior pairs")
    return replace(claim, reason=f"{claim.reason}  {BESIDE_EDGES}".lstrip()) if scene in SCENES else claim


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
    """Variance of dx along the rows, the map's share of edge pairs, and means at edges and elsewhere."""
    views = (*SCENES, MAP)
    picture, axes = style.panels(len(views), 2, width=4.2, height=2.7)
    for (left, right), scene in zip(axes, views, strict=True):
        for k, arm in enumerate(ARMS):
            dx = a[f"{scene}.{arm}.dx"]
            along = dx.var(axis=0, ddof=1)
            along = along if scene in SCENES else along.reshape(SIDE, SIDE - 1).mean(axis=0)
            left.semilogy(np.arange(len(along)), along + FLOOR, lw=0.8, **style.nth(k, marker="", label=arm))
            means = [error(a, scene, arm, where).mean() for where in (EDGE, INTERIOR)]
            look = {"color": style.nth(k)["color"], "hatch": style.HATCHES[k], "edgecolor": style.PAPER}
            right.bar(np.arange(2) + 0.27 * (k - 1), means, 0.25, label=arm, **look)
        title, pair, unit = (f"{scene}, moving", "pair of pixels", "radiance$^2$")
        if scene == MAP:
            title, pair, unit = f"{scene}, still", "pair of pixels, mean over rows", "(radiance x radian)$^2$"
        left.set(xlabel=pair, ylabel=f"variance of dx ({unit})", title=title)
        right.set_xticks([0, 1], [EDGE, INTERIOR])
        right.set(xlabel="pairs", ylabel=f"variance ({unit})", title=f"{scene}: means, {len(dx)} replicas")
        right.grid(axis="x", visible=False)
    style.below(axes[-1, 1], ncols=3)
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
            Setup(
                "real time", "moving", "all", "whole rows of checker floor (FS6) and posts (FS5); a map of posts, still"
            ),
        ),
    ),
    arm="reuse",
    presets={
        "quick": {"replicas": 2, "map": {"replicas": 2, "blocks": 1, "frames": 3}},
        "paper": {"replicas": 128, "map": {"replicas": 32, "blocks": 2, "frames": GRADIENT.pairs.cap}},
    },
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)
