"""When reuse pays, in flatland: predicted from passes over four trees, measured over one to thirty-two.

Reuse pays up to M* trees per pixel (`experiments.reuse`).  Offline frames begin with 32 trees: where the ratio of what
a shifted path carries varies much, reuse makes them worse, the more so the farther the neighbours and the more rounds.
"""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims.figure import Arrays, Claim, Figure
from figures.experiments import reuse
from figures.experiments.views import HYBRID, at_random, view
from figures.report import style
from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.integrals import Image
from restir_ref.loop import OFFLINE

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure as Picture

SCENES, RADII = ("cornell", "glossy_cornell", "ajar"), (6, 10, 30)
KNOWN, TREES = 4, (1, 4, 8, 32)
"""Trees of the passes that predict, and of those that are measured."""
OFTEN = OFFLINE.trees
ROUNDS_LOOK = 3
"""The look of several rounds, after those of three radii, in every picture."""
TILE = 8
"""Pixels whose variances are averaged."""


def chunks(preset: Any) -> Sequence[dict[str, Any]]:
    """One per scene and radius."""
    return [{"scene": scene, "radius": radius} for scene in SCENES for radius in RADII]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """`measured` of a scene's inset."""
    of = view(chunk["scene"], HYBRID, Counter())
    return measured(of, reuse.distinct(of, at_random, chunk["radius"], Live(rng)), preset["replicas"], rng)


def measured(of: Image, near: Sequence[Array], replicas: int, rng: np.random.Generator) -> Arrays:
    """sigma2, S and Q of every pixel (n,), and variances (TREES, n): without reuse, after one round, after three."""
    found, chance = reuse.split(of, near, KNOWN, replicas, Live(rng)), Live(rng)
    rounds = OFFLINE.rounds
    made = [reuse.images(of, near, M, replicas, chance, rounds) for M in TREES]
    kept = {"without": 0, "one": 1, "three": rounds}
    variances = {name: np.stack([each[k].var(axis=0, ddof=1) for each in made]) for name, k in kept.items()}
    return {**vars(found), **variances}


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """Everything by "scene.radius.name"."""
    named = zip(chunks(preset), results, strict=True)
    return {f"{c['scene']}.{c['radius']}.{name}": array for c, part in named for name, array in part.items()}


def check(a: Arrays) -> list[Claim]:
    """No paper claims it; that prediction and measurement agree is a law among the tests."""
    return []


def of(a: Arrays, scene: str, radius: int) -> reuse.Split:
    """The split of a scene and radius."""
    return reuse.Split(*(a[f"{scene}.{radius}.{name}"] for name in ("sigma2", "S", "Q")))


def gains(a: Arrays, scene: str, radius: int, tile: Callable[[Array], Array]) -> tuple[Array, Array]:
    """Variance without reuse over that after one round, 32 trees, by tile: predicted and measured."""
    s, name = of(a, scene, radius), f"{scene}.{radius}"
    predicted = tile(s.without(OFTEN)) / tile(s.with_reuse(OFTEN))
    at = TREES.index(OFTEN)
    return predicted, tile(a[f"{name}.without"][at]) / tile(a[f"{name}.one"][at])


def in_row(pixels: Array) -> Array:
    """Means of TILE pixels of a row each."""
    return np.asarray(pixels.reshape(-1, TILE).mean(axis=1))


def draw(a: Arrays) -> "Picture":
    """Variance with reuse over that without, against trees; and gains of tiles, predicted against measured."""
    return pictured(a, SCENES, RADII, in_row)


FROM_TREES = f"gain predicted from {KNOWN} trees"


def pictured(
    a: Arrays, scenes: Sequence[str], radii: Sequence[int], tile: Callable[[Array], Array], known: str = FROM_TREES
) -> "Picture":
    """One panel per scene, and gains on the right, whose prediction is `known` from something; all worlds."""
    picture, axes = style.panels(1, len(scenes) + 1, width=3.2, height=3.9)
    for axis, scene in zip(axes[0], scenes, strict=False):
        ratios(axis, a, scene, radii)
    scatter(axes[0, -1], {scene: [gains(a, scene, r, tile) for r in radii] for scene in scenes}, known)
    return picture


def ratios(axis: "Axes", a: Arrays, scene: str, radii: Sequence[int]) -> None:
    """Variance after reuse over that without, predicted as a line, measured as marks; by radius."""
    M = np.geomspace(TREES[0], TREES[-1], 50)
    for k, radius in enumerate(radii):
        s, name = of(a, scene, radius), f"{scene}.{radius}"
        line = [s.with_reuse(m).sum() / s.without(m).sum() for m in M]
        axis.loglog(M, line, **style.nth(k, marker="", label=f"radius {radius}, predicted"))
        once = a[f"{name}.one"].sum(axis=1) / a[f"{name}.without"].sum(axis=1)
        axis.loglog(TREES, once, **style.nth(k, ls="", label=f"radius {radius}, one round"), markevery=1)
    thrice = a[f"{scene}.{OFFLINE.radius}.three"].sum(axis=1) / a[f"{scene}.{OFFLINE.radius}.without"].sum(axis=1)
    words = f"radius {OFFLINE.radius:g}, {OFFLINE.rounds} rounds"
    axis.loglog(TREES, thrice, **style.nth(ROUNDS_LOOK, ls=":", label=words), markevery=1)
    axis.axhline(1, color=style.INK, lw=1, ls="-", marker="", label="no gain, no loss")
    axis.set_xticks([], minor=True)
    axis.set_xticks(TREES, [str(M) for M in TREES])
    in_halves(axis.yaxis)
    axis.set(xlabel="trees per pixel $M$", ylabel="variance with / without reuse", title=scene)
    style.below(axis, ncols=1)


def in_halves(axis: "Axis") -> None:
    """Ticks at 1, 2 and 5 times the powers of ten."""
    from matplotlib.ticker import LogLocator  # noqa: PLC0415  (drawing only)

    axis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    axis.set_major_formatter("{x:g}")
    axis.set_minor_formatter("")


def scatter(axis: "Axes", found: Mapping[str, Sequence[tuple[Array, Array]]], known: str) -> None:
    """Predicted against measured gains of tiles, 32 trees, all radii."""
    low, high = np.inf, 0.0
    for k, (scene, pairs) in enumerate(found.items()):
        predicted, measured = (np.concatenate(each) for each in zip(*pairs, strict=True))
        axis.loglog(predicted, measured, **style.nth(k, ls="", label=scene, markersize=2.5), markevery=1)
        low, high = min(low, predicted.min(), measured.min()), max(high, predicted.max(), measured.max())
    axis.plot([low, high], [low, high], color=style.GREY, lw=1, ls="-", marker="", label="as predicted")
    for each in (axis.xaxis, axis.yaxis):
        in_halves(each)
    axis.set(xlabel=known, ylabel="gain measured", title=f"Tiles, {OFTEN} trees, one round")
    style.below(axis, ncols=1)


FIGURE = Figure(
    id="PAYS-2D",
    title="When reuse pays, in flatland",
    world="flatland2d",
    source="of this project, about [GRIS 8.3, 9.1]",
    claims=(),
    presets={"quick": {"replicas": 24}, "paper": {"replicas": 1024}},
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)
