"""GPT Fig. 9: positivization, where differences of both signs meet; and reuse across signs.

A rack of bars is lit from both sides, and seen by a moving camera as in the caption.  All arms reuse by the same
preset; they differ in which reservoirs a pair has: one for either sign, which reuses its own sign or both, or one for
both signs.  All are unbiased, so that the variance of dx over replicas is their squared error.  What one reservoir adds
to it is 4 P N for many fresh candidates, P and N the integrals of the two parts; reuse may make it more.  A map of the
end of one bar shows how that depends on the place.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims import criteria
from figures.claims.figure import Arrays, Claim, Conditions, Figure, Setup
from figures.experiments.gradients import rendered, spread, with_restir
from figures.experiments.replicas import smaller
from figures.report import style
from restir_ref.batch import Array
from restir_ref.chance import Chance
from restir_ref.gradient_loop import ACROSS_SIGNS, GRADIENT, SAME_SIGN, UNSIGNED, Partners, View

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture

ARMS: Mapping[str, Partners] = MappingProxyType(
    {"same sign": SAME_SIGN, "across signs": ACROSS_SIGNS, "one reservoir": UNSIGNED}
)


ROW, MAP = "rack row", "rack map"


def chunks(preset: Any) -> Sequence[dict[str, str]]:
    """One per view and kind of reuse."""
    return [{"view": view, "reuse": name} for view in preset["replicas"] for name in ARMS]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """The image and its differences, (replicas, n) each, and rays per pixel."""
    own = replace(GRADIENT, partners=ARMS[chunk["reuse"]])

    def method(views: Sequence[View], asked: Counter[str], replicas: int, chance: Chance) -> Arrays:
        return with_restir(views, asked, replicas, chance, own)

    return rendered(chunk["view"], method, preset["replicas"][chunk["view"]], rng, own)


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """Everything by "view.reuse.name"."""
    named = zip(chunks(preset), results, strict=True)
    return {f"{at['view']}.{at['reuse']}.{key}": each for at, part in named for key, each in part.items()}


def error(a: Arrays, arm: str, view: str = ROW) -> Array:
    """Variance of the differences in all directions, of every replica; (R,)."""
    return spread([each for name, each in a.items() if name in (f"{view}.{arm}.dx", f"{view}.{arm}.dy")])


def check(a: Arrays) -> list[Claim]:
    """Two reservoirs against one, at equal samples and at equal rays; across signs against the same sign."""
    ours, across, one = (error(a, arm) for arm in ARMS)
    cost = {arm: float(a[f"{ROW}.{arm}.rays"]) for arm in ARMS}
    dearer = cost["same sign"] / cost["one reservoir"]
    return [
        smaller("GPT-F09", (ours, one), 0.7, "equal samples"),
        smaller("GPT-F09", (ours * dearer, one), 0.9, "equal rays"),
        Claim("GPT-F09t", criteria.reported(f"{dearer:.2f} (the paper's time: 1.33)"), "rays of two reservoirs / one"),
        smaller("GPT-C02", (ours, across), 1 / 0.95, "noise same sign / across signs", TWICE_THE_HISTORY),
        Claim(
            "GPT-C02",
            criteria.reported(f"{cost['across signs'] / cost['same sign']:.3g}"),
            "rays across signs / same sign",
            reason=SHIFTED_TWICE,
        ),
        on_the_map(a),
    ]


def on_the_map(a: Arrays) -> Claim:
    """Reported: the same at the end of a bar, where noise that has nothing to do with signs is larger."""
    part = "equal samples, map at the end of a bar"
    if f"{MAP}.same sign.dx" not in a:
        return Claim("GPT-F09", None, part, reason="The map takes as long as the row, and is left to the paper preset.")
    text = criteria.ratio_interval(error(a, "same sign", MAP), error(a, "one reservoir", MAP))[2]
    return Claim("GPT-F09", criteria.reported(text), part)


TWICE_THE_HISTORY = "Across signs a new sample meets the histories of both signs, so twice the confidence of one."

SHIFTED_TWICE = (
    "As implemented, which shifts a sample once for each sign that receives it, and back once for each that it may "
    "come from.  A shift does not depend on the sign: shared by both, it would cost about as much as for the same "
    "sign."
)


def draw(a: Arrays) -> "Picture":
    """The spread of dx per pair, and their errors at equal samples and at equal rays."""
    picture, axes = style.panels(1, 2, width=4.2, height=3.0)
    left, right = axes[0]
    bottom = np.zeros(2)
    for k, arm in enumerate(ARMS):
        dx = a[f"{ROW}.{arm}.dx"]
        smooth = np.convolve(dx.var(axis=0, ddof=1), np.ones(9) / 9, mode="valid")
        left.semilogy(4 + np.arange(len(smooth)), smooth, **style.nth(k, marker="", label=arm))
        both = error(a, arm).mean() * np.array([1, a[f"{ROW}.{arm}.rays"] / a[f"{ROW}.same sign.rays"]])
        look = {"color": style.nth(k)["color"], "hatch": style.HATCHES[k], "edgecolor": style.PAPER}
        right.bar(np.arange(2) + 0.27 * (k - 1), both, 0.25, bottom, label=arm, **look)
    left.set(xlabel="pair of pixels of the inset", ylabel="variance of dx, 9 pairs (radiance$^2$)", title="Moving rack")
    right.set_xticks([0, 1], ["equal samples", "equal rays"])
    right.set(
        xlabel="what is equal", ylabel="variance of dx (radiance$^2$)", title=f"Mean over pairs, {len(dx)} replicas"
    )
    right.grid(axis="x", visible=False)
    style.below(left, ncols=3)
    return picture


FIGURE = Figure(
    id="GPT-F09",
    title="Positivization",
    world="flatland2d",
    source="[GPT Fig. 9; 4.4, 5.1]",
    claims=("GPT-F09", "GPT-F09t", "GPT-C02"),
    conditions=(
        Conditions(
            ("GPT-F09", "GPT-F09t", "GPT-C02"),
            "[GPT Fig. 9; 4.4]",
            Setup("real time", "moving", "all", "a metal rack under two lights"),
            Setup("real time", "moving", "all", "bars lit from both sides (FS7)"),
        ),
    ),
    arm="reuse",
    presets={"quick": {"replicas": {ROW: 2}}, "paper": {"replicas": {ROW: 192, MAP: 32}}},
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)
