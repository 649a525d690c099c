"""MCMC 3.2, 4.2, 5.2: which mutations keep contribution weights unbiased, and what they are good for.

One pixel of six cells, and what k mutations do to E[f W'], for its own integrand and for its neighbour's:
enumerated from the code, and predicted by matrices.  A pixel's own total sees few mistakes, the neighbour's all.
"""

from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims import criteria
from figures.claims.figure import Arrays, Claim, Figure
from figures.report import style
from restir_ref.batch import Array, ratio
from restir_ref.oracle.cells import Frame, cells
from restir_ref.oracle.mutations import (
    FOLDS,
    Mutation,
    blue,
    inverted,
    kernel,
    last_accepted,
    repeated,
    steps,
    unsymmetric,
)
from restir_ref.oracle.scenes import paired

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture

MOST = 5  # mutations
LATER = 50  # and many more
CAVEAT = "on finite cells only, not in a rendered scene"


Walk = Callable[[int], Mutation]


def blue_walk(w: float) -> Walk:
    """k mutations with w_bn = w."""
    return lambda k: repeated(k, blue(w))


BLUE = {"$w_{bn}$ = 0.25": 0.25, "$w_{bn}$ = 0.5": 0.5, "$w_{bn}$ = 1": 1.0}

WALKS: Mapping[str, tuple[str, Walk]] = MappingProxyType(
    {
        "right": ("bounded", repeated),
        "right, wrapped": ("wrapped", repeated),
        "W inverted": ("bounded", lambda k: repeated(k, inverted)),
        "last accepted": ("bounded", last_accepted),
        "clamped": ("clamped", lambda k: repeated(k, unsymmetric)),
        **{name: ("bounded", blue_walk(w)) for name, w in BLUE.items()},
    }
)
"""Name -> the fold of its proposals, and k mutations."""

RIGHT = tuple(WALKS)[:2]


def six_cells(fold: str) -> Frame:
    """T0: two pixels of six equal cells, f_i = .05 + exp(-((x - 2 - i)/1.2)^2), steps of about one cell."""
    x = np.arange(6)
    f = np.stack([0.05 + np.exp(-(((x - centre) / 1.2) ** 2)) for centre in (2, 3)])
    v = np.full((2, 6), 1 / 6)
    return Frame(cells(v, f, np.ones((1, 2, 6)), paired(2, 6, {}), proposal=steps(6, 1, FOLDS[fold])), 2)


def moved_weight(name: str, k: int) -> tuple[Array, float]:
    """E[W' 1{X'=y}] / v (6,) of pixel 0 when W was unbiased, and the relative error of stationarity."""
    fold, walk = WALKS[name]
    frame = six_cells(fold)
    found, pi = kernel(frame, 0, walk(k)), frame.cells.p_hat[0]
    return found.A.sum(axis=0), float(abs(pi @ found.P / pi - 1).max())


def predicted(name: str, k: int) -> Array:
    """The same weights from matrices written down here: T a moves, the rest stays."""
    frame = six_cells(WALKS[name][0])
    p, T = frame.cells.p_hat[0], np.asarray(frame.cells.proposal)
    w = BLUE.get(name, 0)
    T_ratio = np.ones(T.shape) if name == "clamped" else ratio(T.T, T)
    moves = T * np.minimum(1, (w + (1 - w) * p / p[:, None]) * T_ratio)
    stays, W = np.diag(1 - moves.sum(axis=1)), p / p[:, None] if name == "W inverted" else p[:, None] / p
    if name == "last accepted":
        before = np.linalg.matrix_power(moves + stays, k - 1)
        return np.asarray((before @ moves * W).sum(axis=0) + (before @ stays).sum(axis=1))
    return np.asarray(np.linalg.matrix_power(moves * W + stays, k).sum(axis=0))


def asymmetry(name: str) -> float:
    """Largest |p_hat(x) P(x, y) - p_hat(y) P(y, x)| of one step, relative to the largest flow."""
    fold, walk = WALKS[name]
    frame = six_cells(fold)
    flow = frame.cells.p_hat[0][:, None] * kernel(frame, 0, walk(1)).P
    return float(abs(flow - flow.T).max() / flow.max())


def biases() -> Arrays:
    """Per walk: relative bias (k,) of E[f W'], of its own total, and per cell; and the distance from the matrices."""
    k, f = range(1, MOST + 1), six_cells("bounded").cells.f
    cell = np.array([[moved_weight(name, each)[0] for each in k] for name in WALKS]) - 1
    matrices = np.array([[predicted(name, each) for each in k] for name in WALKS]) - 1
    return {
        "own": cell @ f[0] / f[0].sum(),
        "neighbour": cell @ f[1] / f[1].sum(),
        "cell": abs(cell).max(axis=-1),
        "off": abs(cell - matrices).max(axis=-1) / (1 + abs(matrices)).max(axis=-1),
        "stationary": np.array([moved_weight(name, 1)[1] for name in WALKS]),
        "asymmetry": np.array([asymmetry(name) for name in WALKS]),
        "later": np.array([later(name) for name in RIGHT]),
    }


def later(name: str) -> float:
    """Largest bias per cell after many more mutations: one enumerated step, as often."""
    fold, walk = WALKS[name]
    A = np.linalg.matrix_power(kernel(six_cells(fold), 0, walk(1)).A, LATER)
    return float(abs(A.sum(axis=0) - 1).max())


# ---------------------------------------------------------------- the figure


def chunks(preset: Any) -> Sequence[Any]:
    """All at once."""
    return [{}]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """Exact biases; nothing is random."""
    return biases()


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """The one chunk."""
    return results[0]


def check(a: Arrays) -> list[Claim]:
    """Right mutations are exact after any number of steps; every mistake has the bias that its matrix says."""
    at = {name: number for number, name in enumerate(WALKS)}
    good = [at[name] for name in RIGHT]
    exact = criteria.below(a["cell"][good].max(), 1e-10)
    last, blues = a["cell"][at["last accepted"]], [at[name] for name in BLUE]

    def off(*names: str) -> criteria.Outcome:
        return criteria.below(max(a["off"][at[name]].max() for name in names), 1e-10)

    def biased(name: str) -> criteria.Outcome:
        return criteria.above(abs(a["neighbour"][at[name]]).min(), 0.01)

    return [
        Claim("MCMC-E03", criteria.below(a["stationary"][good].max(), 1e-12), "p_hat P = p_hat, relative error"),
        Claim("MCMC-E04", criteria.below(a["asymmetry"][good].max(), 1e-14), "largest asymmetry of the flow"),
        Claim("MCMC-E06", exact, "1 to 5 steps: largest bias of any cell"),
        Claim("MCMC-E06", biased("W inverted"), "W inverted, 1 to 5 steps: smallest bias of E[f W']"),
        Claim("MCMC-C02", exact, "1 to 5 steps: largest bias of any cell", caveat=CAVEAT),
        Claim(
            "MCMC-C02",
            criteria.below(a["later"].max(), 1e-10),
            f"{LATER} steps: largest bias of any cell",
            caveat=CAVEAT,
        ),
        Claim("MCMC-A05", exact, "any accepted: largest bias of any cell"),
        Claim("MCMC-A05", criteria.below(last[0], 1e-10), "last accepted, k = 1: largest bias"),
        Claim(
            "MCMC-A05", criteria.above(last[[1, 4]].min(), 0.01), "last accepted, k = 2 and 5: largest bias of a cell"
        ),
        Claim("MCMC-A05", off("last accepted"), "last accepted: distance from its matrices"),
        Claim(
            "MCMC-A07", criteria.below(a["stationary"][good].max(), 1e-12), "bounded, wrapped: error of stationarity"
        ),
        Claim("MCMC-A07", criteria.above(a["stationary"][at["clamped"]], 0.01), "clamped: error of stationarity"),
        Claim(
            "MCMC-E13", criteria.above(abs(a["neighbour"][blues, -1]).min(), 0.05), "w_bn > 0, k = 5: bias of E[f W']"
        ),
        Claim("MCMC-E13", off("right", *BLUE), "w_bn = 0 to 1: distance from the matrices"),
        Claim("MCMC-E13", criteria.below(abs(a["own"][blues]).max(), 1e-10), "w_bn > 0: bias of E[p_hat W']"),
    ]


def draw(a: Arrays) -> "Picture":
    """Bias over the number of mutations, for the pixel's own total and for the neighbour's."""
    picture, axes = style.panels(1, 2, width=4.4, height=3.4)
    titles = ("own integrand, $f = \\hat p$", "integrand of the neighbour")
    for axis, which, title in zip(axes[0], ("own", "neighbour"), titles, strict=True):
        for name, bias in zip(WALKS, a[which], strict=True):
            if name in LOOKS:
                axis.semilogy(range(1, MOST + 1), shown(bias), **LOOKS[name], markevery=1)
        axis.set(xlabel="mutations $k$", ylabel="|relative bias| of $E[f\\,W']$", title=title, ylim=(3e-17, 1e2))
        axis.set_xticks(range(1, MOST + 1))
    axes[0, 1].legend(loc="center right")
    return picture


def shown(bias: Array) -> Array:
    """|bias|, or rounding where it is 0."""
    return np.asarray(np.maximum(abs(bias), 1e-16))


LOOKS: Mapping[str, dict[str, Any]] = {name: style.look(name) for name in WALKS if name != "right, wrapped"}
FIGURE = Figure(
    id="MCMC-E06",
    title="Mutations that keep W unbiased, and those that do not",
    world="toy1d",
    source="[MCMC 3.2.1, 3.2.4, 4.2, 5.2, Alg. 3]",
    claims=(
        "MCMC-E03",
        "MCMC-E04",
        "MCMC-E06",
        "MCMC-E13",
        "MCMC-A05",
        "MCMC-A07",
        "MCMC-C02",
    ),
    presets={"quick": {}, "paper": {}},
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)
