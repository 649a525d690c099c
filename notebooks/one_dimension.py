"""Behind `01_from_ris_to_gris`: resampling in one dimension, step by step, on the toys of `toy1d`.

Every function draws from a fixed seed, so that a slider changes one thing at a time.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from figures.report import style
from restir_ref import WEIGHTS, Live, Pixels, Reservoirs, Shifted, Weights, initial, shade, spatial, temporal
from restir_ref.batch import Array
from restir_ref.integrals import p_hat_from
from restir_ref.mis import Confidences
from restir_ref.oracle.scenes import offset
from toy1d import Chart, Line, overlapping_supports, two_pixels

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture

SEED = 1
BUMP = 1
"""The pixel of `two_pixels` with the bump: f = .2 + 3 exp(-((x - .6)/.15)^2)."""

# ---------------------------------------------------------------- RIS


def selected(M: int, count: int = 40_000) -> Reservoirs:
    """`count` independent results of RIS over M uniform candidates for the bump.  [GRIS Eq. 1-2]"""
    return initial(_bump(count), Live(np.random.default_rng(SEED)), M)


def _bump(count: int) -> Pixels:
    return Pixels(two_pixels(), np.full(count, BUMP))


def true_integral(line: Line, pixel: int, nodes: int = 20_000) -> float:
    """int f_i by the midpoint rule."""
    x, dx = np.linspace(line.low[pixel], line.high[pixel], nodes, endpoint=False, retstep=True)
    return float(line.f(np.full(nodes, pixel), x + dx / 2).sum() * dx)


def ris(M: int) -> "Picture":
    """Where the selected sample falls, and its mean contribution weight there, beside their limits."""
    Y, line = selected(M), two_pixels()
    edges, x = np.linspace(0, 1, 41), np.linspace(0, 1, 400, endpoint=False)
    count, _ = np.histogram(Y.x, edges)
    weight, _ = np.histogram(Y.x, edges, weights=Y.W)
    p_bar = line.f(np.full(400, BUMP), x) / true_integral(line, BUMP)
    density = count / count.sum() * 40
    picture, ((left, right),) = style.panels(1, 2)
    left.stairs(density, edges, color=style.COLOURS[0], label="density of $Y$")
    left.plot(x, p_bar, color=style.COLOURS[3], ls="--", marker="", label=r"$\bar p = \hat p / \|\hat p\|$")
    left.set(xlabel="$x$ (unit interval)", ylabel="density (per unit length)", title=f"Selected sample, M = {M}")
    left.legend()
    right.semilogy(x, 1 / p_bar, color=style.COLOURS[3], ls="--", marker="", label=r"$1 / \bar p$")
    middle = (edges[1:] + edges[:-1]) / 2
    lit = count > 0
    right.semilogy(middle[lit], 1 / density[lit], color=style.COLOURS[0], ls="-", marker="", label="$1 / p_Y$")
    right.semilogy(middle[lit], (weight[lit] / count[lit]), "k.", markevery=1, label="mean of $W_Y$ given $Y$")
    right.set(
        ylim=(0.2, 30), xlabel="$x$ (unit interval)", ylabel="weight (unit length)", title="What $W_Y$ stands for"
    )
    right.legend(loc="upper center")
    return picture


def spread(M: int) -> tuple[float, float, float]:
    """Mean of f(Y) W_Y relative to the truth, its standard error, and the relative standard deviation of one."""
    Y = selected(M)
    estimate = shade(Y, _bump(len(Y.W)))[0] / true_integral(two_pixels(), BUMP)
    return float(estimate.mean()), float(estimate.std() / np.sqrt(estimate.size)), float(estimate.std())


# ---------------------------------------------------------------- shifts and Jacobians


@dataclass(frozen=True, eq=False)
class Powers(Line):
    """A line whose shifts return J to a power instead of J: 1 is right, 0 leaves J out, -1 inverts it."""

    power: float = 1.0

    def shift(self, x: Array, index: Array, to: Pixels) -> Shifted:
        """T_ij with J^power, and 0 where T_ij is undefined."""
        y = super().shift(x, index, to)
        return Shifted(y.x, np.where(y.J > 0, np.where(y.J > 0, y.J, 1.0) ** self.power, 0.0))


def stretched(power: float = 1.0) -> Line:
    """Two pixels whose domains differ by a factor: Omega_i = [0, 1 + i); the shift keeps z = x / (1 + i).

    f_i = (.3 + exp(-((z - .4 - .15 i)/.12)^2)) / (1 + i): alike, but for a bump that moved.  Shifts are undefined
    for z > .85, as if something stood in the way; they return J to a power.
    """

    def scaled(pixel: Array, x: Array) -> Array:
        return np.asarray(x / (1 + pixel))

    def f(pixel: Array, x: Array) -> Array:
        return np.asarray((0.3 + np.exp(-(((scaled(pixel, x) - 0.4 - 0.15 * pixel) / 0.12) ** 2))) / (1 + pixel))

    def hole(i: Array, j: Array, z: Array) -> Array:
        return np.asarray((i != j) & (z > 0.85))

    chart = Chart(scaled, lambda pixel, z: z * (1 + pixel), lambda pixel, x: np.ones_like(x) / (1 + pixel))
    return Powers(f, np.zeros(2), np.array([1.0, 2.0]), chart, hole, power=power)


def shift() -> "Picture":
    """The two integrands, and where the shift takes samples of the first."""
    line, (picture, axes) = stretched(), style.panels(2, 1, width=6.2, height=1.9)
    X = np.arange(0.025, 1, 0.05)
    Y = line.shift(X, np.zeros(len(X), dtype=int), Pixels(line, np.ones(len(X), dtype=int)))
    kept = Y.J > 0
    for pixel, points, J in ((0, X, np.ones(len(X))), (1, Y.x[kept], Y.J[kept])):
        ax, x = axes[pixel, 0], np.linspace(0, 1 + pixel, 300, endpoint=False)
        ax.plot(x, line.f(np.full(300, pixel), x), marker="", color=style.COLOURS[0])
        lost = ~kept if pixel == 0 else np.zeros(len(points), dtype=bool)
        ax.plot(points[~lost], np.zeros((~lost).sum()), "k|", ms=14, markevery=1, label="samples")
        ax.plot(points[lost], np.zeros(lost.sum()), "x", color=style.COLOURS[3], markevery=1, label="not shifted")
        ax.set(xlim=(-0.05, 2.05), ylim=(-0.1, 1.4), ylabel="integrand", title=f"Pixel {pixel + 1}, J = {J.max():g}")
        ax.legend(loc="upper right")
    axes[1, 0].set(xlabel="$x$ (length)")
    return picture


def reuse(power: float, mis: str) -> Array:
    """Mean estimates of both pixels over their truth and the standard errors, after one spatial pass; (2, 2)."""
    line, count = stretched(power), 60_000
    here, chance = Pixels(line, np.arange(2 * count)), Live(np.random.default_rng(SEED))
    Y = spatial(initial(here, chance), here, [offset(line, here.index, 1)], chance, mis=WEIGHTS[mis])
    estimates = shade(Y, here)[0].reshape(count, 2) / [true_integral(line, i) for i in (0, 1)]
    return np.array([estimates.mean(axis=0), estimates.std(axis=0) / np.sqrt(count)])


def jacobian(power: float, mis: str) -> "Picture":
    """The mean brightness of both pixels, where 1 is right, with 3 standard errors."""
    (mean, error), (picture, axes) = reuse(power, mis), style.panels(width=5.4, height=2.4)
    ax = axes[0, 0]
    ax.axhline(1, color="k", lw=0.8)
    ax.errorbar([1, 2], mean, 3 * error, ls="", marker="o", ms=7, capsize=4)
    ax.set(xlim=(0.5, 2.5), ylim=(0.3, 1.7), xticks=[1, 2], xlabel="pixel", ylabel="mean estimate / truth")
    ax.set_title(f"J to the power {power:g}, {mis} weights: {mean[0]:.2f} and {mean[1]:.2f} of the truth")
    return picture


# ---------------------------------------------------------------- MIS weights


def shares(mis: str) -> Mapping[str, Array]:
    """`shares_of` the weights of that name."""
    return shares_of(WEIGHTS[mis])


def shares_of(mis: Weights, nodes: int = 900) -> Mapping[str, Array]:
    """The contribution MIS weights c_i(y) of seven pixels for the centre one, (7, y).  [GRIS Eq. 13, 17, 35-38]

    With the nodes y and, there, p_hat.
    """
    line, y = overlapping_supports(), np.linspace(0.2, 0.8, nodes, endpoint=False)
    here = Pixels(line, np.full(nodes, 3))
    near = [here, *(Pixels(line, np.full(nodes, i)) for i in (0, 1, 2, 4, 5, 6))]
    densities = [line.target(here.index, y), *(p_hat_from(at, y, here) for at in near[1:])]
    c = Confidences([np.ones(nodes)] * 7, [0])
    weight = mis.c or mis.m
    each = np.stack(np.broadcast_arrays(*(weight(i, lambda j: densities[j], c) for i in range(7))))
    return {"y": y, "c": np.where(np.stack(densities) > 0, each, 0.0), "p_hat": densities[0]}


def lost_energy(mis: str) -> float:
    """1 - int p_hat sum_i c_i / int p_hat, the sum over the inputs that can realise y: the relative bias, negated."""
    found = shares(mis)
    return float(1 - (found["p_hat"] * found["c"].sum(axis=0)).sum() / found["p_hat"].sum())


def weights(mis: str) -> "Picture":
    """Seven integrands and, stacked, what share of the centre pixel each of them contributes at y."""
    found, line, (picture, axes) = shares(mis), overlapping_supports(), style.panels(1, 2)
    left, right = axes[0]
    x = np.linspace(0.15, 1.05, 500)
    for i in range(7):
        f = line.target(np.full(500, i), x)
        look = {"color": "k", "lw": 2.2, "zorder": 3} if i == 3 else {"color": "#888888", "lw": 0.9}
        left.plot(x, np.where(f > 0, f, np.nan), marker="", ls="-", **look)
    left.set(xlabel="$x$ (length)", ylabel="integrand (per unit length)", title="Seven pixels, the centre black")
    greys = [str(shade) for shade in np.linspace(0.25, 0.9, 7)]
    right.stackplot(found["y"], found["c"], colors=greys, edgecolor="w", lw=0.4)
    right.axhline(1, color=style.COLOURS[3], ls="--", lw=1.2)
    right.set(xlabel="$y$ (length)", ylabel="$c_i(y)$, stacked", ylim=(0, 1.15), xlim=(0.2, 0.8))
    right.set_title(f"{mis}: {lost_energy(mis):.1%} of the light is lost")
    return picture


# ---------------------------------------------------------------- frames


CAPS = {"none": np.inf, "50": 50.0, "20": 20.0, "5": 5.0, "1": 1.0}


@cache
def chains(cap: float, frames: int = 400, count: int = 24) -> Array:
    """Running means of the bump's estimate over its truth, (frames, count): new sample, temporal, spatial reuse."""
    line, chance = two_pixels(), Live(np.random.default_rng(SEED))
    here = Pixels(line, np.arange(2 * count))
    history, found, talbot = None, [], WEIGHTS["talbot"]
    for _ in range(frames):
        X = initial(here, chance)
        if history is not None:
            X = temporal(X, here, history, [Pixels(line, here.index)], chance, mis=talbot, cap=cap)
        history = spatial(X, here, [offset(line, here.index, 1)], chance, mis=talbot)
        found.append(shade(history, here)[0, BUMP::2])
    means: Array = np.cumsum(found, axis=0) / np.arange(1, frames + 1)[:, None] / true_integral(line, BUMP)
    return means


def frozen(cap: str) -> "Picture":
    """Running means of several chains with a cap on the confidence of history."""
    means, (picture, axes) = chains(CAPS[cap]), style.panels(width=6.2, height=2.9)
    ax, t = axes[0, 0], np.arange(1, len(means) + 1)
    ax.semilogx(t, means[:, :8], marker="", color=style.COLOURS[0], ls="-", lw=0.9, alpha=0.8)
    ax.axhline(1, color="k", lw=1.2)
    ax.set(xlabel="frame $t$", ylabel="mean of frames 1..$t$ / truth", ylim=(0, 2.6))
    ax.set_title(f"8 chains, cap {cap}: spread at the end {means[-1].std():.2f}")
    return picture
