"""GPT Fig. 7 and 8: gradient images at equal rays, and what reconstruction makes of them.

Three maps of flatland's fluence, each a crop with an edge that was fixed before anything was measured, without the
light that the map's own rays meet.  The last of ten frames of a still map is judged by its variance over replicas: all
three estimates of differences are unbiased, so that this is their squared error.  A frame with pair reuse is compared
with as many averaged ones of the others as cost its rays.  Images are compared by their squared error and by the same
relative to the reference pixel, as the paper names neither.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims import criteria
from figures.claims.figure import Arrays, Claim, Conditions, Figure, Setup
from figures.experiments import by_metrics
from figures.experiments.by_metrics import Bands
from figures.experiments.gradients import (
    CROP,
    MAPS,
    METHODS,
    SIDE,
    averaged,
    path_traced,
    rendered,
    spread,
    temporal_only,
)
from figures.experiments.replicas import few
from figures.experiments.views import setting
from figures.report import style
from flatland2d.fluence import fluence_map
from flatland2d.pictures import fluence_picture
from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.poisson import ALPHA, l2

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Picture

SCENES = ("occluders", "ajar", "checker")
ONE = "one leaf"
"""Path tracing that shifts one leaf of every tree, chosen by its light."""

ARMS = {**METHODS, "temporal": temporal_only, ONE: path_traced}
SHARES = {"with": 1, "after": 2, "path tracing": 4, "temporal": 3, ONE: 4}
"""Images of each method that are averaged: about as many as cost one frame's rays."""


def chunks(preset: Any) -> Sequence[dict[str, str]]:
    """One per scene and method."""
    return [{"scene": scene, "method": method} for scene in SCENES for method in ARMS]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """The image and its differences, (replicas, n) each, and rays per pixel; as many more as are averaged."""
    replicas = preset["replicas"] * SHARES[chunk["method"]]
    return rendered(f"{chunk['scene']} map", ARMS[chunk["method"]], replicas, rng)


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """Everything by "scene.method.name"."""
    named = zip(chunks(preset), results, strict=True)
    return {f"{at['scene']}.{at['method']}.{key}": each for at, part in named for key, each in part.items()}


def at_equal_rays(a: Arrays, scene: str, method: str) -> dict[str, Array]:
    """Means over images that cost about one frame with pair reuse: image, dx and dy, (R, n) each."""
    return {name: averaged(a[f"{scene}.{method}.{name}"], SHARES[method]) for name in ("primal", "dx", "dy")}


def gradient_error(a: Arrays, scene: str, method: str) -> Array:
    """Variance of dx and dy at the rays of one frame with pair reuse, of every replica; (R,)."""
    found = at_equal_rays(a, scene, method)
    return spread([found["dx"], found["dy"]]) * rays_of(a, scene, method)


def rays_of(a: Arrays, scene: str, method: str) -> float:
    """Rays of the averaged images over those of one frame with pair reuse."""
    return float(a[f"{scene}.{method}.rays"] * SHARES[method] / a[f"{scene}.with.rays"])


def rebuilt(a: Arrays, scene: str, method: str) -> Array:
    """L2 reconstruction of every replica from a method's own image and differences, (R, SIDE, SIDE)."""
    found = at_equal_rays(a, scene, method)
    shapes = {"primal": (SIDE, SIDE), "dx": (SIDE, SIDE - 1), "dy": (SIDE - 1, SIDE)}
    primal, dx, dy = (found[name].reshape(-1, *shape) for name, shape in shapes.items())
    return np.asarray(l2(primal, dx, dy))


def truth(a: Arrays, scene: str) -> Array:
    """The mean of a scene's L2 images by all methods: all are unbiased; (SIDE, SIDE)."""
    return np.asarray(np.mean([rebuilt(a, scene, method).mean(axis=0) for method in METHODS], axis=0))


def primal(a: Arrays, scene: str) -> Bands:
    """Noise of the better image of ReSTIR without differences, by either metric: with a round in space, or without."""
    images = {name: at_equal_rays(a, scene, name)["primal"].reshape(-1, SIDE, SIDE) for name in ("after", "temporal")}
    return by_metrics.best([bands(a, scene, each, rays_of(a, scene, name)) for name, each in images.items()])


def bands(a: Arrays, scene: str, images: Array, cost: float) -> Bands:
    """Variance of images times the rays they cost by band and metric, (R,): all of it, and below and above alpha.

    Below alpha there is the mean alone in so small a map.
    """
    right = truth(a, scene)
    return by_metrics.bands(by_metrics.off(images, right, cost, 0.0), right, ALPHA)


def noise_of(a: Arrays, scene: str, method: str) -> Bands:
    """That of a method's reconstruction."""
    return bands(a, scene, rebuilt(a, scene, method), rays_of(a, scene, method))


def check(a: Arrays) -> list[Claim]:
    """Pair reuse against both others in every scene; reconstruction above alpha against the better image alone."""
    claims = []
    for scene in SCENES:
        ours = gradient_error(a, scene, "with")
        after, traced = (gradient_error(a, scene, method) for method in ("after", "path tracing"))
        for name, theirs in (("after", after), ("path tracing", traced)):
            more = criteria.ratio_above(ours, theirs, 1)
            outcome = criteria.ratio_below(ours, theirs, LIMIT)
            claims.append(Claim("GPT-F07", outcome, f"{scene}, with / {name}", counter=more, caveat=OF_MAPS))
        text = criteria.ratio_interval(after, traced)[2]
        claims.append(Claim("GPT-F07", criteria.reported(text), f"{scene}, after / path tracing"))
        text = criteria.ratio_interval(traced, gradient_error(a, scene, ONE))[2]
        claims.append(Claim("GPT-F07", criteria.reported(text), f"{scene}, path tracing by whole trees / by one leaf"))
    return [*claims, *reconstruction(a)]


OF_MAPS = (
    "In flatland only, of a still map.  Path tracing shifts whole trees, and traces once what their leaves share.  "
    "With pair reuse, image and pairs read one tree per pixel; the paper draws anew.  "
    "By the ray to the left of their middles, the pixels of two maps have no edges: their pairs reuse in time alone."
)


LIMIT = 0.8
"""What pair reuse has to be below, of others' differences, and of the better image above alpha."""

BANDS = {"total": "all frequencies", "low": "its mean", "high": "above alpha"}


def reconstruction(a: Arrays) -> list[Claim]:
    """Noise of the reconstruction against that of the primal image, and against the other gradients'."""
    claims = []
    for scene in SCENES:
        ours, image = noise_of(a, scene, "with"), primal(a, scene)
        for band, name in BANDS.items():
            compared, part = by_metrics.pairs(ours[band], image[band]), f"{scene}, L2 with / primal, {name}"
            high = by_metrics.smaller("GPT-F08", compared, LIMIT, part, OF_MAPS) if band == "high" else None
            claims.append(high or by_metrics.told("GPT-F08", compared, part))
        for method in ("after", "path tracing"):
            compared = by_metrics.pairs(ours["total"], noise_of(a, scene, method)["total"])
            claims.append(by_metrics.told("GPT-F08", compared, f"{scene}, L2 with / L2 {method}"))
        black = (a[f"{scene}.path tracing.primal"] == 0).all(axis=0).reshape(SIDE, SIDE)
        claims.append(unlit("GPT-F08", rebuilt(a, scene, "with"), black, f"{scene}, pixels that no light reaches"))
    return claims


def unlit(id_: str, images: Array, black: Array, part: str) -> Claim:
    """How many pixels are black in all replicas of path tracing, and their share of either error of images."""
    if trouble := few(images):
        return Claim(id_, None, part, reason=trouble)
    noise, of = images.var(axis=0), by_metrics.units(images.mean(axis=0) * ~black)
    shares = ", ".join(f"{m} {(noise / u**2)[black].sum() / (noise / u**2).sum():.1%}" for m, u in of.items())
    return Claim(id_, criteria.reported(f"{black.mean():.1%} of all, of L2's {shares}"), part, reason=INSIDE)


INSIDE = "What is inside of a post or a wall.  ReSTIR and paths leave it black, and the Poisson equation does not."


def draw(a: Arrays) -> "Picture":
    """Where the crop lies, one replica's dx of every method, and their errors."""
    picture, axes = style.panels(len(SCENES), 5, width=2.7, height=2.4)
    for row, scene in zip(axes, SCENES, strict=True):
        whole_view(row[0], scene)
        high = scale(a[f"{scene}.with.dx"])
        for axis, method in zip(row[1:], METHODS, strict=False):
            image = at_equal_rays(a, scene, method)["dx"][0].reshape(SIDE, SIDE - 1)
            shown = axis.imshow(image, vmin=-high, vmax=high, cmap="PuOr", origin="lower")
            axis.set(title=f"{scene}: {method}", xlabel="pair of pixels", ylabel="pixel")
            axis.grid(visible=False)
            picture.colorbar(shown, ax=axis, label="$I_{i+1} - I_i$, fluence", shrink=0.8)
        for method in METHODS:
            row[4].bar(method, gradient_error(a, scene, method).mean(), **style.bar(method))
        row[4].set(ylabel="variance (fluence$^2$)", title=f"{scene}, equal rays")
        row[4].tick_params(axis="x", labelrotation=20)
        row[4].grid(axis="x", visible=False)
    return picture


ROWS, SAMPLES, SEED = 40, 12, 1
"""Rows of the small map of a whole scene, its samples per pixel, and their seed: it is looked at alone."""


def whole_view(axis: "Axes", scene: str) -> None:
    """The fluence of a whole scene, all light, and where the crop of its map lies."""
    s, (x, y) = setting(scene), MAPS[scene]
    width, height = np.subtract(s.high, s.low)
    chance = Live(np.random.default_rng(SEED))
    fluence_picture(axis, s, fluence_map(s, round(ROWS * width / height), ROWS, SAMPLES, chance))
    bounds = (x - CROP / 2, y - CROP / 2, CROP, CROP)
    for colour, line in ((style.PAPER, 3.0), (style.INK, 1.2)):
        axis.indicate_inset(bounds, edgecolor=colour, linewidth=line, alpha=1, zorder=4)
    axis.set(title=f"{scene}: the crop (square)")


def scale(dx: Array) -> float:
    """The largest difference shown: of the mean image, and three standard deviations."""
    return float(np.quantile(abs(dx.mean(axis=0)), 0.98) + 3 * dx.std(axis=0).mean())


FIGURE = Figure(
    id="GPT-F07",
    title="Gradient images at equal rays",
    world="flatland2d",
    source="[GPT Fig. 7, 8; 5.1]",
    claims=("GPT-F07", "GPT-F08"),
    conditions=(
        Conditions(
            ("GPT-F07", "GPT-F08"),
            "[GPT Fig. 7, 8; 5]",
            Setup("real time", "moving", "all", "Classroom, Veach-Ajar, Kitchen"),
            Setup("real time", "still", "all", "maps at a post, a slit, a checker floor"),
            "A fluence map has no camera to move.  Light that its own rays meet is left out: it would hide all else.  "
            "Its G-buffer is what a ray to the left of each middle meets.",
        ),
    ),
    arm="method",
    presets={"quick": {"replicas": 8}, "paper": {"replicas": 64}},
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)
