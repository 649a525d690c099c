"""GRIS Fig. 11: convergence offline with rough and with glossy boxes, for both shifts.

Frames are independent, so the error of their mean falls like 1/T from wherever one frame starts; the shift
decides where.  On rough boxes the two shifts nearly always connect the same vertices.
"""

from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from figures import criteria, offline, style
from figures.figure import Arrays, Claim, Figure
from restir_ref.batch import Array
from restir_ref.metrics import rel_mse

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture

SCENES = {"cornell": "rough boxes (r = .5)", "glossy_cornell": "glossy boxes (r = .15)"}
METHODS = ("path tracing", "reconnection", "hybrid")


def errors(a: Arrays, scene: str, images: Array) -> Array:
    """relMSE of every image, (R,)."""
    return rel_mse(images, a[f"{scene}.reference"])


def ratio(a: Arrays, scene: str, T: int, trees: float, method: str, limit: float) -> criteria.Outcome:
    """relMSE of T frames of a method over that of path tracing with so many trees."""
    ours, theirs = (errors(a, scene, x) for x in (offline.after(a, scene, method, T), offline.traced(a, scene, trees)))
    return criteria.ratio_below(*offline.paired(ours, theirs), limit)


def check(a: Arrays) -> list[Claim]:
    """At one frame and at the longest mean that leaves eight groups, at equal samples; equal rays beside it."""
    claims = []
    for T in (1, longest(a)):
        for method in METHODS[1:]:
            part = f"{method} / path tracing, {T} frames"
            equal = ratio(a, "cornell", T, offline.equal_samples(T), method, 0.5)
            claims.append(Claim("GRIS-F11a", equal, f"{part}, equal samples"))
        hybrid, other = (errors(a, "cornell", offline.after(a, "cornell", m, T)) for m in ("hybrid", "reconnection"))
        claims.append(
            Claim("GRIS-F11a", criteria.between(hybrid.mean() / other.mean(), 0.7, 1.3), f"hybrid / reconnection, {T}")
        )
        glossy = {m: errors(a, "glossy_cornell", offline.after(a, "glossy_cornell", m, T)) for m in METHODS[1:]}
        better = criteria.ratio_below(glossy["hybrid"], glossy["reconnection"], 0.85)
        claims.append(Claim("GRIS-F11b", better, f"hybrid / reconnection, {T} frames"))
    return claims


def longest(a: Arrays) -> int:
    """Frames in a mean, with eight groups of them."""
    return len(a["cornell.hybrid.images"]) // 8


def draw(a: Arrays) -> "Picture":
    """relMSE over frames; path tracing at equal samples, rays and time."""
    picture, axes = style.panels(1, 2, width=4.0, height=3.2)
    T = 2 ** np.arange(int(np.log2(longest(a))) + 1)
    for axis, (scene, title) in zip(axes[0], SCENES.items(), strict=True):
        prices: dict[str, Callable[[int], float]] = {
            "equal samples": offline.equal_samples,
            "equal rays": partial(offline.equal_rays, a, scene, "hybrid"),
            "equal time": offline.equal_time,
        }
        for name, trees in prices.items():
            curve = [errors(a, scene, offline.traced(a, scene, trees(int(t)))).mean() for t in T]
            axis.loglog(T, curve, label=f"path tracing, {name}")
        for method in METHODS[1:]:
            axis.loglog(T, [errors(a, scene, offline.after(a, scene, method, int(t))).mean() for t in T], label=method)
        axis.set(xlabel="frames T in the mean", ylabel="relMSE of the mean", title=title)
        axis.legend()
    return picture


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """Images, rays and references of both scenes."""
    return offline.combine(tuple(SCENES), METHODS, results)


FIGURE = Figure(
    id="GRIS-F11",
    title="Offline convergence with rough and glossy boxes",
    world="flatland2d",
    source="[GRIS Fig. 11; 8.3, 9.1]",
    claims=("GRIS-F11a", "GRIS-F11b"),
    presets={
        "quick": {"path tracing": 5120, "reconnection": 256, "hybrid": 256},
        "paper": {"path tracing": 40960, "reconnection": 2048, "hybrid": 2048},
    },
    chunks=lambda preset: offline.chunks(tuple(SCENES), METHODS),
    compute=offline.compute,
    combine=combine,
    draw=draw,
    check=check,
)
