"""GRIS Eq. 40: through any chain of passes p_hat(Y) W_Y stays below a bound that grows from pass to pass.

Three passes over random finite scenes, enumerated, so the largest value is exact; and over a row of
64 pixels, drawn.  The realised bound takes p_hat_i(X_i) W_i of the very inputs, the recursive one their bounds.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims import criteria
from figures.claims.figure import Arrays, Claim, Figure
from figures.experiments.random_frames import random_frame
from figures.report import style
from restir_ref.batch import Array, ratio
from restir_ref.chance import Chance, Live
from restir_ref.integrals import Pixels, Reservoirs, target
from restir_ref.mis import WEIGHTS, Weights
from restir_ref.oracle import bounds
from restir_ref.oracle.cells import Frame
from restir_ref.oracle.enumeration import Program
from restir_ref.oracle.scenes import offset
from restir_ref.resampling import Input, gris
from restir_ref.restir import around, initial
from toy1d import image_of_64

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture

NAMES = ("talbot", "pairwise", "defensive", "1/Z")
ROBUST = NAMES[:3]
PASSES = 3
NEAR = (-3, 1, 5)
"""The neighbours in the row of 64 pixels."""


def chunks(preset: Any) -> Sequence[Any]:
    """The random scenes, and the row."""
    return [{"scene": "random"}, {"scene": "row"}]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """Largest sums over their bounds."""
    return chains(preset, rng) if chunk["scene"] == "random" else row(preset, rng)


def over_bounds(Y: Reservoirs, inputs: Sequence[Input], here: Pixels) -> tuple[Array, Array]:
    """p_hat(Y) W_Y over the realised bound sum_i c_i p_hat_i(X_i) W_i / C_R, and p_hat(Y) W_Y; (N,)."""
    p_hat_W = [target(each.at, each.X.x) * each.X.W for each in inputs]
    sums = target(here, Y.x) * Y.W
    bound = bounds.sum_bound(np.stack(p_hat_W), np.stack([each.X.c for each in inputs]), inputs[0].X.c)
    return ratio(sums, bound), sums


def chain(frame: Frame, c: Array, mis: Weights) -> Program[Array]:
    """Three passes, pixel i of confidence c_i: p_hat(Y) W_Y over its realised and its recursive bound, (3 * 2, N)."""
    C = [ratio(frame.cells.p_hat, frame.cells.pdf[0]).max(axis=-1)]
    for _ in range(PASSES):
        C.append(bounds.sum_bound(C[-1][:, None], c[:, None], c))

    def program(index: Array, chance: Chance) -> Array:
        here, found = Pixels(frame, index), []
        X = replace(initial(here, chance), c=c[index % frame.n])
        for k in range(PASSES):
            inputs = [Input(X, here), *around(X, [offset(frame, index, by) for by in range(1, frame.n)])]
            Y = gris(inputs, here, mis, chance)
            realised, sums = over_bounds(Y, inputs, here)
            found += [realised, sums / C[k + 1][index % frame.n]]
            X = replace(Y, c=X.c)
        return np.stack(found)

    return program


def chains(preset: Any, rng: np.random.Generator) -> Arrays:
    """Largest p_hat(Y) W_Y over its realised and recursive bounds in random scenes, enumerated; (2, mis, scene)."""
    found = []
    for _ in range(preset["scenes"]):
        frame, c = random_frame(2, 3, rng), 10.0 ** rng.uniform(-1, 1, 2)
        found.append([bounds.largest(chain(frame, c, WEIGHTS[mis]), 2).max(axis=-1) for mis in NAMES])
    by_pass = np.array(found).reshape(preset["scenes"], len(NAMES), PASSES, 2)
    return {"chains": by_pass.max(axis=2).transpose(2, 1, 0)}


def row(preset: Any, rng: np.random.Generator) -> Arrays:
    """The same over the realised bound in the row of 64 pixels, drawn; (mis,)."""
    line, chance, found = image_of_64(), Live(rng), []
    here = Pixels(line, np.arange(64 * preset["replicas"]))
    for mis in NAMES:
        X, largest = initial(here, chance), 0.0
        for _ in range(PASSES):
            inputs = [Input(X, here), *around(X, [offset(line, here.index, by) for by in NEAR])]
            X = gris(inputs, here, WEIGHTS[mis], chance)
            largest = max(largest, float(over_bounds(X, inputs, here)[0].max()))
        found.append(largest)
    return {"row": np.array(found)}


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """All arrays together."""
    return {name: array for result in results for name, array in result.items()}


def check(a: Arrays) -> list[Claim]:
    """Robust weights keep both bounds; 1/Z exceeds the realised one."""
    realised, recursive = a["chains"].max(axis=-1)
    claims = []
    for mis, *values in zip(NAMES, realised, recursive, a["row"], strict=True):
        if mis in ROBUST:
            worst = criteria.between(max(values), 0, 1 + 1e-12)
            claims.append(Claim("GRIS-E40", worst, f"{mis}: largest sum over its bounds"))
    return [
        *claims,
        Claim("GRIS-E40", criteria.above(realised[-1], 1), "control, 1/Z, random scenes: sum over its realised bound"),
        Claim("GRIS-E40", criteria.above(a["row"][-1], 1), "control, 1/Z, row of 64: sum over its realised bound"),
    ]


def draw(a: Arrays) -> "Picture":
    """How often how much of the bounds is used."""
    picture, axes = style.panels(1, 2, width=4.2, height=3.6)
    titles = ("Realised bound", "Recursive bound")
    for axis, scenes, title in zip(axes[0], a["chains"], titles, strict=True):
        for name, values in zip(NAMES, scenes, strict=True):
            axis.plot(np.sort(values), (np.arange(len(values)) + 1) / len(values), **style.look(name, marker=""))
        axis.axvline(1, color=style.INK, lw=1, ls=(0, (1, 1)), marker="", label=BORDER)
        axis.set(
            xscale="log",
            xlabel=r"largest $\hat p(Y) W_Y$ over its bound",
            ylabel="fraction of scenes",
            title=f"{title}, {PASSES} passes",
        )
    axes[0, 0].legend(loc="center right")
    return picture


BORDER = "at the bound"

FIGURE = Figure(
    id="GRIS-E40",
    title="Contributions stay bounded through chains of passes",
    world="toy1d",
    source="[GRIS Eq. 39-40]",
    claims=("GRIS-E40",),
    presets={"quick": {"scenes": 100, "replicas": 200}, "paper": {"scenes": 2000, "replicas": 5000}},
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)
