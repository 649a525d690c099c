"""DDGI resampling Sec. 3.2: probes nearer to a light than surfaces are too bright, and attenuation makes up for it.

FS12.  On the left lamp, probe and table in line, one probe at a time: what it says of the table's direct light, over
the truth.  The plain ratio is that of distances, (s + b)/s, to the first power in flatland.  In the middle and on the
right a volume of all light: its irradiance on all that is seen, by the spacing of probes, and pixel by pixel for 4 per
unit, for which the room is made.
"""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims import criteria
from figures.claims.figure import Arrays, Claim, Conditions, Figure, Setup
from figures.experiments.volumes import at_first, direct, indirect, met, off_surface, seen, view, volume
from figures.experiments.withheld import withheld_where
from figures.report import style
from flatland2d.directions import MAPS
from restir_ref.batch import Array
from restir_ref.chance import Chance, Live
from restir_ref.transport.cache.grid import Grid
from restir_ref.transport.cache.leaving import Cache
from restir_ref.transport.cache.rules import AUGMENTED
from restir_ref.transport.cache.update import Updating, update
from restir_ref.transport.cache.volume import unlit
from restir_ref.transport.materials import Vertex
from restir_ref.transport.scene import Scene

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture

ROOM = "FS12"
SCALES: Mapping[str, float] = {"naive": 0.0, "attenuated": 1.0}
LAMP, TABLE, ACROSS = 0.46, 0.2, 0.4
"""Heights of lamp and table, and where both have their middle."""

VOLUME_RAYS = 1024
"""Of a probe and frame: the lamp is small."""

ALONE = 1.0
"""The spacing of a probe that stands alone: its boundary is farther away than the table."""


def chunks(preset: Any) -> Sequence[Any]:
    """The line; a volume per spacing and scale."""
    volumes = [{"per_unit": each, "scale": scale} for each in preset["spacings"] for scale in SCALES]
    return [{"line": preset["heights"]}, *volumes]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """E over the truth for every probe of the line (scales, frames, heights); or radiance and truth, (replicas, n)."""
    chance = Live(rng)
    if "line" in chunk:
        ratios = [[one_probe(h, scale, preset, chance) for h in chunk["line"]] for scale in SCALES.values()]
        return {"ratio": np.moveaxis(np.array(ratios), 1, 2)}
    s, scale, rows = view(ROOM).setting.scene, SCALES[chunk["scale"]], []
    of = volume(ROOM, chunk["per_unit"], AUGMENTED, scale, preset["tolerance"], VOLUME_RAYS)
    for _ in range(preset["replicas"]):
        x = seen(ROOM, chance.uniform((preset["pixels"],)))
        told = at_first(Cache(s, of, off_surface(1 / chunk["per_unit"])), x)
        rows.append((told, direct(ROOM, x.v) + indirect(ROOM, x.v)))
    told, truth = (np.stack(each) for each in zip(*rows, strict=True))
    x = met(ROOM, preset["points"], chance)
    everywhere = at_first(Cache(s, of, off_surface(1 / chunk["per_unit"])), x).sum()
    return {"told": told, "truth": truth, "everywhere": everywhere / (direct(ROOM, x.v) + indirect(ROOM, x.v)).sum()}


def silent(s: Scene, field: Any, v: Vertex, r: Array, chance: Chance) -> Array:
    """L+ = 0: direct light alone."""
    return np.zeros((s.C, len(r)))


def one_probe(height: float, scale: float, preset: Any, chance: Chance) -> Array:
    """What a probe above the table says of the direct light below it, over the truth; (frames,)."""
    s, x = view(ROOM).setting.scene, np.array([[ACROSS], [TABLE]])
    n = np.array([[0.0], [1.0]])
    empty = unlit(s, Grid((ACROSS, height), (ALONE, ALONE), (1, 1)), MAPS)
    how = Updating(silent, rays=preset["rays"], hysteresis=0.0, attenuation=scale)
    # direct light leaves the table as albedo / 2 times its irradiance
    table = Vertex(x, n, n, np.zeros(1, dtype=int), np.array([on_table(s)]), np.ones(1, dtype=bool))
    truth = direct(ROOM, table)[0] * 2 / s.materials.colour[0, 0]
    told = [update(empty, s, how, chance).irradiance(x, n, n, 0 * x)[0, 0] for _ in range(preset["frames"])]
    return np.asarray(np.array(told) / truth)


def on_table(s: Scene) -> int:
    """The table's top among the primitives."""
    return int(np.flatnonzero((abs(s.corners[:, 1] - TABLE) < 1e-9).all(axis=0))[0])


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """Arrays by spacing and scale."""
    found: Arrays = {"spacings": 1 / np.array(preset["spacings"], dtype=float), "heights": np.array(preset["heights"])}
    for chunk, result in zip(chunks(preset), results, strict=True):
        key = "line" if "line" in chunk else f"{chunk['per_unit']:g} {chunk['scale']}"
        found |= {f"{key} {name}": array for name, array in result.items()}
    return found


def biases(a: Arrays, scale: str) -> Array:
    """Relative bias of the irradiance of all that is seen, (spacings, replicas)."""
    keys = [f"{1 / h:g} {scale}" for h in a["spacings"]]
    return np.stack([a[f"{key} told"].mean(axis=1) / a[f"{key} truth"].mean(axis=1) - 1 for key in keys])


def predicted(heights: Array) -> Array:
    """(s + b) / s."""
    return (LAMP - TABLE) / (LAMP - heights)


TOLD = (
    "On what the scene's own eye sees, table and floor below the lamp. By how much attenuation overshoots depends on "
    "the surfaces that are asked: over all that is met by rays from anywhere it is less than half as much."
)


def by_spacing(h: Array, bias: Array) -> str:
    """Biases in words."""
    return ", ".join(f"1/{1 / each:g}: {100 * b:+.0f} %" for each, b in zip(h, bias, strict=True))


DISPUTED = (
    (
        "DDGIR-C02",
        "attenuated",
        (
            "primary queries are judged, and the paper attenuates for secondary ones (Sec. 3.2), along "
            "the path: these are still to be judged."
        ),
    ),
)
"""What a critic with the paper at hand holds to be the experiment's fault."""


def check(a: Arrays) -> list[Claim]:
    """The line's ratios; the volume's biases."""
    naive, attenuated = a["line ratio"].mean(axis=1)
    expected = predicted(a["heights"])
    apart = abs(naive / expected - 1).max()
    worst = attenuated[np.abs(attenuated - 1).argmax()]
    room = {scale: biases(a, scale) for scale in SCALES}
    plain, faded = (each.mean(axis=1)[0] for each in room.values())
    ends = [
        Claim(
            "DDGIR-C02",
            criteria.reported(by_spacing(a["spacings"], each)),
            f"FS12, bias by spacing, {scale}",
        )
        for scale, each in ((scale, found.mean(axis=1)) for scale, found in room.items())
    ]  # fmt: skip
    coarse = f"{1 / a['spacings'][0]:g}"
    all_round = [f"{scale} {100 * (a[f'{coarse} {scale} everywhere'] - 1):+.0f} %" for scale in SCALES]
    ends += [Claim("DDGIR-C02", criteria.reported(", ".join(all_round)), "FS12, bias on all surfaces")]
    every = [
        Claim("DDGIR-E11", criteria.below(apart, 0.03), "FS12, naive over (s + b) / s, less 1"),
        Claim("DDGIR-E11", criteria.between(worst, 0.97, 1.03), "FS12, attenuated over truth, farthest from 1"),
        Claim("DDGIR-C02", criteria.above(plain, 0.1), "FS12, naive bias", reason=TOLD),
        Claim("DDGIR-C02", criteria.between(faded, -0.1, 0.02), "FS12, attenuated bias", reason=TOLD),
        Claim("DDGIR-C02", criteria.below(abs(faded) / abs(plain), 0.5), "FS12, |attenuated| / |naive|", reason=TOLD),
        *ends,
    ]  # fmt: skip
    return withheld_where(every, DISPUTED)


def draw(a: Arrays) -> "Picture":
    """Ratios along the line; biases by spacing; the row of pixels."""
    picture, axes = style.panels(1, 3, width=3.8, height=3.0)
    line, room, row = axes[0]
    for k, (scale, ratio) in enumerate(zip(SCALES, a["line ratio"].mean(axis=1), strict=True)):
        look = style.nth(3 * k, label=scale, markevery=1)
        line.plot(a["heights"] - TABLE, ratio, **look)
        room.plot(a["spacings"], 100 * biases(a, scale).mean(axis=1), **look)
        row.plot(a[f"{1 / a['spacings'][0]:g} {scale} told"].mean(axis=0), **replace_every(look))
    line.plot(a["heights"] - TABLE, predicted(a["heights"]), **style.look("truth", label="(s + b) / s"))
    line.set(xlabel="probe's height b above the table", ylabel="E over the truth", title="One probe in line")
    room.set(xscale="log", xlabel="probe spacing (scene units)", ylabel="bias (%)", title="FS12: light on what is seen")
    room.set_xticks(a["spacings"], [f"1/{1 / h:g}" for h in a["spacings"]])
    room.minorticks_off()
    row.plot(a[f"{1 / a['spacings'][0]:g} naive truth"].mean(axis=0), **style.look("truth"))
    row.set(xlabel="pixel", ylabel="radiance", title=f"{1 / a['spacings'][0]:g} probes per unit")
    for axis in axes[0]:
        axis.legend()
    return picture


def replace_every(look: dict[str, Any]) -> dict[str, Any]:
    """The look of a row of many pixels."""
    return {**look, "markevery": style.SPARSE}


FIGURE = Figure(
    id="DDGIR-C02",
    title="Direct light in probes near a lamp, and its attenuation",
    world="flatland2d",
    source="[DDGIR 3.2]",
    claims=("DDGIR-C02", "DDGIR-E11"),
    presets={
        "quick": {
            "heights": [0.23, 0.27, 0.31, 0.35, 0.39], "rays": 2048, "frames": 8, "spacings": [4, 8, 16],
            "pixels": 32, "replicas": 8, "tolerance": 0.06, "points": 1000,
        },
        "paper": {
            "heights": [0.22, 0.25, 0.28, 0.31, 0.34, 0.37, 0.4], "rays": 8192, "frames": 32, "spacings": [4, 8, 16],
            "pixels": 128, "replicas": 16, "tolerance": 0.01, "points": 20000,
        },
    },
    conditions=(
        Conditions(
            ("DDGIR-C02", "DDGIR-E11"),
            "Sec. 3.2",
            paper=Setup("one pass", "still", "all", "lights nearer to probes than to surfaces"),
            ours=Setup("one pass", "still", "all", "FS12, the whole film"),
        ),
    ),
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)  # fmt: skip
