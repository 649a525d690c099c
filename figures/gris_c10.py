"""GRIS 7.5: a least distance of reconnections, beside and below furniture that stands 3% above the floor.

Between points that nearly touch, the geometry term of a connection is unbounded; replay knows no geometry term.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from figures import criteria, offline, style
from figures.figure import Arrays, Claim, Conditions, Figure, Setup
from figures.flatland import offline as one_frame
from figures.references import reference
from flatland2d import SCENES
from flatland2d.gbuffer import alike, gbuffer
from restir_ref.batch import Array
from restir_ref.chance import Chance
from restir_ref.integrals import Pixels
from restir_ref.loop import OFFLINE, alike_in_row, frame
from restir_ref.metrics import SMALL
from restir_ref.restir import shade
from restir_ref.transport.paths import Connectability
from restir_ref.transport.restir_pt import PathIntegrals

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture

SCENE = "crease"
DISTANCES = (0.0, 0.01, 0.05)
NEAR = 0.05
"""Pixels that see a point this near to another surface are crease pixels: the largest distance tested."""


def chunks(preset: Any) -> Sequence[dict[str, int]]:
    """One per distance, and one with neighbours that see alike."""
    return [{"distance": k} for k in range(len(DISTANCES) + 1)]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """Independent images (count, 128) with one least distance; the last has none, but neighbours by G-buffer."""
    rules = [offline.Method(one_frame, Connectability(0.2, d)) for d in DISTANCES]
    methods = [*rules, offline.Method(among_alike, Connectability(0.2, 0))]
    return offline.render(methods[chunk["distance"]], SCENE, preset["count"], rng)


def among_alike(of: PathIntegrals, index: Array, chance: Chance) -> Array:
    """An offline frame whose neighbours have similar normals and distances."""
    near = alike_in_row(alike(gbuffer(of.tracer.scene, of.tracer.sensor)))
    here = Pixels(of, index)
    return np.asarray(shade(frame(here, chance, OFFLINE, near), here).mean(axis=0))


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """Images (distance + 1, count, n), rays, the reference, and distances to other surfaces (n,)."""
    arrays = {name: np.stack([part[name] for part in results]) for name in results[0]}
    return {**arrays, "reference": reference(SCENE).mean, "clearance": clearance()}


def clearance() -> Array:
    """Distance of what the middle of each pixel sees to the nearest other surface, (n,)."""
    setting = SCENES[SCENE]()
    sensor = setting.pinhole()
    v = gbuffer(setting.scene, sensor)
    a, b = setting.scene.corners
    edge = b - a
    along = np.einsum("ds,dsn->sn", edge, v.x[:, None] - a[:, :, None]) / (edge**2).sum(axis=0)[:, None]
    nearest = a[:, :, None] + np.clip(along, 0, 1) * edge[:, :, None]
    distance = np.sqrt(((nearest - v.x[:, None]) ** 2).sum(axis=0))
    distance[v.prim, np.arange(sensor.n)] = np.inf
    return np.asarray(distance.min(axis=0))


def errors(a: Arrays, k: int, mask: Array) -> Array:
    """relMSE of every frame over some pixels, (R,)."""
    truth = a["reference"]
    relative = (a["images"][k] - truth) ** 2 / (truth**2 + (SMALL * truth.mean()) ** 2)
    return np.asarray(relative[:, mask].mean(axis=1))


def check(a: Arrays) -> list[Claim]:
    """Crease pixels gain, the others do not change."""
    near, claims = a["clearance"] < NEAR, []
    for k, d in enumerate(DISTANCES[1:], start=1):
        pair = errors(a, k, near), errors(a, 0, near)
        crease, worse = criteria.ratio_below(*pair, 0.8), criteria.ratio_above(*pair, 1)
        why = "" if crease.passed else REASON
        claims.append(Claim("GRIS-C10", crease, f"crease pixels, d = {d:.0%} / d = 0", counter=worse, reason=why))
        unchanged = criteria.ratio_within(errors(a, k, ~near), errors(a, 0, ~near), 0.9, 1.1)
        why = "" if unchanged.passed else SPREAD
        claims.append(Claim("GRIS-C10", unchanged, f"interior, d = {d:.0%} / d = 0", reason=why))
    return claims


REASON = (
    "In the plane the geometry term of short connections grows like 1/r, not 1/r^2: they are hardly noisier than "
    "others. A least distance costs instead: pairs on either side of it cannot be shifted into each other, and 5% "
    "forbids every connection across the 3% gap."
)
SPREAD = "A few bright outliers are most of this error of 21 pixels: these frames do not decide about 10%."


def draw(a: Arrays) -> "Picture":
    """Error per pixel, and where the crease is."""
    picture, axes = style.panels(1, 1, width=6.0, height=3.2)
    axis, truth = axes[0, 0], a["reference"]
    names = [*(f"d = {d:.0%} of the room" for d in DISTANCES), "d = 0, neighbours that see alike"]
    for name, images in zip(names, a["images"], strict=True):
        axis.semilogy(((images - truth) ** 2 / truth**2).mean(axis=0), label=name)
    for place in np.flatnonzero(a["clearance"] < NEAR):
        axis.axvspan(place - 0.5, place + 0.5, color="#dddddd", lw=0, zorder=0)
    axis.set(xlabel="pixel of the inset (crease pixels grey)", ylabel="relative squared error of a frame")
    axis.set_title("Beside furniture: least distance of reconnections")
    axis.legend()
    return picture


FIGURE = Figure(
    id="GRIS-C10",
    title="A least distance of reconnections",
    world="flatland2d",
    source="[GRIS 7.5]",
    claims=("GRIS-C10",),
    conditions=(
        Conditions(
            ("GRIS-C10",),
            "[GRIS 7.5]",
            Setup("real time", "moving", "indirect", "creases"),
            Setup("offline", "still", "all", "beside furniture"),
            "being moved",
        ),
    ),
    presets={"quick": {"count": 256}, "paper": {"count": 4096}},
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)
