"""GPT Fig. 5: temporal reuse by fractional motion vectors, against whole pixels.

The whole floor of squares in 480 pixels, under a camera that moves by .3 pixels per frame.  Both arms keep the place on
the film with the sample.  By area, a pixel's square overlaps two previous pixels, and a sample's place moves as what it
shows; by point, history is that of the nearest pixel, here the same one, and the place stays, so that what is reused
was seen .3 pixels away, and after some frames further.  Both are unbiased; the variance of the last frame over replicas
is the squared error.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims import criteria
from figures.claims.figure import Arrays, Claim, Conditions, Figure, Setup
from figures.experiments.gradients import NONE, spread, with_restir
from figures.experiments.pans import panned, views_along, whole
from figures.experiments.replicas import few, smaller
from figures.experiments.withheld import withheld
from figures.report import style
from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.gradient_loop import GRADIENT, PRIMAL

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture

ARMS = ("by area", "by point")
FILM, FRAMES, STEP = 480, 12, 0.0006
"""Pixels of the film, frames, and units of length that the camera moves in each: .3 pixels on the floor."""

PRESET = replace(GRADIENT, pixels=replace(GRADIENT.pixels, rounds=0), pairs=replace(GRADIENT.pairs, rounds=0))
"""Temporal reuse alone, which is what the figure is about."""

WHAT: Mapping[str, str] = MappingProxyType({"dx": "gradient", PRIMAL: "primal"})


def chunks(preset: Any) -> Sequence[dict[str, str]]:
    """One per kind of reuse."""
    return [{"reuse": arm} for arm in ARMS]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """Image and dx of the last frame, (replicas, n), and rays per pixel."""
    asked = Counter[str]()
    views = views_along("checker", panned("checker", FILM, STEP, FRAMES), PRESET, NONE, asked)
    views = views if chunk["reuse"] == "by area" else [whole(view) for view in views]
    return with_restir(views, asked, preset["replicas"], Live(rng), PRESET)


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """Everything by "reuse.name"."""
    return {f"{arm}.{key}": each for arm, part in zip(ARMS, results, strict=True) for key, each in part.items()}


def error(a: Arrays, arm: str, name: str) -> Array:
    """Variance of the image or of dx, of every replica; (R,)."""
    return spread([a[f"{arm}.{name}"]])


def check(a: Arrays) -> list[Claim]:
    """Area against point for gradients, and whether these gain more than the image does."""
    gradient, primal = ([error(a, arm, name) for arm in ARMS] for name in WHAT)
    area, point = gradient
    parts = ("gradient, area / point", "gain of area, primal / gradient")
    if few(area):
        return [Claim("GPT-F05", None, part, reason=few(area)) for part in parts]
    return [
        smaller("GPT-F05", (area, point), 0.8, parts[0], POINT),
        withheld(Claim("GPT-F05", more_than(primal, gradient), parts[1]), ALIKE),
    ]


POINT = "Point reuse of the paper fixes the primary hit; here it keeps the place within the pixel, as area reuse does."


ALIKE = (
    "point reuse of the paper fixes the primary hit, which a pair has twice and a pixel once.  Here both arms move the "
    "place of image and pair alike, so that most of this difference is not in the experiment."
)


def more_than(ours: Sequence[Array], theirs: Sequence[Array]) -> criteria.Outcome:
    """(area / point of ours) / (area / point of theirs) > 1 with its whole interval, bootstrapped over replicas."""
    chosen = np.random.default_rng(criteria.STREAM).integers(len(ours[0]), size=(criteria.BOOTSTRAP, len(ours[0])))
    ratios = [one[chosen].mean(axis=1) / other[chosen].mean(axis=1) for one, other in (ours, theirs)]
    low, high = np.quantile(ratios[0] / ratios[1], [0.025, 0.975])
    text = f"95% {low:.4g} to {high:.4g}"
    return criteria.Outcome(text, "> 1 at 95%", bool(low > 1))


def draw(a: Arrays) -> "Picture":
    """Variance of dx along the row, and means of both."""
    picture, axes = style.panels(1, 2, width=4.2, height=3.0)
    left, right = axes[0]
    for k, arm in enumerate(ARMS):
        dx = a[f"{arm}.dx"]
        smooth = np.convolve(dx.var(axis=0, ddof=1), np.ones(9) / 9, mode="valid")
        left.semilogy(4 + np.arange(len(smooth)), smooth, **style.nth(k, marker="", label=arm))
        means = [error(a, arm, name).mean() for name in WHAT]
        look = {"color": style.nth(k)["color"], "hatch": style.HATCHES[k], "edgecolor": style.PAPER}
        right.bar(np.arange(2) + 0.35 * (k - 0.5), means, 0.33, label=arm, **look)
    left.set(
        xlabel="pair of pixels",
        ylabel="variance of dx, 9 pairs (radiance$^2$)",
        title="Checker floor, .3 pixels a frame",
    )
    right.set_xticks([0, 1], ["dx", "image"])
    right.set(
        xlabel="what is estimated", ylabel="variance (radiance$^2$)", title=f"Mean over the row, {len(dx)} replicas"
    )
    right.grid(axis="x", visible=False)
    style.below(right)
    return picture


FIGURE = Figure(
    id="GPT-F05",
    title="Area reservoirs",
    world="flatland2d",
    source="[GPT Fig. 5; 4.3.1]",
    claims=("GPT-F05",),
    conditions=(
        Conditions(
            ("GPT-F05",),
            "[GPT Fig. 5; 4.3.1]",
            Setup("real time", "moving", "all", "not named"),
            Setup("real time", "moving", "all", "checker floor (FS6), temporal reuse alone"),
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
