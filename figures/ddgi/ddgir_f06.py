"""DDGI resampling Fig. 6: bounding the geometry term takes fireflies out of creases.

Chains of frames look into the wedge of FS4, and away from it.  Fireflies come from samples that a neighbour found and
that are very close to x_1.  Weights that count inputs (1/M), those of the paper's predecessor, pass them on, and are
judged; weights that compare targets hold most of them back already.  The bound G_max has the unit 1 / length, here
1 / room height, and is swept: the printed 1 has no unit, 1 / m is 3 in a room of 3 m, and 10 is a tenth of the height.
"""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims import criteria
from figures.claims.figure import Arrays, Claim, Conditions, Figure, Setup
from figures.experiments.creases import BALANCED, COUNTED, PRESETS, ROOMS, Sizes, moments, variance
from figures.report import style
from restir_ref.batch import Array
from restir_ref.chance import Live

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture

ROOM = "FS4"
PRINTED, METRES, OURS = 1.0, 3.0, 10.0
"""As printed, if a room's height were the unit; if that is a metre, of three; and a tenth of the height."""

FEW = 16
"""Samples of a pixel of which fireflies may be missing."""
VIEWS = ("crease", "away")
UNBOUNDED = "none"


def bound(name: str) -> float:
    """G_max by its name."""
    return np.inf if name == UNBOUNDED else float(name)


def chunks(preset: Any) -> Sequence[Any]:
    """Both weights with all bounds, which are the arms."""
    bounds = [f"{each:g}" for each in preset["bounds"]] + [UNBOUNDED]
    blocks = range(preset["blocks"])
    return [{"weights": w, "block": k, "G_max": each} for k in blocks for w in PRESETS for each in bounds]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """Moments of samples in both views."""
    size, G_max = Sizes(preset["replicas"], preset["groups"], preset["frames"]), bound(chunk["G_max"])
    views = ROOMS[preset["room"]]()
    found = {name: moments(views[name], G_max, chunk["weights"], size, Live(rng)) for name in VIEWS}
    return {f"{name}.{what}": array for name, each in found.items() for what, array in each.items()}


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """Variance and high quantile of every view and arm, (replicas,) each."""
    listed, found = chunks(preset), {"bounds": np.array(preset["bounds"])}
    found["samples"] = np.array(preset["groups"] * preset["frames"])
    for weights, G_max in dict.fromkeys((chunk["weights"], chunk["G_max"]) for chunk in listed):
        mine = [r for c, r in zip(listed, results, strict=True) if (c["weights"], c["G_max"]) == (weights, G_max)]
        for view in VIEWS:
            joined = {each: np.concatenate([r[f"{view}.{each}"] for r in mine]) for each in ("mean", "square", "high")}
            joined["near"] = mine[0][f"{view}.near"]
            name = named(view, weights, G_max)
            found |= {f"{name}.variance": variance(joined), f"{name}.high": joined["high"]}
    return found


def arm(a: Arrays, view: str, weights: str, G_max: float | str, what: str = "variance") -> Array:
    """What was found of one arm, (replicas,)."""
    name = G_max if isinstance(G_max, str) else f"{G_max:g}"
    return a[f"{named(view, weights, name)}.{what}"]


def named(view: str, weights: str, G_max: str) -> str:
    """An arm in the names of arrays."""
    return f"{view}, weights {[*PRESETS].index(weights)}, {G_max}"


def check(a: Arrays) -> list[Claim]:
    """Highest values and variance in the crease, and variance away from it, bounded over unbounded."""
    return [*of_fireflies(a, (METRES, OURS)), *of_weights(a)]


def of_fireflies(a: Arrays, bounds: Sequence[float]) -> list[Claim]:
    """With the paper's kind of weights two bounds are judged; all else is told."""
    of_paper = [each for G_max in bounds for each in judged(a, G_max)]
    beside = [told(a, BALANCED, G_max) for G_max in (PRINTED, *bounds)]
    return [*of_paper, told(a, COUNTED, PRINTED), elsewhere(a, PRINTED), *beside]


def elsewhere(a: Arrays, G_max: float) -> Claim:
    """The variance away from the crease under a bound that is not judged."""
    x, y = pair(a, "away", COUNTED, G_max)
    same = "the same bits: no connection is bounded"
    text = same if np.array_equal(x, y) else criteria.ratio_interval(x, y)[2]
    part = f"G_max = {G_max:g}, {COUNTED}: variance elsewhere, over unbounded"
    return Claim("DDGIR-F06", criteria.reported(text), part, reason=UNITLESS)


WEIGHTS = (
    "With weights that count inputs, of the paper's predecessor; those that compare targets leave less to bound, and "
    "variance falls by less than half."
)

UNITLESS = "G_max = 1 is printed without a unit; in a room of 1 m it would be this."


def pair(a: Arrays, view: str, weights: str, G_max: float, what: str = "variance") -> tuple[Array, Array]:
    """Bounded and unbounded."""
    return arm(a, view, weights, G_max, what), arm(a, view, weights, UNBOUNDED, what)


def judged(a: Arrays, G_max: float) -> list[Claim]:
    """One bound, with weights that count inputs."""
    high, spread = pair(a, "crease", COUNTED, G_max, "high"), pair(a, "crease", COUNTED, G_max)
    part = f"G_max = {G_max:g}, {COUNTED}"
    others = Claim("DDGIR-F06", unchanged(*pair(a, "away", COUNTED, G_max)), f"{part}: variance elsewhere")
    crease = f"{part}: 99.9th percentile and variance in the crease"
    if a["samples"] < FEW:
        few = f"{a['samples']} samples of a pixel may have no fireflies at all."
        return [Claim("DDGIR-F06", None, crease, reason=few), others]
    below = criteria.all_of(criteria.ratio_below(*high, 0.5), criteria.ratio_below(*spread, 0.5))
    above = criteria.all_of(criteria.ratio_above(*high, 1), criteria.ratio_above(*spread, 1))
    return [Claim("DDGIR-F06", below, crease, above, WEIGHTS, sweep(a, COUNTED)), others]


def told(a: Arrays, weights: str, G_max: float) -> Claim:
    """Ratios in the crease that are not judged."""
    high, spread = (arm_ratio(*pair(a, "crease", weights, G_max, what)) for what in ("high", "variance"))
    text = f"99.9th percentile {high:.3g}, variance {spread:.3g}"
    part = f"G_max = {G_max:g}, {weights}: in the crease, over unbounded"
    return Claim("DDGIR-F06", criteria.reported(text), part, reason=sweep(a, weights))


def arm_ratio(x: Array, y: Array) -> float:
    """Of means."""
    return float(x.mean() / y.mean())


def unchanged(x: Array, y: Array) -> criteria.Outcome:
    """x / y within 10%; or nothing was bounded at all."""
    if np.array_equal(x, y):
        return criteria.Outcome("the same bits: no connection is bounded", "ratio in [0.9, 1.1] at 95%", True)
    return criteria.ratio_within(x, y, 0.9, 1.1)


def sweep(a: Arrays, weights: str) -> str:
    """The variance in the crease over the bound."""
    listed = [*(f"{each:g}" for each in a["bounds"]), UNBOUNDED]
    told = [f"{name}: {arm(a, 'crease', weights, name).mean():.3g}" for name in listed]
    return f"Variance in the crease by G_max, {'; '.join(told)}."


def of_weights(a: Arrays) -> list[Claim]:
    """What a sum over all techniques would do, as far as balanced weights are one."""
    unbounded, split = arm(a, "crease", BALANCED, UNBOUNDED), arm(a, "crease", COUNTED, OURS)
    told = f"balanced weights, unbounded: {unbounded.mean():.3g}; 1/M, G_max = {OURS:g}: {split.mean():.3g}"
    return [Claim("DDGIR-C08", criteria.reported(told), "variance in the crease")]


def draw(a: Arrays) -> "Picture":
    """Variance and highest values over the bound."""
    return painted(a, "1 / room height")


def painted(a: Arrays, unit: str) -> "Picture":
    """Three panels; without a bound at the right end."""
    picture, axes = style.panels(1, 3, width=3.9, height=3.2)
    names = [*(f"{each:g}" for each in a["bounds"]), UNBOUNDED]
    panels: Mapping[str, tuple[str, str]] = {
        "99.9th percentile in the crease": ("crease", "high"),
        "Variance in the crease": ("crease", "variance"),
        "Variance away from it": ("away", "variance"),
    }
    looks = {BALANCED: style.nth(0, label=BALANCED), COUNTED: style.look("1/M")}
    for axis, (title, (view, what)) in zip(axes[0], panels.items(), strict=True):
        for weights in PRESETS:
            found = np.array([arm(a, view, weights, name, what).mean() for name in names])
            axis.plot(range(len(names)), found, **looks[weights])
        axis.set_yscale("log")
        axis.set_xticks(range(len(names)), names)
        label = "radiance" if what == "high" else "variance / mean²"
        axis.set(xlabel=f"G_max, {unit}", ylabel=label, title=title)
        style.below(axis)
    return picture


CONDITIONS = (
    Conditions(
        ("DDGIR-F06",),
        "[DDGIR Fig. 6]",
        Setup("real time", "still", "all", "a crease, 128 samples per pixel"),
        Setup("real time", "still", "all", "frames of chains into a crease and beside it, light by way of x_1"),
    ),
    Conditions(
        ("DDGIR-C08",),
        "[DDGIR 3.5]",
        Setup("real time", "still", "all", "said of all scenes"),
        Setup("real time", "still", "all", "wedge (FS4)"),
    ),
)

FIGURE = Figure(
    id="DDGIR-F06",
    title="The geometry term bounded, in a wedge",
    world="flatland2d",
    source="[DDGIR Fig. 6; 3.5]",
    claims=("DDGIR-F06", "DDGIR-C08"),
    conditions=CONDITIONS,
    presets={
        "quick": {
            "room": ROOM,
            "bounds": [PRINTED, METRES, OURS],
            "blocks": 1,
            "replicas": 8,
            "groups": 2,
            "frames": 8,
        },
        "paper": {
            "room": ROOM,
            "bounds": [1, 3, 10, 30, 100, 1000],
            "blocks": 2,
            "replicas": 8,
            "groups": 8,
            "frames": 16,
        },
    },
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
    arm="G_max",
)
