"""GRIS Fig. 16, 17 and 18: offline renderers in ten scenes, at equal rays, to equal error, and at equal samples.

All images are of independent frames, direct light included.  Errors of means between the measured numbers of frames
are interpolated in logarithms, and continued behind them like T^(-1/2).
"""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from figures import criteria, offline, style
from figures.figure import Arrays, Claim, Conditions, Figure, Setup
from figures.flatland import TEN, means
from restir_ref.batch import Array
from restir_ref.metrics import mape, rel_mse

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture

SIX = ("cornell", "glossy_cornell", "ajar", "glass_disc", "distant_caustic", "clear_coat")
"""Scenes of the comparison to equal error; the others are about gradients and geometry."""

METHODS = ("path tracing", "path reuse", "reconnection", "hybrid")
TARGET = 1024
"""Path trees whose error is to be reached.  [GRIS Fig. 17]"""


def curve(a: Arrays, scene: str, method: str) -> tuple[Array, Array]:
    """Rays per pixel and MAPE of means of 1, 2, 4, .. frames, as long as there are eight groups."""
    images = a[f"{scene}.{method}.images"]
    T = 2 ** np.arange(int(np.log2(len(images) // 8)) + 1)
    errors = [mape(means(images, int(t)), a[f"{scene}.reference"]).mean() for t in T]
    return T * float(a[f"{scene}.{method}.rays"]), np.array(errors)


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


def check(a: Arrays) -> list[Claim]:
    """Fig. 16 and 17 by MAPE, Fig. 18 by relMSE of single frames."""
    return [*faster(a), *cleaner(a), *equal_count(a)]


def faster(a: Arrays) -> list[Claim]:
    """GRIS-F17: best speedups over six scenes."""
    best = {method: max(speedups(a, method).items(), key=lambda item: item[1]) for method in METHODS[1:]}
    reuse = best["path reuse"][1]
    claims = [
        Claim(
            "GRIS-F17",
            criteria.above(best[m][1], limit),
            f"{m}: best speedup ({best[m][0]}), {limit_name}",
            caveat='',
        )
        for m in METHODS[2:]
        for limit, limit_name in ((3.0, "at least 3"), (reuse, "more than path reuse"))
    ]
    coat = speedups(a, "path reuse")["clear_coat"]
    slower = Claim(
        "GRIS-F17", criteria.below(coat, 1.2), "path reuse: speedup on the clear coat", caveat=''
    )
    return [*claims, slower]


def cleaner(a: Arrays) -> list[Claim]:
    """GRIS-F16: one hybrid frame against others at equal rays."""
    claims = []
    for scene in ("ajar", "clear_coat"):
        truth, price = a[f"{scene}.reference"], float(a[f"{scene}.hybrid.rays"])
        ours = mape(offline.after(a, scene, "hybrid", 1), truth)
        for other in ("path reuse", "path tracing"):
            T = int(np.ceil(price / float(a[f"{scene}.{other}.rays"])))
            theirs = mape(offline.after(a, scene, other, T), truth)
            ratio = criteria.ratio_below(*offline.paired(ours, theirs), 1)
            claims.append(Claim("GRIS-F16", ratio, f"{scene}: MAPE, hybrid / {other}", caveat=''))
    return claims


def equal_count(a: Arrays) -> list[Claim]:
    """GRIS-F18: hybrid against reconnection, frame against frame."""
    ratios = shift_ratios(a)
    usual = max((value, scene) for scene, value in ratios.items() if scene != "distant_caustic")
    return [
        Claim(
            "GRIS-F18",
            criteria.below(usual[0], 1.05),
            f"relMSE hybrid / reconnection, largest ({usual[1]})",
            reason=WHY,
        ),
        Claim("GRIS-F18", criteria.above(ratios["distant_caustic"], 1), "the same from the distant highlight"),
    ]


WHY = (
    "Where everything is rough the two shifts differ by the least distance of connections only, which costs more than "
    "it saves in the plane (GRIS-C10); on the clear coat, by the coat, whose light is a distant lamp (GRIS-F13b)."
)


def shift_ratios(a: Arrays) -> Mapping[str, float]:
    """relMSE of hybrid over reconnection frames, by scene."""
    found = {}
    for scene in TEN:
        by_shift = [rel_mse(a[f"{scene}.{m}.images"], a[f"{scene}.reference"]).mean() for m in METHODS[:1:-1]]
        found[scene] = float(by_shift[0] / by_shift[1])
    return found


def draw(a: Arrays) -> "Picture":
    """MAPE over rays in six scenes, and the shifts' ratio in all."""
    picture, axes = style.panels(2, 4, width=3.2, height=2.7)
    for axis, scene in zip([*axes[0], *axes[1, :2]], SIX, strict=True):
        for method in METHODS:
            axis.loglog(*curve(a, scene, method), label=method)
        same_time = offline.equal_time(1) * float(a[f"{scene}.path tracing.rays"]) / offline.UNIT
        axis.axvline(same_time, color="#777777", lw=0.9, label="path tracing in the time of a frame")
        axis.set(xlabel="rays per pixel", ylabel="MAPE", title=scene.replace("_", " "))
    axes[0, 0].legend(fontsize=6)
    times = axes[1, 2]
    for k, method in enumerate(METHODS[1:]):
        times.bar(np.arange(len(SIX)) + 0.27 * (k - 1), list(speedups(a, method).values()), 0.25, label=method)
    times.axhline(1, color="k", lw=0.8)
    times.set_yscale("log")
    times.set_xticks(range(len(SIX)), [name.replace("_", "\n") for name in SIX], fontsize=6)
    times.set(ylabel="rays of path tracing / rays", title=f"To the MAPE of {TARGET} trees")
    times.set_ylim(top=200)
    times.legend(ncols=3, fontsize=6, loc="upper left")
    ratios = shift_ratios(a)
    axes[1, 3].barh(list(ratios), list(ratios.values()), color=style.COLOURS[0])
    axes[1, 3].axvline(1, color="k", lw=0.8)
    axes[1, 3].set(xlabel="relMSE, hybrid / reconnection", title="Equal samples")
    axes[1, 3].tick_params(axis="y", labelsize=6)
    return picture


def chunks(preset: Any) -> Sequence[dict[str, str]]:
    """Every scene and method; path reuse where it is compared."""
    return [chunk for chunk in offline.chunks(TEN, METHODS) if wanted(chunk)]


def wanted(chunk: Mapping[str, str]) -> bool:
    """Path reuse is slow and compared in six scenes only."""
    return chunk["method"] != "path reuse" or chunk["scene"] in SIX


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """Images, rays and references of all scenes."""
    return offline.combine_chunks(chunks(preset), results)


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
            Setup("offline", "still", "indirect", "the insets of FS1 to FS10, equal samples"),
        ),
    ),
    arm="method",
    presets={
        "quick": {"path tracing": 2048, "path reuse": 1024, "reconnection": 128, "hybrid": 128},
        "paper": {"path tracing": 16384, "path reuse": 16384, "reconnection": 2048, "hybrid": 2048},
    },
    chunks=chunks,
    compute=offline.compute,
    combine=combine,
    draw=draw,
    check=check,
)
