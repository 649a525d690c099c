"""The bug zoo: which check catches which mistake, by how much it is off, and in how many scenes it shows.

Every mistake is planted in a loop of the real code on finite cells, so biases and variances are
exact.  Beside the matrix: the range of the bias over the cells of the mistake's own scene and over
random scenes.  Two continuous toys repeat what sampling can see of it.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims import criteria
from figures.claims.figure import Arrays, Claim, Figure
from figures.report import style
from restir_ref.batch import Array, ratio
from restir_ref.chance import Chance, Live
from restir_ref.integrals import Pixels, Reservoirs, Shifted
from restir_ref.mis import WEIGHTS
from restir_ref.oracle.cells import Frame, cells
from restir_ref.oracle.laws import expected_weight
from restir_ref.oracle.scenes import Edit, Neighbours, Parts, Scene, keep, next_pixel, random_scene
from restir_ref.oracle.zoo import BUGS, CHECKS, INEFFICIENT, exact_bias, examine
from restir_ref.oracle.zoo.confidence import brighter_neighbour, null_confidence_zero
from restir_ref.restir import initial, spatial, temporal
from toy1d import Chart, Line, overlapping_supports

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Picture

BOTH = {**BUGS, **INEFFICIENT}
GROUPS = 64  # replicates behind a sampled mean
MERGES = 6


def chunks(preset: Any) -> Sequence[Any]:
    """The matrix, blocks of random scenes, and the toys."""
    blocks = [{"kind": "scenes", "block": block} for block in range(preset["blocks"])]
    return [{"kind": "matrix"}, *blocks, {"kind": "neighbours"}, {"kind": "shifts"}]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """One chunk, by its kind."""
    kinds: dict[str, Callable[[], Arrays]] = {
        "matrix": matrix,
        "scenes": lambda: over_scenes(preset["scenes"], rng),
        "neighbours": lambda: neighbours(preset["replicas"], rng),
        "shifts": lambda: shifts(preset["replicas"], rng),
    }
    return kinds[chunk["kind"]]()


# ---------------------------------------------------------------- exact


def matrix() -> Arrays:
    """What every check finds of every bug (bug, check), the range of the exact bias (bug, 2), and six merges."""
    found = [examine(bug.wrong, bug.right, bug.scene()) for bug in BOTH.values()]
    bias = [on(bug.scene(), bug.wrong) for bug in BOTH.values()]
    right = [np.abs(on(bug.scene(), bug.right)).max() for bug in BOTH.values()]
    return {
        "value": np.array([[each.value for each in row.values()] for row in found]),
        "caught": np.array([[each.caught for each in row.values()] for row in found]),
        "bias": np.array(bias),
        "right": np.array(right),
        "merged": np.array([rarely_lit(keep), rarely_lit(null_confidence_zero)]),
    }


def rarely_lit(edit: Edit) -> float:
    """E[f W] after temporal merges without a cap, f = 1 on [0, .2] of [0, 1]."""
    v = np.array([[0.2, 0.8]])
    pixel = Frame(cells(v, np.array([[1.0, 0.0]]), np.ones((1, 1, 2)), np.array([[[0, 1]]])), 1)

    def loop(index: Array, chance: Chance) -> Reservoirs:
        here, before = Pixels(pixel, index), Pixels(pixel, index)
        Y = edit(initial(here, chance), here)
        for _ in range(MERGES):
            Y = edit(temporal(edit(initial(here, chance), here), here, Y, [before], chance, cap=np.inf), here)
        return Y

    return float(expected_weight(loop, v)[0, 0])


def over_scenes(count: int, rng: np.random.Generator) -> Arrays:
    """Ranges of the exact bias on random scenes (scene, bug, 2), and the largest bias of any right loop (scene,)."""
    sizes = {bug.scene.__name__: bug.scene for bug in BOTH.values()}
    draws = [{name: random_scene(scene(), rng=rng) for name, scene in sizes.items()} for _ in range(count)]
    rights = {(bug.right, bug.scene.__name__) for bug in BOTH.values()}
    return {
        "ranges": np.array([[on(drawn[bug.scene.__name__], bug.wrong) for bug in BOTH.values()] for drawn in draws]),
        "rights": np.array([max(np.abs(on(drawn[name], right)).max() for right, name in rights) for drawn in draws]),
    }


def on(scene: Scene, parts: Parts) -> tuple[float, float]:
    """The smallest and the largest bias of a loop's cells on a scene."""
    bias = exact_bias(parts(scene), scene)
    return float(bias.min()), float(bias.max())


# ---------------------------------------------------------------- sampled


def neighbours(replicas: int, rng: np.random.Generator) -> Arrays:
    """Mean estimates of seven pixels that choose a neighbour by position or by its sample, over the truth; (2, R)."""
    line = overlapping_supports()
    choices = (next_pixel, brighter_neighbour)
    return {"neighbours": np.stack([reused(line, choice, replicas, rng)[0].mean(axis=0) for choice in choices])}


def reused(line: Line, choice: Neighbours, replicas: int, rng: np.random.Generator) -> Array:
    """E[f W] for f = p_hat and f = 1 after one spatial pass, over the truth; (2, pixel, group)."""
    chance, here = Live(rng), Pixels(line, np.arange(line.n * GROUPS * replicas))
    X = initial(here, chance)
    Y = spatial(X, here, choice(line, here.index, X, chance), chance, mis=WEIGHTS["talbot"])
    estimates = np.stack([line.target(here.index, Y.x) * Y.W, Y.W]).reshape(2, GROUPS, replicas, line.n)
    return np.asarray(estimates.mean(axis=2).transpose(0, 2, 1) / truth(line)[..., None])


def truth(line: Line) -> Array:
    """int f and int 1 of every pixel, (2, n), by the midpoint rule."""
    u = (np.arange(100_000) + 0.5) / 100_000
    sizes = line.high - line.low
    x = line.low + sizes * u[:, None]
    f = line.f(np.broadcast_to(np.arange(line.n), x.shape), x)
    return np.stack([f.mean(axis=0) * sizes, sizes])


@dataclass(frozen=True, eq=False)
class Rescaled(Line):
    """A line whose shift reports another Jacobian."""

    rescale: Callable[[Array], Array] = np.asarray

    def shift(self, x: Array, index: Array, to: Pixels) -> Shifted:
        """T_ij with a function of J for J."""
        y = super().shift(x, index, to)
        return Shifted(y.x, self.rescale(y.J))


JACOBIANS: dict[str, Callable[[Array], Array]] = {
    "right": np.asarray,
    "left out": lambda J: np.where(J > 0, 1.0, 0.0),
    "inverted": lambda J: ratio(np.ones(J.shape), J),
}
CHARTS = {
    "affine": Chart(
        to=lambda pixel, x: np.where(pixel == 0, x, 0.25 + 0.6 * x),
        back=lambda pixel, z: np.where(pixel == 0, z, (z - 0.25) / 0.6),
        slope=lambda pixel, x: np.where(pixel == 0, 1.0, 0.6),
    ),
    "quadratic": Chart(
        to=lambda pixel, x: np.where(pixel == 0, x, x**2),
        back=lambda pixel, z: np.where(pixel == 0, z, np.sqrt(np.maximum(z, 0))),
        slope=lambda pixel, x: np.where(pixel == 0, 1.0, 2 * x),
    ),
}


def shifts(replicas: int, rng: np.random.Generator) -> Arrays:
    """Estimates of two pixels over affine and quadratic partial shifts; (chart, Jacobian, 2, pixel, R)."""
    low, high = np.array([0.0, 0.2]), np.array([0.9, 1.0])
    found = [
        [
            reused(Rescaled(slanted, low, high, chart, rescale=rescale), next_pixel, replicas, rng)
            for rescale in JACOBIANS.values()
        ]
        for chart in CHARTS.values()
    ]
    return {"shifts": np.array(found)}


def slanted(pixel: Array, x: Array) -> Array:
    """f_1 = 1/2 + x and f_2 = 3/2 - x."""
    return np.where(pixel == 0, 0.5 + x, 1.5 - x)


# ---------------------------------------------------------------- judging


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """Everything, the random scenes joined."""
    first, *blocks, chosen, shifted = results
    joined = {name: np.concatenate([block[name] for block in blocks]) for name in ("ranges", "rights")}
    return {**first, **joined, **chosen, **shifted}


def check(a: Arrays) -> list[Claim]:
    """What sampled and exact controls say of three claims."""
    names = list(BOTH)
    bias = dict(zip(names, np.abs(a["bias"]).max(axis=-1), strict=True))
    right = dict(zip(names, a["right"], strict=True))
    by_position, by_sample = a["neighbours"]
    by_value, jacobians = "neighbour chosen by sample value", ("Jacobian left out", "inverted Jacobian")
    return [
        Claim("GRIS-C19", criteria.unbiased(by_position, 1, eps=0.005), "7 pixels, neighbour by position"),
        Claim("GRIS-C19", criteria.biased(by_sample, 1, 0.01, 1), "7 pixels, control: neighbour by larger target"),
        Claim("GRIS-C19", criteria.below(right[by_value], 1e-12), "exact, by position: worst cell"),
        Claim("GRIS-C19", criteria.above(bias[by_value], 0.01), "exact, control: worst cell"),
        Claim("GRIS-A18", criteria.equal_to(a["merged"][0], 0.2), "exact mean after six merges"),
        Claim("GRIS-A18", criteria.above(a["merged"][1] / 0.2 - 1, 0.01), "control, nulls not counted: exact bias"),
        *jacobian_claims(a["shifts"]),
        Claim("GRIS-E07", criteria.below(a["rights"].max(), 1e-12), "exact, right loops on random scenes: worst cell"),
        Claim(
            "GRIS-E07", criteria.above(min(bias[name] for name in jacobians), 0.01), "exact, both controls: worst cell"
        ),
    ]


def jacobian_claims(estimates: Array) -> Iterator[Claim]:
    """One pass over affine and quadratic shifts: right for f = p_hat and f = 1 in both pixels, wrong with a wrong J."""
    for chart, (right, *wrong) in zip(CHARTS, estimates, strict=True):
        for f, values in zip(("p_hat", "1"), right, strict=True):
            each = [criteria.unbiased(pixel, 1, eps=0.003) for pixel in values]
            yield Claim("GRIS-E07", criteria.all_of(*each), f"{chart} shift, f = {f}, both pixels")
        for name, (of_target, _) in zip(list(JACOBIANS)[1:], wrong, strict=True):
            far = criteria.above(abs(of_target[0].mean() - 1), 0.01)
            outcome = criteria.all_of(criteria.biased(of_target[0], 1, -1, 9), far)
            yield Claim("GRIS-E07", outcome, f"{chart} shift, control: J {name}, pixel 1")


# ---------------------------------------------------------------- drawing

LEFT, RIGHT = -1.1, 2.1  # ends of the axis of biases


def draw(a: Arrays) -> "Picture":
    """The matrix, and beside it the ranges of biases with the number of random scenes in which they show."""
    picture, ((table, ranges),) = style.panels(1, 2, width=6.2, height=14)
    table.get_gridspec().set_width_ratios((2, 1))
    ranges.sharey(table)
    draw_matrix(table, a["value"], a["caught"])
    for axes in (table, ranges):
        axes.axhline(len(BUGS) - 0.5, color=style.INK, lw=1, ls="-", marker="", label="above: bias; below: none")
        axes.tick_params(length=0)
    draw_ranges(ranges, a["bias"], a["ranges"])
    table.set_ylim(len(BOTH) - 0.5, -0.5)
    return picture


def draw_matrix(axes: "Axes", value: Array, caught: Array) -> None:
    """Numbers in % where a check speaks, on ground that is darker than grey for too little, brighter for too much."""
    shown = np.where(caught, np.clip(value, -1, 1), np.nan)
    image = axes.imshow(shown, cmap=style.IMAGE_MAP, vmin=-1, vmax=1, aspect="auto")
    scale: dict[str, Any] = {"location": "bottom", "shrink": 0.5, "aspect": 50, "pad": 0.01, "extend": "both"}
    axes.figure.colorbar(image, ax=axes, label="what a check finds, 1 = 100 %", **scale)
    for (row, column), number in np.ndenumerate(value):
        silent = not caught[row, column]
        colour = style.GREY if silent else "k" if number > 0.1 else "w"
        text = "·" if silent else percent(number)
        axes.text(column, row, text, ha="center", va="center", color=colour, fontsize=8.5)
    axes.set_yticks(range(len(BOTH)), list(BOTH), fontsize=8.5)
    axes.set_xticks(range(len(CHECKS)), [name.replace("p_hat", r"$\hat p$") for name in CHECKS], rotation=35, ha="left")
    axes.tick_params(axis="x", top=True, labeltop=True, bottom=False, labelbottom=False)
    axes.set_xlabel(
        "check;  number: what it finds, in %, where 0 is right;  dark: too little, bright: too much;  ·: silent"
    )
    axes.set_ylabel("mistake; below the line: no bias, only inefficient")
    axes.grid(visible=False)


def percent(value: float) -> str:
    """A signed percentage with two digits or so."""
    return f"{100 * value:+.0f}" if abs(value) >= 0.0995 else f"{100 * value:+.1f}"


def draw_ranges(axes: "Axes", bias: Array, ranges: Array) -> None:
    """Bars: cells of the mistake's own scene; lines: cells of all random scenes, with a triangle where they go on."""
    row = np.arange(len(BOTH))
    low, high = np.minimum(ranges[..., 0].min(axis=0), 0), np.maximum(ranges[..., 1].max(axis=0), 0)
    axes.barh(row, bias[:, 1] - bias[:, 0], left=bias[:, 0], color=style.BLUE, height=0.6, label="its own scene")
    axes.hlines(row, np.maximum(low, LEFT), np.minimum(high, RIGHT), color=style.INK, lw=1, label="random scenes")
    beyond = high > RIGHT
    axes.plot(np.full(beyond.sum(), RIGHT), row[beyond], ls="", marker=">", color="k", markevery=1, clip_on=False)
    shows = (np.abs(ranges).max(axis=-1) > 1e-9).sum(axis=0)
    for y, count in zip(row, shows, strict=True):
        axes.text(RIGHT + 0.12, float(y), f"{count} / {len(ranges)}", va="center", fontsize=8.5)
    axes.axvline(0, color=style.INK, lw=0.8, ls=":", marker="", label="no bias")
    axes.set(xlim=(LEFT, RIGHT), xlabel="relative bias of cells (1 = 100 %)")
    axes.set_title("Range of the exact bias\nright: random scenes in which it shows")
    style.below(axes, ncols=1)
    axes.grid(visible=False, axis="y")
    axes.tick_params(axis="y", labelleft=False)


FIGURE = Figure(
    id="GRIS-ZOO",
    title="The bug zoo: who catches what",
    world="toy1d",
    source="[GRIS 4-6, App. A]",
    claims=("GRIS-C19", "GRIS-A18", "GRIS-E07"),
    presets={
        "quick": {"blocks": 3, "scenes": 3, "replicas": 2000},
        "paper": {"blocks": 20, "scenes": 20, "replicas": 5000},
    },
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)
