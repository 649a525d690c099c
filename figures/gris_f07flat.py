"""GRIS Fig. 7 and 8 in flatland: n samples of each pixel of a window, and one sample of ever more pixels.

Fig. 7: n samples of every pixel of a window of seven enter one pass as n groups of seven, each weighted as if
alone, divided by n: that is what replicated inputs do to any weight.  Fig. 8: one sample of each pixel of a
window that grows around one canonical pixel, beside the slit through which the light comes.
"""

from collections import Counter
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from figures import criteria, style
from figures.figure import Arrays, Claim, Figure
from figures.flatland import HYBRID, view
from flatland2d import SCENES
from restir_ref.batch import Array, take
from restir_ref.chance import Live
from restir_ref.integrals import Pixels
from restir_ref.mis import WEIGHTS
from restir_ref.resampling import Input, weigh
from restir_ref.restir import initial
from restir_ref.transport.restir_pt import PathIntegrals

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture

WINDOW = 7
MIDDLE = 960
STEP = {"adjacent pixels": 1, "pixels 10 apart": 10}
PROPER = ("talbot", "pairwise", "defensive")
GROWING = {"adjacent": ("defensive",), "whole film": ("talbot", "defensive")}
APART = {"adjacent": 1, "whole film": 14}
"""Film pixels between neighbours of the growing window: 129 of them are an inset, or nearly the film of 1920."""


def chunks(preset: Any) -> Sequence[dict[str, Any]]:
    """A window and a weight; a window that grows."""
    seven = [{"figure": 7, "step": step, "mis": mis} for step in STEP for mis in WEIGHTS]
    windows = [(apart, mis) for apart, weights in GROWING.items() for mis in weights]
    grown = [{"figure": 8, "apart": apart, "mis": mis, "M": M} for apart, mis in windows for M in preset["M"][mis]]
    return [*seven, *grown]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """f(Y) W_Y of the centre pixel: (n, replicas), or (replicas,)."""
    if chunk["figure"] == 7:
        return {"estimate": seven(preset, chunk, Live(rng))}
    window, chance = around("ajar", chunk["M"], APART[chunk["apart"]], preset["replicas"][chunk["mis"]]), Live(rng)
    w, _ = weighed(window, chunk["mis"], chance)
    return {"estimate": w.sum(axis=0)}


def around(scene: str, M: int, step: int, columns: int) -> list[Pixels]:
    """The pixel in the middle of the film, then those around it, in `columns` replicas."""
    setting = SCENES[scene]()
    reach = (M // 2) * step
    of: PathIntegrals = view(scene, HYBRID, Counter(), setting.pinhole(2 * reach + 1, MIDDLE - reach))
    offsets = [0, *(sign * k * step for k in range(1, M // 2 + 1) for sign in (-1, 1))]
    return [Pixels(of, np.full(columns, reach + offset)) for offset in offsets]


def weighed(window: Sequence[Pixels], mis: str, chance: Live) -> tuple[Array, Array]:
    """p_hat m W of one sample of each pixel, shifted to the first, and c / m; (M, columns) each.

    All initial samples are drawn in one batch.
    """
    columns = len(window[0].index)
    drawn = initial(Pixels(window[0].of, np.concatenate([at.index for at in window])), chance)
    inputs = [Input(take(drawn, np.arange(k * columns, (k + 1) * columns)), at) for k, at in enumerate(window)]
    found = list(weigh(inputs, window[0], WEIGHTS[mis]))
    ones = np.ones(columns)
    return np.stack([y.p_hat * y.mW for y in found]), np.stack(
        [ones if y.c_over_m is None else y.c_over_m for y in found]
    )


def seven(preset: Any, chunk: Any, chance: Live) -> Array:
    """f(Y) W_Y for every n from the first n groups, (n, replicas)."""
    R, most = preset["columns"], max(preset["n"])
    window = around("cornell", WINDOW, STEP[chunk["step"]], R * most)
    w, c_over_m = (x.reshape(WINDOW, most, R) for x in weighed(window, chunk["mis"], chance))
    return np.stack([selected(w[:, :n], c_over_m[:, :n], chance) for n in preset["n"]])


def selected(w: Array, c_over_m: Array, chance: Live) -> Array:
    """(c_s / m_s) sum w / n of the chosen one of 7 n candidates, f = p_hat; w (7, n, R)."""
    n, flat = w.shape[1], w.reshape(-1, w.shape[2])
    s = chance.choose(flat)
    return np.asarray(flat.sum(axis=0) / n * np.take_along_axis(c_over_m.reshape(flat.shape), s[None], axis=0)[0])


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """Estimates by name, relative to nothing."""
    arrays = {name(chunk): part["estimate"] for chunk, part in zip(chunks(preset), results, strict=True)}
    return arrays | {
        "n": np.array(preset["n"]),
        **{named("M", mis): np.array(preset["M"][mis]) for mis in GROWING["whole film"]},
    }


def name(chunk: Any) -> str:
    """Of a chunk's array."""
    keys = ("step", "mis") if chunk["figure"] == 7 else ("apart", "mis", "M")
    return named(*(chunk[key] for key in keys))


def named(*parts: object) -> str:
    """Parts joined by dots; 1/Z without its stroke, which names of arrays may not have."""
    return ".".join(str(part) for part in parts).replace("/", " over ")


def variance(a: Arrays, key: str) -> Array:
    """Relative variance over replicas, (n,)."""
    x = a[key]
    return np.asarray(x.var(axis=-1, ddof=1) / x.mean(axis=-1) ** 2)


def check(a: Arrays) -> list[Claim]:
    """Slopes of proper weights; the window that grows."""
    claims = []
    for step in STEP:
        for mis in PROPER:
            line = criteria.slope_within(a["n"], variance(a, named(step, mis)), -1, 0.1, decades=1.8)
            claims.append(Claim("GRIS-F07", line, f"flatland, {step}, {mis}: slope over n = 1 .. 64"))
    return [*claims, *(grown(a, mis) for mis in GROWING["whole film"])]


def grown(a: Arrays, mis: str) -> Claim:
    """Whether the whole film is a worse window than the best one, by a bootstrap over replicas."""
    M = a[named("M", mis)]
    square = {int(m): squared(a[named("whole film", mis, m)]) for m in M}
    best = min(square, key=lambda m: square[m].mean())
    ratio = criteria.ratio_above(square[int(M[-1])], square[best], 1)
    part = f"flatland, {mis}: Var of a window of {M[-1]} / of {best}, the best"
    return Claim("GRIS-F08", ratio, part, reason="" if ratio.passed else REASON)


REASON = (
    "Talbot's weights compare every neighbour with all others. Far pixels here sample their own light no worse than "
    "near ones, so that more of them never hurt; the figure on the line has the same finding for equal samplers."
)


def squared(estimate: Array) -> Array:
    """Squared relative deviations, (R,)."""
    return np.asarray((estimate / estimate.mean() - 1) ** 2)


def draw(a: Arrays) -> "Picture":
    """Variance over n in two windows, and over the window's size."""
    picture, axes = style.panels(1, 3, width=3.7, height=3.1)
    for axis, step in zip(axes[0], STEP, strict=False):
        for mis in WEIGHTS:
            axis.loglog(a["n"], variance(a, named(step, mis)), label=mis)
        axis.set(xlabel="samples n per pixel", ylabel="relative variance of f(Y) W", title=f"Seven {step}")
    axes[0, 0].legend()
    for apart, weights in GROWING.items():
        for mis in weights:
            M = a[named("M", mis)]
            axes[0, 2].loglog(M, [variance(a, named(apart, mis, m)) for m in M], label=f"{mis}, {apart}")
    axes[0, 2].set(xlabel="pixels M in the window", ylabel="relative variance of f(Y) W", title="One canonical sample")
    axes[0, 2].legend()
    return picture


FIGURE = Figure(
    id="GRIS-F07flat",
    title="Samples per pixel, and pixels per window, in flatland",
    world="flatland2d",
    source="[GRIS Fig. 7, Fig. 8; 5.5]",
    claims=("GRIS-F07", "GRIS-F08"),
    presets={
        "quick": {
            "n": [1, 2, 4, 8, 16, 32, 64],
            "columns": 512,
            "M": {"talbot": [1, 9, 33, 129], "defensive": [1, 3, 5, 9, 17, 33, 65, 129]},
            "replicas": {"talbot": 300, "defensive": 6000},
        },
        "paper": {
            "n": [1, 2, 4, 8, 16, 32, 64],
            "columns": 4096,
            "M": {"talbot": [1, 3, 5, 9, 17, 33, 65, 129], "defensive": [1, 3, 5, 9, 17, 33, 65, 129]},
            "replicas": {"talbot": 4000, "defensive": 60_000},
        },
    },
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)
