"""GRIS Fig. 12: shifts decided per sampled lobe, against one roughness for the whole material.

The floor is Lambert under a sharp coat.  One number must mistreat one of the two: their average lets the
coat reconnect, the glossiest lobe makes the base replay.  The last of twenty frames of a moving camera is judged, by
the indirect light in it, which is all that shifts share.
"""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims import criteria
from figures.claims.figure import Arrays, Claim, Conditions, Figure, Setup
from figures.experiments import corners, realtime, split_light
from figures.experiments.realtime import Method
from figures.experiments.references import INDIRECT, reference
from figures.experiments.split_light import IndirectIntegrals
from figures.experiments.views import HYBRID, view
from figures.report import style
from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.integrals import Pixels
from restir_ref.metrics import rel_mse
from restir_ref.restir import initial
from restir_ref.transport.materials import Table
from restir_ref.transport.paths import Tracer

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture

SCENE, DIRECT = "clear_coat", "direct light"
Summary = Callable[[Table], Array]


def averaged(table: Table) -> Array:
    """Mean roughness of a material's lobes, by their weights in choosing, (M,)."""
    return np.asarray((table.roughness.reshape(-1, table.L) * table.weight.T).sum(axis=1))


def glossiest(table: Table) -> Array:
    """Roughness of the glossiest lobe, (M,)."""
    return np.asarray(np.where(table.weight.T > 0, table.roughness.reshape(-1, table.L), np.inf).min(axis=1))


@dataclass(frozen=True)
class OneRoughness:
    """Indirect light whose shifts see one roughness per material; lobes scatter as before."""

    summary: Summary

    def __call__(self, t: Tracer) -> IndirectIntegrals:
        """The integrals of a tracer."""
        table, r = t.scene.materials, self.summary(t.scene.materials)
        one = replace(table, roughness=np.repeat(r, table.L), roughest=r)
        return IndirectIntegrals(replace(t, scene=replace(t.scene, materials=one)))


INTEGRALS: Mapping[str, Callable[[Tracer], IndirectIntegrals]] = MappingProxyType(
    {"per lobe": IndirectIntegrals, "averaged": OneRoughness(averaged), "glossiest": OneRoughness(glossiest)}
)


def chunks(preset: Any) -> Sequence[dict[str, str]]:
    """One per way to judge; and direct light, which is the same in all of them."""
    return [*({"rule": rule} for rule in INTEGRALS), {"light": DIRECT}]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """Images of one way to judge roughness, and how many vertices its shifts replay; or images of direct light."""
    if "light" in chunk:
        return split_light.direct(SCENE, preset[DIRECT], rng)
    integrals = INTEGRALS[chunk["rule"]]
    arrays = realtime.moved(Method(HYBRID, integrals), SCENE, preset["frames"], rng)
    return arrays | {"replayed": replayed(integrals, preset["shifts"], rng)}


def replayed(integrals: Callable[[Tracer], IndirectIntegrals], replicas: int, rng: np.random.Generator) -> Array:
    """Vertices that a shift of an initial sample traces, mean of every replica, (replicas,)."""
    of = integrals(view(SCENE, HYBRID, Counter()).tracer)
    X = initial(Pixels(of, np.arange(replicas * of.n)), Live(rng))
    traced = np.where(X.x.c > 0, X.x.c - 1, X.x.k) * (X.W > 0)
    return np.asarray(traced.reshape(replicas, -1).sum(axis=1) / (X.W > 0).reshape(replicas, -1).sum(axis=1))


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """Images, rays and replayed vertices by "rule.name"; direct light; references of indirect and of all light."""
    *parts, direct = results
    named = zip(INTEGRALS, parts, strict=True)
    arrays = {f"{rule}.{name}": each for rule, part in named for name, each in part.items()}
    references = {"indirect": reference(SCENE, INDIRECT).mean, "all": reference(SCENE).mean}
    return arrays | references | {"direct": direct["images"]}


def check(a: Arrays) -> list[Claim]:
    """Noise against both numbers; replayed vertices against the glossiest lobe, for the average replays nothing."""
    claims = []
    for other in ("averaged", "glossiest"):
        noise = errors(a, "per lobe"), errors(a, other)
        part = f"relMSE of indirect light, per lobe / {other}"
        all_light = criteria.ratio_interval(whole(a, "per lobe"), whole(a, other))[2]
        claims.append(judged(noise, part, f"With direct light by ReSTIR DI in the image it is {all_light}."))
    length = a["per lobe.replayed"], a["glossiest.replayed"]
    claims.append(judged(length, "replayed vertices, per lobe / glossiest"))
    return [*claims, *(Claim("GRIS-F12", criteria.reported(text), part, reason=why) for part, text, why in beside(a))]


def judged(pair: tuple[Array, Array], part: str, caveat: str = "") -> Claim:
    """Less by a tenth."""
    more = criteria.ratio_above(*pair, 1)
    return Claim("GRIS-F12", criteria.ratio_below(*pair, 0.9), part, counter=more, caveat=caveat)


def errors(a: Arrays, rule: str) -> Array:
    """relMSE of the indirect light in every frame, (R,)."""
    return rel_mse(a[f"{rule}.images"], a["indirect"])


def beside(a: Arrays) -> list[tuple[str, str, str]]:
    """Reported: part, text and reason of whole images, and of the vertices that the average replays."""
    own, *others = (whole(a, rule) for rule in INTEGRALS)
    light = rel_mse(a["direct"] + a["indirect"], a["all"]).mean() / rel_mse(whole_light(a), a["all"]).mean()
    why = f"Direct light by ReSTIR DI is {light:.0%} of this error: the lamp mirrored in the coat."
    ratios = [
        (f"relMSE of the whole image, per lobe / {name}", criteria.ratio_interval(own, other)[2], why)
        for name, other in zip(tuple(INTEGRALS)[1:], others, strict=True)
    ]
    length = " and ".join(f"{a[f'{rule}.replayed'].mean():.2f}" for rule in ("per lobe", "averaged"))
    return [*ratios, ("replayed vertices, per lobe and averaged", length, AVERAGE)]


AVERAGE = "The average is rough, so that everything reconnects at x_2: of a shifted path y_1 alone is traced."


def whole_light(a: Arrays, rule: str = "per lobe") -> Array:
    """Images with direct light, (R, n)."""
    return np.add(*realtime.paired(a[f"{rule}.images"], a["direct"]))


def whole(a: Arrays, rule: str) -> Array:
    """relMSE of images with direct light, (R,)."""
    return rel_mse(whole_light(a, rule), a["all"])


LOOKS: Mapping[str, Mapping[str, Any]] = MappingProxyType(
    {rule: style.nth(k, marker="", label=rule) for k, rule in enumerate(INTEGRALS)}
)


def draw(a: Arrays) -> "Picture":
    """Error per pixel, and replayed vertices."""
    picture, axes = style.panels(1, 2, width=4.2, height=3.0)
    left, right = axes[0]
    for rule in INTEGRALS:
        error = corners.relative(a[f"{rule}.images"], a["indirect"]).mean(axis=0)
        smooth = np.convolve(error, np.ones(9) / 9, mode="valid")
        left.semilogy(np.arange(4, 124), smooth, **LOOKS[rule])
    left.set(xlabel="pixel of the inset", ylabel="relative squared error, 9 pixels", title="Indirect light, clear coat")
    left.legend()
    for k, rule in enumerate(INTEGRALS):
        look = {"color": LOOKS[rule]["color"], "edgecolor": style.PAPER, "hatch": style.HATCHES[k]}
        right.bar(rule, a[f"{rule}.replayed"].mean(), **look)
    right.set(
        xlabel="roughness by which vertices are judged", ylabel="vertices replayed per shift", title="Length of replay"
    )
    right.grid(axis="x", visible=False)
    return picture


FIGURE = Figure(
    id="GRIS-F12",
    title="Shifts per sampled lobe",
    world="flatland2d",
    source="[GRIS Fig. 12; 7.5, 7.6, 9.3]",
    claims=("GRIS-F12",),
    conditions=(
        Conditions(
            ("GRIS-F12",),
            "[GRIS Fig. 12; 9.3]",
            Setup("real time", "moving", "direct by ReSTIR DI", "a floor of several lobes"),
            Setup("real time", "moving", "indirect", "floor under a clear coat (FS10); whole images beside it"),
            "What is compared shares indirect light only; ReSTIR DI adds the same noise to all.",
        ),
    ),
    arm="rule",
    presets={
        "quick": {"frames": 64, DIRECT: 32, "shifts": 64},
        "paper": {"frames": 512, DIRECT: 128, "shifts": 512},
    },
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)
