"""GRIS Fig. 15: real-time frames of ten scenes, ReSTIR PT against path tracing, both with ReSTIR DI for direct light.

The last of twenty frames under a moving camera.  Both add the same direct light; path tracing renders the rest with
as many trees as cost at least the rays that ReSTIR PT spends on it.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims import criteria
from figures.claims.figure import Arrays, Claim, Conditions, Figure, Setup
from figures.experiments import realtime, split_light
from figures.experiments.flatland import TEN
from figures.experiments.references import reference
from figures.report import style
from restir_ref.metrics import mape

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture

PT, OURS = "path tracing", "ReSTIR PT"
RENDERERS = {OURS: split_light.indirect, PT: split_light.indirect_trees}
DIRECT = "direct by ReSTIR DI"
LEAST, LOW, HIGH = 0.10, 0.24, 0.75
"""Reduction in every scene, and the printed range, in which the median shall lie."""


def chunks(preset: Any) -> Sequence[dict[str, str]]:
    """Of every scene the direct light that both add, and both renderers of the rest."""
    return [{"scene": scene, **each} for scene in TEN for each in ({"light": DIRECT}, {"method": OURS}, {"method": PT})]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """Images of one part, and rays per pixel of those that are compared."""
    if "light" in chunk:
        return split_light.direct(chunk["scene"], preset[DIRECT], rng)
    return RENDERERS[chunk["method"]](chunk["scene"], preset[chunk["method"]], rng)


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
    """A reduction in every scene, and its median in the printed range; beside them their range, and at equal time."""
    found = reductions(a, "rays")
    worst = int(found.argmin())
    least = criteria.Outcome(f"{found[worst]:.3f} in {TEN[worst]}", f"≥ {LEAST:g}", bool(found[worst] >= LEAST))
    return [
        Claim("GRIS-F15", least, "least reduction of MAPE over ten scenes, equal rays"),
        Claim("GRIS-F15", criteria.between(np.median(found), LOW, HIGH), "median reduction over ten scenes"),
        Claim("GRIS-F15", criteria.reported(spread(found)), "range of reductions, equal rays"),
        Claim("GRIS-F15", criteria.reported(spread(reductions(a, "time"))), "range of reductions, equal time"),
    ]


def spread(found: Any) -> str:
    """Least and largest of reductions by scene, and which scenes are outside the printed range."""
    low, high = int(found.argmin()), int(found.argmax())
    outside = [f"{scene} {each:.2f}" for scene, each in zip(TEN, found, strict=True) if not LOW <= each <= HIGH]
    text = f"{found[low]:.2f} ({TEN[low]}) to {found[high]:.2f} ({TEN[high]})"
    return f"{text}; outside {LOW:g} to {HIGH:g}: {', '.join(outside) or 'none'}"


def reductions(a: Arrays, other: str) -> Any:
    """1 - MAPE of ReSTIR PT / MAPE of path tracing, (scene,)."""
    return 1 - a["restir"].mean(axis=1) / a[other].mean(axis=1)


def draw(a: Arrays) -> "Picture":
    """Reductions per scene, and the errors behind them."""
    picture, axes = style.panels(1, 2, width=5.0, height=3.6)
    left, right = axes[0]
    y = np.arange(len(TEN))[::-1]
    left.axvspan(LOW, HIGH, color=style.PALE, zorder=0, label="printed range")
    left.axvline(LEAST, color=style.INK, ls=":", marker="", lw=1, label="least")
    left.barh(y + 0.2, reductions(a, "rays"), 0.38, color=style.BLUE, label="equal rays")
    left.barh(
        y - 0.2, reductions(a, "time"), 0.38, color=style.PAPER, edgecolor=style.BLUE, hatch="//", label="equal time"
    )
    left.set_yticks(y, TEN)
    left.grid(visible=False, axis="y")
    left.set_xlim(min(0, reductions(a, "time").min() - 0.02), 1)
    left.set(xlabel="reduction of MAPE", title="ReSTIR PT against path tracing")
    style.below(left, ncols=4)
    for name, dy, look in (
        ("rays", 0.1, style.look("path tracing", ls="", label="path tracing, equal rays")),
        ("restir", -0.1, style.look("ReSTIR PT", ls="")),
    ):
        e = a[name]
        spread = 1.96 * e.std(axis=1, ddof=1) / np.sqrt(e.shape[1])
        right.errorbar(e.mean(axis=1), y + dy, xerr=spread, markevery=1, **look)
    right.set_xscale("log")
    right.set_yticks(y, [f"{a['rays_ours'][k]:.0f} / {a['rays_tree'][k]:.1f}" for k in range(len(TEN))])
    right.set(xlabel="MAPE of the whole image (bars: 95%)", ylabel="rays: our frame / a tree", title="Errors")
    style.below(right, ncols=2)
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
            "[GRIS Fig. 15; 9.3]",
            Setup("real time", "moving", "direct by ReSTIR DI", "whole images of large scenes, equal time"),
            Setup("real time", "moving", "direct by ReSTIR DI", "insets of FS1 to FS10, equal rays"),
        ),
    ),
    arm="method",
    presets={
        "quick": {DIRECT: 16, OURS: 16, PT: 192},
        "paper": {DIRECT: 128, OURS: 128, PT: 1536},
    },
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)
