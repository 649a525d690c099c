"""GRIS Fig. 7: with proper MIS weights one pass tends to zero variance, with constant weights it does not.

Seven pixels with partly overlapping domains give n samples each; |R| / M = 1/7 stays fixed.  The
variance of f(Y) W_Y is exact (moments on cells, n copies entering as confidence n); the real code,
fed with all 7 n inputs on the continuous toy, lies beside it.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.special import erf

from figures.claims import criteria
from figures.claims.figure import Arrays, Claim, Figure
from figures.report import style
from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.integrals import Pixels
from restir_ref.mis import WEIGHTS
from restir_ref.oracle.cells import Frame
from restir_ref.oracle.moments import Moments, Source, drawn, mapped, operator, resampled, variance
from restir_ref.resampling import Input, gris
from restir_ref.restir import initial, shade
from toy1d import overlapping_supports, quotient

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture

CENTRE = 3
NAMES = tuple(WEIGHTS)
PROPER = ("talbot", "pairwise", "defensive")
SECTIONS = {"talbot": "GRIS-E36", "pairwise": "GRIS-E37", "defensive": "GRIS-E38"}


def chunks(preset: Any) -> Sequence[Any]:
    """The exact curves at once, and one chunk of real passes per weight and n."""
    return [{"kind": "exact"}, *({"kind": "sampled", "mis": mis, "n": n} for mis in NAMES for n in preset["n_sampled"])]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """Relative mean and variance of f(Y) W_Y."""
    if chunk["kind"] == "exact":
        frame = quotient(overlapping_supports(), preset["cells"])
        pixels = [CENTRE, *(i for i in range(frame.n) if i != CENTRE)]
        found = [[exact(frame, pixels, mis, n) for n in preset["n"]] for mis in NAMES]
        bias, relative_variance = np.array(found).transpose(2, 0, 1)
        alone = np.array([exact(frame, (CENTRE,), "constant", n) for n in preset["n"]]).T
        return {"bias": bias, "variance": relative_variance, "canonical": alone}
    batches = range(preset["batches"])
    return {"estimates": np.stack([sampled(chunk["mis"], chunk["n"], preset["columns"], Live(rng)) for _ in batches])}


def exact(frame: Frame, pixels: Sequence[int], mis: str, n: int) -> tuple[float, float]:
    """Bias and variance of f(Y) W_Y of the first of `pixels` with n samples of each, relative to the truth."""
    K, one = frame.cells.v.shape[-1], drawn(frame)
    covariance = one.second - np.outer(one.mean, one.mean)
    average = Moments(one.mean, np.outer(one.mean, one.mean) + covariance / n)  # of n independent copies
    one_pass = operator([Source(i * K, frame, i, n) for i in pixels], len(one.mean), WEIGHTS[mis])
    f = frame.cells.f[CENTRE]
    estimate = mapped(resampled(average, [one_pass]), f[None])
    truth = float(f @ frame.cells.v[CENTRE])
    return float(estimate.mean[0]) / truth - 1, float(variance(estimate)[0]) / truth**2


def sampled(mis: str, n: int, columns: int, chance: Live) -> Array:
    """f(Y) W_Y of the centre pixel in `columns` replicas of one pass over 7 n inputs."""
    line = overlapping_supports()
    pixels = [Pixels(line, np.full(columns, i)) for i in range(line.n)]
    inputs = [Input(initial(at, chance), at) for at in pixels for _ in range(n)]
    Y = gris(inputs, pixels[CENTRE], WEIGHTS[mis], chance)
    return np.asarray(shade(Y, pixels[CENTRE])[0])


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """Exact (mis, n) and sampled (mis, n) relative variances, the latter with standard errors over batches."""
    shape = (len(NAMES), len(preset["n_sampled"]), preset["batches"], preset["columns"])
    estimates = np.stack([result["estimates"] for result in results[1:]]).reshape(shape) / true_integral()
    per_batch = estimates.var(axis=-1, ddof=1)
    return {
        "n": np.array(preset["n"]),
        "bias": results[0]["bias"],
        "variance": results[0]["variance"],
        "canonical": results[0]["canonical"],
        "n_sampled": np.array(preset["n_sampled"]),
        "sampled": per_batch.mean(axis=-1),
        "sampled_error": per_batch.std(axis=-1, ddof=1) / np.sqrt(preset["batches"]),
    }


def true_integral() -> float:
    """The centre pixel's integral, in closed form."""
    line = overlapping_supports()
    low, high = line.low[CENTRE], line.high[CENTRE]
    width = 0.12 * np.sqrt(2)
    bump = width * np.sqrt(np.pi) / 2 * (erf((high - 0.5) / width) - erf((low - 0.5) / width))
    return float(0.1 * (high - low) + bump)


def check(a: Arrays) -> list[Claim]:
    """Slopes, bias and plateau; the straight lines must also be unbiased, for those of 1/M fall as well."""
    n, var, bias = a["n"], dict(zip(NAMES, a["variance"], strict=True)), dict(zip(NAMES, a["bias"], strict=True))
    plateau = criteria.above(criteria.slope(n, var["1/Z"]), -0.35)
    lost = criteria.above(np.abs(bias["constant"]).min(), 0.01)
    shown = [list(n).index(k) for k in a["n_sampled"]]
    z = np.abs((a["sampled"] - a["variance"][:, shown]) / a["sampled_error"]).max()
    return [
        *(claim for mis in PROPER for claim in check_proper(a, mis)),
        Claim("GRIS-F07", plateau, "1/Z: slope of the variance"),
        Claim("GRIS-F07", criteria.above(var["1/Z"][-1] / var["1/Z"][0], 0.3), "1/Z: Var(256) / Var(1)"),
        Claim("GRIS-F07", lost, "1/M: exact relative bias"),
        Claim("GRIS-F07", criteria.below(z, 4.5), "real code against exact variance, largest |z|"),
        Claim("GRIS-C03", lost, "1/M over unequal supports: exact relative bias"),
        Claim("GRIS-C03", criteria.below(np.abs(bias["1/Z"]).max(), 1e-10), "1/Z: exact bias"),
        Claim("GRIS-C03", plateau, "1/Z: slope of the variance"),
        Claim("GRIS-C03", criteria.below(np.abs(a["canonical"][0]).max(), 1e-10), "1/M, all canonical: exact bias"),
        Claim("GRIS-C03", criteria.slope_within(n, a["canonical"][1], -1, 1e-6), "1/M, all canonical: slope"),
    ]


def check_proper(a: Arrays, mis: str) -> list[Claim]:
    """A proper weight: slope -1, exactly and of the real code's own points, and no bias."""
    k = NAMES.index(mis)
    exactly = criteria.slope_within(a["n"], a["variance"][k], -1, 1e-6)
    sampled_slope = criteria.within(criteria.slope(a["n_sampled"], a["sampled"][k]), -1, 0.1)
    unbiased = criteria.below(np.abs(a["bias"][k]).max(), 1e-10)
    parts = ((exactly, "slope of the variance"), (unbiased, "exact bias"), (sampled_slope, "slope of the real code"))
    return [Claim(id_, found, f"{mis}: {part}") for id_ in ("GRIS-F07", SECTIONS[mis]) for found, part in parts]


LABELS = {
    "talbot": "generalised Talbot",
    "pairwise": "pairwise, uniform",
    "defensive": "pairwise, defensive",
    "1/Z": "1/Z (unbiased)",
    "constant": "1/M (biased)",
}


def draw(a: Arrays) -> "Picture":
    """The toy, and variance over n."""
    picture, axes = style.panels(1, 2, width=4.4, height=3.4)
    toy, curves = axes[0]
    line, x = overlapping_supports(), np.linspace(0.15, 1.05, 600)
    for i in range(line.n):
        y = line.target(np.full(600, i), x)
        look = {"color": style.INK, "lw": 2.2, "ls": "-", "label": "centre", "zorder": 3}
        other = {
            "color": style.GREY,
            "lw": 1,
            "ls": "--",
            "label": "others, cut off by their domains" if i == 0 else None,
        }
        toy.plot(x, np.where(y > 0, y, np.nan), marker="", **(look if i == CENTRE else other))
    toy.set(
        xlabel="$x$ (length)",
        ylabel="integrand (per unit length)",
        title="Seven pixels, partly overlapping domains",
        ylim=(0.05, 1.45),
    )
    toy.legend(loc="upper left")
    for k, mis in enumerate(NAMES):
        curves.loglog(a["n"], a["variance"][k], **style.look(mis, marker="", label=LABELS[mis]))
        real = style.look(mis, ls="", label=None)
        curves.errorbar(a["n_sampled"], a["sampled"][k], 2 * a["sampled_error"][k], **real, markevery=1)
    curves.set(
        xlabel="samples per pixel $n$, $M = 7n$, $|R| = n$",
        ylabel="relative variance of $f(Y) W_Y$",
        title="Lines exact, markers the real code",
    )
    curves.legend()
    return picture


EXACT = {"cells": 168, "n": [1, 2, 4, 8, 16, 32, 64, 128, 256]}

FIGURE = Figure(
    id="GRIS-F07",
    title="Zero variance in the limit needs proper MIS weights",
    world="toy1d",
    source="[GRIS Fig. 7; 5.6]",
    claims=("GRIS-F07", "GRIS-E36", "GRIS-E37", "GRIS-E38", "GRIS-C03"),
    presets={
        "quick": {**EXACT, "n_sampled": [1, 2, 4, 8], "columns": 2048, "batches": 16},
        "paper": {**EXACT, "n_sampled": [1, 2, 4, 8, 16], "columns": 4096, "batches": 64},
    },
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)
