"""GRIS Fig. 7 in space: variance over samples per pixel in a window of 7 x 7 pixels, with every MIS weight.

As in flatland: indirect light of the rough Cornell box, reconnection, f(Y) W_Y of the window's middle pixel.  A pass
over 49 n samples weighs n groups of 49, each by itself: m_i of n equal groups is that of one group, over n.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims import criteria
from figures.claims.figure import Arrays, Claim, Conditions, Figure, Setup
from figures.experiments.split_light import IndirectIntegrals
from figures.experiments.views import setting
from figures.gris.gris_f07flat import PROPER, named, squared, variances
from figures.report import style
from restir_ref.batch import Array, take
from restir_ref.chance import Chance, Live
from restir_ref.integrals import Pixels
from restir_ref.mis import WEIGHTS
from restir_ref.resampling import Input, select, weigh
from restir_ref.restir import initial, shade
from restir_ref.transport.paths import RECONNECTION, Tracer

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture

SCENE, SIDE = "CB3", 7
VIEWS: Mapping[str, tuple[tuple[int, int], int]] = {
    "adjacent pixels": ((960, 540), 1),
    "across the foot of a box": ((1076, 1022), 10),
}
"""Windows: column and row of the middle pixel, and the step between neighbours, pixels of the film."""

ADJACENT, FOOT = VIEWS
COMPARED: Mapping[str, tuple[str, ...]] = {ADJACENT: tuple(WEIGHTS), FOOT: ("pairwise", "defensive", "constant")}
"""Weights by window; where samplers are poor, those that need few shifts and so can have many replicas."""


def chunks(preset: Any) -> Sequence[dict[str, str]]:
    """One per window and weight of the preset."""
    return [{"view": view, "mis": mis} for view, weights in preset["weights"].items() for mis in weights]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """f(Y) W_Y of the middle pixel by n, (columns,) each."""
    chance, found = Live(rng), {}
    for n in preset["n"]:
        around = window(chunk["view"], columns(preset, chunk["view"], n))
        groups = [samples(around, chance) for _ in range(n)]
        found[f"{n}"] = one_pass(groups, around[0], chunk["mis"], chance)
    return found


def columns(preset: Any, view: str, n: int) -> int:
    """Replicas of a pass: as many samples in all for every n, but where these are too few."""
    return int(preset["inputs"][view] // min(n, FEW))


FEW = 8
"""Samples per pixel from which on passes have as many replicas."""


def samples(around: Sequence[Pixels], chance: Chance) -> list[Input]:
    """One initial sample of every pixel."""
    image, C = around[0].of, len(around[0].index)
    X = initial(Pixels(image, np.concatenate([at.index for at in around])), chance)
    return [Input(take(X, np.arange(k * C, (k + 1) * C)), at) for k, at in enumerate(around)]


def window(view: str, columns: int, side: int = SIDE) -> list[Pixels]:
    """The middle pixel and then the others of a window of side x side pixels, in `columns` replicas."""
    ((x, y), step), of = VIEWS[view], setting(SCENE)
    half, wide = side // 2 * step, (side - 1) * step + 1
    sensor = of.pinhole(wide, wide, (x - half, y - half))
    image = IndirectIntegrals(Tracer(of.scene, sensor, of.depth, RECONNECTION))
    places = [row * step * wide + column * step for row in range(side) for column in range(side)]
    middle = places.pop(side**2 // 2)
    return [Pixels(image, np.full(columns, place)) for place in (middle, *places)]


def one_pass(groups: Sequence[Sequence[Input]], here: Pixels, mis: str, chance: Chance) -> Array:
    """f(Y) W_Y of one pass over n groups of one sample per pixel, (columns,).

    Every sum over all samples has n equal terms where that over a group has one: m_i is the group's, over n.
    """
    offered = [replace(y, mW=y.mW / len(groups)) for group in groups for y in weigh(group, here, WEIGHTS[mis])]
    return np.asarray(shade(select(offered, chance, np.ones(len(here.index))), here).mean(axis=0))


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """All by "view.mis.n", and `n`."""
    arrays: Arrays = {"n": np.array(preset["n"])}
    for chunk, part in zip(chunks(preset), results, strict=True):
        arrays |= {named(chunk["view"], chunk["mis"], n): array for n, array in part.items()}
    return arrays


# ---------------------------------------------------------------- verdicts


def check(a: Arrays) -> list[Claim]:
    """Slopes of proper weights; those of constant ones and the order are reported."""
    return [
        *(proper(a, view, mis) for view in VIEWS for mis in PROPER if mis in COMPARED[view]),
        *(constant(a, view, mis) for view in VIEWS for mis in COMPARED[view] if mis not in PROPER),
        order(a, ADJACENT),
    ]


def there(a: Arrays, view: str, *weights: str) -> bool:
    """Whether the preset has these weights in this window."""
    return all(named(view, mis, 1) in a for mis in weights)


def proper(a: Arrays, view: str, mis: str) -> Claim:
    """Slope -1."""
    part, n = f"space, {view}, {mis}: slope over n, real passes", a["n"]
    if not there(a, view, mis):
        return Claim("GRIS-F07", None, part, reason=LATER)
    decades = float(np.log10(n[-1] / n[0]))
    line = criteria.slope_within(n, variances(a, view, mis), -1, 0.1, decades=decades)
    return Claim("GRIS-F07", line, part, reason=f"n = 1 .. {n[-1]} spans {decades:.1f} decades only.", caveat=CAVEAT)


def constant(a: Arrays, view: str, mis: str) -> Claim:
    """What constant weights do, as found."""
    part, n = f"space, {view}, {mis}: slope over n, real passes", a["n"]
    if not there(a, view, mis):
        return Claim("GRIS-F07", None, part, reason=LATER)
    spread = variances(a, view, mis)
    text = f"slope {criteria.slope(n, spread):.3f}, Var(n = {n[-1]}) / Var(1) {spread[-1] / spread[0]:.3g}"
    return Claim("GRIS-F07", criteria.reported(text), part, reason=CONSTANT)


def order(a: Arrays, view: str) -> Claim:
    """Talbot against uniform pairwise weights, one sample per pixel."""
    part = f"space, {view}: Var of Talbot / pairwise, n = 1"
    if not there(a, view, *PROPER[:2]):
        return Claim("GRIS-F07", None, part, reason=LATER)
    talbot, uniform = (squared(a[named(view, mis, 1)]) for mis in PROPER[:2])
    return Claim("GRIS-F07", criteria.reported(criteria.ratio_interval(talbot, uniform)[2]), part)


LATER = "Weights that ask all 49 pixels of every sample, and the other window, take the paper preset."
CONSTANT = "The clause on constant weights is judged on the line, where supports are unequal; here as found."
CAVEAT = "Constant weights converge here as well (below), which Fig. 7 and the line (T7) do not show."


# ---------------------------------------------------------------- picture


def draw(a: Arrays) -> "Picture":
    """Variance over n in both windows."""
    views = [view for view in VIEWS if there(a, view, PROPER[1])]
    picture, axes = style.panels(1, len(views), width=4.4, height=3.8)
    for axis, view in zip(axes[0], views, strict=True):
        for mis in (each for each in COMPARED[view] if there(a, view, each)):
            axis.loglog(a["n"], variances(a, view, mis), **style.look(mis), markevery=1)
        axis.set_xticks([], minor=True)
        axis.set_xticks(a["n"], [str(n) for n in a["n"]])
        axis.set(xlabel="samples $n$ per pixel", ylabel="relative variance of $f(Y) W_Y$")
        axis.set_title(f"7 x 7 pixels, {view}")
        style.below(axis, ncols=3)
    return picture


FIGURE = Figure(
    id="GRIS-F07-3D",
    title="Samples per pixel in a window of 7 x 7 pixels, in space",
    world="tracer3d",
    source="[GRIS Fig. 7; 5.6, 9.1]",
    claims=("GRIS-F07",),
    conditions=(
        Conditions(
            ("GRIS-F07",),
            "Fig. 7; 9.1",
            Setup("one pass", "still", "indirect", "a window of 7 x 7 pixels in the rough Cornell box, reconnection"),
            Setup("one pass", "still", "indirect", "windows of 7 x 7 pixels, |R| / M = 1/49, same box and shift"),
        ),
    ),
    arm="mis",
    presets={
        "quick": {
            "n": [1, 2, 3, 4, 6, 8],
            "inputs": {ADJACENT: 1024},
            "weights": {ADJACENT: ["pairwise", "defensive"]},
        },
        "paper": {
            "n": [1, 2, 3, 4, 6, 8, 12, 16],
            "inputs": {ADJACENT: 1536, FOOT: 4096},
            "weights": {ADJACENT: list(WEIGHTS), FOOT: list(COMPARED[FOOT])},
        },
    },
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)
