"""GRIS Fig. 11 in space: convergence offline with rough and with glossy boxes, for both shifts.

As in flatland, by the same code: indirect light, independent frames.  Errors are those of five crops of the film of
1920 x 1080 pixels, where neighbours are as near as in the paper, and with glossy boxes those of an inset that shows
one; the reference is path tracing with trees of its own.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims.figure import Arrays, Claim, Conditions, Figure, Setup
from figures.experiments import offline
from figures.experiments.references import INDIRECT, reference
from figures.experiments.solid import WIDE
from figures.gris.gris_f11 import METHODS, Boxes, convergence, judged
from figures.report import style

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture

SPACE = Boxes("CB3", "CB3-glossy, box")
"""Rough: crops that nobody chose.  Glossy: an inset that shows a box, as Fig. 11b is about what boxes reflect."""


def chunks(preset: Any) -> Sequence[dict[str, str]]:
    """Every scene and method."""
    return offline.chunks((SPACE.rough, SPACE.glossy), METHODS)


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """Independent images of the crops (count, n), the mean of their channels, and rays per pixel."""
    count = preset["path tracing" if chunk["method"] == "path tracing" else "frames"]
    return offline.render(offline.METHODS[chunk["method"]], chunk["scene"], count, rng)


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """All images and rays by "scene.method.name", the truth by "scene.truth.image"."""
    named = zip(chunks(preset), results, strict=True)
    found = {f"{chunk['scene']}.{chunk['method']}.{key}": part[key] for chunk, part in named for key in part}
    return found | {f"{each}.truth.image": reference(each, INDIRECT).mean for each in (SPACE.rough, SPACE.glossy)}


def check(a: Arrays) -> list[Claim]:
    """As in flatland."""
    return judged(a, SPACE)


def draw(a: Arrays) -> "Picture":
    """relMSE over frames, path tracing at equal samples and rays; and one glossy frame."""
    picture, axes = style.panels(1, 3, width=3.9, height=3.9)
    convergence(axes[0, :2], a, SPACE, ("equal samples", "equal rays"))
    scene = SPACE.glossy
    rows = {
        "reference": a[f"{scene}.truth.image"],
        "path tracing,\nequal samples": offline.traced(a, scene, offline.equal_samples(1))[0],
        **{method: a[f"{scene}.{method}.images"][0] for method in METHODS[1:]},
    }
    style.crops(axes[0, 2], rows, side=WIDE, title="One frame, glossy")
    return picture


FIGURE = Figure(
    id="GRIS-F11-3D",
    title="Offline convergence with rough and glossy boxes, in space",
    world="tracer3d",
    source="[GRIS Fig. 11; 8.3, 9.1]",
    claims=("GRIS-F11a", "GRIS-F11b"),
    conditions=(
        Conditions(
            ("GRIS-F11a",),
            "Fig. 11a; 9.1, 9.2",
            Setup("offline", "still", "indirect", "Cornell box, rough"),
            Setup("offline", "still", "indirect", "CB3, five crops of the film, 24 x 24 pixels each"),
        ),
        Conditions(
            ("GRIS-F11b",),
            "Fig. 11b; 9.1, 9.2",
            Setup("offline", "still", "indirect", "Cornell box with two glossy boxes"),
            Setup("offline", "still", "indirect", "CB3-glossy, an inset of the edge of a box, 36 x 36 pixels"),
        ),
    ),
    arm="method",
    presets={
        "quick": {"path tracing": 72, "frames": 8},
        "paper": {"path tracing": 576, "frames": 64},
    },
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)
