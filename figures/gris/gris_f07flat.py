"""GRIS Fig. 7 and 8 in flatland: n samples of each pixel of a window, and one sample of ever more pixels.

Indirect light by the reconnection shift, as in [GRIS 9.1].  Fig. 7: one pass with 7 n inputs, n of each pixel of a
window of seven.  Beside it the algebra: inputs enter by their densities alone, so that 7 n of them weigh like n groups
of seven, each as if alone, divided by n.  Fig. 8: one sample of each pixel of a window that grows around one canonical
pixel.

That pixel lies at the foot of a box: a third of its light comes from right beside it, where other pixels are a hundred
times worse samplers.  The second one lies in the dark room beside a slit.
"""

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims import criteria
from figures.claims.figure import Arrays, Claim, Conditions, Figure, Setup
from figures.experiments.split_light import IndirectIntegrals
from figures.report import style
from flatland2d import SCENES
from restir_ref.batch import Array, ratio
from restir_ref.chance import Chance, Live
from restir_ref.integrals import Pixels
from restir_ref.loop import OFFLINE
from restir_ref.mis import WEIGHTS
from restir_ref.resampling import Candidate, Input, select, weigh
from restir_ref.restir import initial, shade
from restir_ref.transport.paths import RECONNECTION, Tracer

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Picture

WINDOW = 7
MIDDLE, FOOT = 960, 1024
"""Film pixels of the Cornell box: the middle of the film, and the floor .0014 before the left box."""

SEVEN: Mapping[str, tuple[int, int]] = {"adjacent pixels": (MIDDLE, 1), "across the foot of a box": (FOOT, 10)}
"""Windows of Fig. 7: canonical pixel and step between neighbours."""

GROWING: Mapping[str, tuple[str, int, int]] = {
    "foot of a box, inset": ("cornell", FOOT, 64),
    "beside a slit, film": ("ajar", MIDDLE, 896),
    "foot of a box, film": ("cornell", FOOT, 832),
}
"""Windows of Fig. 8: scene, canonical pixel, and how far the largest window reaches, in pixels of a film of 1920."""

PROPER = ("talbot", "pairwise", "defensive")
SPATIAL = OFFLINE.across
"""The weights of the paper's spatial reuse, defensive ones.  [GRIS 8.3]"""

WIDENED = [
    (view, mis) for view in GROWING for mis in ("talbot", SPATIAL) if (view, mis) != ("foot of a box, film", "talbot")
]
"""Views and weights of Fig. 8."""

JUDGED = [("beside a slit, film", SPATIAL)]
"""The dark room beside a slit, which the ledger's row names; the foot of a box is reported beside it."""


# ---------------------------------------------------------------- passes


def around(scene: str, middle: int, M: int, step: int, columns: int) -> list[Pixels]:
    """A film pixel, then those to its left and right, nearest first, in `columns` replicas."""
    setting, reach = SCENES[scene](), (M // 2) * step
    sensor = setting.pinhole(2 * reach + 1, middle - reach)
    of = IndirectIntegrals(Tracer(setting.scene, sensor, setting.depth, RECONNECTION))
    offsets = [0, *(sign * k * step for k in range(1, M // 2 + 1) for sign in (-1, 1))]
    return [Pixels(of, np.full(columns, reach + offset)) for offset in offsets]


def one_pass(inputs: Sequence[Input], here: Pixels, mis: str, chance: Chance) -> tuple[Array, Array]:
    """f(Y) W_Y and sum w of one pass, (columns,) each."""
    candidates = list(weigh(inputs, here, WEIGHTS[mis]))
    Y = select(candidates, chance, np.ones(len(here.index)))
    return np.asarray(shade(Y, here).mean(axis=0)), sum_of_weights(candidates)


def sum_of_weights(candidates: Sequence[Candidate]) -> Array:
    """sum p_hat m W J, (columns,)."""
    return np.asarray(sum(y.p_hat * y.mW for y in candidates))


def realised(window: Sequence[Pixels], chance: Chance) -> tuple[float, float]:
    """Share of the window that realises the canonical pixel's light, and share of light sampled 100 times better there.

    The latter is where the mean of the others' p_hat_from is below 1% of its own.
    """
    here, M = window[0], len(window)
    X = initial(here, chance)
    inputs = [Input(X, at) for at in window]
    y, of_z = (next(weigh(inputs, here, WEIGHTS[name])) for name in ("talbot", "1/Z"))
    light = y.p_hat * X.W
    others = (ratio(X.W, y.mW) - 1) / (M - 1)
    Z = ratio(np.full(len(light), M), of_z.c_over_m)  # type: ignore[arg-type]
    return float(light @ Z / (M * light.sum())), float(light @ (others < 0.01) / light.sum())


# ---------------------------------------------------------------- chunks


def chunks(preset: Any) -> Sequence[dict[str, Any]]:
    """A window and a weight; a window that grows and a weight; what is in the windows."""
    seven = [{"figure": 7, "view": view, "mis": mis} for view in SEVEN for mis in WEIGHTS]
    grown = [{"figure": 8, "view": view, "mis": mis} for view, mis in WIDENED]
    return [*seven, *grown, *({"counted": view} for view in (*SEVEN, *GROWING))]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """f(Y) W_Y of the canonical pixel by n or M, (replicas,) each; or what the window realises."""
    chance = Live(rng)
    if "counted" in chunk:
        return {"realised": np.array(realised(window_of(chunk["counted"], max(preset["M"]), COUNTED), chance))}
    if chunk["figure"] == 7:
        return seven(preset, chunk["view"], chunk["mis"], chance)
    return growing(preset["M"], preset["replicas"][chunk["mis"]], chunk["view"], chunk["mis"], chance)


def window_of(view: str, M: int, columns: int) -> list[Pixels]:
    """The seven pixels of a view of Fig. 7, or the M pixels of the largest window of Fig. 8."""
    if view in SEVEN:
        middle, step = SEVEN[view]
        return around("cornell", middle, WINDOW, step, columns)
    scene, middle, reach = GROWING[view]
    return around(scene, middle, M, reach // (M // 2), columns)


def seven(preset: Any, view: str, mis: str, chance: Chance) -> Arrays:
    """Passes with 7 n inputs, and how far sum w of n = 4 is from the mean over four groups of seven."""
    found: Arrays = {}
    for n in preset["n"]:
        window = window_of(view, WINDOW, max(preset["columns"], preset["inputs"] // n))
        inputs = [Input(initial(at, chance), at) for _ in range(n) for at in window]
        found[f"{n}"], w = one_pass(inputs, window[0], mis, chance)
        if n == GROUPS:
            found["algebra"] = np.array(abs(grouped(inputs, window, mis) / w - 1)[w > 0].max())
    return found


GROUPS = 4
COUNTED = 4000


def grouped(inputs: Sequence[Input], window: Sequence[Pixels], mis: str) -> Array:
    """The mean of sum w over groups of seven inputs, each weighted as if alone, (columns,)."""
    groups = [inputs[k : k + WINDOW] for k in range(0, len(inputs), WINDOW)]
    return np.asarray(np.mean([sum_of_weights(list(weigh(g, window[0], WEIGHTS[mis]))) for g in groups], axis=0))


def growing(sizes: Sequence[int], R: int, view: str, mis: str, chance: Chance) -> Arrays:
    """Passes over the first M pixels of the largest window, all with the same samples."""
    window = window_of(view, max(sizes), R)
    inputs = [Input(initial(at, chance), at) for at in window]
    return {f"{M}": one_pass(inputs[:M], window[0], mis, chance)[0] for M in sizes}


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """All by "view.mis.name" and "view.realised"."""
    arrays: Arrays = {"n": np.array(preset["n"]), "M": np.array(preset["M"])}
    for chunk, part in zip(chunks(preset), results, strict=True):
        of = (chunk["counted"],) if "counted" in chunk else (chunk["view"], chunk["mis"])
        arrays |= {named(*of, name): array for name, array in part.items()}
    return arrays


def named(*parts: object) -> str:
    """Parts joined by dots; 1/Z without its stroke, which names of arrays may not have."""
    return ".".join(str(part) for part in parts).replace("/", " over ")


# ---------------------------------------------------------------- verdicts


def check(a: Arrays) -> list[Claim]:
    """Slopes of proper weights and what is said beside them; the window that grows."""
    return [
        *(claim for view in SEVEN for claim in of_seven(a, view)),
        *(grown(a, *each) for each in WIDENED),
    ]


def of_seven(a: Arrays, view: str) -> Iterator[Claim]:
    """Slopes of Fig. 7; for constant weights, and the order, numbers only."""
    n, name = a["n"], f"flatland, {view}"
    decades = min(2.0, float(np.log10(n[-1] / n[0])))
    short = "" if decades == 2 else f"n = 1 .. {n[-1]} spans {decades:.1f} decades only."
    constant = criteria.slope(n, variances(a, view, "constant"))
    caveat = (
        f"Constant weights converge here as well, slope {constant:.2f}, which Fig. 7 and the line (T7) do not show."
    )
    for mis in PROPER:
        line = criteria.slope_within(n, variances(a, view, mis), -1, 0.1, decades=decades)
        yield Claim("GRIS-F07", line, f"{name}, {mis}: slope over n, real passes", reason=short, caveat=caveat)
    for mis in (each for each in WEIGHTS if each not in PROPER):
        spread = variances(a, view, mis)
        text = f"slope {criteria.slope(n, spread):.3f}, Var(n = {n[-1]}) / Var(1) {spread[-1] / spread[0]:.3g}"
        yield Claim("GRIS-F07", criteria.reported(text), f"{name}, {mis}: slope over n, real passes", reason=CONSTANT)
    talbot, uniform = (squared(a[named(view, mis, 1)]) for mis in PROPER[:2])
    order = criteria.reported(criteria.ratio_interval(talbot, uniform)[2])
    yield Claim("GRIS-F07", order, f"{name}: Var of Talbot / pairwise, n = 1")
    algebra = max(float(a[named(view, mis, "algebra")]) for mis in WEIGHTS)
    text = f"relative difference of sum w at n = {GROUPS}, all weights: {algebra:.1e} at most"
    yield Claim("GRIS-F07", criteria.reported(text), f"{name}: real passes against groups of seven", reason=ALGEBRA)
    yield Claim("GRIS-F07", criteria.reported(in_words(a, view)), f"{name}: the window")


CONSTANT = "The clause on constant weights is judged on the line, where supports are unequal; here as found."
ALGEBRA = "By algebra the slope of Var[sum w] is -1 for any weight; of constant ones f(Y) W_Y is not sum w."


def grown(a: Arrays, view: str, mis: str) -> Claim:
    """Whether the largest window is worse than the best of the smaller ones, by a bootstrap over replicas."""
    M = [int(m) for m in a["M"]]
    square = {m: squared(a[named(view, mis, m)]) for m in M}
    best = min(M[:-1], key=lambda m: square[m].mean())
    pair = square[M[-1]], square[best]
    part = f"flatland, {view}, {mis}: Var of the largest window / of the best smaller one"
    why = f"Windows up to {M[-1]}; best of the smaller ones: {best}. {in_words(a, view)}."
    if (view, mis) in JUDGED:
        worse, better = criteria.ratio_above(*pair, 1), criteria.ratio_below(*pair, 1)
        talbot = criteria.ratio_interval(*(squared(a[named(view, "talbot", m)]) for m in (M[-1], best)))[2]
        caveat = f"With defensive weights, the paper's of spatial reuse; with Talbot's the same windows give {talbot}."
        return Claim("GRIS-F08", worse, part, counter=better, reason=why, caveat=caveat)
    beside = TALBOT if mis == "talbot" else FAR if view.endswith("film") else ""
    return Claim("GRIS-F08", criteria.reported(criteria.ratio_interval(*pair)[2]), part, reason=f"{why} {beside}")


TALBOT = (
    "Below 1 the opposite of the figure holds. The paper's spatial reuse has defensive weights, which are judged. "
    "Talbot's hurt where samplers are worse than their targets claim, as on the line; a path's luminance behind x_2 "
    "has the same spread from wherever x_2 was found: far pixels here are worse matches, but no worse than they claim."
)
FAR = (
    "Below 1 the opposite of the figure holds: the film ends before the rise. Pixels this far apart claim so little "
    "of the light right beside the pixel that they do not spoil it."
)


def in_words(a: Arrays, view: str) -> str:
    """How much of the canonical pixel's light others sample, and how well."""
    share, poor = a[named(view, "realised")]
    return (
        f"On average {share:.1%} of the window's pixels realise the light of the canonical one; {poor:.1%} of it the "
        "others sample over 100 times more rarely"
    )


def variances(a: Arrays, view: str, mis: str) -> Array:
    """Relative variance of f(Y) W_Y by n, (n,)."""
    return np.array([squared(a[named(view, mis, n)]).mean() for n in a["n"]])


def squared(estimate: Array) -> Array:
    """Squared relative deviations, (R,)."""
    return np.asarray((estimate / estimate.mean() - 1) ** 2)


# ---------------------------------------------------------------- the picture


def draw(a: Arrays) -> "Picture":
    """Variance over n in two windows, and over the window's size."""
    picture, axes = style.panels(1, 3, width=3.9, height=3.7)
    for axis, view in zip(axes[0], SEVEN, strict=False):
        for mis in WEIGHTS:
            axis.loglog(a["n"], variances(a, view, mis), **style.look(mis), markevery=1)
        axis.set(xlabel="samples $n$ per pixel", ylabel="relative variance of $f(Y) W_Y$")
        axis.set_title(f"Fig. 7: seven {view}" if "pixels" in view else f"Fig. 7: seven pixels {view}")
    for axis in axes[0, :2]:
        style.below(axis, ncols=3)
    _growing(axes[0, 2], a)
    return picture


def _growing(axis: "Axes", a: Arrays) -> None:
    for view, mis in WIDENED:
        spread = [squared(a[named(view, mis, m)]).mean() for m in a["M"]]
        look = style.look(mis, marker=MARKS[view], label=f"{mis}, {view}")
        axis.loglog(a["M"], spread / spread[0], **look, markevery=1)
    axis.set(xlabel="pixels $M$ in the window", ylabel="relative variance of $f(Y) W_Y$ / of $M = 1$")
    axis.set_title("Fig. 8: one canonical sample")
    style.below(axis, ncols=1)


MARKS = dict(zip(GROWING, style.MARKERS, strict=False))
"""Views differ in their markers; colours and dashes are the weights'."""


FIGURE = Figure(
    id="GRIS-F07flat",
    title="Samples per pixel, and pixels per window, in flatland",
    world="flatland2d",
    source="[GRIS Fig. 7, Fig. 8; 5.5, 9.1]",
    claims=("GRIS-F07", "GRIS-F08"),
    conditions=(
        Conditions(
            ("GRIS-F07",),
            "Fig. 7; 9.1",
            Setup("one pass", "still", "indirect", "a window of 7 x 7 pixels in the rough Cornell box, reconnection"),
            Setup("one pass", "still", "indirect", "windows of 7 pixels of a row, |R| / M = 1/7, same box and shift"),
        ),
        Conditions(
            ("GRIS-F08",),
            "Fig. 8; 9.1",
            Setup("one pass", "still", "indirect", "growing windows in the rough Cornell box, reconnection"),
            Setup("one pass", "still", "indirect", "the same at the foot of a box; beside a slit between two rooms"),
        ),
    ),
    arm="mis",
    presets={
        "quick": {
            "n": [1, 2, 3, 4, 6, 10],
            "columns": 512,
            "inputs": 4096,
            "M": [1, 3, 5, 9, 17, 33, 65],
            "replicas": {"talbot": 400, "defensive": 4000},
        },
        "paper": {
            "n": [1, 2, 4, 8, 16, 32, 64, 128],
            "columns": 192,
            "inputs": 16_384,
            "M": [1, 3, 5, 9, 17, 33, 65, 129],
            "replicas": {"talbot": 1500, "defensive": 15_000},
        },
    },
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)
