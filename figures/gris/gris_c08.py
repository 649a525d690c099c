"""GRIS 5.6: defensive pairwise weights cost a little where neighbours are good, and save where they mislead.

Harsh toy: the neighbours' targets promise samples that their sampler has at 1% or 0.1% of the right density; then a
canonical sample with a floor of 1/M in its weight helps.  Variances of one pass over one sample per pixel are exact.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims import criteria
from figures.claims.figure import Arrays, Claim, Figure
from figures.experiments.exact import integral, sum_of_weights
from figures.report import style
from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.integrals import Pixels
from restir_ref.mis import WEIGHTS
from restir_ref.resampling import Input, gris
from restir_ref.restir import initial, shade
from toy1d import Line, overlapping_supports, overstating_neighbours

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture

NAMES = ("talbot", "pairwise", "defensive")
SHARES = (1.0, 0.3, 0.1, 0.03, 0.01, 0.003, 0.001)
ORDER = (3, 0, 1, 2, 4, 5, 6)


def chunks(preset: Any) -> Sequence[Any]:
    """Exact variances at once, then real passes per weight on the mild toy and on the harsh one with 10%."""
    return [{"kind": "exact"}, *({"kind": "sampled", "mis": mis, "toy": toy} for mis in NAMES for toy in (0, 1))]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """Relative means and variances of f(Y) W_Y."""
    if chunk["kind"] == "exact":
        harsh = [[moments(overstating_neighbours(share), mis) for share in SHARES] for mis in NAMES]
        return {"mild": np.array([moments(overlapping_supports(), mis) for mis in NAMES]), "harsh": np.array(harsh)}
    line = (overlapping_supports(), overstating_neighbours(0.1))[chunk["toy"]]
    return {"estimates": sampled(line, chunk["mis"], preset["batches"], preset["columns"], Live(rng))}


def moments(line: Line, mis: str) -> Array:
    """Exact mean and variance over the truth, (2,)."""
    truth = integral(line, ORDER[0])
    return sum_of_weights(line, [(i, 1) for i in ORDER], WEIGHTS[mis], nodes=2100) / [truth, truth**2]


def sampled(line: Line, mis: str, batches: int, columns: int, chance: Live) -> Array:
    """f(Y) W_Y over the truth of the centre pixel, (batches, columns)."""
    at = [Pixels(line, np.full(batches * columns, i)) for i in ORDER]
    Y = gris([Input(initial(there, chance), there) for there in at], at[0], WEIGHTS[mis], chance)
    return np.asarray(shade(Y, at[0])[0].reshape(batches, columns) / integral(line, ORDER[0]))


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """Exact (weight, moment) and (weight, share, moment); sampled variances (weight, toy) and standard errors."""
    batches = np.array([result["estimates"].var(axis=1, ddof=1) for result in results[1:]]).reshape(len(NAMES), 2, -1)
    error = batches.std(axis=-1, ddof=1) / np.sqrt(batches.shape[-1])
    return {**results[0], "sampled": batches.mean(axis=-1), "error": error}


def check(a: Arrays) -> list[Claim]:
    """Ratios of exact variances: no bootstrap is needed."""
    (uniform, defensive), harsh = a["mild"][1:, 1], a["harsh"][1:, :, 1]
    exact = np.stack([a["mild"][:, 1], a["harsh"][:, SHARES.index(0.1), 1]], axis=1)
    bias = max(abs(a["mild"][:, 0] - 1).max(), abs(a["harsh"][..., 0] - 1).max())
    return [
        Claim("GRIS-C08", criteria.below(uniform / defensive, 0.95), "good neighbours, exact: Var uniform / defensive"),
        *(
            Claim(
                "GRIS-C08",
                criteria.below(harsh[1, k] / harsh[0, k], 0.8),
                f"{SHARES[k]:.1%} of the promised density, exact: Var defensive / uniform",
            )
            for k in (SHARES.index(0.01), SHARES.index(0.001))
        ),
        Claim("GRIS-C08", criteria.below(bias, 1e-5), "relative bias, all toys and weights (quadrature)"),
        Claim(
            "GRIS-C08", criteria.below((abs(a["sampled"] - exact) / a["error"]).max(), 4.5), "real code, largest |z|"
        ),
    ]


def draw(a: Arrays) -> "Picture":
    """The neighbours' sampler, and variances over how much it lacks."""
    picture, axes = style.panels(1, 3, width=3.8, height=3.1)
    toy, curves, mild = axes[0]
    line, x = overstating_neighbours(0.1), np.linspace(0, 1, 500, endpoint=False)
    toy.plot(
        x,
        line.target(np.full(500, 3), x) / integral(line, 3),
        marker="",
        color=style.INK,
        ls="-",
        label=r"target $\bar p$, all pixels",
    )
    toy.plot(x, line.pdf(np.full(500, 3), x), marker="", color=style.BLUE, ls="--", label="sampler of the centre")
    toy.plot(
        x,
        line.pdf(np.full(500, 0), x),
        marker="",
        color=style.VERMILLION,
        ls=":",
        label="of the neighbours (share 10%)",
    )
    toy.set(xlabel="$x$ (unit interval)", ylabel="density (per unit length)", title="Neighbours that overstate")
    toy.set_ylim(0, 4)
    toy.legend(loc="upper left")
    for k, name in enumerate(NAMES):
        curves.loglog(SHARES, a["harsh"][k, :, 1], **style.look(name, marker="", lw=3 - k))
        real = style.look(name, ls="", label=None, fillstyle="none", ms=9 - 2 * k)
        curves.plot(0.1, a["sampled"][k, 1], markevery=1, **real)
        bars = mild.bar(name, a["mild"][k, 1], **style.bar(name, label=None))
        mild.bar_label(bars, fmt="%.3f")
    curves.set(xlabel="share of the promised density", ylabel="relative variance of $f(Y) W_Y$")
    curves.set_title("The insurance; markers: real code")
    mild.set(xlabel="MIS weights", ylabel="relative variance of $f(Y) W_Y$", title="The premium: overlapping_supports")
    mild.grid(visible=False, axis="x")
    curves.legend(loc="upper right")
    return picture


FIGURE = Figure(
    id="GRIS-C08",
    title="Defensive pairwise weights: a small premium, a large insurance",
    world="toy1d",
    source="[GRIS 5.6; Eq. 37-38]",
    claims=("GRIS-C08",),
    presets={"quick": {"batches": 32, "columns": 2000}, "paper": {"batches": 64, "columns": 20_000}},
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)
