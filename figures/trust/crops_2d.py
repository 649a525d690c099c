"""Crop against radius: what reuse in space is worth to an image and to its differences depends on both.

Maps of the occluders' fluence, all around the same corner of a post: from a twentieth of the room to all of it, in as
many pixels.  Variances over replicas of the last frame, times rays: of the image and of its differences with a round of
reuse in space by all pixels and pairs over those without, and of L2 over the best image without differences.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims.figure import Arrays, Claim, Figure
from figures.experiments.gradients import DENSE, MAP_FRAMES, MAPS, NONE, gradient_view, grey, spread
from figures.experiments.views import setting
from figures.report import style
from flatland2d.sensors import FluenceMap
from restir_ref.batch import Array
from restir_ref.chance import Chance, Live
from restir_ref.gradient_loop import GRADIENT, PRIMAL, GradientPreset, History, View, shaded, step
from restir_ref.poisson import l2
from restir_ref.transport.counting import rays

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Picture

SCENE, SIDE, ALL = "occluders", 16, 1.0
CROPS = (0.05, 0.15, 0.45, ALL)
"""Widths of crops, in units of length; the last one is the whole scene."""

RADII = (0, 2, 4, 8)
"""Pixels, of the SIDE along a film; 0 is no reuse in space."""


def chunks(preset: Any) -> Sequence[dict[str, Any]]:
    """One per crop and radius."""
    return [{"crop": crop, "radius": radius} for crop in CROPS for radius in RADII]


def sensor(crop: float) -> FluenceMap:
    """The map of that width around the middle of the scene's crop, or of all of it."""
    s, (x, y), half = setting(SCENE), MAPS[SCENE], crop / 2
    low, high = (s.low, s.high) if crop == ALL else ((x - half, y - half), (x + half, y + half))
    return FluenceMap(low, high, SIDE, SIDE)


def preset_of(radius: float) -> GradientPreset:
    """The gradient renderer's parameters with that radius for pixels and for pairs."""
    pixels, pairs = (replace(each, radius=radius) for each in (GRADIENT.pixels, GRADIENT.pairs))
    return GradientPreset(replace(pixels, rounds=GRADIENT.pixels.rounds if radius else 0), pairs)


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """Image and differences of the last frame, (replicas, n) each; rays per pixel of both, and of the image alone."""
    film, chosen, asked, chance = sensor(chunk["crop"]), preset_of(chunk["radius"]), Counter[str](), Live(rng)
    view = gradient_view(SCENE, (film, film), asked, chosen, DENSE if chunk["radius"] else NONE)
    replicas, history = preset["replicas"], None
    for _ in range(preset["frames"]):
        before, history = history, stepped(view, chance, chosen, replicas, history)
    found = {name: grey(shaded(group, history[name]), replicas) for name, group in view.items()}  # type: ignore[index]
    pixels, costs = replicas * film.n, {}
    for name, of in (("rays", view), ("rays of the image", {PRIMAL: view[PRIMAL]})):
        spent = rays(asked)
        stepped(of, chance, chosen, replicas, before)
        costs[name] = np.array((rays(asked) - spent) / pixels)
    return found | costs


def stepped(view: View, chance: Chance, chosen: GradientPreset, replicas: int, history: History | None) -> History:
    """The frame of a still view after its history."""
    return step(view, chance, chosen, replicas, None if history is None else (view, history))


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """Everything by "crop.radius.name"."""
    named = zip(chunks(preset), results, strict=True)
    return {f"{c['crop']}.{c['radius']}.{name}": array for c, part in named for name, array in part.items()}


def check(a: Arrays) -> list[Claim]:
    """No paper claims it: its figures show one view of every scene."""
    return []


# ---------------------------------------------------------------- ratios


def image_cost(a: Arrays, crop: float, radius: int) -> float:
    """Variance of the image times its own rays."""
    at = f"{crop}.{radius}"
    return float(spread([a[f"{at}.{PRIMAL}"]]).mean() * a[f"{at}.rays of the image"])


def differences_cost(a: Arrays, crop: float, radius: int) -> float:
    """Variance of dx and dy times the rays of image and differences."""
    at = f"{crop}.{radius}"
    return float(spread([a[f"{at}.dx"], a[f"{at}.dy"]]).mean() * a[f"{at}.rays"])


def rebuilt_cost(a: Arrays, crop: float, radius: int) -> float:
    """Variance of L2 from image and differences times the rays of both."""
    shapes = {PRIMAL: (SIDE, SIDE), "dx": (SIDE, SIDE - 1), "dy": (SIDE - 1, SIDE)}
    images = l2(*(a[f"{crop}.{radius}.{name}"].reshape(-1, *shape) for name, shape in shapes.items()))
    return float(spread([images.reshape(len(images), -1)]).mean() * a[f"{crop}.{radius}.rays"])


def over_none(cost: Any, a: Arrays) -> Array:
    """A cost with reuse in space over that without, (radii but none, crops)."""
    return np.array([[cost(a, crop, radius) / cost(a, crop, 0) for crop in CROPS] for radius in RADII[1:]])


def over_the_best(a: Arrays) -> Array:
    """Cost of L2 over the least one of an image without differences, by any radius, (radii, crops)."""
    best = {crop: min(image_cost(a, crop, radius) for radius in RADII) for crop in CROPS}
    return np.array([[rebuilt_cost(a, crop, radius) / best[crop] for crop in CROPS] for radius in RADII])


# ---------------------------------------------------------------- the picture

FAR = 4
"""Powers of two at the ends of the colours."""


def draw(a: Arrays) -> "Picture":
    """The three ratios, by crop and radius."""
    picture, axes = style.panels(1, 3, width=3.7, height=3.2)
    replicas = len(a[f"{ALL}.0.{PRIMAL}"])
    table(axes[0, 0], over_none(image_cost, a), RADII[1:], "image: reuse in space / none")
    table(axes[0, 1], over_none(differences_cost, a), RADII[1:], "dx and dy: reuse in space / none")
    table(axes[0, 2], over_the_best(a), RADII, f"L2 / best image ({replicas} replicas)")
    return picture


def table(axis: "Axes", ratios: Array, radii: Sequence[int], title: str) -> None:
    """Ratios (radii, crops) as colours and numbers."""
    shown = axis.imshow(np.log2(ratios), cmap="RdBu_r", vmin=-FAR, vmax=FAR, origin="lower", aspect="auto")
    for (row, column), ratio in np.ndenumerate(ratios):
        colour = style.PAPER if abs(np.log2(ratio)) > FAR / 2 else style.INK
        axis.text(column, row, f"{ratio:.2g}", ha="center", va="center", color=colour)
    axis.set_xticks(range(len(CROPS)), [*(f"{crop:g}" for crop in CROPS[:-1]), "all"])
    axis.set_yticks(range(len(radii)), [f"{radius}/{SIDE}" if radius else "none" for radius in radii])
    axis.set(xlabel="width of the crop", ylabel="radius, of the film", title=title)
    axis.grid(visible=False)
    axis.figure.colorbar(shown, ax=axis, label="log2 of the ratio", shrink=0.8)


FIGURE = Figure(
    id="CROPS-2D",
    title="Crop against radius",
    world="flatland2d",
    source="of this project, about [GPT 4.3.2, 5.1]",
    claims=(),
    presets={"quick": {"replicas": 3, "frames": 3}, "paper": {"replicas": 64, "frames": MAP_FRAMES}},
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)
