"""GRIS Eq. 46 and 47: one sample of all frames has the right brightness but one colour; the mean has no such noise.

T independent frames of a colour pixel, with a grey target: resampling them into one sample is a pass of GRIS with
weights 1/M, and f(Y) W_Y is Eq. 46; adding all of them up, with the same weights, is Eq. 47.  Both are exact by
moments on cells, the real code lies beside them.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims import criteria
from figures.claims.figure import Arrays, Claim, Figure
from figures.experiments.exact import Loop, start, step
from figures.report import style
from restir_ref.batch import Array, total
from restir_ref.chance import Live
from restir_ref.integrals import Pixels
from restir_ref.mis import WEIGHTS
from restir_ref.oracle.cells import Frame
from restir_ref.oracle.moments import Moments, copies, drawn, mapped, resampled, reused
from restir_ref.resampling import Input, contribution_weight, select, weigh
from restir_ref.restir import initial, shade
from toy1d import quotient, three_channels

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture

FRAMES = (1, 2, 4, 8, 16, 32, 64, 128, 256)
CONSTANT = WEIGHTS["constant"]
TRUTH = np.ones(3)  # every channel of the toy integrates to 1
CAPS = (1, 2, 5, 10, 20)


def chunks(preset: Any) -> Sequence[Any]:
    """The exact numbers, and blocks of groups of replicas."""
    return [{"kind": "exact"}, *({"kind": "sampled", "block": b} for b in range(preset["blocks"]))]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """Exact errors of both forms over T and of ReSTIR frames over the cap; or estimates of both forms."""
    if chunk["kind"] == "sampled":
        one, mean = both_forms(preset["columns"], preset["frames"], Live(rng))
        return {"one": one, "mean": mean}
    frame = quotient(three_channels(), preset["cells"])
    found = [[exact(frame, T, form) for T in FRAMES] for form in (one_sample, all_samples)]
    return {"exact": np.array(found), "capped": np.array([temporal_frame(frame, cap) for cap in CAPS])}


def colours(frame: Frame) -> Array:
    """f of every cell, from its middle, (3, K)."""
    line, K = three_channels(), frame.cells.v.shape[1]
    return line.contribution(np.zeros(K, dtype=int), (np.arange(K) + 0.5) / K)


def exact(frame: Frame, T: int, form: Any) -> Array:
    """Variance of the brightness and mean square error of the chroma, from T independent frames; (2,)."""
    one = drawn(frame)
    return errors(mapped(form(frame, copies(one, np.full(len(one.mean), T)), T), colours(frame)))


def one_sample(frame: Frame, average: Moments, T: int) -> Moments:
    """Resample T frames into one: f(Y) / |f(Y)| times the mean of |f| W.  [GRIS Eq. 46]"""
    return resampled(average, [reused(frame, 0, np.array([T]), CONSTANT)])


def all_samples(frame: Frame, average: Moments, T: int) -> Moments:
    """1/T sum_t f(Y_t) W_t.  [GRIS Eq. 47]"""
    return average


def errors(colour: Moments) -> Array:
    """Variance of the mean of the channels, and E|I - brightness - truth|^2 / 3 of the rest; (2,)."""
    C = colour.second - np.outer(colour.mean, colour.mean)
    rest = np.eye(3) - 1 / 3
    return np.array([C.mean(), np.trace(rest @ C @ rest) / 3])


def temporal_frame(frame: Frame, cap: float) -> Array:
    """Both errors of a late frame of temporal reuse, (2,)."""
    loop = Loop(frame, cap, ())
    Z, c = start(loop, 0), 0.0
    for _ in range(12 * int(cap + 1)):
        Z, c = step(loop, Z, c)
    return errors(mapped(Z, colours(frame)))


def both_forms(columns: int, T: int, chance: Live) -> tuple[Array, Array]:
    """Eq. 46 and Eq. 47 from the same T frames of the real code, (3, columns) each."""
    here = Pixels(three_channels(), np.arange(columns))
    frames = [initial(here, chance) for _ in range(T)]
    weighed = list(weigh([Input(X, here) for X in frames], here, CONSTANT))
    one = shade(select(weighed, chance, np.ones(columns)), here)
    return one, total([here.of.contribution(here.index, y.x) * contribution_weight(y) for y in weighed])


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """Exact (form, T, error) and (cap, error); estimates in groups (form, group, channel); sampled errors (form, 2)."""
    blocks = results[1:]
    both = np.stack([np.concatenate([block[name] for block in blocks], axis=1) for name in ("one", "mean")])
    rest = both - both.mean(axis=1, keepdims=True)
    sampled = np.stack([both.mean(axis=1).var(axis=-1, ddof=1), (rest**2).mean(axis=(1, 2))], axis=1)
    groups = both.reshape(2, 3, preset["groups"], -1).mean(axis=-1).transpose(0, 2, 1)
    return {**results[0], "T": np.array(preset["frames"]), "sampled": sampled, "groups": groups, "few": both[:, :, :24]}


def check(a: Arrays) -> list[Claim]:
    """Same brightness, T times the chroma noise; both unbiased per channel; chroma gains little from resampling."""
    one, mean = a["exact"][:, FRAMES.index(256)]
    reduction = a["exact"][1, 0] / a["capped"][CAPS.index(20)]  # of (brightness, chroma), by temporal reuse
    measured = a["sampled"]
    return [
        Claim(
            "GRIS-E46", criteria.within(one[0] / mean[0], 1, 0.1), "T = 256, exact: brightness variance over Eq. 47's"
        ),
        Claim("GRIS-E46", criteria.between(one[1] / mean[1] / 256, 0.7, 1.4), "T = 256, exact: chroma MSE ratio / T"),
        Claim("GRIS-E46", criteria.within(measured[0, 0] / measured[1, 0], 1, 0.1), "real code: brightness variances"),
        Claim(
            "GRIS-E46", criteria.between(measured[0, 1] / measured[1, 1] / a["T"], 0.7, 1.4), "real code: chroma / T"
        ),
        *(Claim("GRIS-E47", criteria.unbiased(a["groups"][1, :, c], TRUTH[c]), f"channel {c + 1}") for c in range(3)),
        Claim(
            "GRIS-C17",
            criteria.above(reduction[0] / reduction[1], 2),
            "temporal reuse, cap 20, exact: brightness over chroma reduction",
            reason=f"Variance falls {reduction[0]:.3g} times in brightness, {reduction[1]:.3g} times in chroma.",
        ),
    ]


def draw(a: Arrays) -> "Picture":
    """Colours, errors over T, and errors of ReSTIR frames over the cap."""
    picture, axes = style.panels(1, 3, width=3.7, height=3.3)
    patches, over_T, over_cap = axes[0]
    rows = np.concatenate([a["few"][0].T[None], a["few"][1].T[None], np.ones((1, 24, 3))])
    patches.imshow(np.clip(rows / 2, 0, 1) ** (1 / 2.2), aspect="auto", extent=(0, 24, 3, 0))
    patches.set_yticks([0.5, 1.5, 2.5], ["Eq. 46", "Eq. 47", "truth"])
    patches.grid(visible=False)
    patches.set(xlabel="run (colours as they are)", title=f"Colour pixel after {int(a['T'])} frames")
    names = (("brightness, Eq. 46", "chroma, Eq. 46"), ("brightness, Eq. 47", "chroma, Eq. 47"))
    for form in (0, 1):
        for k in (0, 1):
            ls, lw, colour = LOOKS[form][k]
            over_T.loglog(FRAMES, a["exact"][form, :, k], marker="", ls=ls, lw=lw, color=colour, label=names[form][k])
            over_T.loglog(a["T"], a["sampled"][form, k], marker="os"[k], ls="", color=colour, markevery=1)
    over_T.set(xlabel="frames $T$", ylabel="mean square error", title="Lines exact, markers real code")
    style.below(over_T)
    for k, name in enumerate(("brightness", "chroma")):
        over_cap.loglog(
            CAPS,
            a["exact"][1, 0, k] / a["capped"][:, k],
            **style.nth(4 + k, ls=("-", "--")[k], label=name),
            markevery=1,
        )
    over_cap.axhline(1, color=style.INK, lw=1, ls=":", marker="", label="as without reuse")
    over_cap.set(xlabel="cap $M_c$", ylabel="variance without / with reuse", title="Temporal reuse with a grey target")
    style.below(over_cap)
    return picture


LOOKS = ((("-", 3.5, style.SKY), ("--", 1.5, style.VERMILLION)), (("-.", 1.2, style.INK), (":", 1.8, style.INK)))

FIGURE = Figure(
    id="GRIS-E46",
    title="Colour noise",
    world="toy1d",
    source="[GRIS Eq. 46-47; 6.5, 10.1]",
    claims=("GRIS-E46", "GRIS-E47", "GRIS-C17"),
    presets={
        "quick": {"cells": 64, "frames": 256, "groups": 64, "columns": 2048, "blocks": 2},
        "paper": {"cells": 128, "frames": 256, "groups": 64, "columns": 2048, "blocks": 32},
    },
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)
