"""GRIS 6.5: averaging offline frames converges, for they are independent and their contributions bounded.

In every pass  p_hat(Y) W_Y = sum w_i <= sum_j c_j p_hat_j(X_j) W_j / c_R  [GRIS Eq. 40], from the inputs at hand.
The first inputs are bounded as well: all leaves of a tree together are at most  L_e (1 + 2 sum_k a^k), k = 1 .. depth,
for light and BSDF samples give at most L_e each behind k vertices that return a share a of what their lobe samples.
"""

from collections import Counter
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims import criteria
from figures.claims.figure import Arrays, Claim, Conditions, Figure, Setup
from figures.experiments.references import reference
from figures.experiments.rendering import COLUMNS, means
from figures.experiments.views import HYBRID, view
from figures.report import style
from restir_ref.batch import Array
from restir_ref.chance import Chance, Live
from restir_ref.integrals import Pixels, target
from restir_ref.loop import OFFLINE, spread_in_row
from restir_ref.restir import initial, shade, spatial
from restir_ref.transport.paths import Tracer

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture

SCENES = ("cornell", "glossy_cornell")


def chunks(preset: Any) -> Sequence[dict[str, Any]]:
    """Blocks of frames of both scenes."""
    return [{"scene": scene, "block": k} for scene in SCENES for k in range(preset["blocks"])]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """Independent hybrid frames (count, 128), and the largest share of its bound that a contribution reached."""
    of, chance = view(chunk["scene"], HYBRID, Counter()), Live(rng)
    at_once = COLUMNS // of.n
    parts = [frames(Pixels(of, np.arange(at_once * of.n)), chance) for _ in range(preset["count"] // at_once)]
    images = np.concatenate([image.reshape(-1, of.n) for image, _, _ in parts])
    shares, first = (np.array(max(part[k] for part in parts)) for k in (1, 2))
    return {"images": images, "share": shares, "first": first / bound_of_trees(of.tracer)}


def bound_of_trees(t: Tracer) -> float:
    """L_e (1 + 2 sum_k a^k), a the largest colour over probability of a lobe."""
    table = t.scene.materials
    P = table.weight.T.reshape(-1)
    a = float(np.max(table.colour.max(axis=0)[P > 0] / P[P > 0]))
    return float(t.scene.emission.max() * (1 + 2 * sum(a**k for k in range(1, t.depth + 1))))


def frames(here: Pixels, chance: Chance) -> tuple[Array, float, float]:
    """One offline frame per replica, the largest p_hat(Y) W_Y over its bound in any pass, and the largest first one."""
    X, share = initial(here, chance, OFFLINE.trees), 0.0
    first = float(np.max(target(here, X.x) * X.W))
    for _ in range(OFFLINE.rounds):
        near = spread_in_row(here.of, here.index, OFFLINE.neighbours, OFFLINE.radius, chance)  # type: ignore[arg-type]
        inputs = target(here, X.x) * X.W
        bound = (inputs + sum(inputs[each.index] * X.c[each.index] for each in near) / X.c) * (1 + 1e-12)
        X = spatial(X, here, near, chance)
        share = max(share, float(np.max(target(here, X.x) * X.W / np.where(bound > 0, bound, 1))))
    return np.asarray(shade(X, here).mean(axis=0)), share, first


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """Per scene: mean square error of means of T frames, (T,), and the largest share."""
    blocks, arrays = preset["blocks"], {}
    for k, scene in enumerate(SCENES):
        parts = results[k * blocks : (k + 1) * blocks]
        images = np.concatenate([part["images"] for part in parts])
        T = 2 ** np.arange(int(np.log2(len(images) // 8)) + 1)
        truth = reference(scene).mean
        arrays[f"{scene}.T"] = T
        arrays[f"{scene}.error"] = np.array([((means(images, int(t)) - truth) ** 2).mean() for t in T])
        arrays[f"{scene}.share"] = np.max([part["share"] for part in parts])
        arrays[f"{scene}.first"] = np.max([part["first"] for part in parts])
    return arrays


def check(a: Arrays) -> list[Claim]:
    """Slope and bound, per scene."""
    claims = []
    for scene in SCENES:
        slope = criteria.slope_within(a[f"{scene}.T"], a[f"{scene}.error"], -1, 0.07)
        bound = criteria.below(a[f"{scene}.share"], 1)
        claims += [
            Claim("GRIS-C09", slope, f"{scene}: mean square error over frames"),
            Claim("GRIS-C09", bound, f"{scene}: largest contribution over its bound"),
            Claim("GRIS-C09", criteria.below(a[f"{scene}.first"], 1), f"{scene}: largest first one over its bound"),
            Claim("GRIS-A06", slope, f"{scene}: mean square error over frames"),
        ]
    return claims


def draw(a: Arrays) -> "Picture":
    """Error over frames, beside 1/T."""
    picture, axes = style.panels(1, 1, width=7.0, height=4.0)
    for k, scene in enumerate(SCENES):
        look = style.nth(k, label=scene.replace("_", " "), markevery=1)
        axes[0, 0].loglog(a[f"{scene}.T"], a[f"{scene}.error"], **look)
    T = a[f"{SCENES[0]}.T"]
    axes[0, 0].loglog(T, a[f"{SCENES[0]}.error"][0] / T, color=style.INK, lw=1, ls=":", marker="", label="1 / T")
    axes[0, 0].set(xlabel="independent offline frames T", ylabel="mean square error", title="Hybrid shift, offline")
    axes[0, 0].legend()
    return picture


FIGURE = Figure(
    id="GRIS-C09",
    title="Averaging offline frames",
    world="flatland2d",
    source="[GRIS 6.5, 8.3; Eq. 40]",
    claims=("GRIS-C09", "GRIS-A06"),
    conditions=(
        Conditions(
            ("GRIS-C09", "GRIS-A06"),
            "6.5; 8.3",
            Setup("offline", "still", "all", "no view: offline rendering in general"),
            Setup("offline", "still", "all", "the insets of the rough and the glossy Cornell box, hybrid shift"),
        ),
    ),
    presets={"quick": {"blocks": 2, "count": 512}, "paper": {"blocks": 8, "count": 2048}},
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)
