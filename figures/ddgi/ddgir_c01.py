"""DDGI resampling Sec. 3.2: probes without direct light at the second vertex make the image too dark.

The room behind a door that is ajar, seen whole.  Secondary queries of augmented probes (Eq. 5) and of original ones
(Eq. 4), without attenuation and without gamma; direct light of x_1 is exact.  What the original probes lack is compared
with the light that reaches x_2 straight from the lamp, exactly.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims import criteria
from figures.claims.figure import Arrays, Claim, Conditions, Figure, Setup
from figures.experiments.volumes import (
    along_view,
    arriving,
    at_second,
    direct,
    indirect,
    seen,
    view,
    volume,
)
from figures.report import style
from restir_ref.chance import Live
from restir_ref.transport.cache.leaving import Cache
from restir_ref.transport.cache.rules import AUGMENTED, ORIGINAL

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture

ROOM = "FS3"
RULES = {"augmented": AUGMENTED, "original": ORIGINAL}
LABELS = {"augmented": "augmented probes, Eq. 5", "original": "probes without direct light, Eq. 4"}

PARTS = (
    "FS3, image by original probes",
    "FS3, what is lacking / direct light at the second vertex",
    "FS3, the same ratio by spacing",
)
ENOUGH = 16
"""Replicas."""

NOISY = "Light through the slit is rare, and eight replicas of few rays do not tell: the paper preset does."


def chunks(preset: Any) -> Sequence[Any]:
    """One per spacing: both volumes serve all points."""
    return [{"per_unit": each} for each in preset["spacings"]]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """All light by either rule, its truth, and the direct light of x_2; (replicas, pixels) each."""
    chance, per_unit, rows = Live(rng), chunk["per_unit"], []
    s = view(ROOM).setting.scene
    for _ in range(preset["replicas"]):
        x = seen(ROOM, chance.uniform((preset["pixels"],)))
        rays, near = arriving(s, x, preset["rays"], chance), direct(ROOM, x.v)
        row = {"truth": near + indirect(ROOM, x.v), "second": rays.shown(direct(ROOM, rays.at.z)[None])}
        for name, rule in RULES.items():
            of = volume(ROOM, per_unit, rule, attenuation=0.0, tolerance=preset["tolerance"])
            row[name] = near + at_second(Cache(s, of, along_view(1 / per_unit)), rays, chance)
        rows.append(row)
    return {key: np.stack([row[key] for row in rows]) for key in rows[0]}


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """Arrays by name, (spacings, replicas, pixels)."""
    stacked = {key: np.stack([each[key] for each in results]) for key in results[0]}
    return {
        **stacked,
        "spacings": 1 / np.array(preset["spacings"], dtype=float),
        "per unit": np.array(preset["per_unit"]),
    }


def check(a: Arrays) -> list[Claim]:
    """The original's bias; what it lacks over the direct light of x_2."""
    image = {key: array.mean(axis=1) for key, array in judged(a).items()}
    dark = criteria.biased(image["original"] / image["truth"], 1, -1, -0.01)
    lacking = image["augmented"] - image["original"]
    bias = {name: float((image[name] / image["truth"] - 1).mean()) for name in RULES}
    shares = (a["augmented"] - a["original"]).mean(axis=(1, 2)) / a["second"].mean()
    lacked = [f"1/{1 / h:g}: {share:.2f}" for h, share in zip(a["spacings"], shares, strict=True)]
    told = f"Bias of the image {100 * bias['original']:+.1f} % by Eq. 4, {100 * bias['augmented']:+.1f} % by Eq. 5."
    reason = (
        f"{told} What is lacking is a tenth of the light that probes hold, and at this spacing they hold some percent "
        "too much, more so by Eq. 5, as light bounces off what probes before walls know.  So the ratio moves with "
        "spacing and tolerance, and is no criterion: the sentence says too dark, not by how much."
    )
    if len(lacking) < ENOUGH:
        return [Claim("DDGIR-C01", None, part, reason=NOISY) for part in PARTS]
    ratio = criteria.reported(criteria.ratio_interval(lacking, image["second"])[2])
    return [
        Claim("DDGIR-C01", dark, PARTS[0], reason=told),
        Claim("DDGIR-C01", ratio, PARTS[1], reason=reason),
        Claim("DDGIR-C01", criteria.reported(", ".join(lacked)), PARTS[2]),
    ]


def judged(a: Arrays) -> Arrays:
    """Arrays (replicas, pixels) at the spacing that is judged."""
    k = int(np.flatnonzero(np.isclose(1 / a["spacings"], a["per unit"]))[0])
    return {name: a[name][k] for name in (*RULES, "truth", "second")}


def draw(a: Arrays) -> "Picture":
    """The images; and what original probes lack."""
    picture, axes = style.panels(1, 2, width=4.6, height=3.0)
    left, right = axes[0]
    a = judged(a)
    for k, name in enumerate(RULES):
        left.plot(a[name].mean(axis=0), **style.nth(5 - 2 * k, label=LABELS[name]))
    left.plot(a["truth"].mean(axis=0), **style.look("truth"))
    right.plot((a["augmented"] - a["original"]).mean(axis=0), **style.nth(6, label="Eq. 5 less Eq. 4"))
    right.plot(a["second"].mean(axis=0), **style.look("truth", label="direct light at $x_2$, exact"))
    for axis, title in ((left, "FS3, all light"), (right, "What Eq. 4 lacks at $x_2$")):
        axis.set(xlabel="pixel", ylabel="radiance", title=title)
        axis.set_ylim(bottom=min(0, axis.get_ylim()[0]), top=1.3 * axis.get_ylim()[1])
        axis.legend(loc="upper right")
    return picture


FIGURE = Figure(
    id="DDGIR-C01",
    title="Probes without direct light at the second vertex",
    world="flatland2d",
    source="[DDGIR 3.2]",
    claims=("DDGIR-C01",),
    presets={
        "quick": {"per_unit": 8, "spacings": [4, 8], "pixels": 32, "rays": 64, "replicas": 8, "tolerance": 0.04},
        "paper": {
            "per_unit": 16,
            "spacings": [8, 16, 32],
            "pixels": 64,
            "rays": 256,
            "replicas": 16,
            "tolerance": 0.01,
        },
    },
    conditions=(
        Conditions(
            ("DDGIR-C01",),
            "Sec. 3.2",
            paper=Setup("one pass", "still", "all", "scenes of the paper"),
            ours=Setup("one pass", "still", "all", "FS3, the whole film"),
        ),
    ),
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)
