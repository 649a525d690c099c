"""GRIS Theorems 1 and A.4: bounds on the variance of a pass and on its weights, against exact values.

Theorem 1 over random finite scenes, enumerated, so both sides are exact.  In units of
(C_f ||p_hat||)^2 every pixel is a point, and the theorem says that all lie below one curve in
t = sqrt(V) / ||p_hat||.  Theorem A.4 over random densities and confidences.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims import criteria
from figures.claims.figure import Arrays, Claim, Figure
from figures.experiments.random_frames import random_frame
from figures.report import style
from restir_ref.batch import Array, ratio, total
from restir_ref.chance import Chance
from restir_ref.integrals import Pixels
from restir_ref.mis import WEIGHTS, Confidences, Mis, Weights
from restir_ref.oracle import bounds
from restir_ref.oracle.cells import Frame
from restir_ref.oracle.enumeration import Program
from restir_ref.oracle.laws import expected_sum
from restir_ref.oracle.scenes import offset
from restir_ref.resampling import Candidate, Input, select, weigh
from restir_ref.restir import around, initial, spatial

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture

ROBUST = ("talbot", "pairwise", "defensive")
UNWEIGHTED = Weights(lambda i, q, c: np.ones(1))
KINDS = ("candidates of one domain", "shifted domains", "shifted domains, second pass")
SIZES = ((1, 4), (3, 3), (2, 3))
"""Pixels and cells of the scenes of each kind."""


def chunks(preset: Any) -> Sequence[Any]:
    """Groups of scenes of every kind, and one chunk of random weights."""
    scenes = [{"kind": kind, "group": g} for kind in range(len(KINDS)) for g in range(preset["groups"])]
    return [*scenes, {"kind": "weights"}]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """Exact variances and their bounds, or the largest weights relative to theirs."""
    if chunk["kind"] == "weights":
        return {"weights": largest_weights(preset["configurations"], rng)}
    scenes = [one_scene(chunk["kind"], k, rng) for k in range(preset["scenes"])]
    return {"scenes": np.concatenate(scenes, axis=-1)}


# ---------------------------------------------------------------- Theorem 1


def one_scene(kind: int, number: int, rng: np.random.Generator) -> Array:
    """t, the excess, and that of a wrong W_Y, in units of (C_f ||p_hat||)^2, for every pixel; (3, n)."""
    n, K = SIZES[kind]
    frame, mis = random_frame(n, K, rng), WEIGHTS[ROBUST[number % len(ROBUST)]]
    c, M = 10.0 ** rng.uniform(-1, 1, n), int(rng.integers(2, 5))
    program = one_domain(frame, M) if kind == 0 else reuse(frame, mis, kind, c)
    S, S_S, fW, fW_fW, wrong, wrong_wrong = expected_sum(program, n)
    f, p_hat, v = frame.cells.f, frame.cells.p_hat, frame.cells.v
    norm, limit = (p_hat * v).sum(axis=-1), bounds.limit_variance(f, p_hat, v)
    excess = np.stack([fW_fW - fW**2, wrong_wrong - wrong**2]) - limit
    t = np.sqrt(np.maximum(S_S - S**2, 0)) / norm
    return np.stack([t, *(excess / (bounds.reasonable(f, p_hat) * norm) ** 2)])


def one_domain(frame: Frame, M: int) -> Program[Array]:
    """RIS from M candidates of each pixel itself; the numbers of `last_pass`."""

    def program(index: Array, chance: Chance) -> Array:
        here = Pixels(frame, index)
        raw = [Candidate(x, frame.target(index, x), W) for _ in range(M) for x, W in frame.candidates(index, chance)]
        return last_pass(here, [replace(each, mW=each.mW / M) for each in raw], raw, chance)

    return program


def reuse(frame: Frame, mis: Weights, passes: int, c: Array) -> Program[Array]:
    """`passes` rounds of reuse from all other pixels, pixel i with confidence c_i; the numbers of `last_pass`."""

    def program(index: Array, chance: Chance) -> Array:
        here, confidence = Pixels(frame, index), c[index % frame.n]
        others = [offset(frame, index, by) for by in range(1, frame.n)]
        X = replace(initial(here, chance), c=confidence)
        for _ in range(passes - 1):
            X = replace(spatial(X, here, others, chance, mis=mis), c=confidence)
        inputs = [Input(X, here), *around(X, others)]
        return last_pass(here, list(weigh(inputs, here, mis)), list(weigh(inputs, here, UNWEIGHTED)), chance)

    return program


def last_pass(here: Pixels, offered: Sequence[Candidate], raw: Sequence[Candidate], chance: Chance) -> Array:
    """sum w, f(Y) W_Y and f(Y) times a wrong W_Y, the sum without the m_i; each and its square, (6, N)."""
    S, unweighted = (total([each.p_hat * each.mW for each in group]) for group in (offered, raw))
    Y = select(offered, chance, np.ones(1))
    f = here.of.contribution(here.index, Y.x)[0]
    wrong = f * ratio(unweighted, here.of.target(here.index, Y.x))
    return np.stack([S, S**2, f * Y.W, (f * Y.W) ** 2, wrong, wrong**2])


# ---------------------------------------------------------------- Theorem A.4


def largest_weights(configurations: int, rng: np.random.Generator) -> Array:
    """max_i w_i C_R / (c_i C_i) in random configurations, for all weights alike; (mis, configurations)."""
    sizes = rng.integers(2, 10, configurations)
    drawn = [random_densities(int(M), int(rng.integers(1, M + 1)), rng) for M in sizes]
    return np.array([[relative_weight(WEIGHTS[name].m, *each) for each in drawn] for name in WEIGHTS])


def random_densities(M: int, R: int, rng: np.random.Generator) -> tuple[Array, Confidences]:
    """q_i = p_hat_from_i(y) over six decades with zeros, (M, 1), confidences over two; the first R are canonical."""
    q = 10.0 ** rng.uniform(-3, 3, (M, 1)) * (rng.random((M, 1)) >= 0.2)
    q[:R] = 10.0 ** rng.uniform(-3, 3)
    return q, Confidences(list(10.0 ** rng.uniform(-1, 1, (M, 1))), range(R))


def relative_weight(m: Mis, q: Array, c: Confidences) -> float:
    """max_i m_i p_hat C_R / (c_i q_i) over the inputs that realise y: w_i over its bound when p_hat_i W_i = C_i."""
    weights = np.array([m(i, q.__getitem__, c) for i in range(len(c))])
    return float(ratio(weights * q[0], q * bounds.weight_bound(1, np.array(c.c), c.C_R)).max())


# ---------------------------------------------------------------- verdicts


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """Points (3, pixels) of all scenes with their kind, and the largest weights (mis, configurations)."""
    points = [result["scenes"] for result in results[:-1]]
    kinds = np.repeat(np.arange(len(KINDS)), preset["groups"])
    return {
        "points": np.concatenate(points, axis=-1),
        "kind": np.concatenate([np.full(p.shape[-1], kind) for p, kind in zip(points, kinds, strict=True)]),
        "weights": results[-1]["weights"],
    }


def used(t: Array, excess: Array, constant: float) -> float:
    """Largest excess over its bound, where V is more than rounding."""
    random = t > 1e-6
    return float((excess[random] / bounds.excess_bound(1, t[random] ** 2, 1, constant)).max())


def check(a: Arrays) -> list[Claim]:
    """No scene violates a bound, and the deliberate errors do."""
    t, excess, wrong = a["points"]
    printed, sharper = (used(t, excess, constant) for constant in (bounds.PRINTED, bounds.SHARPER))
    weights = dict(zip(WEIGHTS, a["weights"].max(axis=-1), strict=True))
    robust = [
        Claim("GRIS-TA4", criteria.between(weights[name], 0, 1 + 1e-12), f"{name}: largest w_i over its bound")
        for name in ROBUST
    ]
    return [
        Claim("GRIS-T1", criteria.between(printed, 0, 1), "largest excess over the printed bound"),
        Claim("GRIS-T1", criteria.between(sharper, 0, 1), "largest excess over the bound with factor 1"),
        Claim("GRIS-T1", criteria.above(used(t, wrong, bounds.PRINTED), 1), "control: W_Y without MIS weights"),
        *robust,
        Claim("GRIS-TA4", criteria.above(weights["constant"], 1), "control, 1/M: largest w_i over the bound"),
    ]


LABELS = {
    "talbot": "generalised Talbot",
    "pairwise": "pairwise, uniform",
    "defensive": "pairwise, defensive",
    "1/Z": "1/M as in 1/Z (control)",
    "constant": "1/M (control)",
}


def draw(a: Arrays) -> "Picture":
    """Scenes under the curves of Theorem 1, and how much of their bounds weights use."""
    picture, axes = style.panels(1, 2, width=4.6, height=4.2)
    variance, weight = axes[0]
    t, excess, wrong = a["points"]
    look = {"ls": "", "ms": 3, "markevery": 1, "rasterized": True}
    variance.loglog(t, wrong, **look, marker="x", color=style.GREY, label="control: $W_Y$ without $m_i$", zorder=1)
    for kind, name in enumerate(KINDS):
        mine = a["kind"] == kind
        variance.loglog(t[mine], excess[mine], **style.nth(kind, label=name) | look)
    draw_bounds(variance, t)
    for name, values in zip(WEIGHTS, a["weights"], strict=True):
        if name != "1/Z":
            weight.plot(
                np.sort(values), np.linspace(0, 1, len(values)), **style.look(name, marker="", label=LABELS[name])
            )
    weight.axvline(1, color=style.INK, lw=1, ls=(0, (1, 1)), marker="", label="at the bound")
    weight.set(
        xscale="log",
        xlabel="largest $w_i$ over its bound $c_i C_i / C_R$",
        ylabel="fraction of configurations",
        title="Theorem A.4: only 1/M exceeds 1",
    )
    style.below(weight)
    return picture


def draw_bounds(axes: Any, t: Array) -> None:
    """The three bounds as functions of t, and the axes' words."""
    x = np.geomspace(0.01, t.max(), 200)
    for constant, ls, label in (
        (bounds.PRINTED, "-", r"$t\,(1 + 2t)$, printed"),
        (bounds.SHARPER, "--", r"$t\,(1 + t)$"),
    ):
        axes.loglog(x, bounds.excess_bound(1, x**2, 1, constant), ls=ls, color=style.INK, marker="", label=label)
    axes.loglog(
        x, bounds.sharpest_excess_bound(1, x**2, 1), ls=":", color=style.INK, marker="", label="$t\\sqrt{1 + t^2}$"
    )
    axes.set(
        xlim=(0.008, 1.3 * t.max()),
        ylim=(1e-5, 1e4),
        xlabel=r"$t = \sqrt{V}\,/\,\|\hat p\|$, relative deviation of $\sum w$",
        ylabel=r"excess of Var$[f(Y) W_Y]$ in $(C_f \|\hat p\|)^2$",
        title="Theorem 1: exact points lie below (negative ones not drawn)",
    )
    style.below(axes)


FIGURE = Figure(
    id="GRIS-T1",
    title="Theorems 1 and A.4 against exact values",
    world="toy1d",
    source="[GRIS Thm. 1, Eq. 29-30; Thm. A.4, Eq. 39]",
    claims=("GRIS-T1", "GRIS-TA4"),
    presets={
        "quick": {"groups": 1, "scenes": 134, "configurations": 4000},
        "paper": {"groups": 10, "scenes": 1340, "configurations": 40_000},
    },
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)
