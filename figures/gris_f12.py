"""GRIS Fig. 12: shifts decided per sampled lobe, against one roughness for the whole material.

The floor is Lambert under a sharp coat.  One number must mistreat one of the two: their average lets the
coat reconnect, the glossiest lobe makes the base replay.
"""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from figures import criteria, offline, style
from figures.figure import Arrays, Claim, Conditions, Figure, Setup
from figures.flatland import HYBRID, view
from figures.flatland import offline as one_frame
from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.integrals import Pixels
from restir_ref.metrics import rel_mse
from restir_ref.restir import initial
from restir_ref.transport.materials import Table
from restir_ref.transport.paths import Tracer
from restir_ref.transport.restir_pt import PathIntegrals

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture

SCENE = "clear_coat"
Summary = Callable[[Table], Array]


def averaged(table: Table) -> Array:
    """Mean roughness of a material's lobes, by their weights in choosing, (M,)."""
    return np.asarray((table.roughness.reshape(-1, table.L) * table.weight.T).sum(axis=1))


def glossiest(table: Table) -> Array:
    """Roughness of the glossiest lobe, (M,)."""
    return np.asarray(np.where(table.weight.T > 0, table.roughness.reshape(-1, table.L), np.inf).min(axis=1))


@dataclass(frozen=True)
class OneRoughness:
    """Path integrals whose shifts see one roughness per material; lobes scatter as before."""

    summary: Summary

    def __call__(self, t: Tracer) -> PathIntegrals:
        """The integrals of a tracer."""
        table, r = t.scene.materials, self.summary(t.scene.materials)
        one = replace(table, roughness=np.repeat(r, table.L), roughest=r)
        return PathIntegrals(replace(t, scene=replace(t.scene, materials=one)))


INTEGRALS: Mapping[str, Callable[[Tracer], PathIntegrals]] = MappingProxyType(
    {"per lobe": PathIntegrals, "averaged": OneRoughness(averaged), "glossiest": OneRoughness(glossiest)}
)


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """Independent images of one way to judge roughness, and how many vertices its shifts replay."""
    integrals = INTEGRALS[chunk["method"]]
    arrays = offline.render(offline.Method(one_frame, HYBRID, integrals), SCENE, preset["count"], rng)
    return arrays | {"replayed": replayed(integrals, preset["replicas"], rng)}


def replayed(integrals: Callable[[Tracer], PathIntegrals], replicas: int, rng: np.random.Generator) -> Array:
    """Vertices that a shift of an initial sample traces, mean of every replica, (replicas,)."""
    of = view(SCENE, HYBRID, Counter(), integrals=integrals)
    X = initial(Pixels(of, np.arange(replicas * of.n)), Live(rng))
    traced = np.where(X.x.c > 0, X.x.c - 1, X.x.k) * (X.W > 0)
    return np.asarray(traced.reshape(replicas, -1).sum(axis=1) / (X.W > 0).reshape(replicas, -1).sum(axis=1))


def chunks(preset: Any) -> Sequence[dict[str, str]]:
    """One per way to judge."""
    return offline.chunks([SCENE], tuple(INTEGRALS))


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """All images, rays, replayed vertices, and the reference."""
    return offline.combine([SCENE], tuple(INTEGRALS), results)


def check(a: Arrays) -> list[Claim]:
    """Per lobe against both numbers: noise and replayed vertices."""
    claims = []
    for other in ("averaged", "glossiest"):
        noise = errors(a, "per lobe"), errors(a, other)
        length = a[f"{SCENE}.per lobe.replayed"], a[f"{SCENE}.{other}.replayed"]
        for part, pair in (("relMSE", noise), ("replayed vertices", length)):
            less, more = criteria.ratio_below(*pair, 0.9), criteria.ratio_above(*pair, 1)
            why = "" if less.passed else REASONS[other]
            claims.append(Claim("GRIS-F12", less, f"{part}, per lobe / {other}", counter=more, reason=why))
    return claims


REASONS = {
    "averaged": "The average is rough, so that everything reconnects: nothing is replayed, and the coat, whose light "
    "is a distant lamp, does better with it, as in GRIS-F13b.",
    "glossiest": "The whole floor replays: paths are longer, but replaying the matte base costs little noise here.",
}


def errors(a: Arrays, method: str) -> Array:
    """relMSE of every frame, (R,)."""
    return rel_mse(a[f"{SCENE}.{method}.images"], a[f"{SCENE}.reference"])


def draw(a: Arrays) -> "Picture":
    """Error per pixel, and replayed vertices."""
    picture, axes = style.panels(1, 2, width=4.0, height=3.0)
    truth = a[f"{SCENE}.reference"]
    for method in INTEGRALS:
        error = ((a[f"{SCENE}.{method}.images"] / truth - 1) ** 2).mean(axis=0)
        axes[0, 0].semilogy(np.convolve(error, np.ones(9) / 9, mode="valid"), label=method)
    axes[0, 0].set(xlabel="pixel of the inset", ylabel="relative squared error of a frame", title="Clear-coat floor")
    axes[0, 0].legend()
    heights = [a[f"{SCENE}.{method}.replayed"].mean() for method in INTEGRALS]
    axes[0, 1].bar(list(INTEGRALS), heights, color=style.COLOURS[: len(heights)], edgecolor="k")
    axes[0, 1].set(ylabel="vertices replayed per shift", title="Length of replay")
    axes[0, 1].grid(axis="x", visible=False)
    return picture


FIGURE = Figure(
    id="GRIS-F12",
    title="Shifts per sampled lobe",
    world="flatland2d",
    source="[GRIS Fig. 12; 7.5, 7.6]",
    claims=("GRIS-F12",),
    conditions=(
        Conditions(
            ("GRIS-F12",),
            "[GRIS Fig. 12]",
            Setup("real time", "moving", "direct by ReSTIR DI", "a"),
            Setup("offline", "still", "all", "b"),
            "being moved",
        ),
    ),
    presets={"quick": {"count": 256, "replicas": 64}, "paper": {"count": 4096, "replicas": 512}},
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)
