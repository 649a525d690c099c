"""GRIS 10.1: one sample offered through two shift maps at once, as two inputs that are correlated.

Exact, over random finite scenes: a neighbour's sample enters through shift A, through shift B, or
through both.  If both share the sample's confidence, pairwise weights make sum w the average of the
two single-shift sums, so by convexity the variance is at most the larger one.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims import criteria
from figures.claims.figure import Arrays, Claim, Figure
from figures.experiments.random_frames import random_frame
from figures.report import style
from restir_ref.batch import Array
from restir_ref.chance import Chance
from restir_ref.integrals import Pixels, Reservoirs
from restir_ref.mis import WEIGHTS, Weights
from restir_ref.oracle.cells import Frame
from restir_ref.oracle.laws import bias_per_cell
from restir_ref.oracle.scenes import Loop
from restir_ref.oracle.selected import Selected, contribution_variance, selected
from restir_ref.resampling import Input, gris
from restir_ref.restir import initial

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture

ROBUST = ("talbot", "pairwise", "defensive")
LINEAR = ("pairwise", "defensive")
WAYS = (((1,), 1.0), ((2,), 1.0), ((1, 2), 0.5), ((1, 2), 1.0))
"""Shift A, shift B, both sharing the confidence, both counted fully: maps used and the confidence of each."""


def two_maps(frame: Frame) -> Frame:
    """Integral 2 becomes integral 1 once more, but keeps its own shifts: another map of the same sample."""
    tables, row = frame.cells, np.array([0, 1, 1])
    return Frame(
        replace(tables, v=tables.v[row], f=tables.f[row], p_hat=tables.p_hat[row], pdf=tables.pdf[:, row]), frame.n
    )


def merge(frame: Frame, maps: Sequence[int], c: float, mis: Weights) -> Loop:
    """Pixel 0 merges its own sample with one of the neighbour, through the given maps, each of confidence c."""

    def loop(index: Array, chance: Chance) -> Reservoirs:
        at = [Pixels(frame, np.full(len(index), i)) for i in range(3)]
        own, other = initial(at[0], chance), initial(at[1], chance)
        through = [Input(replace(other, c=c * other.c), at[i]) for i in maps]
        return gris([Input(own, at[0]), *through], at[0], mis, chance)

    return loop


def merged(frame: Frame, maps: Sequence[int], c: float, mis: str) -> Selected:
    """The law of pixel 0's sample."""
    return selected(merge(frame, maps, c, WEIGHTS[mis]), frame.cells.v[:1])


def chunks(preset: Any) -> Sequence[Any]:
    """Groups of scenes."""
    return [{"group": g} for g in range(preset["groups"])]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """Var[sum w] (scene, mis, way) and the largest bias of any cell (scene, mis, way)."""
    found = [scene(two_maps(random_frame(3, 3, rng))) for _ in range(preset["scenes"])]
    return {"variance": np.array([v for v, _ in found]), "bias": np.array([b for _, b in found])}


def scene(frame: Frame) -> tuple[Array, Array]:
    """Relative variances and biases of one scene, (mis, way) each."""
    laws = [[merged(frame, maps, c, mis) for maps, c in WAYS] for mis in ROBUST]
    p_hat, v = frame.cells.p_hat[:1], frame.cells.v[:1]
    variance = [[contribution_variance(Y, p_hat)[0] for Y in of_mis] for of_mis in laws]
    bias = [[abs(bias_per_cell(Y.W, v, p_hat > 0)).max() for Y in of_mis] for of_mis in laws]
    return np.array(variance) / (p_hat @ v.T).item() ** 2, np.array(bias)


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """Variances of both ways of using both maps over the larger of the single ones, (way, mis, scene); largest bias."""
    variance = np.concatenate([result["variance"] for result in results])
    larger = variance[..., :2].max(axis=-1)
    matters = (larger > 1e-9).all(axis=-1)
    over = variance[matters, :, 2:] / larger[matters, :, None]
    return {"over": over.transpose(2, 1, 0), "bias": np.max([result["bias"].max() for result in results])}


def check(a: Arrays) -> list[Claim]:
    """Unbiased always, which is the claim; beside it the variance, which it does not speak of."""
    return [
        Claim("GRIS-C15", criteria.below(a["bias"], 1e-10), "largest exact bias of a cell"),
        Claim("GRIS-C15", criteria.reported(spread(a)), "Var[sum w] over the larger single-shift one", reason=WHY),
    ]


WHY = (
    "The paper claims that both shifts may be combined, not that it always pays. If they share the sample's "
    "confidence, pairwise weights average both sums, and the variance is at most the larger one. Counted fully, one "
    "sample weighs as two, and its noise can exceed that of the worse shift."
)


def spread(a: Arrays) -> str:
    """Largest variance ratios and how often they exceed 1, in words."""
    ways = zip(("confidence shared", "counted fully"), a["over"], strict=True)
    return "; ".join(f"{way}: " + ", ".join(map(_largest, ROBUST, over)) for way, over in ways)


def _largest(mis: str, over: Array) -> str:
    return f"{mis} at most {over.max():.3g} and above 1 in {(over > 1 + 1e-9).mean():.0%} of the scenes"


def draw(a: Arrays) -> "Picture":
    """How the variance with both maps compares with the worse map."""
    picture, axes = style.panels(1, 2, width=4.2, height=3.8)
    titles = ("Confidence shared by both shifts", "Each shift counted fully")
    for axis, over, title in zip(axes[0], a["over"], titles, strict=True):
        for mis, values in zip(ROBUST, over, strict=True):
            axis.plot(np.sort(values), (np.arange(len(values)) + 1) / len(values), **style.look(mis, marker=""))
        axis.axvline(1, color=style.INK, lw=1, ls=(0, (1, 1)), marker="", label=BORDER)
        axis.set(
            xlim=(0, 2),
            xlabel=r"Var$[\sum w]$ with both shifts over the larger single one",
            ylabel="fraction of scenes",
            title=title,
        )
    for axis in axes[0]:
        style.below(axis)
    return picture


BORDER = "as the worse shift"

FIGURE = Figure(
    id="GRIS-C15",
    title="One sample through two shift maps",
    world="toy1d",
    source="[GRIS 10.1]",
    claims=("GRIS-C15",),
    presets={"quick": {"groups": 2, "scenes": 100}, "paper": {"groups": 10, "scenes": 400}},
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)
