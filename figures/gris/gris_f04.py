"""GRIS Fig. 4: without contribution MIS weights, overlapping shifted supports count the domain several times.

Every input realises part of the centre pixel's domain.  How often each point y counts, sum_i c_i(y), is read
off the same `weigh` that renders: input i is the sample T_i^-1(y) with W = 1 / J, so that c_i W_i J_i = c_i.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims import criteria
from figures.claims.figure import Arrays, Claim, Figure
from figures.experiments.exact import integral
from figures.report import style
from restir_ref.batch import Array, total
from restir_ref.chance import Live
from restir_ref.integrals import Pixels, Reservoirs
from restir_ref.mis import WEIGHTS, Confidences, Density, Weights
from restir_ref.oracle.scenes import offset
from restir_ref.resampling import Input, contribution_weight, weigh
from restir_ref.restir import initial, shade, spatial
from toy1d import Line, overlapping_supports

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture

CENTRE = 3
BINS = 30


def uncounted(i: int, q: Density, c: Confidences) -> Array:
    """c_i = 1: no contribution weights at all."""
    return np.ones(np.shape(c.C))


FAMILY = {"none": Weights(uncounted), **WEIGHTS}
PASSES = ("1/Z", "constant")


def chunks(preset: Any) -> Sequence[Any]:
    """The coverage at once, then groups of real passes per weight."""
    groups = [{"kind": "passes", "mis": mis, "group": g} for mis in PASSES for g in range(preset["chunks"])]
    return [{"kind": "coverage"}, *groups]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """Coverage per point, exact and from real samples; or estimates of the centre pixel in groups."""
    line, chance = overlapping_supports(), Live(rng)
    if chunk["kind"] == "passes":
        groups = preset["groups"] // preset["chunks"]
        estimates = passes(line, chunk["mis"], groups * preset["columns"], chance)
        return {"estimates": estimates.reshape(groups, -1).mean(axis=1)}
    y = points(line, preset["points"])
    seen = [sampled(line, FAMILY[name], preset["samples"], chance) for name in ("none", "talbot")]
    return {"y": y, "exact": np.stack([coverage(line, y, mis) for mis in FAMILY.values()]), "sampled": np.stack(seen)}


def points(line: Line, n: int) -> Array:
    """Middles of n cells of the centre pixel's domain."""
    low, high = line.low[CENTRE], line.high[CENTRE]
    return np.asarray(low + (high - low) * (np.arange(n) + 0.5) / n)


def coverage(line: Line, y: Array, mis: Weights) -> Array:
    """sum_i c_i(y) over the pixels that can realise y, (n,).  [GRIS Eq. 13-14, 17]"""
    here = Pixels(line, np.full(len(y), CENTRE))
    at = [here, *(Pixels(line, np.full(len(y), j)) for j in range(line.n) if j != CENTRE)]
    back = [line.shift(y, here.index, there) for there in at]
    one = np.ones(len(y))
    inputs = [Input(Reservoirs(x.x, x.J, one), there) for x, there in zip(back, at, strict=True)]
    return total([contribution_weight(each) for each in weigh(inputs, here, mis)])


def overlap(line: Line, y: Array) -> Array:
    """How many domains contain y, counted from their ends; the toy's shift is the identity."""
    return np.asarray(((line.low[:, None] <= y) & (y < line.high[:, None])).sum(axis=0))


def sampled(line: Line, mis: Weights, samples: int, chance: Live) -> Array:
    """The same per bin, from real samples: E[sum_i c_i W_i J_i 1{Y_i in bin}] / size; (bins,)."""
    at = [Pixels(line, np.full(samples, (CENTRE + by) % line.n)) for by in range(line.n)]
    weighed = weigh([Input(initial(there, chance), there) for there in at], at[0], mis)
    edges = np.linspace(line.low[CENTRE], line.high[CENTRE], BINS + 1)
    counts = [np.histogram(y.x, edges, weights=contribution_weight(y))[0] for y in weighed]
    return np.asarray(total(counts) / np.diff(edges) / samples)


def passes(line: Line, mis: str, columns: int, chance: Live) -> Array:
    """f(Y) W_Y of the centre pixel, over its integral, after reuse from all others."""
    here = Pixels(line, np.arange(line.n * columns))
    near = [offset(line, here.index, by) for by in range(1, line.n)]
    Y = spatial(initial(here, chance), here, near, chance, mis=WEIGHTS[mis])
    return np.asarray(shade(Y, here)[0].reshape(columns, line.n)[:, CENTRE] / integral(line, CENTRE))


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """Coverage (weights, point) and (2, bin), estimates over the truth (weights, group)."""
    estimates = np.concatenate([result["estimates"] for result in results[1:]]).reshape(len(PASSES), -1)
    return {**results[0], "overlap": overlap(overlapping_supports(), results[0]["y"]), "estimates": estimates}


def check(a: Arrays) -> list[Claim]:
    """Counted as often as domains overlap without c_i, once with them, Z/M times with 1/M."""
    exact, Z = dict(zip(FAMILY, a["exact"], strict=True)), a["overlap"]
    summing = [name for name in WEIGHTS if name != "constant"]
    once = [Claim("GRIS-F04", criteria.equal_to(exact[k], np.ones(len(Z))), f"{k}: coverage is 1") for k in summing]
    unbiased, biased = a["estimates"]
    return [
        Claim("GRIS-F04", criteria.equal_to(exact["none"], Z), "no weights: coverage is the number of domains"),
        *once,
        Claim("GRIS-F04", criteria.equal_to(exact["constant"], Z / 7), "twin, 1/M: coverage is Z / M, not 1"),
        Claim("GRIS-E21", criteria.unbiased(unbiased, 1, eps=0.01), "m = 1/M, c = 1/Z"),
        Claim("GRIS-E21", criteria.biased(biased, 1, -1, -0.01), "control: m = c = 1/M"),
    ]


def draw(a: Arrays) -> "Picture":
    """The domains, how often their points count, and what that does to the estimates."""
    picture, axes = style.panels(1, 3, width=3.6)
    domains, coverages, estimates = axes[0]
    line = overlapping_supports()
    for i in range(line.n):
        x = points(line, 400) if i == CENTRE else np.linspace(line.low[i], line.high[i], 400, endpoint=False)
        y = line.f(np.full(400, i), x)
        look = {"color": style.INK, "lw": 2, "ls": "-"} if i == CENTRE else {"color": style.GREY, "lw": 1, "ls": "--"}
        domains.plot(x, y, marker="", label={CENTRE: "centre", 0: "neighbours"}.get(i), **look)
    domains.set(xlabel="$x$ (length)", ylabel="integrand (per unit length)", title="Seven pixels, partly overlapping")
    domains.set_ylim(0, 1.5)
    domains.legend(ncols=2)
    _coverages(coverages, a)
    _estimates(estimates, a["estimates"])
    return picture


LOOKS = (
    {"color": style.PURPLE, "ls": "-"},
    {"color": style.LOOKS["1/M"].colour, "ls": style.LOOKS["1/M"].line},
    {"color": style.VERMILLION, "ls": ":"},
)


def _coverages(axis: Any, a: Arrays) -> None:
    names = {"none": "no weights", "constant": "1/M", "talbot": "1/Z, Talbot, pairwise"}
    exact, middles = dict(zip(FAMILY, a["exact"], strict=True)), points(overlapping_supports(), BINS)
    for (name, label), look in zip(names.items(), LOOKS, strict=True):
        axis.plot(a["y"], exact[name], **look, marker="", label=label)
    for k, marker in ((0, "o"), (1, "s")):
        axis.plot(middles, a["sampled"][k], ls="", marker=marker, ms=3, color=style.INK, alpha=0.6, markevery=1)
    axis.set(xlabel="$y$ (length)", ylabel=r"coverage $\sum_i c_i(y)$", title="Lines exact, markers real samples")
    axis.set_ylim(0, 10.5)
    axis.legend(loc="upper left")


def _estimates(axis: Any, estimates: Array) -> None:
    x = np.arange(len(PASSES))
    mean, error = estimates.mean(axis=1), estimates.std(axis=1, ddof=1) / np.sqrt(estimates.shape[1])
    axis.errorbar(x, mean, 4 * error, ls="", marker="o", color=style.BLUE, capsize=4)
    axis.axhline(1, **style.look("truth"))
    axis.legend(loc="center right")
    axis.set_xticks(x, ["$m = 1/M$, $c = 1/Z$", "$m = c = 1/M$"])
    axis.set(xlim=(-0.6, 1.6), ylim=(0.75, 1.05), ylabel="mean / truth", title="One pass from all seven; bars: 4 SE")
    axis.set_xlabel("weights of the pass")


FIGURE = Figure(
    id="GRIS-F04",
    title="Without contribution MIS weights the domain is covered unevenly",
    world="toy1d",
    source="[GRIS Fig. 4; 4.3; Eq. 21]",
    claims=("GRIS-F04", "GRIS-E21"),
    presets={
        "quick": {"points": 600, "samples": 40_000, "groups": 64, "columns": 400, "chunks": 2},
        "paper": {"points": 6000, "samples": 400_000, "groups": 64, "columns": 4000, "chunks": 8},
    },
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)
