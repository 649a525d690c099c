"""Rooms for probes in flatland: what a volume of probes knows of light and distance, and where it leaks.

A gallery: it shows what the figures of DDGI resampling compute on, and claims nothing.  Above, every probe with its
irradiance by direction, and the surfaces that are told of light by probes which do not see them; below, how far probes
see: the mean, and one standard deviation more and less, dotted.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims.figure import Arrays, Claim, Figure
from figures.report import style
from flatland2d.directions import MAPS
from flatland2d.probe_pictures import depth_picture, volume_picture
from flatland2d.probe_rooms import PROBE_ROOMS, probes
from flatland2d.scenes import Setting
from restir_ref.chance import Live
from restir_ref.transport.cache.converge import converge
from restir_ref.transport.cache.grid import Grid
from restir_ref.transport.cache.update import Updating
from restir_ref.transport.cache.volume import Volume, unlit

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Picture

ROOMS = PROBE_ROOMS
TOLD = ("irradiance", "inside a wall", "leaks, 1 % of E or more", "mean distance")
"""What legends say; colours of walls are told by the gallery of scenes."""

NAMES = {"sunlit": "FS11", "lamp_beside_probe": "FS12", "open_room": "FS13"}


def chunks(preset: Any) -> Sequence[Any]:
    """One per room."""
    return [{"room": name} for name in ROOMS]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """The converged volume: E (1, P, K), r (2, P, K')."""
    setting = ROOMS[chunk["room"]]()
    empty, how = unlit(setting.scene, grid(setting, preset), MAPS), Updating(rays=preset["rays"])
    v = converge(empty, setting.scene, how, Live(rng), tolerance=preset["tolerance"])
    return {"E": v.E, "r": v.r}


def grid(setting: Setting, preset: Any) -> Grid:
    """So many probes per unit as can be told apart in a picture."""
    return probes(setting, preset["per_unit"])


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """Volumes by the rooms' names."""
    pairs = zip(ROOMS, results, strict=True)
    found = {f"{room} {name}": array for room, result in pairs for name, array in result.items()}
    return {**found, "per unit": np.array(preset["per_unit"])}


def check(a: Arrays) -> list[Claim]:
    """Nothing: tests of volumes do."""
    return []


def draw(a: Arrays) -> "Picture":
    """Light above, depth below."""
    picture, axes = style.panels(2, len(ROOMS), width=3.7, height=3.9)
    for (above, below), room in zip(axes.T, ROOMS, strict=True):
        draw_room(above, below, room, a)
    return picture


def draw_room(above: "Axes", below: "Axes", room: str, a: Arrays) -> None:
    """A room twice."""
    setting = ROOMS[room]()
    v = stored(setting, a[f"{room} E"], a[f"{room} r"], float(a["per unit"]))
    volume_picture(above, setting, v)
    depth_picture(below, setting, v, np.flatnonzero(v.active)[::7].tolist())
    above.set_title(f"{NAMES[room]}: light")
    below.set_title(f"{NAMES[room]}: distance, every 7th probe")
    for axis in (above, below):
        lines, names = axis.get_legend_handles_labels()
        told = [(line, name) for line, name in zip(lines, names, strict=True) if name in TOLD]
        style.below(axis, handles=[line for line, _ in told], labels=[name for _, name in told], ncols=1)


def stored(setting: Setting, E: np.ndarray[Any, Any], r: np.ndarray[Any, Any], per_unit: float) -> Volume:
    """The volume that was computed."""
    empty = unlit(setting.scene, probes(setting, per_unit), MAPS)
    return Volume(empty.grid, empty.maps, E, r, empty.active, frames=1)


FIGURE = Figure(
    id="FLAT-PROBES",
    title="Rooms for probes, and what volumes know of them",
    world="flatland2d",
    source="scenes and volumes of this project, after [DDGIR 2]",
    claims=(),
    presets={
        "quick": {"per_unit": 8, "rays": 128, "tolerance": 0.04},
        "paper": {"per_unit": 8, "rays": 512, "tolerance": 0.01},
    },
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)
