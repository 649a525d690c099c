"""MCMC 5.2.6: are mutations of light samples worth less than those of paths?  Under 64 lamps, direct and all light.

ReSTIR DI moves points over the lamps, in steps of their random numbers, ReSTIR PT moves x_c; both mutate five times
between temporal and spatial reuse, with the same cap and the same neighbours.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims import criteria
from figures.claims.figure import Arrays, Claim, Conditions, Figure, Setup
from figures.experiments.mutated import ARMS, ENOUGH, LOOP, View, chain, covariances, shown
from figures.report import style
from flatland2d.sensors import FILM
from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.integrals import Pixels, Reservoirs
from restir_ref.loop import REAL_TIME, WHOLE, random_in_row
from restir_ref.transport.baselines.light_mutations import MovingLights
from restir_ref.transport.baselines.restir_di import DEBIASED, direct_light
from restir_ref.transport.mutations import TwoRays
from restir_ref.transport.paths import first_hit

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture

SEEN = View("many_lights", FILM)
NONE, FIVE = "k = 0", "k = 5"
KINDS = ("ReSTIR DI", "ReSTIR PT")
PRESET = replace(LOOP, cap=REAL_TIME.cap)
"""M_c = 20 for both: the cap that ReSTIR DI has here."""


def chunks(preset: Any) -> Sequence[dict[str, Any]]:
    """Both renderers, without and with mutations, in parts."""
    return [
        {"kind": kind, "arm": arm, "part": part}
        for kind in KINDS
        for arm in (NONE, FIVE)
        for part in range(preset["parts"])
    ]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """Images (replicas, 128)."""
    render = {KINDS[0]: direct, KINDS[1]: everything}[chunk["kind"]]
    return {"images": render(chunk["arm"], preset["frames"], preset["replicas"], Live(rng))}


def everything(arm: str, frames: int, replicas: int, chance: Live) -> Array:
    """All light, by paths."""
    return shown(*chain(TwoRays(SEEN.tracer), ARMS[arm], frames, replicas, chance, loop=PRESET))


def direct(arm: str, frames: int, replicas: int, chance: Live) -> Array:
    """Direct light at new first hits in every frame."""
    t, n = SEEN.tracer, SEEN.sensor.n
    index, passes = np.arange(replicas * n), replace(WHOLE, mutation=ARMS[arm].between)
    X: Reservoirs | None = None
    before: list[Pixels] = []
    for _ in range(frames):
        v, _, T = first_hit(t, chance.uniform((t.sensor.numbers, len(index))), index % n)
        here = Pixels(MovingLights(t.scene, n, v, T), index)
        near = random_in_row(here.of, index, PRESET.neighbours, PRESET.radius, chance)  # type: ignore[arg-type]
        X = direct_light(here, near, DEBIASED["defensive"], chance, X, before, passes=passes)
        before = [here]
    return shown(X, before[0])  # type: ignore[arg-type]


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """Covariance of every image over the squared mean, (K,), by renderer and arm."""
    found: Arrays = {}
    rows = list(zip(chunks(preset), results, strict=True))
    for kind in KINDS:
        for arm in (NONE, FIVE):
            mine = [each["images"] for row, each in rows if (row["kind"], row["arm"]) == (kind, arm)]
            images = np.concatenate(mine)
            found[f"{kind}.{arm}"] = covariances(images) / images.mean() ** 2
    return found


def check(a: Arrays) -> list[Claim]:
    """The covariance that is left, of both; their intervals are apart or not."""
    part = "FS15: remaining covariance, DI and PT"
    if len(a[f"{KINDS[0]}.{NONE}"]) < ENOUGH:
        return [Claim("MCMC-A13", None, part, reason="Too few images.")]
    light, paths = (criteria.ratio_interval(a[f"{kind}.{FIVE}"], a[f"{kind}.{NONE}"]) for kind in KINDS)
    text = f"{light[2]} against {paths[2]}"
    outcome = criteria.Outcome(text, "intervals apart, that of DI above", light[0] > paths[1])
    return [Claim("MCMC-A13", outcome, part, criteria.Outcome(text, "apart, that of PT above", paths[0] > light[1]))]


def draw(a: Arrays) -> "Picture":
    """Covariances of both, without and with mutations."""
    picture, axes = style.panels(1, 1, width=5.0, height=3.2)
    axis = axes[0, 0]
    for number, (arm, name) in enumerate({NONE: "no mutations", FIVE: "5 mutations"}.items()):
        found = [a[f"{kind}.{arm}"] / a[f"{kind}.{NONE}"].mean() for kind in KINDS]
        spread = [1.96 * each.std(ddof=1) / np.sqrt(len(each)) for each in found]
        look: dict[str, Any] = {"color": style.COLOURS[number], "hatch": style.HATCHES[number]}
        place = np.arange(2) + 0.38 * (number - 0.5)
        axis.bar(place, [each.mean() for each in found], 0.36, yerr=spread, label=name, edgecolor=style.PAPER, **look)
    axis.set_xticks(range(2), ["ReSTIR DI,\ndirect light", "ReSTIR PT,\nall light"])
    axis.grid(visible=False, axis="x")
    axis.set(ylabel="relative covariance (bars: 95%)", title="64 lamps: covariance within 8 pixels")
    style.below(axis)
    return picture


FIGURE = Figure(
    id="MCMC-A13",
    title="Mutations of light samples and of paths",
    world="flatland2d",
    source="[MCMC 5.2.6]",
    claims=("MCMC-A13",),
    conditions=(
        Conditions(
            ("MCMC-A13",),
            "[MCMC 5.2.6]",
            Setup("real time", "still", "all", "a remark, without a figure"),
            Setup("real time", "still", "all", "FS15, its inset; ReSTIR DI has the direct light of it"),
        ),
    ),
    arm="arm",
    presets={
        "quick": {"frames": 4, "replicas": 10, "parts": 1},
        "paper": {"frames": 20, "replicas": 100, "parts": 2},
    },
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)
