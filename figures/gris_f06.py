"""GRIS Fig. 6c: spatiotemporal reuse of one path tree per pixel, by the reconnection shift and by the hybrid shift.

Where boxes are glossy, reconnecting to them fails.  On rough boxes the hybrid shift differs from the reconnection
shift by its distance test alone.  In flatland a connection of length r counts like 1/r instead of 1/r^2, so that short
ones do less harm.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from figures import criteria, realtime, style
from figures.figure import Arrays, Claim, Conditions, Figure, Setup
from figures.references import reference
from flatland2d import SCENES
from restir_ref.batch import Array
from restir_ref.loop import REAL_TIME
from restir_ref.metrics import SMALL
from restir_ref.transport.rays import arrive

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Picture

GLOSSY, ROUGH = "glossy_cornell", "cornell"
RENDERED = (
    (GLOSSY, "reconnection"),
    (GLOSSY, "no distance test"),
    (GLOSSY, "hybrid"),
    (ROUGH, "reconnection"),
    (ROUGH, "hybrid"),
)


def chunks(preset: Any) -> Sequence[dict[str, str]]:
    """One per scene and shift."""
    return [{"scene": scene, "method": method} for scene, method in RENDERED]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """Relative squared error of every pixel, mean of the last half of the frames (replicas, n), and one last frame."""
    found = realtime.still(realtime.METHODS[chunk["method"]], chunk["scene"], preset["replicas"], rng)
    truth = reference(chunk["scene"]).mean
    error = (found["images"][1:] - truth) ** 2 / (truth**2 + (SMALL * truth.mean()) ** 2)
    return {"error": error.mean(axis=0), "image": found["images"][-1, 0]}


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """By "scene.shift.name", with references and what pixels see."""
    named = zip(RENDERED, results, strict=True)
    arrays = {f"{scene}.{method}.{key}": part[key] for (scene, method), part in named for key in part}
    truths = {f"{scene}.reference": reference(scene).mean for scene in (GLOSSY, ROUGH)}
    return arrays | truths | {"box": on_box()}


def on_box() -> Array:
    """Whether a pixel's centre sees a box, (n,): the same in both scenes."""
    setting = SCENES[GLOSSY]()
    sensor = setting.pinhole()
    v, _, _ = arrive(setting.scene, *sensor.ray(np.arange(sensor.n), np.full((1, sensor.n), 0.5))[:2])
    return np.asarray(v.material == 1)


def along_edges(box: Array) -> Array:
    """Pixels whose neighbours may lie on the other side of a box's edge, (n,)."""
    edges = np.flatnonzero(np.diff(box.astype(int))) + 0.5
    return np.asarray((np.abs(np.arange(len(box))[:, None] - edges) <= REAL_TIME.radius).any(axis=1))


def check(a: Arrays) -> list[Claim]:
    """Glossy pixels, rough pixels, and pixels along the box' edge."""
    box = a["box"]
    glossy = criteria.ratio_below(*pair(a, GLOSSY, "hybrid", "reconnection", box), 0.8)
    rough = ratio_within(*pair(a, ROUGH, "hybrid", "reconnection", np.ones_like(box)), 0.8, 1.25)
    edges = criteria.ratio_below(*pair(a, GLOSSY, "hybrid", "no distance test", along_edges(box)), 0.9)
    return [
        Claim("GRIS-F06", glossy, "glossy box: relMSE, hybrid / reconnection"),
        Claim("GRIS-F06", rough, "rough boxes: relMSE, hybrid / reconnection", reason=ALONE),
        Claim("GRIS-F06", edges, "along the glossy box' edge: relMSE, with / without distance test", reason=NEARBY),
    ]


def ratio_within(errors: Array, others: Array, low: float, high: float) -> criteria.Outcome:
    """The ratio's whole bootstrap 95% interval lies in [low, high]."""
    least, most, text = criteria.ratio_interval(errors, others)
    return criteria.Outcome(text, f"ratio in [{low:g}, {high:g}] at 95%", low <= least and most <= high)


ALONE = (
    "At roughness .5 everything connects, so the shifts differ by the distance test alone; the inset is the foot of a "
    "box, where it rejects many connections."
)
NEARBY = (
    "Thresholds from .25% to 5% of the scene's size do not help either.  Likely reason: in two dimensions the Jacobian "
    "of a short connection is a ratio of distances, not of their squares, and one more replayed vertex costs more."
)


def pair(a: Arrays, scene: str, one: str, other: str, mask: Array) -> tuple[Array, Array]:
    """relMSE of the masked pixels for two shifts, (replicas,) each."""
    first, second = (a[f"{scene}.{method}.error"][:, mask].mean(axis=1) for method in (one, other))
    return first, second


def draw(a: Arrays) -> "Picture":
    """The glossy inset, and where its error lies."""
    picture, axes = style.panels(1, 3, width=4.0, height=3.2)
    _strips(axes[0, 0], a)
    _profile(axes[0, 1], a, GLOSSY, "glossy boxes (r = .15)")
    _profile(axes[0, 2], a, ROUGH, "rough boxes (r = .5)")
    axes[0, 1].legend(loc="lower left")
    return picture


def _strips(axis: "Axes", a: Arrays) -> None:
    methods = [method for scene, method in RENDERED if scene == GLOSSY]
    rows = [a[f"{GLOSSY}.reference"], *(a[f"{GLOSSY}.{method}.image"] for method in methods)]
    high = 1.5 * a[f"{GLOSSY}.reference"].max()
    axis.imshow(np.repeat(np.stack(rows), 4, axis=0), vmin=0, vmax=high, aspect="auto", extent=(0, 128, len(rows), 0))
    axis.set_yticks(np.arange(len(rows)) + 0.5, ["reference", *methods])
    axis.grid(visible=False)
    axis.set(xlabel="pixel: floor, then box", title=f"{GLOSSY}, frame {realtime.FRAMES}")


LOOKS = {
    "reconnection": {"color": "#D55E00", "ls": "--"},
    "no distance test": {"color": "#000000", "ls": ":"},
    "hybrid": {"color": "#0072B2", "ls": "-"},
}


def _profile(axis: "Axes", a: Arrays, scene: str, title: str) -> None:
    """relMSE over four pixels each."""
    box, x = a["box"], np.arange(2, len(a["box"]), 4)
    edges = np.flatnonzero(along_edges(box))
    axis.axvspan(edges[0], edges[-1] + 1, color="#eeeeee", zorder=0)
    axis.axvline(float(np.argmax(box)), color="#888888", lw=0.8, marker="")
    for method in (method for each, method in RENDERED if each == scene):
        error = a[f"{scene}.{method}.error"].mean(axis=0).reshape(-1, 4).mean(axis=1)
        axis.semilogy(x, error, marker="", label=method, **LOOKS[method])
    axis.set(xlabel="pixel: floor, then box", ylabel="relMSE of 4 pixels", title=title)
    axis.set_ylim(1.5e-3, 1)


FIGURE = Figure(
    id="GRIS-F06",
    title="Both shifts with spatiotemporal reuse",
    world="flatland2d",
    source="[GRIS Fig. 6c; 7.5, 9.2]",
    claims=("GRIS-F06",),
    conditions=(
        Conditions(
            ("GRIS-F06",),
            "[GRIS Fig. 6]",
            Setup("real time", "still", "indirect", "a"),
            Setup("real time", "still", "all", "b"),
            "being moved",
        ),
    ),
    presets={"quick": {"replicas": 80}, "paper": {"replicas": 512}},
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)
