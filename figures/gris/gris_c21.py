"""GRIS 1: the checklist for convergence, one condition broken at a time.

Right MIS weights, bounded f / p_hat, a vanishing variance of sum w, enough canonical samples, a cap on confidence.
Every number is exact (moments on cells): one pass over n samples from each of seven pixels, and, for the cap, the
mean of frames of two pixels.  Any p_hat that is not f leaves a variance behind [GRIS Eq. 28]; one with f / p_hat
unbounded leaves one without limit, which grows as cells are refined, and one with a bounded ratio does not.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims import criteria
from figures.claims.figure import Arrays, Claim, Figure
from figures.experiments.exact import Loop, accumulated, integrals, start, step
from figures.report import style
from restir_ref.batch import Array
from restir_ref.mis import WEIGHTS, Weights
from restir_ref.oracle.cells import Frame
from restir_ref.oracle.moments import Moments, copies, drawn, mapped, resampled, reused, variance
from toy1d import overlapping_supports, quotient, two_pixels

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture

CENTRE = 3
COUNTS = (1, 2, 4, 8, 16, 32, 64, 128, 256)
REFINED = (42, 84, 168, 336)
"""Cells per pixel over which E[(f(Y) W_Y)^2] may or may not grow."""
CONDITIONS = ("MIS weights", "f / p_hat", "Var[sum w]", "canonical share", "cap")
BROKEN = ("m = 1/M", "f / p_hat unbounded", "n copies of one sample", "|R| = 1 of 1 + 6n", "none")


def chunks(preset: Any) -> Sequence[Any]:
    """The passes, frames with and without a cap, and passes over finer and finer cells."""
    return [{"kind": "passes"}, *({"kind": "frames", "capped": k} for k in (1, 0)), {"kind": "refined"}]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """Relative bias and variance over n per setup; or the relative sd of the mean over frames; or second moments."""
    if chunk["kind"] == "frames":
        return {"sd": mean_of_frames(20 if chunk["capped"] else np.inf, preset["frames"])}
    if chunk["kind"] == "refined":
        return {"second": second_moments()}
    frame = quotient(overlapping_supports(), preset["cells"])
    return {"passes": np.array([[make(frame, n) for n in COUNTS] for make in SETUPS.values()])}


# ---------------------------------------------------------------- passes


def one_pass(frame: Frame, samples: Moments, n: Array, mis: Weights = WEIGHTS["defensive"]) -> tuple[float, float]:
    """Relative bias and variance of f(Y) W_Y of the centre pixel, from n (7,) samples per pixel given as averages."""
    f = frame.cells.f[CENTRE]
    estimate = mapped(resampled(samples, [reused(frame, CENTRE, n, mis)]), f[None])
    truth = float(f @ frame.cells.v[CENTRE])
    return float(estimate.mean[0]) / truth - 1, float(variance(estimate)[0]) / truth**2


def independent(frame: Frame, n: Array) -> Moments:
    """Averages of n (7,) independent samples per pixel."""
    return copies(drawn(frame), np.repeat(n, frame.cells.v.shape[1]))


def intact(frame: Frame, n: int) -> tuple[float, float]:
    """All conditions hold: n independent samples from every pixel, p_hat = f, defensive weights."""
    return one_pass(frame, independent(frame, np.full(7, n)), np.full(7, n))


def wrong_weights(frame: Frame, n: int) -> tuple[float, float]:
    """m = 1/M although supports differ."""
    return one_pass(frame, independent(frame, np.full(7, n)), np.full(7, n), WEIGHTS["constant"])


def unbounded_ratio(frame: Frame, n: int) -> tuple[float, float]:
    """p_hat = s^2 f with s from 0 to 1 over the domain, so that f / p_hat has no bound as cells get finer."""
    inside = frame.cells.pdf[0] > 0
    s = (np.cumsum(inside, axis=1) - 0.5) / inside.sum(axis=1, keepdims=True)
    return aiming_at(np.where(inside, s**2 * frame.cells.f, 0), frame, n)


def bounded_ratio(frame: Frame, n: int) -> tuple[float, float]:
    """p_hat = sqrt f: as wrong a target, but f / p_hat = sqrt f is bounded."""
    return aiming_at(np.sqrt(frame.cells.f), frame, n)


def aiming_at(p_hat: Array, frame: Frame, n: int) -> tuple[float, float]:
    """All else intact."""
    return intact(Frame(replace(frame.cells, p_hat=p_hat), frame.n), n)


def second_moments() -> Array:
    """Relative E[(f(Y) W_Y)^2] at the largest n, for p_hat = f, f / p_hat unbounded and bounded; (3, cells)."""
    frames = [quotient(overlapping_supports(), cells) for cells in REFINED]
    targets = (intact, unbounded_ratio, bounded_ratio)
    passes = np.array([[target(frame, COUNTS[-1]) for frame in frames] for target in targets])
    return np.asarray(passes[..., 1] + (1 + passes[..., 0]) ** 2)


def duplicates(frame: Frame, n: int) -> tuple[float, float]:
    """The n samples of a pixel are one sample n times."""
    return one_pass(frame, drawn(frame), np.full(7, n))


def one_canonical(frame: Frame, n: int) -> tuple[float, float]:
    """One sample from the centre, n from every other pixel."""
    counts = np.where(np.arange(7) == CENTRE, 1, n)
    return one_pass(frame, independent(frame, counts), counts)


SETUPS: dict[str, Callable[[Frame, int], tuple[float, float]]] = {
    "intact": intact,
    BROKEN[0]: wrong_weights,
    BROKEN[1]: unbounded_ratio,
    BROKEN[2]: duplicates,
    BROKEN[3]: one_canonical,
}

# ---------------------------------------------------------------- frames


def mean_of_frames(cap: float, frames: int) -> Array:
    """Relative sd of the mean of the first t frames of two pixels, over pixels, (frames,)."""
    loop = Loop(quotient(two_pixels(), 16), cap, (1,))
    Z, c, found = start(loop, 2), 0.0, []
    for t in range(1, frames + 1):
        Z, c = step(loop, Z, c)
        Z = accumulated(loop, Z)
        found.append(np.sqrt((np.maximum(variance(Z)[-2:], 0) / (t * integrals(loop.frame)) ** 2).mean()))
    return np.array(found)


# ---------------------------------------------------------------- judging


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """Bias and variance (setup, n), sd (capped or not, frame), and numbers (intact or broken, condition).

    `twin` is the second condition's number for a target that is wrong but bounded.
    """
    bias, spread = results[0]["passes"].transpose(2, 0, 1)
    sd = np.stack([results[1]["sd"], results[2]["sd"]])
    fall, late = spread[:, -1] / spread[:, 0], sd[:, -1] / sd[:, sd.shape[1] // 10 - 1]
    growth = [criteria.slope(REFINED, second) for second in results[3]["second"]]
    good = [abs(bias[0]).max(), growth[0], fall[0], fall[0], late[0]]
    broken = [abs(bias[1]).max(), growth[1], *fall[3:], late[1]]
    twin = np.array(growth[2])
    return {"bias": bias, "variance": spread, "sd": sd, "numbers": np.array([good, broken]), "twin": twin}


CHECKS = (
    ("largest relative bias", 1e-10),
    ("growth of E[(f W)^2] with 8 times finer cells, slope", 0.05),
    ("Var(n = 256) / Var(n = 1)", 0.02),
    ("Var(n = 256) / Var(n = 1)", 0.02),
    ("sd of the mean, last frame / a tenth of it", 0.45),
)


def check(a: Arrays) -> list[Claim]:
    """The intact setup passes every check, each broken one fails its own; a wrong but bounded target passes its own."""
    what, limit = CHECKS[1]
    twin = Claim("GRIS-C21", criteria.below(a["twin"], limit), f"f / p_hat, bounded, p_hat = sqrt f: {what}")
    return [
        twin,
        *(
            claim
            for k, (what, limit) in enumerate(CHECKS)
            for claim in (
                Claim("GRIS-C21", criteria.below(a["numbers"][0, k], limit), f"{CONDITIONS[k]}, intact: {what}"),
                Claim("GRIS-C21", criteria.above(a["numbers"][1, k], limit), f"{CONDITIONS[k]}, {BROKEN[k]}: {what}"),
            )
        ),
    ]


def draw(a: Arrays) -> "Picture":
    """Variances over n, spreads over frames, and the checks."""
    picture, axes = style.panels(1, 3, width=3.8, height=3.1)
    passes, frames, table = axes[0]
    shown = [k for k in range(len(SETUPS)) if k != 1]
    for k in shown:
        passes.loglog(COUNTS, a["variance"][k], label=list(SETUPS)[k].replace("p_hat", r"$\hat p$"), markevery=1)
    passes.set(xlabel="samples per pixel $n$", ylabel="relative variance of $f(Y) W_Y$", title="One pass")
    passes.set_ylim(None, 4000 * a["variance"].max())
    passes.legend(loc="upper right")
    t = np.arange(1, a["sd"].shape[1] + 1)
    for sd, name in zip(a["sd"], ("$M_c = 20$", "no cap"), strict=True):
        frames.loglog(t, sd, **style.look(name, marker=""))
    frames.set(xlabel="frames averaged $t$", ylabel="relative sd of their mean", title="Two pixels, time and space")
    frames.legend(loc="lower left")
    _table(table, a["numbers"])
    return picture


def _table(axis: Any, numbers: Array) -> None:
    axis.axis("off")
    axis.set(xlim=(0, 1), ylim=(5.6, -0.8), title="Each condition's own check")
    for x, head in ((0.5, "limit"), (0.72, "intact"), (0.94, "broken")):
        axis.text(x, -0.4, head, ha="right", weight="bold", fontsize=8)
    for k, (condition, broken) in enumerate(zip(CONDITIONS, BROKEN, strict=True)):
        axis.text(0, k + 0.1, condition, fontsize=8.5, weight="bold")
        axis.text(0, k + 0.5, f"broken: {broken}", fontsize=8, color=style.INK)
        for x, value in ((0.5, CHECKS[k][1]), (0.72, numbers[0, k]), (0.94, numbers[1, k])):
            axis.text(x, k + 0.1, f"{value:.2g}", ha="right", fontsize=8.5)
        axis.axhline(k + 0.7, color=style.GREY, lw=0.6)


FIGURE = Figure(
    id="GRIS-C21",
    title="The checklist for convergence, one condition broken at a time",
    world="toy1d",
    source="[GRIS 1; 5.7, 6.4]",
    claims=("GRIS-C21",),
    presets={"quick": {"cells": 84, "frames": 1000}, "paper": {"cells": 168, "frames": 3000}},
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)
