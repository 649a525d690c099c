"""DDGI resampling Sec. 3.2: probes nearer to a light than surfaces are too bright, and attenuation makes up for it.

FS12.  On the left lamp, probe and table in line, one probe at a time: what it says of the table's direct light, over
the truth.  The plain ratio is that of distances, (s + b)/s, to the first power in flatland.  In the middle and on the
right a volume of all light, asked at x_2 as the method does, along the path: indirect light of all that is seen, by the
spacing of probes, and pixel by pixel for 4 per unit, for which the room is made.  What primary queries would be told,
and what the volume says of all surfaces, is told beside it.  A replicate has a volume of its own rays: one volume's
noise is a percent of the light.
"""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims import criteria
from figures.claims.figure import Arrays, Claim, Conditions, Figure, Setup
from figures.experiments.volumes import (
    along_view,
    arriving,
    at_first,
    at_second,
    direct,
    indirect,
    met,
    off_surface,
    seen,
    view,
)
from figures.report import style
from flatland2d.directions import MAPS
from flatland2d.probe_rooms import probes
from restir_ref.batch import Array
from restir_ref.chance import Chance, Live
from restir_ref.transport.cache.converge import converge
from restir_ref.transport.cache.grid import Grid
from restir_ref.transport.cache.leaving import Cache, telling
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
    """The line; so many volumes per spacing and scale, to a tolerance."""
    sizes = [preset[key] for key in ("spacings", "volumes", "tolerances")]
    volumes = [
        {"per_unit": h, "scale": s, "volumes": n, "tolerance": e}
        for h, n, e in zip(*sizes, strict=True)
        for s in SCALES
    ]
    return [{"line": preset["heights"]}, *volumes]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """E over the truth for every probe of the line (scales, frames, heights); or radiance and truth, (replicas, n)."""
    chance = Live(rng)
    if "line" in chunk:
        ratios = [[one_probe(h, scale, preset, chance) for h in chunk["line"]] for scale in SCALES.values()]
        return {"ratio": np.moveaxis(np.array(ratios), 1, 2)}
    rows = [of_volume(chunk, preset, chance) for _ in range(chunk["volumes"])]
    return {key: np.stack([row[key] for row in rows]) for key in rows[0]}


def of_volume(chunk: Any, preset: Any, chance: Chance) -> Arrays:
    """Indirect light by secondary queries and all scattered light by primary ones, with their truths, (n,)."""
    setting, per_unit = view(ROOM).setting, chunk["per_unit"]
    s, along = setting.scene, along_view(1 / per_unit)
    how = Updating(telling(along), AUGMENTED, VOLUME_RAYS, attenuation=SCALES[chunk["scale"]])
    of = converge(unlit(s, probes(setting, per_unit), MAPS), s, how, chance, tolerance=chunk["tolerance"])
    first, x = Cache(s, of, off_surface(1 / per_unit)), seen(ROOM, chance.uniform((preset["pixels"],)))
    once, twice = direct(ROOM, x.v), indirect(ROOM, x.v)
    all_round = met(ROOM, preset["points"], chance)
    whole = (direct(ROOM, all_round.v) + indirect(ROOM, all_round.v)).sum()
    return {
        "told": at_second(Cache(s, of, along), arriving(s, x, preset["gathered"], chance), chance),
        "truth": twice,
        "first": at_first(first, x),
        "first truth": once + twice,
        "everywhere": at_first(first, all_round).sum() / whole,
    }


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


def biases(a: Arrays, scale: str, queries: str = "") -> Array:
    """Relative bias of indirect light by secondary queries, (spacings,); "first" asks at x_1."""
    keys = [f"{1 / h:g} {scale}" for h in a["spacings"]]
    told, truth = (queries, f"{queries} truth") if queries else ("told", "truth")
    return np.stack([a[f"{key} {told}"].mean() / a[f"{key} {truth}"].mean() - 1 for key in keys])


def coarsest(a: Arrays, scale: str) -> tuple[Array, Array]:
    """What is told at x_2 with the fewest probes, and the truth; (volumes,) each."""
    key = f"{1 / a['spacings'][0]:g} {scale}"
    return a[f"{key} told"].mean(axis=1), a[f"{key} truth"].mean(axis=1)


def predicted(heights: Array) -> Array:
    """(s + b) / s."""
    return (LAMP - TABLE) / (LAMP - heights)


TOLD = (
    "Queries at x_2 along the path, of all that the scene's own eye sees, table and floor below the lamp; light that "
    "was scattered once before. At x_1, where the paper does not ask, attenuation overshoots by more."
)


def by_spacing(h: Array, bias: Array) -> str:
    """Biases in words."""
    return ", ".join(f"1/{1 / each:g}: {100 * b:+.1f} %" for each, b in zip(h, bias, strict=True))


def check(a: Arrays) -> list[Claim]:
    """The line's ratios; the volume's biases at x_2."""
    naive, attenuated = a["line ratio"].mean(axis=1)
    expected = predicted(a["heights"])
    apart = abs(naive / expected - 1).max()
    worst = attenuated[np.abs(attenuated - 1).argmax()]
    above = criteria.ratio_above(*coarsest(a, "naive"), 1.1)
    near = criteria.ratio_within(*coarsest(a, "attenuated"), 0.9, 1.02)
    plain, faded = (biases(a, scale)[0] for scale in SCALES)
    return [
        Claim("DDGIR-E11", criteria.below(apart, 0.03), "FS12, naive over (s + b) / s, less 1"),
        Claim("DDGIR-E11", criteria.between(worst, 0.97, 1.03), "FS12, attenuated over truth, farthest from 1"),
        Claim("DDGIR-C02", above, "FS12, naive over truth", reason=TOLD),
        Claim("DDGIR-C02", near, "FS12, attenuated over truth", reason=TOLD),
        Claim("DDGIR-C02", criteria.below(abs(faded) / abs(plain), 0.5), "FS12, |attenuated| / |naive|", reason=TOLD),
        *beside(a),
    ]  # fmt: skip


def beside(a: Arrays) -> list[Claim]:
    """Biases by spacing, at x_2 and at x_1, and of all surfaces."""
    found = []
    for scale in SCALES:
        for queries, where in (("", ""), ("first", ", at x_1")):
            told = by_spacing(a["spacings"], biases(a, scale, queries))
            found.append(Claim("DDGIR-C02", criteria.reported(told), f"FS12, bias by spacing, {scale}{where}"))
    coarse = f"{1 / a['spacings'][0]:g}"
    all_round = [f"{scale} {100 * (a[f'{coarse} {scale} everywhere'].mean() - 1):+.0f} %" for scale in SCALES]
    return [*found, Claim("DDGIR-C02", criteria.reported(", ".join(all_round)), "FS12, bias on all surfaces, at x_1")]


def draw(a: Arrays) -> "Picture":
    """Ratios along the line; biases by spacing; the row of pixels."""
    picture, axes = style.panels(1, 3, width=3.8, height=3.0)
    line, room, row = axes[0]
    for k, (scale, ratio) in enumerate(zip(SCALES, a["line ratio"].mean(axis=1), strict=True)):
        look = style.nth(3 * k, label=scale, markevery=1)
        line.plot(a["heights"] - TABLE, ratio, **look)
        room.plot(a["spacings"], 100 * biases(a, scale), **look)
        row.plot(a[f"{1 / a['spacings'][0]:g} {scale} told"].mean(axis=0), **replace_every(look))
    line.plot(a["heights"] - TABLE, predicted(a["heights"]), **style.look("truth", label="(s + b) / s"))
    line.set(xlabel="probe's height b above the table", ylabel="E over the truth", title="One probe in line")
    room.set(
        xscale="log",
        xlabel="probe spacing (scene units)",
        ylabel="bias (%)",
        title="FS12: indirect light of what is seen",
    )
    room.set_xticks(a["spacings"], [f"1/{1 / h:g}" for h in a["spacings"]])
    room.minorticks_off()
    row.plot(a[f"{1 / a['spacings'][0]:g} naive truth"].mean(axis=0), **style.look("truth"))
    row.set(xlabel="pixel", ylabel="indirect radiance", title=f"{1 / a['spacings'][0]:g} probes per unit")
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
            "heights": [0.23, 0.27, 0.31, 0.35, 0.39], "rays": 2048, "frames": 8, "spacings": [4, 8],
            "volumes": [8, 1],
            "pixels": 32, "gathered": 64, "tolerances": [0.01, 0.06], "points": 1000,
        },
        "paper": {
            "heights": [0.22, 0.25, 0.28, 0.31, 0.34, 0.37, 0.4], "rays": 8192, "frames": 32, "spacings": [4, 8, 16],
            "volumes": [16, 4, 2],
            "pixels": 128, "gathered": 128, "tolerances": [0.01, 0.01, 0.01], "points": 5000,
        },
    },
    conditions=(
        Conditions(
            ("DDGIR-C02", "DDGIR-E11"),
            "Sec. 3.2",
            paper=Setup("one pass", "still", "all", "lights nearer to probes than to surfaces"),
            ours=Setup("one pass", "still", "indirect", "FS12, the whole film, light by way of x_2"),
            why="Direct light of x_1 is exact by ReSTIR DI in both: it has no part in biases.",
        ),
    ),
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)  # fmt: skip
