"""Does a better shift gain more where frames also reuse history?  Hybrid over reconnection, in real time and offline.

Real time: the last of twenty frames of a moving camera, one path tree per pixel.  Offline: independent frames of 32
trees and three spatial rounds.  Indirect light in both.  Judged are scenes in which the two shifts differ; beside
them what a shift costs, in rays.  [GRIS 9.3]
"""

from collections import Counter
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims import criteria
from figures.claims.figure import Arrays, Claim, Conditions, Figure, Setup
from figures.experiments import indirect, offline, realtime
from figures.experiments.flatland import TEN
from figures.experiments.references import INDIRECT, reference
from figures.experiments.views import RULES, view
from figures.report import style
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

JUDGED = ("glossy_cornell", "glass_disc", "clear_coat")
"""The scenes in which more than LEAST of the shifts differ."""
LEAST = 0.1
SHIFTS = ("hybrid", "reconnection")
LOOPS = ("real time", "offline")
COUNTED, ONE = "shifts that differ", "one shift"
MOST = 4
"""Rays of a shift at depth 3, at most: to y_1, y_2, y_3, and one for the end."""


def chunks(preset: Any) -> Sequence[dict[str, str]]:
    """One per scene, loop and shift; and what is counted: the rays of a shift, and shifts that differ."""
    errors = [{"scene": scene, "loop": loop, "shift": shift} for scene in JUDGED for loop in LOOPS for shift in SHIFTS]
    return [*errors, {"count": ONE}, {"count": COUNTED}]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """Images of one shift; or counts of both, each with the same random numbers."""
    if "loop" in chunk:
        return RENDERED[chunk["loop"]](chunk["scene"], chunk["shift"], preset[chunk["loop"]][chunk["scene"]], rng)
    replicas, seed = preset[chunk["count"]], int(rng.integers(2**63))
    if chunk["count"] == COUNTED:
        return {"differ": np.array([differing(scene, replicas, seed) for scene in TEN])}
    found = {shift: rays_per_shift(JUDGED[0], shift, replicas, np.random.default_rng(seed)) for shift in SHIFTS}
    return {f"{shift}.{key}": value for shift, part in found.items() for key, value in part.items()}


def in_real_time(scene: str, shift: str, replicas: int, rng: np.random.Generator) -> Arrays:
    """Last frames of a moving camera, (replicas, n)."""
    return {"images": realtime.moved(indirect.METHODS[shift], scene, replicas, rng)["images"]}


def frame_by_frame(scene: str, shift: str, replicas: int, rng: np.random.Generator) -> Arrays:
    """Independent offline frames, (replicas, n)."""
    return {"images": offline.render(offline.METHODS[shift], scene, replicas, rng)["images"]}


RENDERED = {"real time": in_real_time, "offline": frame_by_frame}


def differing(scene: str, replicas: int, seed: int) -> float:
    """The share of shifts of initial samples to a neighbour in which hybrid and reconnection shift differ."""
    found = [shifted(scene, shift, replicas, np.random.default_rng(seed)) for shift in SHIFTS]
    (alive, *hybrid), (_, *reconnection) = found
    differ = np.any([one != other for one, other in zip(hybrid, reconnection, strict=True)], axis=0)
    return float(differ[alive].mean())


def shifted(scene: str, shift: str, replicas: int, rng: np.random.Generator) -> tuple[Array, Array, Array]:
    """Whether there is a sample, J, and F where J > 0, (N,) each."""
    method, chance = indirect.METHODS[shift], Live(rng)
    of = method.integrals(view(scene, method.rule, Counter()).tracer)
    X = initial(here := Pixels(of, np.arange(replicas * of.n)), chance)
    (near,) = random_in_row(of, here.index, 1, REAL_TIME.radius, chance)
    y = of.shift(X.x, here.index, near)
    return X.W > 0, y.J, of.contribution(near.index, y.x)[0] * (y.J > 0)


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


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """relMSE by "scene.loop.shift", and counts by name."""
    *images, one, differ = results
    arrays = {**{f"{ONE}.{name}": each for name, each in one.items()}, **differ}
    for chunk, part in zip(chunks(preset), images, strict=False):
        truth = reference(chunk["scene"], INDIRECT).mean
        arrays[f"{chunk['scene']}.{chunk['loop']}.{chunk['shift']}"] = rel_mse(part["images"], truth)
    return arrays


def check(a: Arrays) -> list[Claim]:
    """The ratio in real time less the ratio offline is below 0."""
    return [*(judged(a, scene) for scene in JUDGED), Claim("GRIS-C12", criteria.reported(counted(a)), COUNTED)]


def judged(a: Arrays, scene: str) -> Claim:
    """One scene."""
    less, more = difference(a, scene)
    why = f"In real time {ratio(a, scene, 'real time')}, offline {ratio(a, scene, 'offline')}."
    part = f"{scene}: relMSE hybrid / reconnection, real time less offline"
    return Claim("GRIS-C12", less, part, counter=more, reason=why)


def counted(a: Arrays) -> str:
    """The share of shifts that differ, of every scene where any does."""
    shares = [f"{scene} {share:.0%}" for scene, share in zip(TEN, a["differ"], strict=True) if share > 0]
    return f"{', '.join(shares)}; elsewhere none. Judged are scenes above {LEAST:.0%}"


def errors(a: Arrays, scene: str, loop: str) -> tuple[Array, Array]:
    """relMSE with the hybrid and with the reconnection shift, (replicas,) each."""
    hybrid, reconnection = (a[f"{scene}.{loop}.{shift}"] for shift in SHIFTS)
    return hybrid, reconnection


def ratio(a: Arrays, scene: str, loop: str) -> str:
    """Hybrid over reconnection with its interval."""
    return criteria.ratio_interval(*errors(a, scene, loop))[2]


def difference(a: Arrays, scene: str) -> tuple[criteria.Outcome, criteria.Outcome]:
    """Ratio in real time less ratio offline below 0, and above, with its bootstrap 95% interval over both loops."""
    both = [resampled(*errors(a, scene, loop)) for loop in LOOPS]
    value = np.subtract(*(h.mean() / r.mean() for h, r in (errors(a, scene, loop) for loop in LOOPS)))
    low, high = np.quantile(both[0] - both[1], [0.025, 0.975])
    text = f"{value:+.3f} (95% {low:+.3f} to {high:+.3f})"
    less = criteria.Outcome(text, "< 0 at 95%", bool(high < 0))
    return less, criteria.Outcome(text, "> 0 at 95%", bool(low > 0))


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


LOOKS = {"real time": style.nth(2, ls="", label="real time"), "offline": style.nth(5, ls="", label="offline")}


def _ratios(axis: "Axes", a: Arrays) -> None:
    for k, loop in enumerate(LOOPS):
        pairs = [errors(a, scene, loop) for scene in JUDGED]
        found = [criteria.ratio_interval(*pair) for pair in pairs]
        low, high = (np.array([each[i] for each in found]) for i in (0, 1))
        x = np.arange(len(JUDGED)) + 0.16 * (k - 0.5)
        value = np.array([hybrid.mean() / reconnection.mean() for hybrid, reconnection in pairs])
        axis.errorbar(x, value, yerr=[value - low, high - value], markevery=1, **LOOKS[loop])
    axis.axhline(1, color=style.INK, ls=":", lw=1, marker="", label="shifts alike")
    axis.set_xticks(np.arange(len(JUDGED)), JUDGED)
    axis.set_xlim(-0.6, len(JUDGED) - 0.4)
    axis.set(xlabel="scene", ylabel="relMSE, hybrid / reconnection", title="Gain by the better shift (bars: 95%)")
    axis.set_ylim(0, 1.25 * axis.get_ylim()[1])
    axis.legend(loc="upper left", ncols=3)


def _rays(axis: "Axes", a: Arrays) -> None:
    for k, shift in enumerate(SHIFTS):
        count = a[f"{ONE}.{shift}.needed"]
        share = count / count.sum()
        mean, late = float(a[f"{ONE}.{shift}.mean"]), int(np.searchsorted(np.cumsum(share), 0.95))
        label = f"{shift}: mean {mean:.2f}, 95% at most {late}"
        axis.bar(np.arange(len(share)) + 0.4 * (k - 0.5), share, 0.38, **style.bar(shift, label=label))
    axis.set(xlabel="rays per shift, if nothing ends it early", ylabel="share of shifts", title=f"Cost in {JUDGED[0]}")
    axis.set_ylim(0, 1.3)
    axis.grid(visible=False, axis="x")
    axis.legend(loc="upper right")


def of_scenes(*counts: int) -> dict[str, int]:
    """Replicas of each judged scene."""
    return dict(zip(JUDGED, counts, strict=True))


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
            Setup("real time", "moving", "direct by ReSTIR DI", "whole frames; offline frames of indirect light"),
            Setup("real time", "moving", "indirect", "insets of FS2, FS8, FS10; offline frames of the same"),
            "Offline the paper shows indirect light only; both loops are compared by the light that the shifts share.",
        ),
    ),
    arm="shift",
    presets={
        "quick": {"real time": of_scenes(128, 24, 96), "offline": of_scenes(64, 24, 64), ONE: 64, COUNTED: 16},
        "paper": {"real time": of_scenes(512, 96, 512), "offline": of_scenes(384, 96, 384), ONE: 256, COUNTED: 64},
    },
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)
