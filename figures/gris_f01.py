"""GRIS Fig. 1: a frame of a moving camera by path tracing, ReSTIR GI and ReSTIR PT, at equal rays.

Twenty frames with one path tree per pixel, and the last one judged.  Path tracing gets as many trees as cost at
least the rays of one frame of ours.  ReSTIR GI keeps the radiance it found at x_2, which is right if x_2 is Lambertian.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from figures import criteria, realtime, style
from figures.figure import Arrays, Claim, Conditions, Figure, Setup
from figures.references import reference
from restir_ref.batch import Array
from restir_ref.metrics import mape

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Picture

SCENES = ("glossy_cornell", "ajar", "distant_caustic", "cornell")
JUDGED = SCENES[:3]
GLOSSY = ("glossy_cornell", "distant_caustic")
REUSED = ("hybrid", "ReSTIR GI")
PT = "path tracing"


def chunks(preset: Any) -> Sequence[dict[str, str]]:
    """One per scene and renderer."""
    return [{"scene": scene, "method": method} for scene in SCENES for method in (*REUSED, PT)]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """Images and rays per pixel of one renderer."""
    if chunk["method"] == PT:
        return realtime.trees(chunk["scene"], preset["trees"], rng)
    return realtime.moved(realtime.METHODS[chunk["method"]], chunk["scene"], preset["replicas"], rng)


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """MAPE and image mean per renderer, (replicas,), an image of each, and rays, by "scene.renderer.name"."""
    parts = iter(results)
    arrays: Arrays = {}
    for scene in SCENES:
        truth = reference(scene).mean
        ours, gi, trees = next(parts), next(parts), next(parts)
        images = {
            "hybrid": ours["images"],
            "ReSTIR GI": gi["images"],
            PT: realtime.at_equal_rays(trees, float(ours["rays"])),
            "equal time": realtime.at_equal_time(trees, scene),
        }
        arrays |= {f"{scene}.reference": truth, f"{scene}.rays": rays_of(ours, gi, trees)}
        for name, each in images.items():
            arrays |= {
                f"{scene}.{name}.error": mape(each, truth),
                f"{scene}.{name}.image": each[0],
                f"{scene}.{name}.mean": each.mean(axis=-1) / truth.mean(),
            }
    return arrays


def rays_of(ours: Arrays, gi: Arrays, trees: Arrays) -> Array:
    """Rays per pixel: a frame of ours, a frame of ReSTIR GI, one path tree; (3,)."""
    return np.array([float(each["rays"]) for each in (ours, gi, trees)])


def check(a: Arrays) -> list[Claim]:
    """Against path tracing in three scenes, against ReSTIR GI in the two glossy ones."""
    against_paths = [
        Claim("GRIS-F01", ratio(a, scene, PT, 0.76), f"{scene}: MAPE, ReSTIR PT / path tracing") for scene in JUDGED
    ]
    against_gi = []
    for scene in GLOSSY:
        outcome = ratio(a, scene, "ReSTIR GI", 1)
        part = f"{scene}: MAPE, ReSTIR PT / ReSTIR GI"
        against_gi.append(Claim("GRIS-F01", outcome, part, reason=WHY[scene] + bias(a, scene)))
    return against_paths + against_gi


WHY = {
    "glossy_cornell": "Boxes are glossy where they are seen and where light comes from. ",
    "distant_caustic": "The inset lies inside the mirrored light: radiance stored at the mirror is nearly right there, "
    "and connecting to it varies less than replaying the whole way to the window. ",
}


def ratio(a: Arrays, scene: str, other: str, limit: float) -> criteria.Outcome:
    """MAPE of the hybrid shift over another renderer's."""
    return criteria.ratio_below(*realtime.paired(a[f"{scene}.hybrid.error"], a[f"{scene}.{other}.error"]), limit)


def bias(a: Arrays, scene: str) -> str:
    """How far the mean image of ReSTIR GI is off."""
    ratios = a[f"{scene}.ReSTIR GI.mean"]
    return f"ReSTIR GI's mean: {ratios.mean() - 1:+.1%} (SE {ratios.std(ddof=1) / np.sqrt(len(ratios)):.1%})."


def draw(a: Arrays) -> "Picture":
    """One scene as an image, and MAPE in all of them."""
    picture, axes = style.panels(1, 2, width=5.0, height=3.2)
    _strips(axes[0, 0], a, "glossy_cornell")
    _bars(axes[0, 1], a)
    return picture


NAMES = {
    PT: "path tracing, equal rays",
    "equal time": "path tracing, equal time",
    "ReSTIR GI": "ReSTIR GI",
    "hybrid": "ReSTIR PT",
}
LOOKS: dict[str, dict[str, Any]] = {
    PT: {"color": "#E69F00", "hatch": ""},
    "equal time": {"color": "#ffffff", "hatch": "//", "edgecolor": "#E69F00"},
    "ReSTIR GI": {"color": "#56B4E9", "hatch": ".."},
    "hybrid": {"color": "#0072B2", "hatch": ""},
}


def _strips(axis: "Axes", a: Arrays, scene: str) -> None:
    names = [name for name in NAMES if name != "equal time"]
    rows = [a[f"{scene}.reference"], *(a[f"{scene}.{name}.image"] for name in names)]
    high = 1.5 * a[f"{scene}.reference"].max()
    axis.imshow(np.repeat(np.stack(rows), 4, axis=0), vmin=0, vmax=high, aspect="auto", extent=(0, 128, len(rows), 0))
    axis.set_yticks(np.arange(len(rows)) + 0.5, ["reference", *(NAMES[name] for name in names)])
    axis.grid(visible=False)
    axis.set(xlabel="pixel of the inset", title=f"{scene}, frame {realtime.FRAMES} of a moving camera")


def _bars(axis: "Axes", a: Arrays) -> None:
    for k, (name, label) in enumerate(NAMES.items()):
        errors = [a[f"{scene}.{name}.error"] for scene in SCENES]
        x = np.arange(len(SCENES)) + 0.2 * (k - 1.5)
        spread = [1.96 * e.std(ddof=1) / np.sqrt(len(e)) for e in errors]
        axis.bar(x, [e.mean() for e in errors], 0.19, yerr=spread, label=label, error_kw={"lw": 0.8}, **LOOKS[name])
    axis.set_yscale("log")
    axis.set_ylim(0.05, 12)
    rays = {scene: a[f"{scene}.rays"] for scene in SCENES}
    labels = [f"{scene}\n{frame:.0f} rays,\n{tree:.1f} a tree" for scene, (frame, _, tree) in rays.items()]
    axis.set_xticks(np.arange(len(SCENES)), labels, fontsize=7.5)
    axis.grid(visible=False, axis="x")
    axis.set(ylabel="MAPE", title="Error of that frame (bars: 95%)")
    axis.legend(ncols=2, loc="upper right")


FIGURE = Figure(
    id="GRIS-F01",
    title="Path tracing, ReSTIR GI and ReSTIR PT in real time",
    world="flatland2d",
    source="[GRIS Fig. 1; 8.3, 9.3]",
    claims=("GRIS-F01",),
    conditions=(
        Conditions(
            ("GRIS-F01",),
            "[GRIS Fig. 1]",
            Setup("real time", "moving", "direct by ReSTIR DI", "a"),
            Setup("real time", "moving", "all", "b"),
            "being moved",
        ),
    ),
    presets={"quick": {"replicas": 32, "trees": 384}, "paper": {"replicas": 128, "trees": 1536}},
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)
