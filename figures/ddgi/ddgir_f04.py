"""DDGI resampling Fig. 4: paths that go on by glossy lobes until they have spread err less on glossy boxes.

The whole film of FS2, its boxes from nearly specular to rough: converged secondary DDGI, which asks the cache at x_2,
and the same with recursion, against path tracing.  Only light that scatters twice or more counts.  Pixels are told
apart by what they see, the boxes or the rough room.  The slider of Sec. 3.2 makes the probes' irradiance right in the
mean at all x_2, whatever is asked of it later; beside them stands exact irradiance in their place.
"""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache as once
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims import criteria
from figures.claims.figure import Arrays, Claim, Conditions, Figure, Setup
from figures.experiments.cached import FREEZING, PER_UNIT, SHADING, along_view
from figures.experiments.deep import DEEP
from figures.experiments.rendering import estimates, lattice_tracing
from figures.experiments.traced import Traced
from figures.report import style
from flatland2d.directions import MAPS
from flatland2d.probe_rooms import probes
from flatland2d.scenes import cornell
from restir_ref.batch import Array, take
from restir_ref.chance import Chance, Live
from restir_ref.transport.baselines import probes as baselines
from restir_ref.transport.baselines.restir_di import indirect_light
from restir_ref.transport.cache.converge import converge
from restir_ref.transport.cache.integrals import CacheIntegrals, cache_integrals, ray
from restir_ref.transport.cache.leaving import Cache, displacement, telling
from restir_ref.transport.cache.shading import plain
from restir_ref.transport.cache.update import Updating
from restir_ref.transport.cache.volume import unlit
from restir_ref.transport.counting import counted
from restir_ref.transport.paths import RECONNECTION, Tracer
from restir_ref.transport.rays import arrive
from restir_ref.transport.restir_pt import PathIntegrals

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture

ROUGHNESS = (0.05, 0.1, 0.2, 0.3, 0.5, 0.7)
GLOSSY, ROUGH = 0.1, 0.5
HOW = ("asked at x_2", "recursion")
LIGHTS_OF = ("probes", "exact")
SEEN = ("room", "boxes")
"""What pixels see, by material."""

PIXELS, BLOCKS, ENOUGH = 128, 16, 8
BESIDE = (
    "Beside a glossy box paths from the rough floor have not spread at x_2 and go on.  Asked there, near x_2 are told "
    "too bright and far ones too dark, by exact irradiance as well; recursion mends near ones, and the sum errs more."
)
FITTING = 0x5116
"""The stream of the x_2 at which the slider is set."""

CLOSE = 0.003
"""How near the slider brings the mean to what is right."""


def chunks(preset: Any) -> Sequence[Any]:
    """The truth, the probes' light, and that of exact irradiance, for every roughness."""
    counts = {"truth": preset["truths"], "probes": preset["groups"], "exact": preset["exact"]}
    return [
        {"roughness": r, "part": p, "group": k} for r in preset["roughness"] for p in counts for k in range(counts[p])
    ]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """One image by a lattice of path trees (n,); or means of both ways over samples (how, n), and the slider."""
    chance, t = Live(rng), film(chunk["roughness"])
    if chunk["part"] == "truth":
        asked = Counter[str]()
        of = PathIntegrals(Tracer(counted(t.scene, asked), t.sensor, DEEP, RECONNECTION))
        return {"image": estimates(lattice_tracing(indirect_light), of, asked, 1, chance).images[0]}
    light, slider = cached(chunk["roughness"], preset["tolerance"], preset["points"])
    if chunk["part"] == "exact":
        light = Cache(t.scene, Traced(t.scene, light.field.spacing, chance))
    index, total = np.arange(preset["samples"] * PIXELS), np.zeros((len(HOW), PIXELS))
    batches = preset["batches"][chunk["part"]]
    for _ in range(batches):
        first = x_1(t, light, index, chance)
        found = [baselines.secondary(first, index, shading, chance) for shading in (plain, SHADING)]
        total += np.stack([L.mean(axis=0).reshape(-1, PIXELS).mean(axis=0) for L in found])
    return {chunk["part"]: total / batches, "slider": np.array(slider)}


def film(roughness: float) -> Tracer:
    """The room, and its eye's whole film."""
    setting = cornell(roughness)
    return Tracer(setting.scene, replace(setting.pinhole(PIXELS, 0), film=PIXELS), DEEP, RECONNECTION)


def x_1(t: Tracer, light: Cache, index: Array, chance: Chance) -> CacheIntegrals:
    """New first vertices of all columns."""
    return cache_integrals(t, light, chance.uniform((t.sensor.numbers, len(index))), index % PIXELS, np.inf)


@once
def cached(roughness: float, tolerance: float, points: int) -> tuple[Cache, float]:
    """A frozen volume, and its slider: by secants until E at so many x_2 has the mean of exact E; 1 for no points."""
    if not points:
        return probed(roughness, tolerance, 1.0), 1.0
    excess = too_bright(roughness, tolerance, points)
    s, e = [1.0, 2.0], [excess(1.0), excess(2.0)]
    while abs(e[-1]) > CLOSE and s[-1] > 0:
        s.append(max(s[-1] - e[-1] * (s[-1] - s[-2]) / (e[-1] - e[-2]), 0.0))
        e.append(excess(s[-1]))
    return probed(roughness, tolerance, s[-1]), s[-1]


def probed(roughness: float, tolerance: float, slider: float) -> Cache:
    """A volume whose updates attenuate direct light by so much of the further way."""
    setting = cornell(roughness)
    empty = unlit(setting.scene, probes(setting, PER_UNIT), MAPS)
    how = Updating(telling(along_view(empty)), attenuation=slider)
    chance = Live(np.random.default_rng(FREEZING))
    return Cache(setting.scene, converge(empty, setting.scene, how, chance, tolerance=tolerance), along_view(empty))


def too_bright(roughness: float, tolerance: float, points: int) -> Callable[[float], float]:
    """slider -> mean of E over x_2 of the film, over that of exact E, less 1."""
    t, chance = film(roughness), Live(np.random.default_rng(FITTING))
    exact = Cache(t.scene, Traced(t.scene, np.zeros(t.scene.space.d), chance))
    index = np.arange(points)
    found = ray(x_1(t, exact, index, chance), index, chance)
    z, r = take((found.z, found.r), np.flatnonzero(found.weight.any(axis=0)))
    E = exact.field.irradiance(z.x, z.n, z.n, 0 * z.x).mean()

    def excess(slider: float) -> float:
        c = probed(roughness, tolerance, slider)
        return float(c.field.irradiance(z.x, z.n, z.n, displacement(c, z, r)).mean() / E - 1)

    return excess


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """Truth (roughness, n), images (roughness, group, how, n) of LIGHTS_OF, sliders, and what pixels see."""
    listed = chunks(preset)

    def of(r: float, name: str) -> Array:
        return np.stack(
            [each[name] for c, each in zip(listed, results, strict=True) if c["roughness"] == r and name in each]
        )

    t = film(GLOSSY)
    v, _, _ = arrive(t.scene, *t.sensor.ray(np.arange(PIXELS), np.full((1, PIXELS), 0.5))[:2])
    return {
        "roughness": np.array(preset["roughness"]),
        "seen": v.material,
        "sliders": np.array([of(r, "slider").mean() for r in preset["roughness"]]),
        "truth": np.stack([of(r, "image").mean(axis=0) for r in preset["roughness"]]),
    } | {name: np.stack([of(r, name) for r in preset["roughness"]]) for name in LIGHTS_OF if preset[GROUPS[name]]}


GROUPS = {"probes": "groups", "exact": "exact"}


def biases(a: Arrays, light: str, what: int) -> Array:
    """Mean over blocks of |error| / truth, (roughness, group, how), of pixels that see one of SEEN.

    The sign is that of all groups' mean error, lest the noise of one group count as bias.
    """
    mine = np.flatnonzero(a["seen"] == what)
    images, at = (
        np.stack(
            [each[..., mine[mine * BLOCKS // PIXELS == k]].mean(axis=-1) for k in np.unique(mine * BLOCKS // PIXELS)],
            axis=-1,
        )
        for each in (a[light], a["truth"])
    )
    error = images / at[:, None, None] - 1
    return np.asarray((error * np.sign(error.mean(axis=1, keepdims=True))).mean(axis=-1))


def check(a: Arrays) -> list[Claim]:
    """Bias with recursion over bias without, by roughness and by what is seen."""
    listed = a["roughness"].tolist()
    return [
        of_roughness(a, what, r, listed.index(r) if r in listed else None)
        for r in ROUGHNESS
        for what in range(len(SEEN))
    ]


def of_roughness(a: Arrays, what: int, r: float, k: int | None) -> Claim:
    """One roughness of the boxes, and the pixels that see them, or the room."""
    part = f"boxes of roughness {r:g}: pixels of the {SEEN[what]}"
    if k is None or a["probes"].shape[1] < ENOUGH:
        return Claim("DDGIR-F04", None, part, reason="Too few samples for images without noise.")
    asked, followed = biases(a, "probes", what)[k].T
    exact = biases(a, "exact", what)[k].mean(axis=0)
    told = (
        f"|error| / truth: {asked.mean():.3f} asked at x_2, {followed.mean():.3f} with recursion; with exact "
        f"irradiance {exact[0]:.3f} and {exact[1]:.3f}.  Slider {a['sliders'][k]:.2f}."
    )
    if r <= GLOSSY and SEEN[what] == "boxes":
        below, above = criteria.ratio_below(followed, asked, 0.5), criteria.ratio_above(followed, asked, 1)
        left = (
            f"By exact irradiance, which ends on a lobe filtered by a cosine, the ratio is {exact[1] / exact[0]:.2f}."
        )
        return Claim("DDGIR-F04", below, part, above, reason=f"{told}  {left}")
    if r <= GLOSSY:
        same = criteria.ratio_within(followed, asked, 0.9, 1.1)
        return Claim("DDGIR-F04", same, part, reason=f"{told}  {BESIDE}")
    if SEEN[what] == "room" or r >= ROUGH:
        return Claim("DDGIR-F04", criteria.ratio_within(followed, asked, 0.9, 1.1), part, reason=told)
    return Claim("DDGIR-F04", criteria.reported(criteria.ratio_interval(followed, asked)[2]), part, reason=told)


def draw(a: Arrays) -> "Picture":
    """Bias over roughness, by what is seen, and the film with the most glossy boxes."""
    picture, axes = style.panels(1, 3, width=4.2, height=3.4)
    for what, axis in zip((1, 0), axes[0], strict=False):
        for light in (each for each in LIGHTS_OF if each in a):
            for k, how in enumerate(HOW):
                look = style.nth(2 * LIGHTS_OF.index(light) + k, label=f"{light}, {how}", markevery=1)
                axis.plot(a["roughness"], biases(a, light, what)[..., k].mean(axis=1), **look)
        axis.set(xlabel="roughness of the boxes", ylabel="|error| / truth", ylim=(0, 1.15 * axis.get_ylim()[1]))
        axis.set(title=f"Bias, pixels of the {SEEN[what]}")
        style.below(axis)
    rows = [*a["probes"][0].mean(axis=0), a["truth"][0]]
    style.strips(axes[0, 2], rows, [*HOW, "reference"], float(2 * np.median(a["truth"][0])), PIXELS)
    axes[0, 2].set(xlabel="pixel", title=f"Converged, roughness {a['roughness'][0]:g}")
    return picture


FIGURE = Figure(
    id="DDGIR-F04",
    title="Specular recursion",
    world="flatland2d",
    source="[DDGIR Fig. 4; 3.3]",
    claims=("DDGIR-F04",),
    conditions=(
        Conditions(
            ("DDGIR-F04",),
            "[DDGIR Fig. 4]",
            Setup("one pass", "still", "indirect", "near-specular surfaces, secondary DDGI"),
            Setup("one pass", "still", "indirect", "glossy boxes in a rough room (FS2)"),
        ),
    ),
    presets={
        "quick": {
            "roughness": [GLOSSY],
            "truths": 1,
            "groups": 1,
            "exact": 0,
            "samples": 64,
            "batches": {"probes": 4},
            "points": 0,
            "tolerance": 0.05,
        },
        "paper": {
            "roughness": list(ROUGHNESS),
            "truths": 3,
            "groups": 8,
            "exact": 4,
            "samples": 64,
            "batches": {"probes": 16, "exact": 4},
            "points": 60_000,
            "tolerance": 0.02,
        },
    },
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)
