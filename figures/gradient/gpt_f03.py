"""GPT Fig. 3: where two integrands share a peak, resampling for one of them misses their difference.

*After*: each pixel resamples M base paths for itself, and the two results give one difference.
*With*: one reservoir resamples M paired base paths for |difference|; *positivized*: one per sign.
Variances are exact: integrals over fine cells of the differences that the code computes.  The real
passes lie beside them.  With M the variance *after* even grows: the samples crowd into the shared peak.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims import criteria
from figures.claims.figure import Arrays, Claim, Figure
from figures.report import style
from restir_ref.batch import Array, ratio
from restir_ref.chance import Live
from restir_ref.gradient import MAGNITUDE, NEGATIVE, POSITIVE, TossedPairs, gradient_after
from restir_ref.integrals import Pixels
from restir_ref.oracle.cells import Frame
from restir_ref.restir import initial, resample, shade
from toy1d import TOYS, Line, quotient

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Picture

METHODS = ("after", "with", "positivized")
SHOWN = {"shared_peak": 32, "bare_peaks": 64}  # toy -> M of the histograms
CAVEAT = "on toys only, not in a rendered scene"
ONE_PAIR = np.array([[0], [1]])
PEAK = 0.6  # half the width of the shared peak


def chunks(preset: Any) -> Sequence[Any]:
    """The exact curves at once, and one chunk of real passes per toy and M."""
    return [{"kind": "exact"}, *({"kind": "real", "toy": toy, "M": M} for toy in SHOWN for M in preset["M_real"])]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """Exact variances of both toys (toy, method, M), or estimates (method, n) and choices of the real passes."""
    if chunk["kind"] == "exact":
        found = [Exact.of(quotient(TOYS[toy](), preset["cells"])) for toy in SHOWN]
        M = np.array(preset["M"])
        curves = np.array([[each.after(M), each.single(M), each.positivized(M)] for each in found])
        floors = np.array([[each.floor_after, each.floor_single] for each in found])
        return {"variance": curves, "floors": floors, "truth": np.array([each.delta.sum() for each in found])}
    n = max(preset["repeats"], preset["base_paths"] // chunk["M"])
    return real_passes(TOYS[chunk["toy"]](), chunk["M"], n, Live(rng))


@dataclass(frozen=True, eq=False)
class Exact:
    """Variances for M candidates of density p, on cells of volume v; d = w* G on both sides (2, K) each.

    The sums are the moments of one candidate: the code's own differences, integrated.
    """

    v: Array
    p: Array
    f: Array
    d: Array

    @classmethod
    def of(cls, frame: Frame) -> "Exact":
        """From the cells of two pixels, sampled by one technique."""
        K, pairs = frame.cells.v.shape[-1], TossedPairs(frame, ONE_PAIR, MAGNITUDE)
        index, x = np.zeros(K, dtype=int), np.arange(K)
        d = [pairs.difference(index, pairs.paired(index, x, np.full(K, k)))[0] for k in (0, 1)]
        return cls(frame.cells.v, frame.cells.pdf[0], frame.cells.f, np.stack(d))

    @property
    def delta(self) -> Array:
        """int w (f_i - f_j) over each side (2,), the second negated: they add up to Delta."""
        return self._integral(self.d)

    @property
    def floor_after(self) -> float:
        """sum over both pixels of ||f_i|| int (w G)^2 / f_i - (int w G)^2, for M -> infinity."""
        return float((self._integral(self.f) * self._integral(ratio(self.d**2, self.f)) - self.delta**2).sum())

    @property
    def floor_single(self) -> float:
        """4 P N: the estimate is sign(G) (P + N), positive with probability P / (P + N)."""
        P, N = (self._integral(part.target(self.d[None])).sum() for part in (POSITIVE, NEGATIVE))
        return float(4 * P * N)

    def after(self, M: Array) -> Array:
        """E[(sum w) (sum w g^2 / f^2)] - E[...]^2 per pixel, g = w G, from pairs of equal and of other candidates."""
        one = self._integral(ratio(self.d**2, self.p))
        other = self._integral(self.f) * self._integral(ratio(self.d**2, self.f))
        return np.asarray(self.floor_after + (one - other).sum() / M)

    def single(self, M: Array) -> Array:
        """Var[sign(G(Y)) sum w] = (E[w^2] - (P + N)^2) / M + 4 P N."""
        return np.asarray(self.floor_single + (self._one - self._integral(abs(self.d)).sum() ** 2) / M)

    def positivized(self, M: Array) -> Array:
        """Var[sum w_+ - sum w_-] = (E[w^2] - Delta^2) / M, for candidates shared by both signs."""
        return np.asarray((self._one - self.delta.sum() ** 2) / M)

    @property
    def _one(self) -> float:
        """E[(w G / p)^2] of one candidate, whose side is a coin's: density p / 2."""
        return float(self._integral(ratio(2 * self.d**2, self.p)).sum())

    def _integral(self, g: Array) -> Array:
        """int g over each side, (2,)."""
        return np.asarray((self.v * g).sum(axis=-1))


def real_passes(line: Line, M: int, n: int, chance: Live) -> Arrays:
    """n estimates of Delta per method (3, n), and the positions chosen after, with, for + and for -; (5, n)."""
    X = initial(Pixels(line, np.arange(2 * n)), chance, M)
    left, right = (Pixels(line, np.arange(k, 2 * n, 2)) for k in (0, 1))
    index = np.arange(n)
    parts = [TossedPairs(line, ONE_PAIR, part) for part in (MAGNITUDE, POSITIVE, NEGATIVE)]
    drawn = [(x, mW / M) for _ in range(M) for x, mW in parts[0].candidates(index, chance)]
    Y = [resample(drawn, Pixels(part, index), chance) for part in parts]
    whole, plus, minus = (shade(each, Pixels(part, index))[0] for each, part in zip(Y, parts, strict=True))
    return {
        "estimates": np.stack([gradient_after(X, left, right)[0], whole, plus + minus]),
        "chosen": np.stack([X.x[0::2], X.x[1::2], *(each.x.x for each in Y)]),
    }


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """Variances (toy, method, M), exact and sampled, standard errors and z of the sampled ones, positions chosen."""
    exact, real, n = results[0], results[1:], len(preset["M_real"])
    toys = [real[:n], real[n:]]
    sampled = np.array([[spread(each["estimates"]) for each in toy] for toy in toys]).transpose(2, 0, 3, 1)
    means = np.array([[each["estimates"].mean(axis=-1) for each in toy] for toy in toys]).transpose(0, 2, 1)
    shown = [preset["M_real"].index(M) for M in SHOWN.values()]
    at = [preset["M"].index(M) for M in preset["M_real"]]
    return {
        **exact,
        "M": np.array(preset["M"]),
        "M_real": np.array(preset["M_real"]),
        "sampled": sampled[0],
        "sampled_error": sampled[1],
        "z_variance": (sampled[0] - exact["variance"][:, :, at]) / sampled[1],
        "z_mean": (means - exact["truth"][:, None, None]) / sampled[2],
        "chosen": np.stack([toy[k]["chosen"][:, : preset["repeats"]] for toy, k in zip(toys, shown, strict=True)]),
    }


def spread(estimates: Array) -> Array:
    """Variance of (methods, n) estimates, its standard error, and that of their mean; (3, methods)."""
    n, centred = estimates.shape[-1], estimates - estimates.mean(axis=-1, keepdims=True)
    second, fourth = (centred**2).mean(axis=-1), (centred**4).mean(axis=-1)
    return np.stack([second * n / (n - 1), np.sqrt((fourth - second**2) / n), np.sqrt(second / n)])


def check(a: Arrays) -> list[Claim]:
    """What is chosen, the ratio of variances, their floors for M -> infinity, and the real passes on the curves."""
    M, claims = list(a["M"]), []
    for toy, (name, m) in enumerate(SHOWN.items()):
        in_peak = (abs(a["chosen"][toy]) < PEAK).mean(axis=-1)
        after, single, positivized = a["variance"][toy]
        at, most = M.index(m), M.index(2048)
        better = criteria.above(after[at] / single[at], 4)
        slope = criteria.slope_within(a["M_real"], a["sampled"][toy, 2], -1, 0.1)
        claims += [
            Claim("GPT-F03", criteria.above(in_peak[:2].mean(), 0.7), f"{name}: chosen in the shared peak, after"),
            Claim("GPT-F03", criteria.below(in_peak[2:].max(), 0.1), f"{name}: chosen in the shared peak, with"),
            Claim("GPT-F03", better, f"{name}: exact Var after / Var with, M = {m}"),
            Claim(
                "GPT-C05", better, f"{name}: exact Var after / Var with, M = {m}", caveat="toys only, no rendered scene"
            ),
            Claim("GPT-P01", criteria.between(single[most] / a["floors"][toy, 1], 0.95, 1.05), f"{name}: Var / 4PN"),
            Claim("GPT-P01", criteria.slope_within(M, positivized, -1, 0.1), f"{name}: positivized, exact slope"),
            Claim("GPT-P01", slope, f"{name}: positivized, slope of the real passes"),
            Claim("GPT-P02", criteria.between(after[most] / a["floors"][toy, 0], 0.9, 1.1), f"{name}: Var / floor"),
        ]
    z = {"GPT-F03": abs(a["z_mean"]), "GPT-P01": abs(a["z_variance"][:, 1:]), "GPT-P02": abs(a["z_variance"][:, 0])}
    what = {"GPT-F03": "means of all real passes against Delta", "GPT-P01": AGAINST, "GPT-P02": AGAINST}
    return claims + [Claim(id_, criteria.below(z[id_].max(), 4.5), f"{what[id_]}, largest |z|") for id_ in z]


AGAINST = "real passes against the exact variance"
TITLES = {"shared_peak": "A shared peak, light everywhere", "bare_peaks": "A shared peak, nothing between"}


def draw(a: Arrays) -> "Picture":
    """Per toy: the integrands, what is chosen, and variance over M."""
    picture, axes = style.panels(len(SHOWN), 3, width=3.5, height=2.8)
    for toy, (name, row) in enumerate(zip(SHOWN, axes, strict=True)):
        draw_integrands(row[0], name)
        draw_chosen(row[1], a["chosen"][toy], SHOWN[name])
        draw_variance(row[2], a, toy)
    return picture


def draw_integrands(axes: "Axes", toy: str) -> None:
    """f_1, f_2 and where they differ."""
    x, line = np.linspace(-2, 2, 801), TOYS[toy]()
    f = [line.f(np.full(801, k), x) for k in (0, 1)]
    axes.fill_between(x, abs(f[0] - f[1]), color=style.GREY, lw=0, label="$|f_1 - f_2|$")
    for k in (0, 1):
        axes.plot(x, f[k], **style.look(f"$f_{k + 1}$", marker=""))
    axes.set(xlabel="$x$ (length)", ylabel="integrand (per unit length)", title=TITLES[toy])
    axes.legend()


def draw_chosen(axes: "Axes", chosen: Array, M: int) -> None:
    """Histograms of the positions chosen by one method or the other."""
    bins, repeats = np.linspace(-2, 2, 61), chosen.shape[-1]
    after, with_ = (100 * np.histogram(x, bins)[0] / x.size for x in (chosen[:2], chosen[2]))
    axes.stairs(after, bins, fill=True, color=style.LOOKS["after"].colour, label="after")
    axes.stairs(with_, bins, color=style.LOOKS["with"].colour, lw=1.5, label="with")
    axes.set(xlabel="$x$ (length)", ylabel="chosen samples per bin (%)", title=f"{repeats} repeats, $M$ = {M}")
    axes.set_ylim(0, 1.2 * max(after.max(), with_.max()))
    axes.legend(ncols=2, loc="upper center")


def draw_variance(axes: "Axes", a: Arrays, toy: int) -> None:
    """Exact curves with their floors, markers for the real passes."""
    for k, name in enumerate(METHODS):
        axes.loglog(a["M"], a["variance"][toy, k], **style.look(name, marker=""))
        real = style.look(name, ls="", label=None)
        axes.errorbar(a["M_real"], a["sampled"][toy, k], 2 * a["sampled_error"][toy, k], **real, markevery=1)
    for floor, label in zip(a["floors"][toy], ("floors, $M \\to \\infty$", None), strict=True):
        axes.axhline(floor, color=style.GREY, lw=1, ls=":", marker="", label=label)
    axes.set(
        xlabel="candidates $M$ per pixel or pair",
        ylabel="variance of the difference (integral$^2$)",
        title="Lines exact, markers the real code",
    )
    axes.legend()


EXACT = {"cells": 4000, "M": [1, 2, 4, 8, 16, 32, 64, 128, 256, 512, 1024, 2048], "repeats": 500}

FIGURE = Figure(
    id="GPT-F03",
    title="Resample the difference, not the pixels",
    world="toy1d",
    source="[GPT Fig. 3; 4.1, 4.2, 4.4]",
    claims=("GPT-F03", "GPT-P01", "GPT-P02", "GPT-C05"),
    presets={
        "quick": {**EXACT, "M_real": [1, 4, 32, 64, 256, 1024], "base_paths": 400_000},
        "paper": {**EXACT, "M_real": [1, 2, 4, 8, 16, 32, 64, 128, 256, 512, 1024, 2048], "base_paths": 2_000_000},
    },
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)
