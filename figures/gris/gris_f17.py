"""GRIS Fig. 16, 17 and 18: offline renderers in ten scenes, at equal rays, to equal error, and at equal samples.

All images are of independent frames and of indirect light.  Errors of means between the measured numbers of frames
are interpolated in logarithms, and continued behind them like T^(-1/2).

Where all is rough and nothing near, hybrid and reconnection are the same map: there one of them is rendered, and
nothing is compared.  How many shifts differ is counted in every scene.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims import criteria
from figures.claims.figure import Arrays, Claim, Conditions, Figure, Setup
from figures.experiments import offline
from figures.experiments.flatland import TEN
from figures.experiments.rendering import means
from figures.experiments.views import view
from figures.report import style
from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.integrals import Pixels, Shifted
from restir_ref.loop import OFFLINE, spread_in_row
from restir_ref.metrics import mape, rel_mse
from restir_ref.restir import initial
from restir_ref.transport.baselines.restir_di import indirect_light
from restir_ref.transport.paths import RECONNECTION, trace

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Picture

SIX = ("cornell", "glossy_cornell", "ajar", "glass_disc", "distant_caustic", "clear_coat")
"""Scenes of the comparison to equal error; the others are about gradients and geometry."""

METHODS = ("path tracing", "path reuse", "reconnection", "hybrid")
SHIFTS = METHODS[2:]
ONE_MAP = ("ajar", "crease", "occluders", "checker", "rack")
"""Scenes in whose insets both shifts are the same map."""

TARGET = 1024
"""Path trees whose error is to be reached.  [GRIS Fig. 17]"""


# ---------------------------------------------------------------- chunks


def chunks(preset: Any) -> Sequence[dict[str, str]]:
    """Every scene and method where they are compared, in every scene how many shifts differ, and what the coat does."""
    made = [chunk for chunk in offline.chunks(TEN, METHODS) if wanted(chunk)]
    return [*made, *({"scene": scene, "what": "shifts"} for scene in TEN), {"scene": "clear_coat", "what": "coat"}]


def wanted(chunk: Mapping[str, str]) -> bool:
    """Six scenes are compared to equal error; elsewhere, two shifts that differ."""
    scene, method = chunk["scene"], chunk["method"]
    if method == "reconnection":
        return scene not in ONE_MAP
    return scene in SIX or (method == "hybrid" and scene not in ONE_MAP)


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """Images and rays, or a share: of shifts that differ, or of light by the coat."""
    if "method" in chunk:
        return offline.compute(preset, chunk, rng=rng)
    share = {"shifts": differing, "coat": by_last_lobe}[chunk["what"]]
    return {chunk["what"]: np.array(share(chunk["scene"], preset["shifts"], int(rng.integers(2**63))))}


def differing(scene: str, replicas: int, seed: int) -> float:
    """Share of initial samples that carry light whose shifts to a neighbour differ in anything."""
    (sample, W, one), (_, _, other) = (shifted(scene, method, replicas, seed) for method in SHIFTS)
    unlike = (one.J != other.J) | (one.x.F != other.x.F).any(axis=0)
    return float(unlike[W * sample > 0].mean())


def by_last_lobe(scene: str, replicas: int, seed: int) -> float:
    """Share of indirect light that leaves x_1 by the last of its material's lobes, the coat of the clear coat."""
    t = view(scene, RECONNECTION, Counter()).tracer
    pixel = np.tile(np.arange(t.sensor.n), replicas)
    tree = trace(t, np.random.default_rng(seed).random((t.D, len(pixel))), pixel)
    L = indirect_light(tree).mean(axis=0)
    return float(L[tree.at[0].lobe == t.scene.materials.L - 1].sum() / L.sum())


def shifted(scene: str, method: str, replicas: int, seed: int) -> tuple[Array, Array, Shifted]:
    """Initial samples' targets and W (N,), the same for either shift, and the samples shifted to a neighbour."""
    how, chance = offline.METHODS[method], Live(np.random.default_rng(seed))
    of = view(scene, how.rule, Counter(), None, how.integrals)
    here = Pixels(of, np.arange(replicas * of.n))
    X = initial(here, chance)
    (near,) = spread_in_row(of, here.index, 1, OFFLINE.radius, chance)
    return of.target(here.index, X.x), X.W, of.shift(X.x, here.index, near)


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """Images, rays and references, the share of shifts that differ (10,), and of light by the coat.

    Raises ValueError if both shifts differ where one of them is left out.
    """
    done = list(zip(chunks(preset), results, strict=True))
    made = [(chunk, result) for chunk, result in done if "method" in chunk]
    differ = np.array([float(result["shifts"]) for _, result in done if "shifts" in result])
    if differ[[scene in ONE_MAP for scene in TEN]].any():
        raise ValueError(f"both shifts are to be the same map in {ONE_MAP}, but shares of {differ} differ in {TEN}.")
    return {**offline.combine_chunks(*zip(*made, strict=True)), "differ": differ, **results[-1]}


# ---------------------------------------------------------------- numbers


def curve(a: Arrays, scene: str, method: str) -> tuple[Array, Array]:
    """Rays per pixel and MAPE of means of 1, 2, 4, .. frames, as long as there are eight groups."""
    name = rendered(a, scene, method)
    images = a[f"{name}.images"]
    T = 2 ** np.arange(int(np.log2(len(images) // 8)) + 1)
    errors = [mape(means(images, int(t)), a[f"{scene}.reference"]).mean() for t in T]
    return T * float(a[f"{name}.rays"]), np.array(errors)


def rendered(a: Arrays, scene: str, method: str) -> str:
    """Scene and method whose frames are `method`'s: hybrid ones stand for both shifts where they are one map."""
    return f"{scene}.{method}" if f"{scene}.{method}.images" in a else f"{scene}.hybrid"


def rays_to(error: float, rays: Array, errors: Array) -> float:
    """Rays at which a falling curve reaches an error; behind its end it goes on like rays^(-1/2).

    Nobody gets credit for a fraction of a frame.
    """
    x, y = np.log(rays), np.log(np.minimum.accumulate(errors))
    if np.log(error) >= y[0]:
        return float(rays[0])
    if np.log(error) <= y[-1]:
        return float(np.exp(x[-1] - 2 * (np.log(error) - y[-1])))
    return float(np.exp(np.interp(-np.log(error), -y, x)))


def speedups(a: Arrays, method: str) -> dict[str, float]:
    """Rays of path tracing with TARGET trees over those of a method with the same MAPE, by scene."""
    found = {}
    for scene in SIX:
        cost = TARGET * float(a[f"{scene}.path tracing.rays"]) / offline.UNIT
        error = float(mape(offline.traced(a, scene, TARGET), a[f"{scene}.reference"]).mean())
        found[scene] = cost / rays_to(error, *curve(a, scene, method))
    return found


def shift_errors(a: Arrays, scene: str) -> tuple[Array, Array]:
    """relMSE of hybrid and of reconnection frames, on the same random numbers."""
    hybrid, other = (rel_mse(a[f"{scene}.{m}.images"], a[f"{scene}.reference"]) for m in ("hybrid", "reconnection"))
    return hybrid, other


# ---------------------------------------------------------------- claims


def check(a: Arrays) -> list[Claim]:
    """Fig. 16 and 17 by MAPE, Fig. 18 by relMSE of single frames."""
    return [*cleaner(a), *faster(a), *equal_count(a)]


def cleaner(a: Arrays) -> list[Claim]:
    """GRIS-F16: one frame of ReSTIR PT against others at equal rays."""
    claims = []
    for scene in ("ajar", "clear_coat"):
        truth, price = a[f"{scene}.reference"], float(a[f"{scene}.hybrid.rays"])
        ours = mape(offline.after(a, scene, "hybrid", 1), truth)
        for other in ("path reuse", "path tracing"):
            T = int(np.ceil(price / float(a[f"{scene}.{other}.rays"])))
            pair = offline.paired(ours, mape(offline.after(a, scene, other, T), truth))
            part = f"{scene}: MAPE, hybrid / {other}, equal rays"
            claims.append(
                Claim("GRIS-F16", criteria.ratio_below(*pair, 1), part, counter=criteria.ratio_above(*pair, 1))
            )
    return claims


def faster(a: Arrays) -> list[Claim]:
    """GRIS-F17: best speedups over six scenes, and beside them all."""
    all_of = {method: speedups(a, method) for method in METHODS[1:]}
    best = {method: max(each.values()) for method, each in all_of.items()}
    claims = [
        Claim("GRIS-F17", outcome, f"{method}: best speedup {what}")
        for method in SHIFTS
        for outcome, what in (
            (criteria.above(best[method], 3), "in rays of path tracing"),
            (criteria.above(best[method] / best["path reuse"], 1), "over that of path reuse"),
        )
    ]
    claims += [
        Claim("GRIS-F17", criteria.reported(in_words(each)), f"{method}: speedup scene by scene")
        for method, each in all_of.items()
    ]
    share = f"{float(a['coat']):.0%} of the inset's indirect light leaves the floor by the coat"
    return [*claims, Claim("GRIS-F17", criteria.reported(share), "clear coat (more in GRIS-F17coat)", reason=INSETS)]


def in_words(found: Mapping[str, float]) -> str:
    """Speedups, and in how many scenes path tracing is faster."""
    slower = [scene for scene, speedup in found.items() if speedup < 1]
    numbers = ", ".join(f"{scene} {speedup:.2g}" for scene, speedup in found.items())
    return f"{numbers}; slower than path tracing in {len(slower)} of {len(found)}" + (
        f" ({', '.join(slower)})" if slower else ""
    )


INSETS = (
    "These are insets, and those of both Cornell boxes are the corner of floor and box, where 40% of the pixels lie "
    "within 2% of another surface, 6% on the whole film. Where both shifts lose to path tracing in such an inset, they "
    "win over the whole film (GRIS-F11a)."
)


def equal_count(a: Arrays) -> list[Claim]:
    """GRIS-F18: hybrid against reconnection, frame against frame, where they differ."""
    claims = []
    for scene, share in zip(TEN, a["differ"], strict=True):
        part = f"{scene}: relMSE, hybrid / reconnection, equal samples"
        if scene in ONE_MAP:
            claims.append(
                Claim("GRIS-F18", criteria.reported("both shifts are the same map: 0% of shifts differ"), part)
            )
        else:
            claims.append(compared(a, scene, part, f"; {share:.1%} of shifts differ"))
    return claims


def compared(a: Arrays, scene: str, part: str, beside: str) -> Claim:
    """One scene in which the shifts differ; no single one refutes what the paper says to be so generally."""
    pair = shift_errors(a, scene)
    reverse = scene == "distant_caustic"
    found = criteria.ratio_above(*pair, 1) if reverse else criteria.ratio_below(*pair, 1.05)
    why = CORNER if scene == "cornell" and not found.passed else ""
    return Claim("GRIS-F18", replace(found, measured=f"{found.measured}{beside}"), part, reason=why)


CORNER = (
    "All is rough here, and the shifts differ by the least distance of connections only: the inset is the corner of "
    "floor and box, where hybrid replays what reconnection connects at less than 2% of the scene's size. Over the "
    "whole film hybrid is a fifth worse (GRIS-F11a). Our explanation: in the plane a short connection costs 1/r, in "
    "space 1/r^2; in a wedge of 40 degrees the distance pays here too (GRIS-C10). Fig. 18 has no rough Cornell box, "
    "and says generally."
)


# ---------------------------------------------------------------- picture


def draw(a: Arrays) -> "Picture":
    """MAPE over rays in six scenes, speedups, and the shifts' ratio where they differ."""
    picture, axes = style.panels(2, 4, width=3.0, height=2.9)
    for axis, scene in zip([*axes[0], *axes[1, :2]], SIX, strict=True):
        for method in METHODS:
            axis.loglog(*curve(a, scene, method), **style.look(method))
        same_time = offline.equal_time(1) * float(a[f"{scene}.path tracing.rays"]) / offline.UNIT
        axis.axvline(same_time, color=style.GREY, lw=1, ls=":", marker="", label=SAME_TIME)
        axis.set(xlabel="rays per pixel", ylabel="MAPE", title=scene.replace("_", " "))
    picture.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=5)
    times = axes[1, 2]
    for k, method in enumerate(METHODS[1:]):
        times.bar(np.arange(len(SIX)) + 0.27 * (k - 1), list(speedups(a, method).values()), 0.25, **style.bar(method))
    times.axhline(1, color=style.INK, lw=1, ls=":", label="as path tracing")
    times.set_yscale("log")
    times.set_xticks(range(len(SIX)), [name.replace("_", "\n") for name in SIX], rotation=90)
    times.set(ylabel="rays of path tracing / rays", title=f"To the MAPE of {TARGET} trees")
    times.set_ylim(top=2000)
    times.legend(ncols=2, loc="upper left", columnspacing=1, handlelength=1.5)
    draw_ratios(a, axes[1, 3])
    return picture


def draw_ratios(a: Arrays, axis: "Axes") -> None:
    """relMSE of hybrid over reconnection frames with 95% intervals, where the shifts differ."""
    scenes = [scene for scene in TEN if scene not in ONE_MAP]
    for k, scene in enumerate(scenes):
        hybrid, other = shift_errors(a, scene)
        low, high, _ = criteria.ratio_interval(hybrid, other)
        axis.plot([low, high], [k, k], color=style.INK, ls="-", marker="|", markevery=1)
        axis.plot(hybrid.mean() / other.mean(), k, color=style.INK, marker="o", markevery=1)
    axis.axvline(1, color=style.INK, lw=1, ls=":", marker="", label="shifts alike")
    axis.set_ylim(-0.5, len(scenes) + 0.5)
    axis.legend(loc="upper left")
    axis.set_xscale("log")
    axis.set_xticks([], minor=True)
    axis.set_xticks([0.2, 0.5, 1, 2], ["0.2", "0.5", "1", "2"])
    axis.set_yticks(range(len(scenes)), [scene.replace("_", "\n") for scene in scenes])
    axis.set(xlabel="relMSE, hybrid / reconnection", title="Equal samples, 95%")


SAME_TIME = "path tracing in the time of a frame"

FIGURE = Figure(
    id="GRIS-F17",
    title="Offline renderers in ten scenes",
    world="flatland2d",
    source="[GRIS Fig. 16, 17, 18; 9.3]",
    claims=("GRIS-F16", "GRIS-F17", "GRIS-F18"),
    conditions=(
        Conditions(
            ("GRIS-F16", "GRIS-F17"),
            "Fig. 16, 17; 9.3",
            Setup("offline", "still", "indirect", "production scenes, equal time"),
            Setup("offline", "still", "indirect", "the insets of FS1, FS2, FS3, FS8, FS9 and FS10, equal rays"),
        ),
        Conditions(
            ("GRIS-F18",),
            "Fig. 18; 9.3",
            Setup("offline", "still", "indirect", "production scenes, equal samples"),
            Setup("offline", "still", "indirect", "the insets of FS1, FS2, FS8, FS9 and FS10, equal samples"),
        ),
    ),
    arm="method",
    presets={
        "quick": {"path tracing": 768, "path reuse": 384, "reconnection": 64, "hybrid": 64, "shifts": 48},
        "paper": {"path tracing": 8192, "path reuse": 8192, "reconnection": 1024, "hybrid": 1024, "shifts": 512},
    },
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)
