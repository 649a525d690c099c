"""Does a better shift gain more where frames also reuse history?  Hybrid over reconnection, in real time and offline.

Real time: late frames of a still camera's chain, one path tree per pixel.  Offline: independent frames of 32 trees and
three spatial rounds.  Beside it what a shift costs, in rays.  [GRIS 9.3]
"""

from collections import Counter
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from figures import criteria, offline, realtime, style
from figures.figure import Arrays, Claim, Conditions, Figure, Setup
from figures.flatland import RULES, view
from figures.references import reference
from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.integrals import Pixels
from restir_ref.loop import REAL_TIME, random_in_row
from restir_ref.metrics import rel_mse
from restir_ref.restir import initial
from restir_ref.transport.counting import rays

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Picture

SCENES = ("glossy_cornell", "ajar", "clear_coat")
JUDGED = SCENES[:2]
SHIFTS = ("hybrid", "reconnection")
LOOPS = ("real time", "offline")
MOST = 4
"""Rays of a shift at depth 3, at most: to y_1, y_2, y_3, and one for the end."""


def chunks(preset: Any) -> Sequence[dict[str, str]]:
    """One per scene and loop; and the rays of a shift."""
    errors = [{"scene": scene, "loop": loop} for scene in SCENES for loop in LOOPS]
    return [*errors, {"scene": SCENES[0], "loop": "one shift"}]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """What `MEASURED` says of both shifts, each with the same random numbers; by "shift.name"."""
    scene, loop, seed = chunk["scene"], chunk["loop"], int(rng.integers(2**63))
    found = {shift: MEASURED[loop](scene, shift, preset[loop], np.random.default_rng(seed)) for shift in SHIFTS}
    return {f"{shift}.{key}": value for shift, part in found.items() for key, value in part.items()}


def in_real_time(scene: str, shift: str, replicas: int, rng: np.random.Generator) -> Arrays:
    """relMSE of frames, mean over the last half of a chain, (replicas,)."""
    images = realtime.still(realtime.METHODS[shift], scene, replicas, rng)["images"][1:]
    return {"error": rel_mse(images, reference(scene).mean).mean(axis=0)}


def frame_by_frame(scene: str, shift: str, replicas: int, rng: np.random.Generator) -> Arrays:
    """relMSE of independent offline frames, (replicas,)."""
    images = offline.render(offline.METHODS[shift], scene, replicas, rng)["images"]
    return {"error": rel_mse(images, reference(scene).mean)}


def rays_per_shift(scene: str, shift: str, replicas: int, rng: np.random.Generator) -> Arrays:
    """Mean rays of a shift of an initial sample to a neighbour, counted, and how many shifts ask for 0 .. MOST.

    The latter are of shifts that nothing ends early: to y_1, to each vertex that is replayed, and one for the end.
    """
    asked, chance = Counter[str](), Live(rng)
    of = view(scene, RULES[shift], asked)
    X = initial(here := Pixels(of, np.arange(replicas * of.n)), chance)
    (near,) = random_in_row(of, here.index, 1, REAL_TIME.radius, chance)
    before = rays(asked)
    of.shift(X.x, here.index, near)
    free = np.where(X.x.c > 0, X.x.c - 1, X.x.k)
    needed = np.maximum(free, 1) + ((X.x.c > 0) | (X.x.k > 0))
    return {"mean": np.array((rays(asked) - before) / len(needed)), "needed": np.bincount(needed, minlength=MOST + 1)}


MEASURED = {"real time": in_real_time, "offline": frame_by_frame, "one shift": rays_per_shift}


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """By "scene.loop.shift.name"."""
    named = zip(chunks(preset), results, strict=True)
    return {f"{chunk['scene']}.{chunk['loop']}.{k}": v for chunk, part in named for k, v in part.items()}


def check(a: Arrays) -> list[Claim]:
    """The ratio in real time less the ratio offline is below 0."""
    return [
        Claim(
            "GRIS-C12",
            difference(a, scene),
            f"{scene}: relMSE hybrid / reconnection, real time less offline",
            reason=f"In real time {ratio(a, scene, 'real time')}, offline {ratio(a, scene, 'offline')}. " + WHY[scene],
        )
        for scene in JUDGED
    ]


WHY = {
    "glossy_cornell": "Without history the gain is as large: 18 neighbours are shifted per frame there.  Under the "
    "sharp coat, drawn beside, it is larger in real time.",
    "ajar": "Everything is Lambert there and nothing near, so both shifts are the same.",
}


def errors(a: Arrays, scene: str, loop: str) -> tuple[Array, Array]:
    """relMSE with the hybrid and with the reconnection shift, (replicas,) each."""
    hybrid, reconnection = (a[f"{scene}.{loop}.{shift}.error"] for shift in SHIFTS)
    return hybrid, reconnection


def ratio(a: Arrays, scene: str, loop: str) -> str:
    """Hybrid over reconnection with its interval."""
    return criteria.ratio_interval(*errors(a, scene, loop))[2]


def difference(a: Arrays, scene: str) -> criteria.Outcome:
    """Ratio in real time less ratio offline, with its bootstrap 95% interval; both loops are resampled."""
    both = [resampled(*errors(a, scene, loop)) for loop in LOOPS]
    value = np.subtract(*(h.mean() / r.mean() for h, r in (errors(a, scene, loop) for loop in LOOPS)))
    low, high = np.quantile(both[0] - both[1], [0.025, 0.975])
    return criteria.Outcome(f"{value:+.3f} (95% {low:+.3f} to {high:+.3f})", "< 0 at 95%", bool(high < 0))


def resampled(hybrid: Array, reconnection: Array) -> Array:
    """Ratios of means over resampled replicas, (BOOTSTRAP,)."""
    R = len(hybrid)
    chosen = np.random.default_rng([criteria.STREAM, R]).integers(R, size=(criteria.BOOTSTRAP, R))
    return np.asarray(hybrid[chosen].mean(axis=1) / reconnection[chosen].mean(axis=1))


def draw(a: Arrays) -> "Picture":
    """Ratios in both loops, and rays per shift."""
    picture, axes = style.panels(1, 2, width=4.4, height=3.2)
    _ratios(axes[0, 0], a)
    _rays(axes[0, 1], a)
    return picture


def _ratios(axis: "Axes", a: Arrays) -> None:
    looks: dict[str, dict[str, Any]] = {
        "real time": {"color": "#0072B2", "marker": "o"},
        "offline": {"color": "#E69F00", "marker": "s"},
    }
    for k, loop in enumerate(LOOPS):
        found = [criteria.ratio_interval(*errors(a, scene, loop)) for scene in SCENES]
        low, high = (np.array([each[i] for each in found]) for i in (0, 1))
        x = np.arange(len(SCENES)) + 0.16 * (k - 0.5)
        value = np.array([h.mean() / r.mean() for h, r in (errors(a, scene, loop) for scene in SCENES)])
        axis.errorbar(x, value, yerr=[value - low, high - value], ls="", markevery=1, label=loop, **looks[loop])
    axis.axhline(1, color="#888888", lw=0.8, marker="")
    axis.set_xticks(np.arange(len(SCENES)), SCENES)
    axis.set_xlim(-0.6, len(SCENES) - 0.4)
    axis.set(ylabel="relMSE, hybrid / reconnection", title="Gain by the better shift (bars: 95%)", ylim=(0, None))
    axis.legend(loc="upper left")


def _rays(axis: "Axes", a: Arrays) -> None:
    looks: dict[str, dict[str, Any]] = {
        "hybrid": {"color": "#0072B2"},
        "reconnection": {"color": "#ffffff", "edgecolor": "#D55E00", "hatch": "//"},
    }
    for k, shift in enumerate(SHIFTS):
        count = a[f"{SCENES[0]}.one shift.{shift}.needed"]
        share = count / count.sum()
        mean, late = float(a[f"{SCENES[0]}.one shift.{shift}.mean"]), int(np.searchsorted(np.cumsum(share), 0.95))
        label = f"{shift}: mean {mean:.2f}, 95% at most {late}"
        axis.bar(np.arange(len(share)) + 0.4 * (k - 0.5), share, 0.38, label=label, **looks[shift])
    axis.set(xlabel="rays per shift, if nothing ends it early", ylabel="share of shifts", title=f"Cost in {SCENES[0]}")
    axis.set_ylim(0, 1.3)
    axis.grid(visible=False, axis="x")
    axis.legend(loc="upper right")


FIGURE = Figure(
    id="GRIS-C12",
    title="What a better shift gains in real time and offline",
    world="flatland2d",
    source="[GRIS 9.3]",
    claims=("GRIS-C12",),
    conditions=(
        Conditions(
            ("GRIS-C12",),
            "[GRIS 9.3]",
            Setup("real time", "moving", "indirect", "a"),
            Setup("real time", "still", "all", "b"),
            "being moved",
        ),
    ),
    presets={
        "quick": {"real time": 64, "offline": 64, "one shift": 64},
        "paper": {"real time": 256, "offline": 512, "one shift": 256},
    },
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)
