"""DDGI resampling Fig. 5: what queries at x_2 leak at sharp corners, displaced off the surface and along the path.

One frozen volume per grid, grids stand anywhere, and all ways get the same rays.  Leak energy is the part of the image
that is told by probes that do not see x_2; it is caused by the displacement where that moves the query through a
surface.  Left a wedge of 30 degrees, seen from before it, right the corner beside a wall in the sun, with and without
thickness: above the part of the image that leaks, below what leaks in all, by spacing.

The control is not displaced at all: where it leaks as much, Chebyshev's test is to blame and not the displacement.
"""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims import criteria
from figures.claims.figure import Arrays, Claim, Conditions, Figure, Setup
from figures.experiments.alignments import WAYS, Room, displaced
from figures.report import style
from restir_ref.batch import Array
from restir_ref.chance import Live

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture

THICK = 0.4
"""Spacings of probes: the thickness of walls that have one."""

ROOMS: Mapping[str, tuple[str, float]] = {
    "FS4, 30 degrees": ("wedge", 0.0),
    "FS4, slab": ("wedge", THICK),
    "FS11": ("sun", 0.0),
    "FS11, slabs": ("sun", THICK),
}
"""Rooms and thicknesses, in spacings."""

OFF, ALONG, UNMOVED = WAYS

JUDGED = 8
"""Probes per unit."""

OWN = 0.2
"""Undisplaced queries may leak such a share of what those off the surface do: more, and it is not the displacement."""


def chunks(preset: Any) -> Sequence[Any]:
    """A room and a spacing."""
    return [{"view": name, "per_unit": each} for name in ROOMS for each in preset["spacings"]]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """By way: what leaks and all that is told (grids, pixels), and the share of queries moved through a surface."""
    (name, thickness), per_unit, chance = ROOMS[chunk["view"]], chunk["per_unit"], Live(rng)
    grids = preset["grids" if per_unit == JUDGED else "few grids"]
    rows = [displaced(Room(name, thickness / per_unit), per_unit, preset, chance) for _ in range(grids)]
    return {key: np.stack([row[key] for row in rows]) for key in rows[0]}


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """Arrays by room, spacing, way and name."""
    found: Arrays = {"spacings": 1 / np.array(preset["spacings"], dtype=float)}
    for chunk, result in zip(chunks(preset), results, strict=True):
        found |= {f"{chunk['view']} {chunk['per_unit']:g} {name}": array for name, array in result.items()}
    return found


def leaks(a: Arrays, name: str, way: str, what: str = "leak") -> Array:
    """What leaks over mean true light, at the spacing that is judged; (grids,)."""
    key = f"{name} {JUDGED:g}"
    return np.asarray(a[f"{key} {way} {what}"].mean(axis=1) / a[f"{key} truth"].mean())


STAYS = (
    "Leaks stay that no displacement causes: undisplaced queries have them too, at walls without thickness and in "
    "wedges."
)

CAUSED = (
    "Queries that the default moves through a surface, {share:.1f} % of all, are told {off:.2f} of the true light by "
    "probes that do not see x_2."
)


def check(a: Arrays) -> list[Claim]:
    """Nothing is moved through a surface; less leaks along the path; next to nothing where walls are thick."""
    return [claim for name in ROOMS for claim in (moved(a, name), less(a, name), little(a, name), biased(a, name))]


def moved(a: Arrays, name: str) -> Claim:
    """The share of queries that the path's displacement moves through a surface; the default moves some."""
    off, along = (a[f"{name} {JUDGED:g} {way} through"].max() for way in (OFF, ALONG))
    if not off > 0:
        return Claim("DDGIR-F05", None, f"{name}, moved through a surface", reason="No query is, off the surface.")
    share = 100 * a[f"{name} {JUDGED:g} {OFF} through"].mean()
    told = CAUSED.format(share=share, off=leaks(a, name, OFF, "caused").mean())
    outcome = criteria.equal_to(along, 0.0, 0)
    return Claim("DDGIR-F05", outcome, f"{name}, moved through a surface", criteria.above(along, 0.01), reason=told)


def less(a: Arrays, name: str) -> Claim:
    """All that leaks, along the path over off the surface."""
    off, along = leaks(a, name, OFF), leaks(a, name, ALONG)
    unmoved = leaks(a, name, UNMOVED)
    share = criteria.ratio_interval(unmoved, off)[2]
    told = f"Off the surface {off.mean():.2f} of the true light leaks; not displaced, {share} of that."
    ratio, counter = criteria.ratio_below(along, off, 1), criteria.ratio_above(along, off, 1)
    caveat = STAYS if unmoved.mean() > OWN * off.mean() else ""
    return Claim("DDGIR-F05", ratio, f"{name}, leak energy", counter, caveat, told)


def little(a: Arrays, name: str) -> Claim:
    """The same below a fifth, judged where it is the displacement that leaks."""
    off, along, unmoved = (leaks(a, name, way) for way in (OFF, ALONG, UNMOVED))
    ratio, counter = criteria.ratio_below(along, off, OWN), criteria.ratio_above(along, off, 1)
    part, own = f"{name}, leak energy below a fifth", float(unmoved.mean() / off.mean())
    if own < OWN:
        return Claim("DDGIR-F05", ratio, part, counter, reason=f"Undisplaced queries leak {own:.2g} of the default's.")
    why = f"Undisplaced queries leak {own:.2g} of what the default's do: no displacement can take that away."
    return Claim("DDGIR-F05", criteria.reported(ratio.measured), part, reason=why)


def biased(a: Arrays, name: str) -> Claim:
    """Of the image, by way."""
    key = f"{name} {JUDGED:g}"
    truth = a[f"{key} truth"]
    told = [f"{way} {100 * (a[f'{key} {way} all'] - truth).mean() / truth.mean():+.0f} %" for way in WAYS]
    return Claim("DDGIR-F05", criteria.reported(", ".join(told)), f"{name}, bias of the image")


def draw(a: Arrays) -> "Picture":
    """What leaks by pixel at the spacing that is judged, and the share of the image that leaks by spacing."""
    picture, axes = style.panels(2, 4, width=3.0, height=3.4)
    for above, below, name in zip(axes[0], axes[1], ROOMS, strict=True):
        key = f"{name} {JUDGED:g}"
        for k, way in enumerate(WAYS):
            above.plot(a[f"{key} {way} leak"].mean(axis=0), **style.nth(k + 2 * (k > 0), label=f"leaks, {way}"))
            look = style.nth(k + 2 * (k > 0), label=way, markevery=1)
            below.plot(a["spacings"], np.maximum(shares(a, name, way), 1e-4), **look)
        above.plot(a[f"{key} truth"].mean(axis=0), **style.look("truth", label="all light, truth"))
        above.set(xlabel="pixel", ylabel="indirect radiance", title=f"{name}: {JUDGED:g} per unit")
        below.set(xlabel="probe spacing (scene units)", ylabel="leaks over true light", title=name)
        below.set(xscale="log", yscale="log")
        low, high = np.log10(below.get_ylim())
        below.set_ylim(10 ** np.floor(low), 10 ** np.ceil(high))
        below.set_xticks(a["spacings"], [f"1/{1 / each:g}" for each in a["spacings"]])
        below.minorticks_off()
        style.below(above, ncols=1)
        style.below(below, ncols=1)
    return picture


def shares(a: Arrays, name: str, way: str) -> Array:
    """What leaks over true light, by spacing."""
    keys = [f"{name} {1 / h:g}" for h in a["spacings"]]
    return np.array([a[f"{key} {way} leak"].mean() / a[f"{key} truth"].mean() for key in keys])


FIGURE = Figure(
    id="DDGIR-F05",
    title="Queries displaced along the path, and off the surface",
    world="flatland2d",
    source="[DDGIR Fig. 5, Sec. 3.4]",
    claims=("DDGIR-F05",),
    presets={
        "quick": {"spacings": [4, 8], "pixels": 32, "rays": 32, "grids": 8, "few grids": 4, "tolerance": 0.06},
        "paper": {"spacings": [4, 8, 16], "pixels": 64, "rays": 128, "grids": 64, "few grids": 16, "tolerance": 0.02},
    },
    conditions=(
        Conditions(
            ("DDGIR-F05",),
            "Fig. 5",
            paper=Setup("one pass", "still", "all", "sharp corners of a room"),
            ours=Setup(
                "one pass", "still", "indirect", "FS4 with a wedge of 30 degrees; FS11's corner; slabs as walls"
            ),
            why="Direct light of x_1 is exact by ReSTIR DI in both: it has no part in biases.",
        ),
    ),
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)
