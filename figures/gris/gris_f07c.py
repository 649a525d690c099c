"""GRIS Fig. 7, in the text: what a pass costs, counted in shifts.

Talbot weights ask every input about every sample, pairwise weights only each pair of a sample and the
canonical one.  The integrals themselves count; nothing is timed.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims import criteria
from figures.claims.figure import Arrays, Claim, Figure
from figures.experiments.exact import integral, sum_of_weights
from figures.report import style
from restir_ref.chance import Live
from restir_ref.counting import Counting
from restir_ref.integrals import Pixels
from restir_ref.mis import WEIGHTS
from restir_ref.oracle.scenes import offset
from restir_ref.resampling import Input, gris
from restir_ref.restir import initial, spatial
from toy1d import image_of_64, overlapping_supports

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture

NAMES = ("talbot", "pairwise", "defensive", "constant")
PROPER = NAMES[:3]
COLUMNS = 64


def chunks(preset: Any) -> Sequence[Any]:
    """Everything at once: counting is cheap."""
    return [{}]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """Shifts per column over M and over n, and the exact variance over n."""
    toy, pixels = overlapping_supports(), (3, 0, 1, 2, 4, 5, 6)
    spread = [[sum_of_weights(toy, [(i, n) for i in pixels], WEIGHTS[k])[1] for n in preset["n"]] for k in PROPER]
    return {
        "M": np.array(preset["M"]),
        "shifts": np.array([[shifts_of_window(name, M, Live(rng)) for M in preset["M"]] for name in NAMES]),
        "n": np.array(preset["n"]),
        "shifts_of_n": np.array([[shifts_of_copies(name, n, Live(rng)) for n in preset["n"]] for name in PROPER]),
        "variance": np.array(spread) / integral(toy, 3) ** 2,
    }


def shifts_of_window(mis: str, M: int, chance: Live) -> float:
    """Shifts per pixel of one spatial pass over M pixels, one of them canonical."""
    image = Counting(image_of_64())
    here = Pixels(image, np.arange(COLUMNS))
    X = initial(here, chance)
    spatial(X, here, [offset(image, here.index, by) for by in range(1, M)], chance, mis=WEIGHTS[mis])
    return image.asked["shift"] / COLUMNS


def shifts_of_copies(mis: str, n: int, chance: Live) -> float:
    """Shifts per pixel of one pass over n samples from each of seven pixels, n of them canonical."""
    toy = Counting(overlapping_supports())
    at = [Pixels(toy, np.full(COLUMNS, (3 + by) % 7)) for by in range(7)]
    gris([Input(initial(there, chance), there) for there in at for _ in range(n)], at[0], WEIGHTS[mis], chance)
    return toy.asked["shift"] / COLUMNS


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """The one chunk."""
    return results[0]


def check(a: Arrays) -> list[Claim]:
    """M (M - 1) against 2 (M - 1), at every M; 49 is the paper's window."""
    M, shifts = a["M"], dict(zip(NAMES, a["shifts"], strict=True))
    at_49 = list(M).index(49)
    pairs = [(name, criteria.equal_to(shifts[name], 2 * (M - 1), tol=0)) for name in ("pairwise", "defensive")]
    return [
        Claim("GRIS-F07c", criteria.equal_to(shifts["talbot"][at_49], 49 * 48, tol=0), "talbot, M = 49: shifts"),
        Claim("GRIS-F07c", criteria.equal_to(shifts["pairwise"][at_49], 2 * 48, tol=0), "pairwise, M = 49: shifts"),
        Claim("GRIS-F07c", criteria.equal_to(shifts["talbot"], M * (M - 1), tol=0), "talbot: M (M - 1) for all M"),
        *(Claim("GRIS-F07c", outcome, f"{name}: 2 (M - 1) for all M") for name, outcome in pairs),
    ]


def draw(a: Arrays) -> "Picture":
    """Shifts over the size of the window, and variance over shifts for growing n."""
    picture, axes = style.panels(1, 2, width=4.4, height=3.6)
    cost, efficiency = axes[0]
    labels = {"talbot": "Talbot: $M(M-1)$", "pairwise": "pairwise: $2(M-1)$", "defensive": "defensive: $2(M-1)$"}
    fine = np.geomspace(2, 64, 100)
    for name in NAMES[:2]:
        look = style.look(name, marker="", label=None)
        cost.loglog(fine, fine * (fine - 1) if name == "talbot" else 2 * (fine - 1), **look)
    for k, name in enumerate(NAMES):
        cost.loglog(
            a["M"], a["shifts"][k], **style.look(name, ls="", label=labels.get(name, "constant: $M-1$")),
            markevery=1, fillstyle="none", ms=5 + 2 * (k == 2),
        )  # fmt: skip
    cost.axvline(49, color=style.GREY, ls=":", marker="", label="the paper's window, $M = 49$")
    cost.set(xlabel="inputs $M$, $|R| = 1$", ylabel="shifts per pixel", title="Cost of a pass (markers counted)")
    cost.set_xticks([2, 5, 10, 20, 49], ["2", "5", "10", "20", "49"])
    cost.minorticks_off()
    style.below(cost)
    for k, name in enumerate(PROPER):
        efficiency.loglog(a["shifts_of_n"][k], a["variance"][k], **style.look(name), markevery=1)
    efficiency.set(
        xlabel="shifts per pixel, counted",
        ylabel="relative variance of $f(Y) W_Y$",
        title="Seven pixels, $M = 7n$, $|R| = n$",
    )
    efficiency.legend()
    return picture


FIGURE = Figure(
    id="GRIS-F07c",
    title="Pairwise weights cost a fraction of Talbot weights",
    world="toy1d",
    source="[GRIS Fig. 7; 5.6, 9.1]",
    claims=("GRIS-F07c",),
    presets={
        "quick": {"M": [2, 3, 4, 6, 9, 16, 25, 36, 49], "n": [1, 2, 4, 8]},
        "paper": {"M": [2, 3, 4, 6, 9, 16, 25, 36, 49, 64], "n": [1, 2, 4, 8, 16, 32]},
    },
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)
