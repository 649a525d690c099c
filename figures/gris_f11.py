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


def against_tracing(a: Arrays, T: int, method: str) -> Claim:
    """relMSE of T frames of a method over that of as many path trees, with rough boxes."""
    images = offline.after(a, "cornell", method, T), offline.traced(a, "cornell", offline.equal_samples(T))
    pair = offline.paired(*(errors(a, "cornell", each) for each in images))
    worse = criteria.ratio_above(*pair, 1)
    part = f"{method} / path tracing, {T} frames, equal samples"
    return Claim("GRIS-F11a", criteria.ratio_below(*pair, 0.5), part, counter=worse, reason=REASON)


REASON = (
    "The mean is that of a dozen pixels in the corner of floor and box (right panel): what neighbours see there is "
    "another surface, or the same from ten times as far, and one path of each of seven pixels tells less than the "
    "pixel's own 32 trees, which leave 9% error in this easy scene. Elsewhere reuse halves the error; it also helps "
    "where one tree is all there is (GRIS-F01), and where light is hard to find (GRIS-F17)."
)


def check(a: Arrays) -> list[Claim]:
    """At one frame and at the longest mean that leaves eight groups, at equal samples; equal rays beside it."""
    claims = []
    for T in (1, longest(a)):
        claims += [against_tracing(a, T, method) for method in METHODS[1:]]
        hybrid, other = (errors(a, "cornell", offline.after(a, "cornell", m, T)) for m in ("hybrid", "reconnection"))
        alike = criteria.ratio_within(hybrid, other, 0.7, 1.3)
        claims.append(Claim("GRIS-F11a", alike, f"hybrid / reconnection, {T} frames", reason=REASON))
        glossy = {m: errors(a, "glossy_cornell", offline.after(a, "glossy_cornell", m, T)) for m in METHODS[1:]}
        better = criteria.ratio_below(glossy["hybrid"], glossy["reconnection"], 0.85)
        claims.append(Claim("GRIS-F11b", better, f"hybrid / reconnection, {T} frames"))
    return claims


def longest(a: Arrays) -> int:
    """Frames in a mean, with eight groups of them."""
    return len(a["cornell.hybrid.images"]) // 8


def draw(a: Arrays) -> "Picture":
    """relMSE over frames; path tracing at equal samples, rays and time; error by pixel."""
    picture, axes = style.panels(1, 3, width=3.9, height=3.3)
    T = 2 ** np.arange(int(np.log2(longest(a))) + 1)
    for axis, (scene, title) in zip(axes[0, :2], SCENES.items(), strict=True):
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
        axis.legend(fontsize=6.5)
    by_pixel(a, axes[0, 2])
    return picture


def by_pixel(a: Arrays, axis: Any) -> None:
    """Relative squared error of one frame along the inset with rough boxes."""
    truth = a["cornell.reference"]
    shown = {
        "path tracing, equal samples": offline.traced(a, "cornell", offline.equal_samples(1)),
        **{method: offline.after(a, "cornell", method, 1) for method in METHODS[1:]},
    }
    for name, images in shown.items():
        error = ((images / truth - 1) ** 2).mean(axis=0)
        axis.semilogy(error.reshape(-1, 4).mean(axis=1).repeat(4), label=name)
    axis.set(xlabel="pixel of the inset", ylabel="relative squared error", title="One frame, rough boxes")
    axis.legend(fontsize=6.5)


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
