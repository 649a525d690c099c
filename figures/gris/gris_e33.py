"""GRIS Eq. 26-34: what keeps contributions bounded, and four separate reasons why they are not.

Four problems with one cause each: too few shifts cover a region, weights c_i far above 1/M, p_hat W
unbounded, a Jacobian unbounded.  With 1/Z weights the largest contribution grows without end, with
those of Eq. 36-38 it stays below sum_i C_i / |R|.  A fifth has f / p_hat unbounded, which no weight
repairs.  The first two causes are about many inputs and exact, the others about many draws.  There
sum_i C_i / |R| grows with M itself, and 1/Z weights attain it, so the largest value must not grow at all.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims import criteria
from figures.claims.figure import Arrays, Claim, Figure
from figures.report import style
from restir_ref.batch import Array
from restir_ref.chance import Chance, Live
from restir_ref.integrals import Pixels
from restir_ref.mis import WEIGHTS, Weights
from restir_ref.oracle import bounds
from restir_ref.oracle.cells import Frame, cells
from restir_ref.oracle.scenes import paired
from restir_ref.resampling import Input, gris
from restir_ref.restir import initial, shade
from toy1d import Chart, Line, Technique

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture

ROBUST = ("talbot", "pairwise", "defensive")
NAMES = (*ROBUST, "1/Z")
CANDIDATES = 4


# ---------------------------------------------------------------- problems on the line


def steep_shift() -> Line:
    """Cause 4: y = x^.2 from pixel 1 to 0, J = .2 x^-.8 unbounded; p_hat = 1, uniform samples, C_i = 1."""
    e = np.array([1.0, 0.2])
    chart = Chart(lambda i, x: x ** e[i], lambda i, z: z ** (1 / e[i]), lambda i, x: e[i] * x ** (e[i] - 1))
    return Line(lambda i, x: np.ones_like(x), np.zeros(2), np.ones(2), chart)


def faint_neighbour() -> Line:
    """Cause 3: pixel 1 aims at and draws from x^.8, so p_hat_1 W_1 = 1/1.8, but p_hat_0 W_1 = x^-.8 / 1.8."""
    one_draw = Technique(
        lambda i, u: np.where(i == 0, u, u ** (1 / 1.8)), lambda i, s: np.where(i == 0, 1.0, 1.8 * s**0.8)
    )
    return Line(lambda i, x: np.where(i == 0, 1.0, x**0.8), np.zeros(2), np.ones(2), techniques=(one_draw,))


def unreasonable() -> Line:
    """f = x^-.4 over p_hat = 1: no C_f."""
    return Line(lambda i, x: np.ones_like(x), np.zeros(1), np.ones(1), chroma=lambda i, x: x[None] ** -0.4)


def reasonable() -> Line:
    """f = 1 + .9 sin 2 pi x over p_hat = f + 1/2: C_f = 1.9 / 2.4, and C_i = 2.4."""

    def wave(x: Array) -> Array:
        return np.asarray(1 + 0.9 * np.sin(2 * np.pi * x))

    chroma = lambda i, x: (wave(x) / (wave(x) + 0.5))[None]  # noqa: E731
    return Line(lambda i, x: wave(x) + 0.5, np.zeros(1), np.ones(1), chroma=chroma)


LINES: Mapping[str, tuple[Callable[[], Line], float]] = {
    "steep shift": (steep_shift, 2.0),
    "faint neighbour": (faint_neighbour, 1 + 1 / 1.8),
    "f / p_hat unbounded": (unreasonable, np.inf),
    "f / p_hat bounded": (reasonable, 1.9),
}
"""Problems whose contributions are drawn, with the bound C_f sum_i C_i / |R|."""

DRAWN = tuple((problem, mis) for problem in list(LINES)[:2] for mis in NAMES) + tuple(
    (problem, "talbot") for problem in list(LINES)[2:]
)


def contributions(line: Line, mis: Weights, draws: int, chance: Chance) -> Array:
    """f(Y) W_Y of pixel 0 from one sample of each pixel, or from four where there is but one; (draws,)."""
    pixels = [Pixels(line, np.full(draws, i)) for i in range(line.n)]
    inputs = [Input(initial(at, chance), at) for at in pixels * (CANDIDATES if line.n == 1 else 1)]
    return np.asarray(shade(gris(inputs, pixels[0], mis, chance), pixels[0])[0])


def recorded(draws: int) -> Array:
    """Numbers of draws to look at."""
    return np.geomspace(100, draws, 12).round().astype(int)


def running_maxima(preset: Any, problem: str, mis: str, chance: Chance) -> Arrays:
    """Largest contribution so far, (run, recorded)."""
    line, at = LINES[problem][0](), recorded(preset["draws"]) - 1
    runs = (contributions(line, WEIGHTS[mis], preset["draws"], chance) for _ in range(preset["runs"]))
    return {"running": np.stack([np.maximum.accumulate(run)[at] for run in runs])}


# ---------------------------------------------------------------- coverage, exactly


def half_covered() -> Frame:
    """Two cells of volume 1/2 with p_hat = 1; pixel 1 has no part in the second, and C_i = 1 and 1/2."""
    v, f = np.full((2, 2), 0.5), np.array([[1.0, 1.0], [1.0, 0.0]])
    pdf = np.array([[[1.0, 1.0], [2.0, 0.0]]])
    return Frame(cells(v, f, pdf, paired(2, 2, {(0, 1): (0, -1)})), 2)


def largest_of(M: float, R: float, mis: Weights) -> float:
    """Largest p_hat(Y) W_Y of pixel 0, enumerated, from R canonical samples and M - R of the neighbour."""
    frame = half_covered()

    def program(index: Array, chance: Chance) -> Array:
        pixels = [Pixels(frame, np.full(len(index), i)) for i in (0, 1)]
        X = [initial(at, chance) for at in pixels]
        inputs = [Input(replace(x, c=c * x.c), at) for x, c, at in zip(X, (R, M - R), pixels, strict=True)]
        return shade(gris(inputs, pixels[0], mis, chance), pixels[0])

    return float(bounds.largest(program, 1)[0, 0])


def coverage(preset: Any) -> Arrays:
    """Largest contributions (cause, mis, M) where the second cell is covered by the |R| canonical inputs only.

    Cause 1: |R| = 1, finitely many.  Cause 2: |R| = sqrt(M), more and more, but c_i = 1/|R| far exceeds 1/M.
    """
    M = np.array(preset["M"], dtype=float)
    found = [
        [[largest_of(m, r, WEIGHTS[mis]) for m, r in zip(M, R, strict=True)] for mis in NAMES]
        for R in (M**0, np.sqrt(M))
    ]
    return {"M": M, "covered": np.array(found)}


# ---------------------------------------------------------------- the figure


def chunks(preset: Any) -> Sequence[Any]:
    """One chunk per drawn problem and weight, and the exact problems."""
    return [*({"problem": problem, "mis": mis} for problem, mis in DRAWN), {"problem": "coverage", "mis": ""}]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """Largest contributions."""
    if chunk["problem"] == "coverage":
        return coverage(preset)
    return running_maxima(preset, chunk["problem"], chunk["mis"], Live(rng))


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """Running maxima (problem, run, recorded), and the exact problem's arrays."""
    running = np.stack([result["running"] for result in results[:-1]])
    return {"draws": recorded(preset["draws"]), "running": running, **results[-1]}


def check(a: Arrays) -> list[Claim]:
    """With 1/Z weights all four causes show; with the others none does."""
    median = np.median(a["running"], axis=1)
    grows = {case: criteria.slope(a["draws"], maxima) for case, maxima in zip(DRAWN, median, strict=True)}
    most = {case: maxima.max() / LINES[case[0]][1] for case, maxima in zip(DRAWN, a["running"], strict=True)}
    drawn = list(LINES)[:2]
    return [
        *check_coverage(a),
        *(Claim("GRIS-E33", criteria.above(grows[problem, "1/Z"], 0.2), f"{problem}, 1/Z: slope") for problem in drawn),
        *(
            Claim("GRIS-E33", criteria.between(most[problem, mis], 0, 1), f"{problem}, {mis}: largest over its bound")
            for problem in drawn
            for mis in ROBUST
        ),
        Claim("GRIS-E26", criteria.above(grows["f / p_hat unbounded", "talbot"], 0.2), "f / p_hat unbounded: slope"),
        Claim("GRIS-E26", criteria.between(most["f / p_hat bounded", "talbot"], 0, 1), "f / p_hat bounded: over bound"),
    ]


def check_coverage(a: Arrays) -> list[Claim]:
    """Causes 1 and 2, over the number of inputs."""
    M, claims = a["M"], []
    for name, covered in zip(CAUSES, a["covered"], strict=True):
        by_name = dict(zip(NAMES, covered, strict=True))
        part, caveat = f"{name}, 1/Z: slope over M", CAVEATS[name]
        growth = {mis: criteria.slope(M, largest) for mis, largest in by_name.items()}
        claims += [
            Claim("GRIS-E33", criteria.above(growth["1/Z"], 0.2), part, caveat=caveat),
            *(Claim("GRIS-E33", criteria.within(growth[mis], 0, 0.05), f"{name}, {mis}: slope") for mis in ROBUST),
        ]
    return claims


def draw(a: Arrays) -> "Picture":
    """Growth over inputs and over draws."""
    picture, axes = style.panels(1, 2, width=4.6, height=3.8)
    inputs, draws = axes[0]
    for name, covered, ls in zip(CAUSES, a["covered"], ("-", "--"), strict=True):
        inputs.loglog(a["M"], covered[-1], **style.look("1/Z", ls=ls, label=f"1/Z, {name}"), markevery=1)
        inputs.loglog(a["M"], covered[0], **style.look("Talbot", ls=ls, label=f"Talbot, {name}"), markevery=1)
    inputs.set(xlabel="inputs $M$", ylabel=r"largest $\hat p(Y) W_Y$ (exact)", title="Regions that few inputs cover")
    median = np.median(a["running"], axis=1)
    for k, (problem, mis) in enumerate(DRAWN):
        if mis in ("1/Z", "talbot"):
            label = f"{SHORT[mis]}{problem}".replace("p_hat", r"$\hat p$")
            look = style.look(mis, marker=PROBLEMS[problem], label=label)
            draws.loglog(a["draws"], median[k], **look)
    draws.set(xlabel="draws", ylabel="largest $f(Y) W_Y$ so far (median of runs)", title="Unbounded factors")
    for each in (inputs, draws):
        style.below(each)
    return picture


CAUSES = ("|R| = 1", "|R| = sqrt(M)")
CAVEATS = {
    "|R| = 1": "",
    "|R| = sqrt(M)": "The paper's second cause is m_i >> 1/M in w_i.  1/Z weights have m_i = 1/M always, so what is"
    " large here is the contribution weight, c_i = 1/|R|; a large m_i is not shown alone.",
}
"""In what respect a cause is not the paper's."""
PROBLEMS = dict(zip(LINES, style.MARKERS, strict=False))
"""Problems differ in their markers; colours and dashes are the weights'."""
SHORT = {"1/Z": "1/Z, ", "talbot": "Talbot, "}

FIGURE = Figure(
    id="GRIS-E33",
    title="Four reasons for unbounded contributions",
    world="toy1d",
    source="[GRIS Def. 5.1, 5.4, Eq. 26-27, 33-34]",
    claims=("GRIS-E26", "GRIS-E33"),
    presets={
        "quick": {"draws": 65_536, "runs": 16, "M": [4**k for k in range(1, 8)]},
        "paper": {"draws": 655_360, "runs": 32, "M": [4**k for k in range(1, 8)]},
    },
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)
