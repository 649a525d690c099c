"""GPT Fig. 5: temporal reuse by fractional motion vectors, against reuse of points.

The whole floor of squares in 480 pixels, under a camera that moves by .3 pixels per frame.  By area, a pixel's square
overlaps two previous pixels, and a sample's place on the film moves as what it shows.  By point, every pixel has a
primary hit of its own, and reuses the rest of the paths of the nearest previous pixel, here the same one, whose hit was
.3 pixels away: in the middle of all pixels, or at one place per frame that all pixels share, so that both of a pair do.
All are unbiased, those through the middles for what is seen there; the variance of the last frame over replicas is the
squared error, which is told over the mean square of what is estimated.  A fourth arm, beside them, keeps the place
within the pixel with the sample, but moves by whole pixels.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims import criteria
from figures.claims.figure import Arrays, Claim, Conditions, Figure, Setup
from figures.experiments.gradients import NONE, spread, with_restir
from figures.experiments.pans import panned, views_along, whole
from figures.experiments.replicas import Interval, few, over, placed, smaller, told
from figures.report import style
from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.gradient_loop import GRADIENT, PRIMAL, View, forward, pairs_of
from restir_ref.transport.paths import Sensor
from restir_ref.transport.restir_pt import PathIntegrals

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture

AREA, KEPT = "by area", "point, place kept"
MIDDLE, JITTERED = "point, in the middle", "point, jittered"
ARMS = (AREA, KEPT, MIDDLE, JITTERED)
POINTS = (MIDDLE, JITTERED)
"""What the paper calls point reuse, by where in the pixel the primary hit is fixed."""

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
    arm, R, asked, chance = chunk["reuse"], preset["replicas"], Counter[str](), Live(rng)
    views = views_along("checker", panned("checker", FILM, STEP, FRAMES), PRESET, NONE, asked)
    if arm == AREA:
        return with_restir(views, asked, R, chance, PRESET)
    views = [whole(view) for view in views]
    if arm == KEPT:
        return with_restir(views, asked, R, chance, PRESET)
    at = [np.full(R, 0.5) if arm == MIDDLE else chance.uniform((R,)) for _ in views]
    found = with_restir([fixed(*each) for each in zip(views, at, strict=True)], asked, 1, chance, PRESET)
    return {name: each.reshape(R, -1) if each.ndim else each for name, each in found.items()}


# ---------------------------------------------------------------- the primary hit fixed


@dataclass(frozen=True, eq=False)
class Fixed:
    """One row per replica, each through one place of all its pixels, at (R,): x_1 is fixed, whatever the number says.

    A path that is shifted to another pixel, or from another frame, has the x_1 of its target; the rest is reused.
    [GPT Fig. 5a; GRIS 7]
    """

    row: Sensor
    at: Array

    @property
    def n(self) -> int:
        """Pixels of all replicas."""
        return self.row.n * len(self.at)

    @property
    def shape(self) -> tuple[int]:
        """That of one row."""
        return (self.row.n,)

    @property
    def numbers(self) -> int:
        """One, which nobody reads."""
        return 1

    @property
    def film_numbers(self) -> int:
        """That one."""
        return 1

    def ray(self, pixel: Array, u: Array) -> tuple[Array, Array, Array]:
        """The row's ray through the place of the pixel's replica."""
        return self.row.ray(pixel % self.row.n, self.at[pixel // self.row.n][None])


def fixed(view: View, at: Array) -> View:
    """The view of R replicas side by side, each with its own place at (R,) in all pixels, and so in both of a pair."""
    image, R = view[PRIMAL].of[PRIMAL], len(at)
    assert isinstance(image, PathIntegrals)
    image = replace(image, tracer=replace(image.tracer, sensor=Fixed(image.tracer.sensor, at)))
    ends = {name: each for name, (each, _) in forward(image.shape, R).items()}
    of = {name: pairs_of(image, each, PRESET.partners) for name, each in ends.items()} | {PRIMAL: {PRIMAL: image}}
    return {
        name: replace(group, of=of[name], by=np.tile(group.by, R), active=np.tile(group.active, R))
        for name, group in view.items()
    }


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """Everything by "reuse.name"."""
    return {f"{arm}.{key}": each for arm, part in zip(ARMS, results, strict=True) for key, each in part.items()}


def error(a: Arrays, arm: str, name: str) -> Array:
    """Variance of the image or of dx over the mean square of its expectation, of every replica; (R,).

    What is seen through the middles of pixels has an expectation of its own; all else has that of the reuse by area.
    """
    shown = a[f"{MIDDLE if arm == MIDDLE else AREA}.{name}"]
    square = (shown.mean(axis=0) ** 2 - shown.var(axis=0, ddof=1) / len(shown)).mean()
    return np.asarray(spread([a[f"{arm}.{name}"]]) / square)


def check(a: Arrays) -> list[Claim]:
    """Area against point reuse of the same pixels for gradients, and whether these gain more than the image does."""
    gradient, primal = ({arm: error(a, arm, name) for arm in ARMS} for name in WHAT)
    claims = []
    for point in POINTS:
        both = [
            smaller("GPT-F05", (gradient[AREA], gradient[point]), 0.8, f"gradient, area / {point}"),
            gain(primal, gradient, point),
        ]
        claims += [of_another_integral(each) for each in both] if point == MIDDLE else both
    kept = gradient[AREA], gradient[KEPT]
    return [
        *claims,
        replace(told("GPT-F05", kept, f"gradient, area / {KEPT}"), reason=few(kept[0]) or NOT_POINT),
        with_what_they_miss(a),
    ]


def of_another_integral(claim: Claim) -> Claim:
    """Reported, whatever it says: arms that estimate different integrals neither show nor refute anything."""
    outcome = criteria.reported(claim.outcome.measured) if claim.outcome else None
    return replace(claim, outcome=outcome, counter=None, reason=f"{claim.reason}  {MIDDLES}".lstrip())


MIDDLES = "What is seen through the middles of pixels has none of the noise of their edges, which it does not see."


def with_what_they_miss(a: Arrays) -> Claim:
    """Squared errors against the integrals over pixels, so with what middles miss of them: area / middle, reported."""
    part = f"area / {MIDDLE}, squared errors against whole pixels, gradient and primal"
    if few(a[f"{AREA}.dx"]):
        return Claim("GPT-F05", None, part, reason=few(a[f"{AREA}.dx"]))
    text = " and ".join(f"{of_whole_pixels(a, name):.3g}" for name in WHAT)
    return Claim("GPT-F05", criteria.reported(text), part)


def of_whole_pixels(a: Arrays, name: str) -> float:
    """Var / (var + bias^2), the bias being the difference of both arms' means, less its own noise."""
    area, middle = a[f"{AREA}.{name}"], a[f"{MIDDLE}.{name}"]
    noise = [each.var(axis=0, ddof=1).mean() for each in (area, middle)]
    bias2 = ((area.mean(axis=0) - middle.mean(axis=0)) ** 2).mean() - sum(noise) / len(area)
    return float(noise[0] / (noise[1] + bias2))


NOT_POINT = (
    "Whole motion vectors alone: this reuse keeps the place within the pixel with the sample, where point reuse fixes "
    "the primary hit."
)


def gain(primal: Mapping[str, Array], gradient: Mapping[str, Array], point: str) -> Claim:
    """Whether gradients gain more by area reuse than the image: (area / point of it) / (area / point of theirs) > 1."""
    part = f"gain of area over {point}, primal / gradient"
    if few(gradient[AREA]):
        return Claim("GPT-F05", None, part, reason=few(gradient[AREA]))
    ours, theirs = ((each[AREA], each[point]) for each in (primal, gradient))
    return placed("GPT-F05", ratio_of_ratios(ours, theirs), over(1), part)


def ratio_of_ratios(ours: tuple[Array, Array], theirs: tuple[Array, Array]) -> Interval:
    """(low, high, text) of one ratio of means over another, bootstrapped over paired replicas (R,)."""
    R = len(ours[0])
    chosen = np.random.default_rng(criteria.STREAM).integers(R, size=(criteria.BOOTSTRAP, R))
    one, other = (top[chosen].mean(axis=1) / bottom[chosen].mean(axis=1) for top, bottom in (ours, theirs))
    low, high = (float(each) for each in np.quantile(one / other, [0.025, 0.975]))
    whole_ = (ours[0].mean() / ours[1].mean()) / (theirs[0].mean() / theirs[1].mean())
    return low, high, f"{whole_:.4g} (95% {low:.4g} to {high:.4g})"


def draw(a: Arrays) -> "Picture":
    """Variance of dx along the row, and relative errors of both."""
    picture, axes = style.panels(1, 2, width=4.2, height=3.0)
    left, right = axes[0]
    for k, arm in enumerate(ARMS):
        dx = a[f"{arm}.dx"]
        smooth = np.convolve(dx.var(axis=0, ddof=1), np.ones(9) / 9, mode="valid")
        left.semilogy(4 + np.arange(len(smooth)), smooth, **style.nth(k, marker="", label=arm))
        means = [error(a, arm, name).mean() for name in WHAT]
        look = {"color": style.nth(k)["color"], "hatch": style.HATCHES[k], "edgecolor": style.PAPER}
        right.bar(np.arange(2) + 0.2 * (k - 1.5), means, 0.19, label=arm, **look)
    left.set(
        xlabel="pair of pixels",
        ylabel="variance of dx, 9 pairs (radiance$^2$)",
        title="Checker floor, .3 pixels a frame",
    )
    right.set_xticks([0, 1], ["dx", "image"])
    right.set_yscale("log")
    right.set(xlabel="what is estimated", ylabel="variance over mean square", title=f"Whole row, {len(dx)} replicas")
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
