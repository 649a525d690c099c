"""GRIS Theorems A.2 and A.3: the selected sample approaches its target, and the estimate its limit.

Everything is exact: the density of Y from the Laplace transforms of the weights (`oracle.selected`),
variances from moments.  Three problems: candidates of the four pixels of the reference scene; seven
pixels with partly overlapping domains, n samples each; and a target that is not proportional to f.

A null sample is no sample, and p_bar has no place for it: distances of the first problem are those of the law of Y
given that it is not null, and P(Y is null) stands beside them.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims import criteria
from figures.claims.figure import Arrays, Claim, Figure
from figures.report import style
from restir_ref.batch import Array, ratio
from restir_ref.mis import WEIGHTS, Weights
from restir_ref.oracle.bounds import limit_variance
from restir_ref.oracle.cells import Frame
from restir_ref.oracle.moments import Moments, Source, copies, drawn, mapped, operator, resampled, reused, variance
from restir_ref.oracle.scenes import reference_scene
from restir_ref.oracle.selected import l1_distance, mean_square_distance, probability, share
from toy1d import overlapping_supports, quotient, two_pixels

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture

ROBUST = ("talbot", "pairwise", "defensive")
TALBOT = WEIGHTS["talbot"]
CENTRE = 3
FEW = 12
"""Up to here every number of candidates is looked at."""


def chunks(preset: Any) -> Sequence[Any]:
    """Each problem is one chunk."""
    return [{"problem": name} for name in ("candidates", "domains", "mismatch")]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """Exact numbers: nothing is drawn."""
    return PROBLEMS[chunk["problem"]](preset)


# ---------------------------------------------------------------- candidates of one domain


def candidates(preset: Any) -> Arrays:
    """Distances of p_Y from p_bar after M candidates (pixel, M), P(Y is null) likewise, and that of one candidate."""
    M = np.unique([*range(1, FEW + 1), *preset["M"]])
    pixels = [(frame, i) for frame in reference_scene().frames for i in range(frame.n)]
    found = [[distances(frame, i, int(m)) for m in M] for frame, i in pixels]
    l1, mean_square, cell = np.array(found).transpose(2, 0, 1)
    of_one = np.array([null(*p) for p in pixels])
    return {"M": M, "l1": l1, "mean_square": mean_square, "cell": cell, "null": of_one, "atom": of_one[:, None] ** M}


def null(frame: Frame, i: int) -> float:
    """Probability that a candidate of pixel i has no target."""
    v, p_hat, p = table(frame, i)
    return float((p * v)[p_hat == 0].sum())


def distances(frame: Frame, i: int, M: int) -> tuple[float, float, float]:
    """L1 and mean-square distance after M candidates of pixel i, and the worst cell's relative error; Y is not null."""
    v, p_hat, _ = table(frame, i)
    P = given_a_sample(law(frame, i, M))
    worst = abs(ratio(P, share(p_hat, v)) - (p_hat > 0)).max()
    return float(l1_distance(P, p_hat, v)), float(mean_square_distance(P, p_hat, v)), float(worst)


def law(frame: Frame, i: int, M: int) -> Array:
    """P(Y = y) after M candidates of pixel i, (K,); what is missing to 1 is P(Y is null)."""
    v, _, p = table(frame, i)
    alone = operator([Source(0, frame, i, 1)], len(v), TALBOT)
    return probability(alone, (p * v)[None], inverse(p)[None], np.array([M]))


def given_a_sample(P: Array) -> Array:
    """P(Y = y | Y is not null) = P(Y = y) / sum_y P(Y = y)."""
    return ratio(P, P.sum())


def table(frame: Frame, i: int) -> tuple[Array, Array, Array]:
    """v, p_hat and p of pixel i, (K,) each."""
    row = frame.ids(np.array(i))
    return frame.cells.v[row], frame.cells.p_hat[row], frame.cells.pdf[0, row]


# ---------------------------------------------------------------- seven domains


def domains(preset: Any) -> Arrays:
    """Of the centre pixel, n samples per pixel: L1 distance and Var[sum w] (mis, n); mean-square error (target, n)."""
    frame, n = quotient(overlapping_supports(), preset["cells"]), preset["n"]
    root, one = aimed(frame, np.sqrt(frame.cells.f)), drawn(frame)
    spread = np.array([[centre(frame, one, WEIGHTS[mis], k)[:2] for k in n] for mis in ROBUST])
    error = np.array([[centre(each, one, TALBOT, k)[2] for k in n] for each in (frame, root)])
    return {"n": np.array(n), "domain_l1": spread[..., 0], "V": spread[..., 1], "error": error}


def aimed(frame: Frame, p_hat: Array) -> Frame:
    """The same frame with another target."""
    return Frame(replace(frame.cells, p_hat=p_hat), frame.n)


def centre(frame: Frame, one: Moments, mis: Weights, n: int) -> tuple[float, float, float]:
    """L1 distance, relative Var[sum w] and relative E[(f(Y) W_Y - f(Y) / p_bar(Y))^2] of the centre pixel."""
    f, p_hat, v = (values[CENTRE] for values in (frame.cells.f, frame.cells.p_hat, frame.cells.v))
    every = np.full(frame.n, n)
    one_pass, Z = reused(frame, CENTRE, every, mis), copies(one, np.full(len(one.mean), n))
    P = probability(one_pass, frame.cells.pdf[0] * frame.cells.v, inverse(frame.cells.pdf[0]), every)
    norm, g, truth = float(p_hat @ v), ratio(f, p_hat), float(f @ v)
    Zu = Z.second @ one_pass.u
    error = f**2 @ (one_pass.Q @ Zu) - 2 * norm * (f * g) @ v + norm**2 * g**2 @ P
    return float(l1_distance(P, p_hat, v)), float(one_pass.u @ Zu) / norm**2 - 1, float(error) / truth**2


def inverse(pdf: Array) -> Array:
    """W = 1/p."""
    return ratio(np.ones(pdf.shape), pdf)


# ---------------------------------------------------------------- a target that does not fit


def mismatch(preset: Any) -> Arrays:
    """Var[f(Y) W_Y] after M candidates (M,), and its limit; f = 1 + .9 sin 2 pi x, p_hat = f (1 + .5 sin 2 pi x)."""
    K = preset["wave_cells"]
    x = (np.arange(K) + 0.5) / K
    frame = quotient(two_pixels(), K)
    frame = aimed(frame, frame.cells.f * (1 + 0.5 * np.sin(2 * np.pi * x)))
    f, alone = frame.cells.f[0], operator([Source(0, frame, 0, 1)], 2 * K, TALBOT)
    estimates = [mapped(resampled(copies(drawn(frame), np.full(2 * K, M)), [alone]), f[None]) for M in preset["M_wave"]]
    limit = limit_variance(f, frame.cells.p_hat[0], frame.cells.v[0])
    return {"M_wave": np.array(preset["M_wave"]), "wave": np.concatenate([*map(variance, estimates)]), "limit": limit}


PROBLEMS = {"candidates": candidates, "domains": domains, "mismatch": mismatch}


# ---------------------------------------------------------------- verdicts


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """All arrays together."""
    return {name: array for result in results for name, array in result.items()}


def check(a: Arrays) -> list[Claim]:
    """Distances fall as they should; mismatched targets leave a floor."""
    return [*check_candidates(a), *check_domains(a), *check_mismatch(a)]


def check_candidates(a: Arrays) -> list[Claim]:
    """Theorem A.2 at every pixel: M up to 12 as the ledger asks, and far out."""
    M, few, late = a["M"], a["M"] <= FEW, a["M"] >= 8
    slopes = {"L1": (a["l1"], -1, 0.2), "mean square": (a["mean_square"], -2, 0.3)}
    claims = []
    for name, (distance, target, tol) in slopes.items():
        steps = criteria.below(np.diff(np.log(distance[:, few]), axis=-1).max(), 0)
        near = max((criteria.slope(M[few][1:], row[few][1:]) for row in distance), key=lambda s: abs(s - target))
        worst = max(distance, key=lambda row: abs(criteria.slope(M[late], row[late]) - target))
        far = criteria.slope_within(M[late], worst[late], target, tol)
        claims += [
            Claim("GRIS-TA2", steps, f"{name}: largest step of log distance, M = 1..12"),
            Claim("GRIS-TA2", criteria.within(near, target, tol), f"{name}: worst slope over M = 2..12"),
            Claim("GRIS-TA2", far, f"{name}: worst slope over M = 8..1024"),
        ]
    cell = criteria.below(a["cell"][:, list(M).index(FEW)].max(), 0.2)
    atom = criteria.reported(nulls(a))
    return [*claims, Claim("GRIS-TA2", cell, "worst cell at M = 12"), Claim("GRIS-TA2", atom, "P(Y is null)")]


def nulls(a: Arrays) -> str:
    """P(Y is null), in words."""
    M, at = list(a["M"]), np.flatnonzero(a["null"] > 0)
    found = [f"pixel {i + 1} {a['null'][i]:.1%} at M = 1, {a['atom'][i, M.index(FEW)]:.2g} at M = {FEW}" for i in at]
    return "; ".join(found) + f"; 0 at the other {len(a['null']) - len(at)} pixels"


def check_domains(a: Arrays) -> list[Claim]:
    """Eq. 23 and Theorem A.3 with samples of other domains."""
    n, V, l1 = a["n"], a["V"], a["domain_l1"]
    worst = max(V, key=lambda row: abs(criteria.slope(n, row) + 1))
    fall = (l1[:, 0] / l1[:, list(n).index(64)]).min()
    share_left = a["error"][0, list(n).index(1024)] / a["error"][0, 0]
    errors = [criteria.slope_within(n, error, -1, 0.1) for error in a["error"]]
    return [
        Claim("GRIS-E23", criteria.slope_within(n, worst, -1, 0.1), "worst of three slopes of Var[sum w]"),
        Claim("GRIS-E23", criteria.below(np.diff(np.log(l1)).max(), 0), "largest step of the log L1 distance"),
        Claim("GRIS-E23", criteria.above(fall, 8), "L1 distance at n = 1 over n = 64"),
        *(
            Claim("GRIS-TA3", outcome, f"target {name}: slope of the mean-square distance")
            for outcome, name in zip(errors, ("f", "sqrt f"), strict=True)
        ),
        Claim("GRIS-TA3", criteria.equal_to(1024 * share_left, 1.0, 1e-6), "target f: 1024 Var(n = 1024) / Var(n = 1)"),
    ]


def check_mismatch(a: Arrays) -> list[Claim]:
    """Eq. 28: the floor, and no gain beyond it."""
    M, var = list(a["M_wave"]), a["wave"]
    floor = criteria.between(var[M.index(4096)] / a["limit"], 0.95, 1.05)
    gain = criteria.below(1 - var[M.index(4096)] / var[M.index(2048)], 0.03)
    parts = ((floor, "Var(M = 4096) over the limit"), (gain, "gain from M = 2048 to 4096"))
    return [Claim(id_, outcome, part) for id_ in ("GRIS-E28", "GRIS-C02") for outcome, part in parts]


def draw(a: Arrays) -> "Picture":
    """The three problems side by side."""
    picture, axes = style.panels(1, 3, height=3.7)
    draw_candidates(axes[0, 0], a)
    draw_domains(axes[0, 1], a)
    floor = axes[0, 2]
    floor.loglog(a["M_wave"], a["wave"], label="Var$[f(Y) W_Y]$")
    floor.axhline(a["limit"], color=style.INK, ls="--", marker="", lw=1, label=r"limit: Var$[f(X)/\bar p(X)]$")
    floor.set(ylim=(0.05, 0.5), xlabel="candidates $M$", ylabel="variance", title=r"$\hat p$ not proportional to $f$")
    style.below(floor, ncols=1)
    return picture


def draw_candidates(axes: Any, a: Arrays) -> None:
    """Distances over M, in one colour per pixel."""
    for i, (l1, mean_square) in enumerate(zip(a["l1"], a["mean_square"], strict=True)):
        null_share = f", {a['null'][i]:.0%} null" if a["null"][i] else ""
        look = style.nth(i)
        axes.loglog(a["M"], l1, **look | {"ls": "-"}, label=f"pixel {i + 1}{null_share}")
        axes.loglog(a["M"], mean_square, **look | {"ls": ":"})
    axes.set(xlabel="candidates $M$", title="Solid: L1, dotted: mean square")
    axes.set_ylabel(r"distance from $\bar p$ of the law of $Y \neq$ null")
    style.below(axes)


def draw_domains(axes: Any, a: Arrays) -> None:
    """L1 distances and mean-square errors over n."""
    for mis, l1 in zip(ROBUST, a["domain_l1"], strict=True):
        axes.loglog(a["n"], l1, **style.look(mis, label=f"L1, {mis}"))
    for k, (error, name) in enumerate(zip(a["error"], ("f", r"\sqrt{f}"), strict=True)):
        axes.loglog(a["n"], error, **style.nth(3 + k, label=rf"mean square, $\hat p = {name}$"))
    axes.set(
        xlabel="samples per pixel $n$, $M = 7n$",
        ylabel=r"distance from the limit (relative)",
        title="Seven overlapping domains",
    )
    style.below(axes)


EXACT = {
    "M": [2**k for k in range(4, 11)],
    "cells": 168,
    "n": [2**k for k in range(11)],
    "wave_cells": 64,
    "M_wave": [2**k for k in range(13)],
}

FIGURE = Figure(
    id="GRIS-TA2",
    title="The selected sample approaches its target",
    world="toy1d",
    source="[GRIS Thm. A.2, A.3; Eq. 23-28]",
    claims=("GRIS-TA2", "GRIS-TA3", "GRIS-E23", "GRIS-E28", "GRIS-C02"),
    presets={"quick": EXACT, "paper": {**EXACT, "cells": 336, "wave_cells": 256}},
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)
