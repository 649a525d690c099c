"""GPT Fig. 9 in space: positivization, where light from both sides meets.

The rack of flatland (FS7), drawn out to bars: seven of them, a lamp on either wall, and the same camera above, which
moves as in the caption; the crop is the top of the bar next to the middle, where two thirds of either lamp are seen,
and follows what its centre sees.  The floor in the middle of the film, tried first, sees none of one lamp.  History
that lies in the square of a pixel or pair stays where it is.  Both arms reuse by the same preset: a pair has one
reservoir for either sign, or one for both.  Both are unbiased, so that the variance of dx and dy over replicas is their
squared error.  The last of as many frames is told as are three times the cap of confidence.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims import criteria
from figures.claims.figure import Arrays, Claim, Conditions, Figure, Setup
from figures.experiments.following import followed, in_place, views_of
from figures.experiments.gradients import ADAPTIVE, with_restir
from figures.experiments.replicas import told
from figures.experiments.scenewise import in_enough
from figures.gradient.gpt_f09 import error
from figures.report import style
from restir_ref.chance import Live
from restir_ref.gradient_loop import GRADIENT, SAME_SIGN, UNSIGNED, GradientPreset, Partners, View
from restir_ref.transport.scene import scene
from tracer3d.scenes import Setting, grey, matte
from tracer3d.shapes import box, quad, rectangle, room
from tracer3d.space import SOLID

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture

ARMS: Mapping[str, Partners] = MappingProxyType({"same sign": SAME_SIGN, "one reservoir": UNSIGNED})
LONG = 3 * GRADIENT.pairs.cap
"""Frames: three times the cap."""

VIEW = "rack"


def rack() -> Setting:
    """Seven bars in a room, between two upright lamps on its left and right walls, seen from above."""
    feet = [rectangle((0.15 + 0.1 * i, 0.2), (0.18 + 0.1 * i, 0.8), 0.3) for i in range(7)]
    bars = [facet for foot in feet for facet in box(foot, 0.3, 1)]
    left = [(0.005, 0.5, 0.3), (0.005, 0.8, 0.3), (0.005, 0.8, 0.7), (0.005, 0.5, 0.7)]
    right = [(1 - x, y, z) for x, y, z in reversed(left)]
    lamps = [facet for corners in (left, right) for facet in quad(corners, 0, grey(8.0))]
    inside = scene(SOLID, [matte(grey(0.5)), matte(grey(0.7))], [*room(0), *bars, *lamps])
    return Setting(inside, (0.5, 0.95, 0.5), (0.5, 0.0, 0.5), (1225, 508), half=0.6, up=(0.0, 0.0, -1.0))


def chunks(preset: Any) -> Sequence[dict[str, Any]]:
    """One per kind of reuse and block of replicas."""
    return [{"reuse": name, "block": block} for name in ARMS for block in range(preset["blocks"])]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """The image and its differences, (replicas, n) each, and rays per pixel."""
    own, asked = replace(GRADIENT, partners=ARMS[chunk["reuse"]]), Counter[str]()
    views = moving(preset["side"], preset["frames"], own, asked)
    return with_restir(views, asked, preset["replicas"], Live(rng), own)


def moving(side: int, frames: int, own: GradientPreset, asked: Counter[str]) -> list[View]:
    """The frames of the moving camera, each after the one before, whose history stays where it is."""
    s = rack()
    return [in_place(view) for view in views_of(s, followed(s, side, frames), own, ADAPTIVE, asked)]


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """All blocks by "rack.reuse.name"; rays as their mean."""
    found: dict[str, list[Any]] = {}
    for at, part in zip(chunks(preset), results, strict=True):
        for key, each in part.items():
            found.setdefault(f"{VIEW}.{at['reuse']}.{key}", []).append(each)
    return {key: np.concatenate(parts) if parts[0].ndim else np.asarray(np.mean(parts)) for key, parts in found.items()}


def dearer(a: Arrays) -> float:
    """Rays of two reservoirs over those of one."""
    return float(a[f"{VIEW}.same sign.rays"] / a[f"{VIEW}.one reservoir.rays"])


def check(a: Arrays) -> list[Claim]:
    """Two reservoirs against one, at equal samples and at equal rays, by the limits of flatland."""
    ours, one = (error(a, arm, VIEW) for arm in ARMS)
    claims = []
    for equal, mine, limit in (("samples", ours, 0.7), ("rays", ours * dearer(a), 0.9)):
        part = f"in space, equal {equal}"
        claims.append(in_enough("GPT-F09", {"the bar": [(mine, one)]}, (limit, 1), part, FIRST))
        claims.append(told("GPT-F09", (mine, one), f"{part}, ratio"))
    return [*claims, Claim("GPT-F09", criteria.reported(dearer(a)), "in space, rays of two reservoirs / one")]


FIRST = (
    "The view was changed once, after a run: the floor in the middle of the film is not lit from two sides, it sees "
    "none of the left lamp and a tenth of the right one, and 64 replicas left it open (0.55, 95% 0.10 to 3.2, at equal "
    "samples)."
)


LOOKS: Mapping[str, int] = MappingProxyType({"same sign": 0, "one reservoir": 2})
"""As in GPT-F09, which has a third arm between them."""


def draw(a: Arrays) -> "Picture":
    """dx of one replica by either arm, and their errors at equal samples and at equal rays."""
    picture, axes = style.panels(1, 3, width=3.4, height=3.0)
    dx = {arm: a[f"{VIEW}.{arm}.dx"] for arm in ARMS}
    side = round(a[f"{VIEW}.same sign.primal"].shape[1] ** 0.5)
    high = float(np.quantile(abs(dx["one reservoir"][0]), 0.98))
    for axis, (arm, images) in zip(axes[0], dx.items(), strict=False):
        shown = axis.imshow(images[0].reshape(side, side - 1), vmin=-high, vmax=high, cmap="PuOr")
        axis.set(title=f"Rack in space: {arm}", xlabel="pair of pixels", ylabel="pixel")
        axis.grid(visible=False)
        picture.colorbar(shown, ax=axis, label="$I_{i+1} - I_i$, radiance", shrink=0.8)
    right = axes[0, 2]
    for k, arm in enumerate(ARMS):
        both = error(a, arm, VIEW).mean() * np.array([1, a[f"{VIEW}.{arm}.rays"] / a[f"{VIEW}.same sign.rays"]])
        n = LOOKS[arm]
        look = {"color": style.nth(n)["color"], "hatch": style.HATCHES[n], "edgecolor": style.PAPER}
        right.bar(np.arange(2) + 0.35 * (k - 0.5), both, 0.33, label=arm, **look)
    right.set_xticks([0, 1], ["equal samples", "equal rays"])
    right.set(xlabel="what is equal", ylabel="variance of dx and dy (radiance$^2$)", title="Mean over pairs, replicas")
    right.grid(axis="x", visible=False)
    style.below(right)
    return picture


FIGURE = Figure(
    id="GPT-F09-3D",
    title="Positivization, in space",
    world="tracer3d",
    source="[GPT Fig. 9; 4.4, 5.1]",
    claims=("GPT-F09",),
    conditions=(
        Conditions(
            ("GPT-F09",),
            "[GPT Fig. 9; 4.4]",
            Setup("real time", "moving", "all", "a metal rack under two lights"),
            Setup("real time", "moving", "all", "bars lit from both sides (FS7, drawn out)"),
        ),
    ),
    arm="reuse",
    presets={
        "quick": {"replicas": 2, "blocks": 1, "side": 6, "frames": 3},
        "paper": {"replicas": 32, "blocks": 2, "side": 12, "frames": LONG},
    },
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)
