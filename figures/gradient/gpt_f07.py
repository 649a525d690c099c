"""GPT Fig. 7 and 8: gradient images at equal rays, and what reconstruction makes of them.

Three maps of flatland's fluence, each a crop with an edge that was fixed before anything was measured, without the
light that the map's own rays meet.  The last of ten frames of a still map is judged by its variance over replicas: all
three estimates of differences are unbiased, so that this is their squared error.  A frame with pair reuse is compared
with as many averaged ones of the others as cost its rays.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims import criteria
from figures.claims.figure import Arrays, Claim, Conditions, Figure, Setup
from figures.experiments.gradients import METHODS, SIDE, averaged, path_traced, rendered, spread, temporal_only
from figures.report import style
from restir_ref.batch import Array
from restir_ref.metrics import MAP, band_powers
from restir_ref.poisson import ALPHA, l2

if TYPE_CHECKING:
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


def primal(a: Arrays, scene: str) -> dict[str, Array]:
    """Noise of the better image of ReSTIR without differences: with a round in space, or without."""
    shape = (-1, SIDE, SIDE)
    each = [
        bands(at_equal_rays(a, scene, name)["primal"].reshape(shape), rays_of(a, scene, name))
        for name in ("after", "temporal")
    ]
    return min(each, key=lambda found: float(found["all frequencies"].mean()))


def bands(images: Array, cost: float) -> dict[str, Array]:
    """Variance of images times the rays they cost, (R,): all of it, and what is below and above alpha.

    Below alpha there is the mean alone in so small a map.
    """
    R = len(images)
    noise = (images - images.mean(axis=0)) * np.sqrt(R / (R - 1) * cost)
    low, high = band_powers(noise, ALPHA, MAP)
    return {"all frequencies": (noise**2).mean(axis=MAP), "its mean": low, "above alpha": high}


def noise_of(a: Arrays, scene: str, method: str) -> dict[str, Array]:
    """That of a method's reconstruction."""
    return bands(rebuilt(a, scene, method), rays_of(a, scene, method))


def check(a: Arrays) -> list[Claim]:
    """Pair reuse against both others in every scene; reconstruction reported."""
    claims = []
    for scene in SCENES:
        ours = gradient_error(a, scene, "with")
        after, traced = (gradient_error(a, scene, method) for method in ("after", "path tracing"))
        for name, theirs, limit in (("after", after, 0.8), ("path tracing", traced, 1.0)):
            more = criteria.ratio_above(ours, theirs, 1)
            outcome = criteria.ratio_below(ours, theirs, limit)
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


def reconstruction(a: Arrays) -> list[Claim]:
    """Noise of the reconstruction against that of the primal image, and against the other gradients'."""
    claims = []
    for scene in SCENES:
        ours, image = noise_of(a, scene, "with"), primal(a, scene)
        for band, mine in ours.items():
            text = criteria.ratio_interval(mine, image[band])[2]
            claims.append(Claim("GPT-F08", criteria.reported(text), f"{scene}, L2 with / primal, {band}"))
        for method in ("after", "path tracing"):
            theirs = noise_of(a, scene, method)["all frequencies"]
            text = criteria.ratio_interval(ours["all frequencies"], theirs)[2]
            claims.append(Claim("GPT-F08", criteria.reported(text), f"{scene}, L2 with / L2 {method}"))
    return claims


def draw(a: Arrays) -> "Picture":
    """One replica's dx of every method, and their errors."""
    picture, axes = style.panels(len(SCENES), 4, width=3.0, height=2.4)
    for row, scene in zip(axes, SCENES, strict=True):
        high = scale(a[f"{scene}.with.dx"])
        for axis, method in zip(row, METHODS, strict=False):
            image = at_equal_rays(a, scene, method)["dx"][0].reshape(SIDE, SIDE - 1)
            shown = axis.imshow(image, vmin=-high, vmax=high, cmap="PuOr", origin="lower")
            axis.set(title=f"{scene}: {method}", xlabel="pair of pixels", ylabel="pixel")
            axis.grid(visible=False)
            picture.colorbar(shown, ax=axis, label="$I_{i+1} - I_i$, fluence", shrink=0.8)
        for method in METHODS:
            row[3].bar(method, gradient_error(a, scene, method).mean(), **style.bar(method))
        row[3].set(ylabel="variance ((radiance x radian)$^2$)", title=f"{scene}, equal rays")
        row[3].tick_params(axis="x", labelrotation=20)
        row[3].grid(axis="x", visible=False)
    return picture


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
