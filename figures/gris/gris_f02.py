"""GRIS Fig. 2: without a cap on confidence, reuse freezes and converges to a wrong constant.

Two pixels, each with one new uniform sample per frame, Talbot weights in time and in space.  The
standard deviation of the running mean over chains is exact (moments on cells); chains of the real
code lie beside it and count how often a pixel's sample stays the same.
"""

from collections.abc import Sequence
from functools import cache
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
from restir_ref.oracle.moments import Moments, Operator, Source, drawn, independent, mapped, operator, resampled
from restir_ref.oracle.scenes import offset
from restir_ref.resampling import LARGEST_CONFIDENCE
from restir_ref.restir import initial, shade, spatial, temporal
from toy1d import quotient, two_pixels

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture

TALBOT = WEIGHTS["talbot"]
NAMES = ("uncapped", "M_c = 20", "M_c = 5", "M_c = 1")


def chunks(preset: Any) -> Sequence[Any]:
    """One exact curve per cap, and blocks of chains per cap; cap 0 stands for none."""
    exact = [{"kind": "exact", "cap": cap} for cap in preset["caps"]]
    blocks = [{"kind": "chains", "cap": cap, "block": b} for cap in preset["caps"] for b in range(preset["blocks"])]
    return exact + blocks


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """Relative moments of the running mean at the recorded frames."""
    cap = chunk["cap"] or np.inf
    if chunk["kind"] == "exact":
        return exact_curve(cap, preset["exact_frames"], preset["cells"])
    return chains(cap, preset["frames"], preset["chains"], rng)


def recorded(frames: int) -> Array:
    """Frames to look at, spaced evenly in the logarithm; 100, 300 and 1000 are among them."""
    return np.unique(np.append(np.geomspace(1, frames, 25).round().astype(int), [100, 300, min(1000, frames)]))


def exact_curve(cap: float, frames: int, K: int) -> Arrays:
    """Bias and standard deviation of the running mean, relative to the truth; (t, 2) each."""
    frame = quotient(two_pixels(), K)
    f, v = frame.cells.f, frame.cells.v
    sums = np.arange(2 * K, 2 * K + 2)  # Z = (history, sums of the shaded frames)
    light = np.zeros((2, 2 * K))
    light[0, :K], light[1, K:] = f
    shaded = np.block([[np.eye(2 * K), np.zeros((2 * K, 2))], [light, np.eye(2)]])
    Z, c, truth, fresh = (
        Moments(np.zeros(2 * K + 2), np.zeros((2 * K + 2,) * 2)),
        0.0,
        (f * v).sum(axis=1),
        drawn(frame),
    )
    found = []
    for t in range(1, frames + 1):
        history = min(c, cap)
        Z = resampled(independent([Z, fresh]), along_time(K, history), sums)
        Z = resampled(Z, across_space(K, 1 + history), sums)
        Z, c = mapped(Z, shaded), min(2 * (1 + history), LARGEST_CONFIDENCE)
        if t in recorded(frames):
            mean, second = Z.mean[sums] / t, np.diag(Z.second)[sums] / t**2
            found.append([mean / truth - 1, np.sqrt(np.maximum(second - mean**2, 0)) / truth])
    bias, sd = np.array(found).transpose(1, 0, 2)
    return {"t": recorded(frames), "bias": bias, "sd": sd}


@cache
def along_time(K: int, c: float) -> tuple[Operator, ...]:
    """Each pixel merges its new sample with its history of confidence c; Z = (history, sums, new)."""
    frame, D = quotient(two_pixels(), K), 4 * K + 2
    return tuple(_merge([(2 * K + 2 + i * K, frame, i, 1.0), (i * K, frame, i, c)], D) for i in (0, 1))


@cache
def across_space(K: int, c: float) -> tuple[Operator, ...]:
    """Each pixel merges its sample with the other's, both of confidence c; Z = (samples, sums)."""
    frame, D = quotient(two_pixels(), K), 2 * K + 2
    return tuple(_merge([(i * K, frame, i, c), ((1 - i) * K, frame, 1 - i, c)], D) for i in (0, 1))


def _merge(sources: Sequence[tuple[int, Any, int, float]], D: int) -> Operator:
    return operator([Source(*source) for source in sources], D, TALBOT)


def chains(cap: float, frames: int, count: int, rng: np.random.Generator) -> Arrays:
    """Running means of `count` chains of the real code, (t, 2, count), and how often samples stayed, (t, 2, count)."""
    line, chance = two_pixels(), Live(rng)
    here = Pixels(line, np.arange(2 * count))
    other, history, total, stayed, found = [offset(line, here.index, 1)], None, 0.0, [], []
    for t in range(1, frames + 1):
        X = initial(here, chance)
        if history is not None:
            X = temporal(X, here, history, [Pixels(line, here.index)], chance, mis=TALBOT, cap=cap)
        X = spatial(X, here, other, chance, mis=TALBOT)
        total = total + shade(X, here)[0]
        if t in recorded(frames):
            found.append(total.reshape(count, 2).T / t)
            stayed.append(np.zeros((2, count)) if history is None else (X.x == history.x).reshape(count, 2).T)
        history = X
    return {"t": recorded(frames), "mean": np.array(found), "stayed": np.array(stayed, dtype=float)}


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """Curves per cap: exact (cap, t), sampled (cap, t), and a few single chains (cap, t, 8) of pixel 1."""
    caps = preset["caps"]
    exact, blocks = results[: len(caps)], results[len(caps) :]
    per_cap = [blocks[i * preset["blocks"] : (i + 1) * preset["blocks"]] for i in range(len(caps))]
    means = np.array([np.concatenate([block["mean"] for block in group], axis=-1) for group in per_cap])
    truth = true_integrals()
    return {
        "caps": np.array(caps),
        "t_exact": exact[0]["t"],
        "bias_exact": np.array([abs(curve["bias"]).max(axis=-1) for curve in exact]),
        "sd_exact": np.array([rms(curve["sd"]) for curve in exact]),
        "t": blocks[0]["t"],
        "sd": rms(means.std(axis=-1, ddof=1) / truth),
        "stayed": np.array(
            [np.mean([block["stayed"].mean(axis=(1, 2)) for block in group], axis=0) for group in per_cap]
        ),
        "few": means[:, :, 1, :8] / truth[1],
    }


def rms(values: Array) -> Array:
    """Root mean square over the two pixels, the last axis."""
    return np.asarray(np.sqrt((values**2).mean(axis=-1)))


def true_integrals() -> Array:
    """The two integrals in closed form; (2,)."""
    bump = 0.15 * np.sqrt(np.pi) / 2 * (erf(0.4 / 0.15) + erf(0.6 / 0.15))
    return np.array([1.0, 0.2 + 3 * bump])


def check(a: Arrays) -> list[Claim]:
    """Uncapped: unbiased, frozen, never converging.  Capped: converging."""
    at, sd = list(a["t_exact"]), a["sd_exact"]

    def spread(k: int, late: int, early: int) -> float:
        return float(sd[k, at.index(late)] / sd[k, at.index(early)])

    late = list(a["t"]).index(300)
    capped = [
        Claim("GRIS-F02", criteria.below(spread(k, 3000, 300), 0.45), f"{NAMES[k]}: sd(3000) / sd(300)")
        for k in (1, 2, 3)
    ]
    agreement = np.abs(a["sd"][:, -1] / sd[:, at.index(int(a["t"][-1]))] - 1).max()
    return [
        Claim("GRIS-F02", criteria.above(spread(0, 1000, 100), 0.9), "uncapped: sd(1000) / sd(100)"),
        Claim("GRIS-F02", criteria.above(a["stayed"][0, late:].mean(), 0.999), "uncapped: P(sample unchanged)"),
        Claim("GRIS-F02", criteria.below(a["bias_exact"][0].max(), 1e-10), "uncapped: exact bias of the mean"),
        *capped,
        Claim("GRIS-F02", criteria.below(agreement, 0.1), "chains of the real code against exact sd"),
        Claim("GRIS-C01", criteria.below(a["bias_exact"].max(), 1e-10), "bias over chains, all frames"),
        Claim("GRIS-C01", criteria.above(sd[0, -1], 0.5), "uncapped: relative sd over chains at frame 3000"),
    ]


def draw(a: Arrays) -> "Picture":
    """The integrands, single chains, and the spread of chains over frames."""
    picture, axes = style.panels(1, 3)
    functions, single, spread = axes[0]
    x, line = np.linspace(0, 1, 400, endpoint=False), two_pixels()
    for i in (0, 1):
        functions.plot(x, line.target(np.full(400, i), x), **style.look(f"$f_{i + 1}$"))
    functions.set(xlabel="$x$ (unit interval)", ylabel="integrand (per unit length)", title="Two pixels")
    functions.legend()
    for k, name in enumerate(SHOWN[:2]):
        look = style.look(name, marker="", lw=1, label=None)
        lines = single.semilogx(a["t"], a["few"][k], **look)
        lines[0].set_label(name)
    single.axhline(1, **style.look("truth"), lw=1.5)
    single.set(xlabel="frame $t$", ylabel="mean of frames 1..$t$ / truth", title="8 chains, pixel 2")
    single.set_ylim(top=1.35 * single.get_ylim()[1])
    single.legend(loc="upper right", ncols=3, columnspacing=1, handlelength=2)
    for k, name in enumerate(SHOWN):
        spread.loglog(a["t_exact"], a["sd_exact"][k], **style.look(name, marker=""))
        spread.loglog(a["t"], a["sd"][k], **style.look(name, ls="", label=None), markevery=0.06)
    spread.set(
        xlabel="frame $t$", ylabel="relative sd of the mean over chains", title="Lines exact, markers the real code"
    )
    spread.legend()
    return picture


SHOWN = ("no cap", *(style.cap(M_c) for M_c in (20, 5, 1)))
CAPS = {"caps": [0, 20, 5, 1], "exact_frames": 3000, "cells": 48}

FIGURE = Figure(
    id="GRIS-F02",
    title="Reuse without a cap freezes",
    world="toy1d",
    source="[GRIS Fig. 2; 6.4]",
    claims=("GRIS-F02", "GRIS-C01"),
    presets={
        "quick": {**CAPS, "frames": 1000, "chains": 600, "blocks": 1},
        "paper": {**CAPS, "frames": 3000, "chains": 1000, "blocks": 8},
    },
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)
