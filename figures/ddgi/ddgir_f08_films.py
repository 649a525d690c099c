"""DDGI resampling Fig. 8 on whole films, as the paper shows its scenes: DDGI resampling, its baselines, and their bias.

Five rooms that do not leak, seen whole by their own eyes, one sample per pixel, warm history.  Bias is that of indirect
light in converged images, with 4 probes per room height, one per .75 m in a room of 3 m: primary queries then err as
visibly as in the paper's scenes.  The slider of Sec. 3.2 makes secondary queries right in the mean, room by room.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from functools import cache as once
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims import criteria
from figures.claims.criteria import Outcome
from figures.claims.figure import Arrays, Claim, Conditions, Figure, Setup
from figures.experiments.cached import (
    FREEZING,
    METHODS,
    PLACES,
    SHADING,
    DirectChain,
    Place,
    Scenery,
    along_view,
    compared,
    frozen,
    scenery,
)
from figures.experiments.deep import DEEP, PANELS, ROOMS, TRACED
from figures.experiments.rendering import estimates, lattice_tracing
from figures.report import style
from flatland2d.directions import MAPS
from flatland2d.probe_rooms import probes
from flatland2d.radiosity import cut, film_points, gather, shares
from flatland2d.sensors import Pinhole
from restir_ref.batch import Array
from restir_ref.chance import Chance, Live
from restir_ref.metrics import mape_with_floor
from restir_ref.transport.baselines import probes as baselines
from restir_ref.transport.baselines.restir_di import indirect_light
from restir_ref.transport.cache.converge import converge
from restir_ref.transport.cache.leaving import Cache, telling
from restir_ref.transport.cache.shading import own_light
from restir_ref.transport.cache.update import Updating
from restir_ref.transport.cache.volume import unlit
from restir_ref.transport.materials import albedo
from restir_ref.transport.rays import arrive
from restir_ref.transport.restir_pt import PathIntegrals
from restir_ref.transport.vectors import dot

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Picture

ROOMS_SEEN = tuple(name for name in PLACES if name != "FS11")
TREES, PRIMARY, SECONDARY, OURS, _ = range(len(METHODS))
SPARSE = 4.0
"""Probes per unit length, where bias is told."""

ENOUGH = 8
VISIBLE = 0.05
"""The least bias of primary queries that is there to be hidden."""

CLOSE = 0.003
"""How near the slider brings the mean to what is right."""

FILM_POINTS = 8


def chunks(preset: Any) -> Sequence[Any]:
    """Chains of frames, converged images and, where it is traced, the truth, room by room."""
    counts = {"chains": preset["blocks"], "converged": preset["groups"]}
    listed = [{"room": r, "part": p, "group": k} for r in preset["rooms"] for p in counts for k in range(counts[p])]
    traced = [r for r in preset["rooms"] if PLACES[r].room in TRACED]
    return listed + [{"room": r, "part": "truth", "group": k} for r in traced for k in range(preset["truths"])]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """Images (method, replica, n) of a warm frame; tails (2, n) of primary and secondary queries; or truths (2, n)."""
    chance, room, n, tolerance = Live(rng), chunk["room"], preset["pixels"], preset["tolerance"]
    if chunk["part"] == "chains":
        of = whole_film(scenery(frozen(PLACES[room], tolerance)), n)
        return {"images": compared(of, preset["replicas"], preset["frames"], chance)["images"][-1]}
    of = whole_film(scenery(frozen(Place(PLACES[room].room, SPARSE), tolerance)), n)
    if chunk["part"] == "truth":
        return {"truth": traced(of, preset["samples"], chance)}
    augmented, slider = slid(room, tolerance, n, preset["fits"])
    index, tails = np.arange(preset["samples"] * n), np.zeros((2, n))
    for _ in range(preset["batches"]):
        first, _ = of.first(index, chance)
        primary = baselines.primary(replace(first, cache=augmented), of.original, index, SHADING, chance)
        secondary = baselines.secondary(replace(first, cache=augmented), index, SHADING, chance)
        tails += np.stack([L.mean(axis=0).reshape(-1, n).mean(axis=0) for L in (primary, secondary)])
    return {"tails": tails / preset["batches"], "slider": np.array(slider)}


def whole_film(of: Scenery, n: int) -> Scenery:
    """The same, seen on all of the film by n pixels."""
    sensor: Any = of.tracer.sensor
    film = replace(sensor, n=n, first=0, film=n)
    return replace(of, tracer=replace(of.tracer, sensor=film), deep=replace(of.deep, sensor=film))


@once
def slid(room: str, tolerance: float, n: int, most: int) -> tuple[Cache, float]:
    """The sparse volume with the slider that makes secondary queries' mean right, by at most so many secants."""
    s, found = [1.0, 0.5][: most + 1], list[float]()
    while most:
        c = probed(PLACES[room].room, tolerance, s[len(found)])
        found.append(excess(room, c, n))
        if abs(found[-1]) < CLOSE or len(found) > most or s[len(found) - 1] == 0:
            return c, s[len(found) - 1]
        if len(found) == len(s):
            s.append(max(s[-1] - found[-1] * (s[-1] - s[-2]) / (found[-1] - found[-2]), 0.0))
    return probed(PLACES[room].room, tolerance, s[0]), s[0]


def probed(name: str, tolerance: float, slider: float) -> Cache:
    """An augmented volume whose updates attenuate direct light by so much of the further way."""
    setting = ROOMS[name]()
    empty = unlit(setting.scene, probes(setting, SPARSE), MAPS)
    how, chance = Updating(telling(along_view(empty)), attenuation=slider), Live(np.random.default_rng(FREEZING))
    return Cache(setting.scene, converge(empty, setting.scene, how, chance, tolerance=tolerance), along_view(empty))


def excess(room: str, c: Cache, n: int) -> float:
    """Mean of what secondary queries tell over what is true, less 1; always at the same points."""
    of = whole_film(scenery(frozen(Place(PLACES[room].room, SPARSE), 0.05)), n)
    chance, index = Live(np.random.default_rng(FREEZING)), np.arange(64 * n)
    first, _ = of.first(index, chance)
    told = baselines.secondary(replace(first, cache=c), index, SHADING, chance).mean()
    return float(told / known(room, n)[1].mean() - 1)


@once
def known(room: str, n: int) -> Array:
    """All light on the film, and indirect light; (2, n)."""
    of = whole_film(scenery(frozen(Place(PLACES[room].room, SPARSE), 0.05)), n)
    if PLACES[room].room in TRACED:
        return traced(of, 64, Live(np.random.default_rng(FREEZING)))
    return radiosities(of)


def traced(of: Scenery, samples: int, chance: Chance) -> Array:
    """By a lattice of path trees, and ReSTIR DI of so many samples for direct light; (2, n)."""
    paths = PathIntegrals(replace(of.deep, depth=DEEP))
    indirect = estimates(lattice_tracing(indirect_light), paths, Counter[str](), 1, chance).images[0]
    index = np.arange(samples * of.n)
    first, _ = of.first(index, chance)
    direct = DirectChain().run(baselines.direct(first), index, chance) + own_light(first, index)
    return np.stack([indirect + direct.mean(axis=0).reshape(-1, of.n).mean(axis=0), indirect])


def radiosities(of: Scenery) -> Array:
    """Of a room of Lambert surfaces: all light, and without the first scattering; (2, n).  B = (1 - T)^-1 L_e."""
    scene, sensor = of.tracer.scene, of.tracer.sensor
    assert isinstance(sensor, Pinhole)
    p = cut(scene, PANELS)
    T = shares(scene, p, (p.a + p.b) / 2, p.n) * albedo(scene.materials).mean(axis=0)[scene.material[p.prim]][:, None]
    B = np.linalg.solve(np.eye(len(T)) - T, p.emission)
    pixel, u, weight = film_points(scene, sensor, FILM_POINTS)
    x, w, _ = sensor.ray(pixel, u[None])
    t, prim = scene.intersect(x, w)
    normal = scene.normals.take(prim, axis=-1)
    front = dot(normal, w) < 0
    seen = [gather(scene, p, each, x + t * w, prim, np.where(front, normal, -normal)) for each in (B, B - p.emission)]
    L = np.stack([seen[0] + scene.emission[0, prim] * front, seen[1]])
    return np.stack([np.bincount(pixel, weight * each, sensor.n) for each in L])


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """Per room: images (method, replica, n), tails (group, 2, n), sliders, truth (2, n), and material seen (n,)."""
    listed, found = list(zip(chunks(preset), results, strict=True)), {}
    for room in preset["rooms"]:
        mine = [r for c, r in listed if c["room"] == room]
        found[f"{room}.images"] = np.concatenate([r["images"] for r in mine if "images" in r], axis=1)
        found[f"{room}.tails"] = np.stack([r["tails"] for r in mine if "tails" in r])
        found[f"{room}.slider"] = np.array([r["slider"] for r in mine if "slider" in r])
        found[f"{room}.seen"] = seen(room, preset["pixels"])
        truths = [r["truth"] for r in mine if "truth" in r]
        found[f"{room}.truth"] = np.mean(truths, axis=0) if truths else known(room, preset["pixels"])
    return found


def seen(room: str, n: int) -> Array:
    """The material that each pixel sees, (n,)."""
    setting = ROOMS[PLACES[room].room]()
    x, w, _ = replace(setting.pinhole(n, 0), film=n).ray(np.arange(n), np.full((1, n), 0.5))
    return arrive(setting.scene, x, w)[0].material


def errors(a: Arrays, room: str) -> Array:
    """MAPE (method, replica)."""
    return mape_with_floor(a[f"{room}.images"], a[f"{room}.truth"][0])


def biases(a: Arrays, room: str) -> Array:
    """MAPE of indirect light by primary and by secondary queries, (2, group)."""
    return mape_with_floor(a[f"{room}.tails"], a[f"{room}.truth"][1]).T


PARTS = ("whole film: resampled / path tracing", "whole film: resampled / secondary")
ORDER = ((PRIMARY, OURS), (OURS, SECONDARY), (SECONDARY, TREES))
VARIANCES = tuple(f"whole film: variance, {METHODS[x]} < {METHODS[y]}" for x, y in ORDER)
NEAR = "whole film of FS2: resampled / path tracing and / secondary, by what pixels see"
BIASED = f"whole film, {SPARSE:g} probes per unit: bias, secondary / primary"


def check(a: Arrays) -> list[Claim]:
    """Ratios of errors of one frame; and of bias, in the rooms in which primary queries have some."""
    rooms = [name for name in ROOMS_SEEN if f"{name}.images" in a]
    if len(rooms) < len(ROOMS_SEEN) or a["FS3.images"].shape[1] < ENOUGH:
        few = "One room, or few images, cannot tell."
        ids = {"DDGIR-F08": (*PARTS, NEAR), "DDGIR-F08b": (*VARIANCES, BIASED)}
        return [Claim(id_, None, part, reason=few) for id_, parts in ids.items() for part in parts]
    e = {name: errors(a, name) for name in rooms}
    trees = {name: criteria.ratio_below(x[OURS], x[TREES], 0.7) for name, x in e.items()}
    second = {name: criteria.ratio_below(x[OURS], x[SECONDARY], 0.9) for name, x in e.items()}
    worse = {name: criteria.ratio_above(x[OURS], x[SECONDARY], 1) for name, x in e.items()}
    return [
        Claim("DDGIR-F08", in_rooms(trees, len(rooms)), PARTS[0]),
        Claim("DDGIR-F08", in_rooms(second, 4), PARTS[1], in_rooms(worse, 2)),
        Claim("DDGIR-F08", criteria.reported(by_surface(a)), NEAR),
        *check_variances(a, rooms),
        check_bias({name: biases(a, name).mean(axis=-1) for name in rooms}, a),
    ]


def by_surface(a: Arrays) -> str:
    """Ratios of errors in FS2, of pixels that see the rough room and of those that see the boxes."""
    said = []
    for what, name in enumerate(("room", "boxes")):
        k = np.flatnonzero(a["FS2.seen"] == what)
        e = mape_with_floor(a["FS2.images"][..., k], a["FS2.truth"][0, k]).mean(axis=-1)
        said.append(f"{name} ({len(k)} pixels) {e[OURS] / e[TREES]:.2f} and {e[OURS] / e[SECONDARY]:.2f}")
    return "; ".join(said)


def check_variances(a: Arrays, rooms: Sequence[str]) -> list[Claim]:
    """The order of noise, in all rooms."""
    V = {name: variances(a, name) for name in rooms}
    found = []
    for (x, y), part in zip(ORDER, VARIANCES, strict=True):
        below, above = (
            {name: rule(v[x], v[y], 1) for name, v in V.items()}
            for rule in (criteria.ratio_below, criteria.ratio_above)
        )
        found.append(Claim("DDGIR-F08b", in_rooms(below, len(rooms)), part, in_rooms(above, 3)))
    return found


def variances(a: Arrays, room: str) -> Array:
    """Squares of what is not the mean over replicas, averaged over pixels: (method, replica)."""
    images = a[f"{room}.images"]
    return np.asarray(((images - images.mean(axis=1, keepdims=True)) ** 2).mean(axis=-1))


def check_bias(B: dict[str, Array], a: Arrays) -> Claim:
    """Secondary below primary in all rooms but one, of those where primary queries err visibly."""
    shown = {name: b for name, b in B.items() if b[0] >= VISIBLE}
    told = "; ".join(
        f"{name} {b[0]:.3f} and {b[1]:.3f}, slider {a[f'{name}.slider'].mean():.2f}" for name, b in B.items()
    )
    reason = f"Primary and secondary: {told}.  Judged where primary queries err by {VISIBLE} or more."
    if len(shown) < 4:
        return Claim("DDGIR-F08b", None, BIASED, reason=f"{reason}  These are fewer than 4 rooms.")
    less = {name: criteria.below(b[1] / b[0], 1) for name, b in shown.items()}
    return Claim("DDGIR-F08b", in_rooms(less, 4), BIASED, reason=reason)


def in_rooms(outcomes: dict[str, Outcome], least: int) -> Outcome:
    """Holds in at least so many rooms; what was measured in each."""
    said = "; ".join(
        f"{name} {criteria.show(o.measured).split()[0]}{'' if o.passed else ' (no)'}" for name, o in outcomes.items()
    )
    rule = f"{next(iter(outcomes.values())).criterion}, in at least {least} of {len(outcomes)}"
    return Outcome(said, rule, sum(bool(o.passed) for o in outcomes.values()) >= least)


def draw(a: Arrays) -> "Picture":
    """Errors of a warm frame, and bias, by room."""
    picture, axes = style.panels(1, 2, width=6.0, height=3.4)
    rooms = [name for name in ROOMS_SEEN if f"{name}.images" in a]
    for k, method in enumerate(METHODS):
        bars(axes[0, 0], [errors(a, name)[k].mean() for name in rooms], method, 0.16 * (k - 2))
    for k, method in enumerate((METHODS[PRIMARY], METHODS[SECONDARY])):
        bars(axes[0, 1], [biases(a, name)[k].mean() for name in rooms], method, 0.16 * (2 * k - 1))
    axes[0, 0].set_yscale("log")
    axes[0, 0].set(ylabel="MAPE", title="Error of one warm frame, whole film")
    axes[0, 1].set(ylabel="MAPE", title=f"Bias of indirect light, {SPARSE:g} probes per unit")
    for axis in axes[0]:
        axis.set_xticks(range(len(rooms)), rooms)
        style.below(axis, ncols=3)
    return picture


def bars(axis: "Axes", heights: Sequence[float], method: str, at: float) -> None:
    """One method's, room by room."""
    axis.bar(np.arange(len(heights)) + at, heights, 0.15, **style.bar(method))


FIGURE = Figure(
    id="DDGIR-F08-FILMS",
    title="Probes at the second vertex, resampled: whole films",
    world="flatland2d",
    source="[DDGIR Fig. 8]",
    claims=("DDGIR-F08", "DDGIR-F08b"),
    conditions=(
        Conditions(
            ("DDGIR-F08", "DDGIR-F08b"),
            "[DDGIR Fig. 8; 4]",
            Setup("real time", "still", "all", "six rooms, one sample per pixel"),
            Setup("real time", "still", "all", "whole films of five rooms (FS2, FS3, FS4, FS5, FS13), warm history"),
        ),
    ),
    presets={
        "quick": {
            "rooms": ["FS3"],
            "pixels": 64,
            "blocks": 1,
            "replicas": 4,
            "frames": 4,
            "groups": 1,
            "samples": 16,
            "batches": 1,
            "truths": 1,
            "fits": 0,
            "tolerance": 0.05,
        },
        "paper": {
            "rooms": list(ROOMS_SEEN),
            "pixels": 512,
            "blocks": 4,
            "replicas": 4,
            "frames": 20,
            "groups": 2,
            "samples": 32,
            "batches": 8,
            "truths": 2,
            "fits": 4,
            "tolerance": 0.02,
        },
    },
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)
