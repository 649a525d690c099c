"""GRIS Fig. 13: two kinds of caustics, and the shift that suits each.

Through glass nothing connects, and only replay follows the light.  A small distant mirror is missed by most
replayed paths, whereas a reconnection turns the light on it by very little.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from figures import criteria, offline, style
from figures.figure import Arrays, Claim, Conditions, Figure, Setup
from restir_ref.batch import Array
from restir_ref.metrics import SMALL

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture

SCENES = {"glass_disc": "contact caustic below glass", "distant_caustic": "highlight of a distant mirror"}
METHODS = ("path tracing", "reconnection", "hybrid")


def caustic(a: Arrays, scene: str) -> Array:
    """Pixels more than half as bright as the brightest, (n,)."""
    truth = a[f"{scene}.reference"]
    return np.asarray(truth > truth.max() / 2)


def errors(a: Arrays, scene: str, images: Array) -> Array:
    """relMSE of every image over its caustic pixels, (R,)."""
    truth, mask = a[f"{scene}.reference"], caustic(a, scene)
    relative = (images - truth) ** 2 / (truth**2 + (SMALL * truth.mean()) ** 2)
    return np.asarray(relative[:, mask].mean(axis=1))


def check(a: Arrays) -> list[Claim]:
    """Frames against frames, and against path tracing at equal rays."""
    ours = {
        scene: {m: errors(a, scene, offline.after(a, scene, m, 1)) for m in ("hybrid", "reconnection")}
        for scene in SCENES
    }
    glass, distant = ours["glass_disc"], ours["distant_caustic"]
    trees = offline.equal_rays(a, "glass_disc", "hybrid", 1)
    traced = errors(a, "glass_disc", offline.traced(a, "glass_disc", trees))
    against_tracing = criteria.ratio_below(*offline.paired(glass["hybrid"], traced), 0.8)
    return [
        Claim("GRIS-F13t", criteria.ratio_below(glass["hybrid"], glass["reconnection"], 0.7), "hybrid / reconnection"),
        Claim("GRIS-F13t", against_tracing, f"hybrid / path tracing with {trees:.0f} trees", reason=REASON),
        Claim(
            "GRIS-F13b", criteria.ratio_below(distant["reconnection"], distant["hybrid"], 0.8), "reconnection / hybrid"
        ),
    ]


REASON = (
    "Replay follows the refraction, but the path's last diffuse vertex is its first: a shifted path must find the lamp "
    "by itself, and 32 trees of one's own already find it often."
)


def draw(a: Arrays) -> "Picture":
    """One frame of every method, and the error per pixel."""
    picture, axes = style.panels(2, 2, width=4.0, height=2.7)
    for row, (scene, title) in zip(axes, SCENES.items(), strict=True):
        truth = a[f"{scene}.reference"]
        trees = offline.equal_rays(a, scene, "hybrid", 1)
        shown = {
            "path tracing, equal rays": offline.traced(a, scene, trees),
            **{method: offline.after(a, scene, method, 1) for method in METHODS[1:]},
        }
        row[0].plot(truth, color="k", lw=2.5, alpha=0.4, marker="", label="reference")
        for name, images in shown.items():
            row[0].plot(images[0], marker="", lw=0.9, label=name)
            error = ((images - truth) ** 2 / truth**2).mean(axis=0)
            row[1].semilogy(np.convolve(error, np.ones(9) / 9, mode="valid"), label=name)
        row[0].set(xlabel="pixel of the inset", ylabel="radiance", title=f"{title}: one frame")
        row[1].set(xlabel="pixel of the inset", ylabel="relative squared error", title="mean over frames")
        row[1].legend()
    return picture


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """Images, rays and references of both scenes."""
    return offline.combine(tuple(SCENES), METHODS, results)


FIGURE = Figure(
    id="GRIS-F13",
    title="Caustics through glass and from a distant highlight",
    world="flatland2d",
    source="[GRIS Fig. 13; 9.2]",
    claims=("GRIS-F13t", "GRIS-F13b"),
    conditions=(
        Conditions(
            ("GRIS-F13t",),
            "[GRIS Fig. 13]",
            Setup("real time", "moving", "direct by ReSTIR DI", "a"),
            Setup("offline", "still", "all", "b"),
            "being moved",
        ),
        Conditions(
            ("GRIS-F13b",),
            "[GRIS Fig. 13]",
            Setup("real time", "moving", "indirect", "a"),
            Setup("offline", "still", "all", "b"),
            "being moved",
        ),
    ),
    presets={
        "quick": {"path tracing": 2048, "reconnection": 128, "hybrid": 128},
        "paper": {"path tracing": 32768, "reconnection": 2048, "hybrid": 2048},
    },
    chunks=lambda preset: offline.chunks(tuple(SCENES), METHODS),
    compute=offline.compute,
    combine=combine,
    draw=draw,
    check=check,
)
