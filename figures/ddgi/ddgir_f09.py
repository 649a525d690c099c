"""DDGI resampling Fig. 9: probes as a control variate at x_1 converge to the same image, and help no single frame.

The nearest probe's rays, constant around each, stand for diffuse transport, and only the difference is resampled, in a
thin-walled room (FS11) and an open one (FS13).  One frame with spatial reuse and without history; values are asked of
every x_1, and weights see obstacles.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims import criteria
from figures.claims.figure import Arrays, Claim, Conditions, Figure, Setup
from figures.experiments.cached import G_MAX, PLACES, SHADING, frozen, scenery
from figures.experiments.deep import truth
from figures.report import style
from flatland2d.probe_cells import Sectors
from restir_ref.batch import Array
from restir_ref.chance import Chance, Live
from restir_ref.integrals import Pixels
from restir_ref.loop import REAL_TIME, random_in_row
from restir_ref.metrics import mape_with_floor
from restir_ref.restir import resample, shade, spatial
from restir_ref.transport.cache.control import ControlledIntegrals, residual_difference, variate
from restir_ref.transport.cache.integrals import CacheIntegrals, asked, by_ray, on_lights
from restir_ref.transport.cache.probe_rays import ProbeRays, brought
from restir_ref.transport.cache.shading import bounded, own_light, residual

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Picture

ROOMS, RAYS = ("FS11", "FS13"), 64
HOW = ("plain", "controlled")
ENOUGH = 256
"""Replicas of which means can be compared."""


def chunks(preset: Any) -> Sequence[Any]:
    """Groups of replicas, room by room."""
    return [{"room": room, "block": k} for room in ROOMS for k in range(preset["blocks"])]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """Images (how, replica, pixel) of the same x_1."""
    place, chance, replicas = frozen(PLACES[chunk["room"]], preset["tolerance"]), Live(rng), preset["replicas"]
    of, grid = scenery(place), place.augmented.grid
    active = np.flatnonzero(place.augmented.active)
    rays, index = brought(of.cache, grid.place(active), Sectors(RAYS), chance), np.arange(replicas * of.n)
    first = replace(of.first(index, chance)[0], G_max=G_MAX, value=asked)
    images = [plain(first, index, chance), controlled(first, rays, index, chance)]
    return {"images": np.stack([L.mean(axis=0).reshape(replicas, of.n) for L in images])}


def plain(first: CacheIntegrals, index: Array, chance: Chance) -> Array:
    """A frame of DDGI resampling, (C, N)."""
    here, found = Pixels(first, index), by_ray(first, index, chance)
    X = resample([*on_lights(first, index, chance), (found.x, found.mW)], here, chance)
    X = spatial(X, here, near(here, chance), chance)
    return own_light(first, index) + bounded(X, here, SHADING, chance) + residual(first, index, found, SHADING, chance)


def controlled(first: CacheIntegrals, rays: ProbeRays, index: Array, chance: Chance) -> Array:
    """The same beside a control variate, (C, N)."""
    of, found = ControlledIntegrals(first, rays), by_ray(first, index, chance)
    there = Pixels(of, index)
    X = resample([*on_lights(first, index, chance), (found.x, found.mW)], there, chance)
    X = spatial(X, there, near(there, chance), chance)
    difference = shade(X, there) + residual_difference(of, index, found, SHADING, chance)
    return np.asarray(own_light(first, index) + variate(of, index) + difference)


def near(here: Pixels, chance: Chance) -> Sequence[Pixels]:
    """Three neighbours."""
    of: Any = here.of
    return random_in_row(of, here.index, REAL_TIME.neighbours, REAL_TIME.radius, chance)


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """Images and truth of both rooms."""
    found: Arrays = {}
    for room in ROOMS:
        mine = [r["images"] for c, r in zip(chunks(preset), results, strict=True) if c["room"] == room]
        found |= {f"{room}.images": np.concatenate(mine, axis=1), f"{room}.truth": truth(PLACES[room].room)}
    return found


def errors(a: Arrays, room: str) -> Array:
    """MAPE (how, replica)."""
    return mape_with_floor(a[f"{room}.images"], a[f"{room}.truth"])


MAY_HELP = (
    "Sec. 5.1 grants that a variate may be beneficial in some settings, of which simple occlusion is the first, as it "
    "is here.  What probes saw hardly differs from what is there, and no difference is larger than the variate."
)


def check(a: Arrays) -> list[Claim]:
    """Error, negative pixels and means, with and without the control variate; noise is judged where probes leak."""
    leaking, simple = (of_room(a, room) for room in ROOMS)
    *noise, mean = simple
    beside = [
        replace(each, outcome=criteria.reported(each.outcome.measured), counter=None, reason=MAY_HELP)
        for each in noise
        if each.outcome
    ]
    return [*leaking, *beside, mean]


def of_room(a: Arrays, room: str) -> list[Claim]:
    """One room."""
    without, with_it = errors(a, room)
    dark = (a[f"{room}.images"] < 0).mean(axis=(1, 2))
    negative = criteria.all_of(criteria.above(dark[1], 0.001), criteria.within(dark[0], 0, 0))
    return [
        Claim(
            "DDGIR-F09",
            criteria.ratio_above(with_it, without, 0.95),
            f"{room}: MAPE with / without",
            criteria.ratio_below(with_it, without, 0.95),
        ),
        Claim("DDGIR-F09", negative, f"{room}: share of negative pixels, with and without"),
        same_mean(a, room),
    ]


def same_mean(a: Arrays, room: str) -> Claim:
    """The same means of image and blocks, by images of the same x_1."""
    plain, other = (criteria.mean_and_blocks(each) for each in a[f"{room}.images"])
    part, at = f"{room}: converged, with = without", plain.mean(axis=0)
    if len(plain) < ENOUGH:
        return Claim("DDGIR-F09", None, part, reason=f"{len(plain)} replicas cannot tell.")
    return Claim("DDGIR-F09", criteria.all_unbiased(other - plain + at, at, eps=0.02), part)


def draw(a: Arrays) -> "Picture":
    """One frame of each as strips, with the converged image and the truth; and errors."""
    picture, axes = style.panels(1, 3, width=4.2, height=3.4)
    for axis, room in zip(axes[0], ROOMS, strict=False):
        draw_strips(axis, a, room)
    draw_errors(axes[0, 2], a)
    return picture


def draw_strips(axis: "Axes", a: Arrays, room: str) -> None:
    """One frame, and means."""
    images, at = a[f"{room}.images"], a[f"{room}.truth"]
    rows = [images[0, 0], images[1, 0], images[0].mean(axis=0), images[1].mean(axis=0), at]
    labels = ["plain\nframe", "controlled\nframe", "mean of\nplain", "mean of\ncontrolled", "reference"]
    style.strips(axis, rows, labels, float(2 * np.median(images[0].mean(axis=0))), len(at))
    axis.set(xlabel="pixel", title=f"{room}, one frame and the mean of all")


def draw_errors(axis: "Axes", a: Arrays) -> None:
    """MAPE of a frame."""
    for k, how in enumerate(HOW):
        place = np.arange(len(ROOMS)) + 0.36 * (k - 0.5)
        found = [errors(a, room)[k].mean() for room in ROOMS]
        look, hatch = style.nth(k)["color"], style.HATCHES[k]
        bars = axis.bar(place, found, 0.34, color=look, hatch=hatch, edgecolor=style.PAPER, label=how)
        axis.bar_label(bars, fmt="%.3f")
    axis.set_xticks(range(len(ROOMS)), list(ROOMS))
    axis.margins(y=0.15)
    axis.set(ylabel="MAPE", title="Error of a frame")
    style.below(axis)


FIGURE = Figure(
    id="DDGIR-F09",
    title="Probes as a control variate",
    world="flatland2d",
    source="[DDGIR Fig. 9; 5.1]",
    claims=("DDGIR-F09",),
    conditions=(
        Conditions(
            ("DDGIR-F09",),
            "[DDGIR Fig. 9]",
            Setup("real time", "still", "all", "a room with leaking probes, one sample per pixel"),
            Setup("one pass", "still", "all", "thin walls (FS11) and an open room (FS13)"),
            "One frame without history, which the caption does not speak of.",
        ),
    ),
    presets={
        "quick": {"blocks": 2, "replicas": 32, "tolerance": 0.05},
        "paper": {"blocks": 16, "replicas": 32, "tolerance": 0.01},
    },
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)
