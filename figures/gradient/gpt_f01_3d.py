"""GPT Fig. 1 in space: differences and reconstructed images at equal rays, under a moving camera.

Each scene is seen through the middle of its own inset of the virtual 1920 x 1080 film, which was fixed long before;
the crop follows what its centre sees.  Of the up to four previous pixels that a moved one overlaps, one is asked,
chosen by its share of the area: with all four, a frame with pair reuse costs six times the rays.  Such a frame is
compared with as many averaged ones of the others as cost its rays.  All are unbiased before reconstruction, and L2
keeps that, so that the variance over replicas is the squared error; of L1 it leaves out the bias.
"""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims import criteria
from figures.claims.figure import Arrays, Claim, Conditions, Figure, Setup
from figures.experiments import solid
from figures.experiments.following import followed, frugal, views_of
from figures.experiments.gradients import ADAPTIVE, METHODS, Method, averaged, spread, temporal_only
from figures.experiments.replicas import few, smaller
from figures.report import style
from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.gradient_loop import GRADIENT
from restir_ref.metrics import MAP, band_powers
from restir_ref.poisson import ALPHA, l2
from restir_ref.poisson_l1 import l1
from tracer3d.scenes import checker

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture

SCENES = {**solid.SCENES, "Checker3": checker}
ARMS: Mapping[str, Method] = MappingProxyType({**METHODS, "temporal": temporal_only})
SHARES = {"with": 1, "after": 2, "path tracing": 4, "temporal": 3}
"""Images of each method that are averaged: about as many as cost one frame's rays."""

NORMS: Mapping[str, Callable[..., Array]] = MappingProxyType({"L2": l2, "L1": l1})


def chunks(preset: Any) -> Sequence[dict[str, Any]]:
    """One per scene, method and block of replicas."""
    return [
        {"scene": scene, "method": method, "block": block}
        for scene in preset["scenes"]
        for method in ARMS
        for block in range(preset["blocks"])
    ]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """Averages at equal rays of image and differences, (replicas, n), the L2 and L1 images, and rays per pixel."""
    side, share, asked = preset["side"], SHARES[chunk["method"]], Counter[str]()
    s = SCENES[chunk["scene"]]()
    views = views_of(s, followed(s, side, preset["frames"]), GRADIENT, ADAPTIVE, asked)
    found = ARMS[chunk["method"]]([*map(frugal, views)], asked, share * preset["replicas"], Live(rng))
    mean = {name: averaged(found[name], share) for name in ("primal", "dx", "dy")}
    shapes = {"primal": (side, side), "dx": (side, side - 1), "dy": (side - 1, side)}
    inputs = [mean[name].reshape(-1, *shape) for name, shape in shapes.items()]
    rebuilt = {name: norm(*inputs) for name, norm in NORMS.items() if chunk["method"] in METHODS}
    return mean | rebuilt | {"rays": found["rays"] * share}


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """All blocks by "scene.method.name"; rays as their mean."""
    found: dict[str, list[Array]] = {}
    for at, part in zip(chunks(preset), results, strict=True):
        for key, each in part.items():
            found.setdefault(f"{at['scene']}.{at['method']}.{key}", []).append(each)
    return {
        key: np.asarray(np.mean(parts)) if key.endswith("rays") else np.concatenate(parts)
        for key, parts in found.items()
    }


def dearer(a: Arrays, scene: str, method: str) -> float:
    """Rays of a method's average over those of one frame with pair reuse."""
    return float(a[f"{scene}.{method}.rays"] / a[f"{scene}.with.rays"])


def gradient_error(a: Arrays, scene: str, method: str) -> Array:
    """Variance of dx and dy at the rays of one frame with pair reuse, of every replica; (R,)."""
    return spread([a[f"{scene}.{method}.dx"], a[f"{scene}.{method}.dy"]]) * dearer(a, scene, method)


def bands(a: Arrays, scene: str, method: str, image: str) -> dict[str, Array]:
    """Variance of an image at equal rays, (R,): all of it, and its power below and above alpha."""
    images = a[f"{scene}.{method}.{image}"]
    R = len(images)
    side = round(images[0].size ** 0.5)
    noise = ((images - images.mean(axis=0)) * np.sqrt(R / (R - 1) * dearer(a, scene, method))).reshape(R, side, side)
    low, high = band_powers(noise, ALPHA, MAP)
    return {"total": (noise**2).mean(axis=MAP), "low": low, "high": high}


def primal(a: Arrays, scene: str) -> dict[str, Array]:
    """The bands of the better image without differences: with reuse in space, or without."""
    each = [bands(a, scene, method, "primal") for method in ("after", "temporal")]
    return min(each, key=lambda found: float(found["total"].mean()))


def scenes_of(a: Arrays) -> list[str]:
    """The scenes that were rendered."""
    return [scene for scene in SCENES if f"{scene}.with.dx" in a]


def check(a: Arrays) -> list[Claim]:
    """The high band of what is reconstructed, against differences by path tracing and against the image alone."""
    claims = []
    for scene in scenes_of(a):
        alone = primal(a, scene)["high"]
        for norm in NORMS:
            ours, after, traced = (bands(a, scene, method, norm)["high"] for method in METHODS)
            part = f"{scene}, {norm}, high band, with"
            claims.append(smaller("GPT-F01", (ours, traced), 0.8, f"{part} / path tracing", ONE_LEAF))
            claims.append(smaller("GPT-F01", (ours, alone), 0.8, f"{part} / image alone"))
            claims.append(told("GPT-F01", (ours, after), f"{part} / after"))
    return claims


ONE_LEAF = "The baseline shifts one leaf of each path tree.  With pair reuse, image and pairs read one tree per pixel."


def told(id_: str, pair: tuple[Array, Array], part: str) -> Claim:
    """Reported, if replicas are enough to tell."""
    if few(pair[0]):
        return Claim(id_, None, part, reason=few(pair[0]))
    return Claim(id_, criteria.reported(criteria.ratio_interval(*pair)[2]), part)


def draw(a: Arrays) -> "Picture":
    """dx by two methods in one replica, and the errors of differences and of images."""
    scenes = scenes_of(a)
    picture, axes = style.panels(len(scenes), 4, width=3.0, height=2.6)
    for row, scene in zip(axes, scenes, strict=True):
        side = round(a[f"{scene}.with.primal"][0].size ** 0.5)
        high = float(
            np.quantile(abs(a[f"{scene}.with.dx"].mean(axis=0)), 0.98) + a[f"{scene}.with.dx"].std(axis=0).mean()
        )
        for axis, method in zip(row, ("with", "path tracing"), strict=False):
            image = a[f"{scene}.{method}.dx"][0].reshape(side, side - 1)
            shown = axis.imshow(image, vmin=-high, vmax=high, cmap="PuOr")
            axis.set(title=f"{scene}: {method}", xlabel="pair of pixels", ylabel="pixel")
            axis.grid(visible=False)
            picture.colorbar(shown, ax=axis, label="$I_{i+1} - I_i$, radiance", shrink=0.8)
        for method in METHODS:
            row[2].bar(method, gradient_error(a, scene, method).mean(), **style.bar(method))
        row[2].set(ylabel="variance of dx, dy (radiance$^2$)", title="differences, equal rays")
        row[2].tick_params(axis="x", labelrotation=20)
        row[2].grid(axis="x", visible=False)
        powers(row[3], a, scene)
    style.below(axes[-1, 3], ncols=2)
    return picture


def powers(axis: Any, a: Arrays, scene: str) -> None:
    """Variance of the L2 images by band, beside the image alone."""
    found = {method: bands(a, scene, method, "L2") for method in METHODS}
    for k, (method, each) in enumerate(found.items()):
        axis.bar(np.arange(2) + 0.2 * (k - 1.5), [each[b].mean() for b in ("total", "high")], 0.18, **style.bar(method))
    alone = primal(a, scene)
    axis.bar(np.arange(2) + 0.3, [alone[b].mean() for b in ("total", "high")], 0.18, **style.bar("image alone"))
    axis.set_xticks([0, 1], ["all", "above alpha"])
    axis.set(yscale="log", xlabel="frequencies", ylabel="variance (radiance$^2$)", title="L2 images, equal rays")
    axis.grid(axis="x", visible=False)


FIGURE = Figure(
    id="GPT-F01-3D",
    title="Differences and reconstructed images in space",
    world="tracer3d",
    source="[GPT Fig. 1; 5.1]",
    claims=("GPT-F01",),
    conditions=(
        Conditions(
            ("GPT-F01",),
            "[GPT Fig. 1; 5]",
            Setup("real time", "moving", "all", "Aachen Toys"),
            Setup("real time", "moving", "all", "insets of CB3, Ajar3, Checker3"),
        ),
    ),
    arm="method",
    presets={
        "quick": {"scenes": ["CB3", "Ajar3", "Checker3"], "replicas": 2, "blocks": 1, "side": 6, "frames": 2},
        "paper": {"scenes": ["CB3", "Ajar3", "Checker3"], "replicas": 16, "blocks": 4, "side": 32, "frames": 12},
    },
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)
