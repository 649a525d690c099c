"""GRIS Fig. 3: the generalised form contains both earlier forms of RIS, to the last bit.

Left and middle column of the table are written down here from [GRIS Eq. 1, 2, 5, 6], without our library, and
run with the same random numbers as one pass of GRIS with the identity shift.  In the right column the inputs
come from an earlier pass in other domains, so nobody knows their densities; there only the mean can be checked.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims import criteria
from figures.claims.figure import Arrays, Claim, Figure
from figures.experiments.exact import integral
from figures.report import style
from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.integrals import Pixels, Reservoirs, pdf
from restir_ref.mis import WEIGHTS, Weights, constant, talbot
from restir_ref.oracle.scenes import offset
from restir_ref.resampling import Input, select, weigh
from restir_ref.restir import initial, shade, spatial
from toy1d import known_densities, overlapping_supports

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture

STEPS = ("X", "W", "w", "Y", "W_Y")
BUMPS = 1  # the pixel of the toy that is estimated
X_OF: tuple[Callable[[Array], Array], ...] = (lambda u: u, np.sqrt, lambda u: (1 + u) / 2)
P: tuple[Callable[[Array], Array], ...] = (np.ones_like, lambda x: 2 * x, lambda x: 2.0 * (x >= 0.5))
COLUMNS = {"identical": (0, 0, 0, 0, 0), "different": (0, 1, 2)}
NEW = {"identical": Weights(constant), "different": Weights(talbot, proxy=pdf)}


def chunks(preset: Any) -> Sequence[Any]:
    """One chunk per column of the table."""
    return [{"column": column} for column in (*COLUMNS, "general")]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """How many of N columns differ per step, and estimates f(Y) W_Y in groups."""
    N, groups, name = preset["columns"], preset["groups"], chunk["column"]
    if name == "general":
        return {
            "estimates": general(N, Live(rng)).reshape(groups, -1).mean(axis=1) / integral(overlapping_supports(), 3)
        }
    drawn, seed = COLUMNS[name], rng.integers(2**63)
    old = OLD[name](drawn, N, np.random.default_rng(seed))
    new = generalised(drawn, NEW[name], [1] * len(drawn), N, np.random.default_rng(seed))
    twin = generalised(drawn, NEW[name], [2] + [1] * (len(drawn) - 1), N, np.random.default_rng(seed))
    return {
        "differ": np.array([(old[step] != new[step]).sum() for step in STEPS]),
        "twin": np.mean(old["W_Y"] != twin["W_Y"]),
        "estimates": (bumps(new["Y"]) * new["W_Y"]).reshape(groups, -1).mean(axis=1) / bumps(middles()).mean(),
        "density": np.histogram(new["Y"], bins=50, range=(0, 1), density=True)[0],
    }


def bumps(x: Array) -> Array:
    """The integrand, which is also the target."""
    return np.asarray(0.1 + np.exp(-(((x - 0.3) / 0.08) ** 2)) + np.exp(-(((x - 0.75) / 0.05) ** 2)) / 2)


def middles(n: int = 20_000) -> Array:
    """Nodes of the midpoint rule on [0, 1]."""
    return (np.arange(n) + 0.5) / n


def identical(drawn: Sequence[int], N: int, rng: np.random.Generator) -> Arrays:
    """w_i = 1/M p_hat(X_i) W_i.  [GRIS Eq. 1]"""
    X = np.stack([X_OF[t](rng.random(N)) for t in drawn])
    W = np.stack([1 / P[t](x) for t, x in zip(drawn, X, strict=True)])
    return {"X": X, "W": W, **chosen(X, bumps(X) * (1 / len(drawn) * W), rng)}


def different(drawn: Sequence[int], N: int, rng: np.random.Generator) -> Arrays:
    """w_i = m_i(X_i) p_hat(X_i) W_i with m_i = p_i / sum_j p_j.  [GRIS Eq. 5-6]"""
    X = np.stack([X_OF[t](rng.random(N)) for t in drawn])
    W = np.stack([1 / P[t](x) for t, x in zip(drawn, X, strict=True)])
    m = np.stack([P[t](x) / sum(P[j](x) for j in drawn) for t, x in zip(drawn, X, strict=True)])
    return {"X": X, "W": W, **chosen(X, bumps(X) * (m * W), rng)}


def chosen(X: Array, w: Array, rng: np.random.Generator) -> Arrays:
    """Y = X_s with P(s = i) = w_i / sum w, and W_Y = sum w / p_hat(Y).  [GRIS Eq. 2]"""
    upto = np.cumsum(w, axis=0)
    s = (upto <= rng.random(X.shape[1]) * upto[-1]).sum(axis=0)
    Y = X[s, np.arange(X.shape[1])]
    return {"w": w, "Y": Y, "W_Y": upto[-1] / bumps(Y)}


OLD = {"identical": identical, "different": different}


def generalised(drawn: Sequence[int], mis: Weights, c: Sequence[int], N: int, rng: np.random.Generator) -> Arrays:
    """One pass of GRIS over candidates with W = 1/p, from integrals that differ in their density only."""
    toy, chance = known_densities(), Live(rng)
    at = [Pixels(replace(toy, techniques=(each,)), np.full(N, BUMPS)) for each in toy.techniques]
    samples = [next(iter(at[t].of.candidates(at[t].index, chance))) for t in drawn]
    X = [Reservoirs(x, W, np.full(N, c_i)) for (x, W), c_i in zip(samples, c, strict=True)]
    weighed = list(weigh([Input(X_i, at[t]) for X_i, t in zip(X, drawn, strict=True)], at[0], mis))
    w = np.stack([y.p_hat * y.mW for y in weighed])
    Y = select(weighed, chance, np.ones(N))
    return {"X": np.stack([X_i.x for X_i in X]), "W": np.stack([X_i.W for X_i in X]), "w": w, "Y": Y.x, "W_Y": Y.W}


def general(N: int, chance: Live) -> Array:
    """f(Y) W_Y of the centre pixel of another toy, resampled from what spatial reuse left in all seven pixels."""
    toy = overlapping_supports()
    here = Pixels(toy, np.arange(7 * N))
    near = [offset(toy, here.index, by) for by in range(1, 7)]
    X = spatial(initial(here, chance), here, near[:2], chance)
    Y = spatial(X, here, near, chance, mis=WEIGHTS["talbot"])
    return np.asarray(shade(Y, here)[0].reshape(N, 7)[:, 3])


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """Differences (column, step), twins and densities (column,), estimates over the truth (column, group)."""
    return {
        "N": np.array(preset["columns"]),
        "differ": np.stack([result["differ"] for result in results[:2]]),
        "twin": np.stack([result["twin"] for result in results[:2]]),
        "density": np.stack([result["density"] for result in results[:2]]),
        "estimates": np.stack([result["estimates"] for result in results]),
    }


def check(a: Arrays) -> list[Claim]:
    """Not one bit differs in the columns that existed before; other confidences make nearly all differ; no bias."""
    found = []
    for name, differ, twin in zip(COLUMNS, a["differ"], a["twin"], strict=True):
        same = criteria.equal_to(differ, np.zeros(len(STEPS)), tol=0)
        found += [
            Claim("GRIS-F03", same, f"{name} densities: values that differ in {', '.join(STEPS)}"),
            Claim(
                "GRIS-F03", criteria.above(twin, 0.5), f"{name} densities, twin with confidence 2: share that differs"
            ),
        ]
    for name, estimates in zip((*COLUMNS, "unknown"), a["estimates"], strict=True):
        found.append(Claim("GRIS-F03", criteria.unbiased(estimates, 1), f"{name} densities: mean of f(Y) W_Y / truth"))
    same = criteria.equal_to(a["differ"][0], np.zeros(len(STEPS)), tol=0)
    return [*found, Claim("GRIS-A02", same, "identity shift, W = 1/p, m = 1/M: values that differ from RIS")]


HEADS = ("RIS, one density\nEq. 1-2", "RIS, known densities\nEq. 5-6", "GRIS\nEq. 7, 19-22")
ROWS = (
    (
        "candidates $X_i$",
        ("5 from $p = 1$", "$p = 1$, $2x$, $2 \\cdot 1_{x \\geq 1/2}$", "reused, $\\Omega_i$ differ"),
    ),
    ("weights $W_i$", ("$1/p(X_i)$", "$1/p_i(X_i)$", "of that pass")),
    ("$w_i$", ("$\\hat p\\, W_i / M$", "$m_i\\, \\hat p\\, W_i$", "$m_i\\, \\hat p\\, W_i\\, |\\partial T_i|$")),
    ("output $Y$", ("$X_s$", "$X_s$", "$T_s(X_s)$")),
    ("its weight $W_Y$", ("$\\sum w / \\hat p(Y)$",) * 3),
)


def draw(a: Arrays) -> "Picture":
    """The paper's table with what was measured in it, and what the selected samples look like."""
    picture, axes = style.panels(1, 2, width=5.2, height=3.4)
    table, histogram = axes[0]
    table.axis("off")
    table.set(xlim=(-0.9, 3), ylim=(6.2, -0.8), title=f"Values that differ from one pass of GRIS, of N = {int(a['N'])}")
    for column, head in enumerate(HEADS):
        table.text(column + 0.5, -0.15, head, ha="center", va="center", weight="bold", fontsize=8)
        mean, error = a["estimates"][column].mean(), a["estimates"][column].std(ddof=1) / a["estimates"].shape[1] ** 0.5
        table.text(column + 0.5, 5.85, f"{mean:.4f} ± {error:.4f}", ha="center", va="center", fontsize=8)
    for row, (name, cells) in enumerate(ROWS):
        table.axhline(row + 0.4, color=style.GREY, lw=0.6)
        table.text(-0.88, row + 0.9, name, va="center", fontsize=8)
        for column, text in enumerate(cells):
            found = f"\n{int(a['differ'][column, row])} differ" if column < 2 else ""
            table.text(column + 0.5, row + 0.9, text + found, ha="center", va="center", fontsize=8)
    table.axhline(5.4, color=style.GREY, lw=0.6)
    table.text(-0.88, 5.85, "mean / truth", va="center", fontsize=8)
    _densities(histogram, a["density"])
    return picture


def _densities(axis: Any, density: Array) -> None:
    x, edges = middles(500), np.linspace(0, 1, 51)
    axis.plot(x, bumps(x) / bumps(middles()).mean(), marker="", color=style.INK, ls=":", label=r"$\bar p$, the target")
    for values, name, look in zip(
        density, COLUMNS, ({"color": style.BLUE, "ls": "-"}, {"color": style.VERMILLION, "ls": "--"}), strict=True
    ):
        axis.stairs(values, edges, label=f"{name} densities", lw=1.3, **look)
    axis.set(xlabel="$Y$ (unit interval)", ylabel="density (per unit length)", title="Density of the selected samples")
    axis.legend()


FIGURE = Figure(
    id="GRIS-F03",
    title="Both earlier forms of RIS are special cases",
    world="toy1d",
    source="[GRIS Fig. 3; 3.1, 3.2, 4.1]",
    claims=("GRIS-F03", "GRIS-A02"),
    presets={"quick": {"columns": 64_000, "groups": 64}, "paper": {"columns": 640_000, "groups": 64}},
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)
