"""GRIS Fig. 15: real-time frames of ten scenes, ReSTIR PT against path tracing, both with ReSTIR DI for direct light.

The last of twenty frames under a moving camera.  Both add the same direct light; path tracing renders the rest with
as many trees as cost at least the rays that ReSTIR PT spends on it.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from figures import criteria, realtime, split_light, style
from figures.figure import Arrays, Claim, Conditions, Figure, Setup
from figures.flatland import TEN
from figures.references import reference
from restir_ref.metrics import mape

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture

PARTS = ("direct", "indirect", "trees")
LEAST, LOW, HIGH = 0.10, 0.24, 0.75
"""Reduction in every scene, and the printed range, in which the median shall lie."""


def chunks(preset: Any) -> Sequence[dict[str, str]]:
    """One per scene and part of the light."""
    return [{"scene": scene, "part": part} for scene in TEN for part in PARTS]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """Images of one part, and rays per pixel of those that are compared."""
    make = {"direct": split_light.direct, "indirect": split_light.indirect, "trees": split_light.indirect_trees}
    return make[chunk["part"]](chunk["scene"], preset[chunk["part"]], rng)


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """MAPE of whole images, (scene, replica) each, rays per pixel and trees at equal rays, (scene,)."""
    parts, rows = iter(results), []
    for scene in TEN:
        truth = reference(scene).mean
        direct, ours, trees = next(parts), next(parts), next(parts)
        rest = {
            "restir": ours["images"],
            "rays": realtime.at_equal_rays(trees, float(ours["rays"])),
            "time": realtime.at_equal_time(trees, scene),
        }
        both = {name: realtime.paired(direct["images"], each) for name, each in rest.items()}
        errors = {name: mape(light + other, truth) for name, (light, other) in both.items()}
        rows.append({**errors, "rays_ours": ours["rays"], "rays_tree": trees["rays"]})
    return {name: np.stack([np.asarray(row[name]) for row in rows]) for name in rows[0]}


def check(a: Arrays) -> list[Claim]:
    """A reduction in every scene, and its median in the printed range."""
    found = reductions(a, "rays")
    worst = int(found.argmin())
    part = f"least reduction of MAPE, {TEN[worst]}"
    return [
        Claim("GRIS-F15", criteria.Outcome(float(found[worst]), f"≥ {LEAST:g}", bool(found[worst] >= LEAST)), part),
        Claim("GRIS-F15", criteria.between(np.median(found), LOW, HIGH), "median reduction over ten scenes"),
    ]


def reductions(a: Arrays, other: str) -> Any:
    """1 - MAPE of ReSTIR PT / MAPE of path tracing, (scene,)."""
    return 1 - a["restir"].mean(axis=1) / a[other].mean(axis=1)


def draw(a: Arrays) -> "Picture":
    """Reductions per scene, and the errors behind them."""
    picture, axes = style.panels(1, 2, width=5.0, height=3.6)
    left, right = axes[0]
    y = np.arange(len(TEN))[::-1]
    left.axvspan(LOW, HIGH, color="#dddddd", zorder=0, label="printed range")
    left.axvline(LEAST, color="k", ls=":", marker="", lw=1, label="least")
    left.barh(y + 0.2, reductions(a, "rays"), 0.38, color="#0072B2", label="equal rays")
    left.barh(
        y - 0.2, reductions(a, "time"), 0.38, color="#ffffff", edgecolor="#0072B2", hatch="//", label="equal time"
    )
    left.set_yticks(y, TEN)
    left.grid(visible=False, axis="y")
    left.set_xlim(min(0, reductions(a, "time").min() - 0.02), 1)
    most = (a["rays"].mean(axis=1) / a["restir"].mean(axis=1)).max()
    left.set(xlabel="reduction of MAPE", title=f"Errors at equal rays: up to {most:.1f} times lower")
    left.legend(loc="upper center", bbox_to_anchor=(0.5, -0.16), ncols=4)
    for name, label, dy, look in (
        ("rays", "path tracing, equal rays", 0.1, {"color": "#E69F00", "marker": "s"}),
        ("restir", "ReSTIR PT", -0.1, {"color": "#0072B2", "marker": "o"}),
    ):
        e = a[name]
        spread = 1.96 * e.std(axis=1, ddof=1) / np.sqrt(e.shape[1])
        right.errorbar(e.mean(axis=1), y + dy, xerr=spread, ls="", label=label, markevery=1, **look)
    right.set_xscale("log")
    right.set_yticks(y, [f"{a['rays_ours'][k]:.0f} / {a['rays_tree'][k]:.1f}" for k in range(len(TEN))])
    right.set(xlabel="MAPE of the whole image (bars: 95%)", ylabel="rays: our frame / a tree", title="Errors")
    right.legend(loc="upper center", bbox_to_anchor=(0.5, -0.16), ncols=2)
    return picture


FIGURE = Figure(
    id="GRIS-F15",
    title="Real-time frames of ten scenes",
    world="flatland2d",
    source="[GRIS Fig. 15; 9.3]",
    claims=("GRIS-F15",),
    conditions=(
        Conditions(
            ("GRIS-F15",),
            "[GRIS Fig. 15]",
            Setup("real time", "moving", "direct by ReSTIR DI", "a"),
            Setup("real time", "moving", "direct by ReSTIR DI", "b"),
            "",
        ),
    ),
    presets={
        "quick": {"direct": 32, "indirect": 32, "trees": 384},
        "paper": {"direct": 128, "indirect": 128, "trees": 1536},
    },
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)
