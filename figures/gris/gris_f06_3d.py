"""GRIS Fig. 6c in space: spatiotemporal reuse of one path tree per pixel, by both shifts, with glossy boxes.

As in flatland: indirect light, a still camera, equal samples.  Glossy pixels are those of an inset with two boxes that
mirror each other.  Edges are those at the foot of one, where connections are short and the geometry term is singular.
Rough pixels are those of the same room, away from edges, in five crops that nobody chose.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims import criteria
from figures.claims.figure import Arrays, Claim, Conditions, Figure, Setup
from figures.experiments import corners, indirect, nearby, realtime, solid
from figures.experiments.references import INDIRECT, reference
from figures.experiments.views import HYBRID, standard
from figures.experiments.views import view as view_of
from figures.gris.gris_f06 import pair
from figures.report import style
from restir_ref.batch import Array
from restir_ref.loop import REAL_TIME
from restir_ref.transport.baselines.restir_di import indirect_light
from restir_ref.transport.paths import trace

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Picture

BOX, FOOT, ROOM, MATT = "CB3-glossy, box", "CB3-glossy, foot", "CB3-glossy", "CB3"
RENDERED: Mapping[str, tuple[str, ...]] = {
    BOX: ("reconnection", "hybrid"),
    FOOT: ("reconnection", "no distance test", "hybrid"),
    ROOM: ("reconnection", "hybrid"),
    MATT: ("reconnection", "hybrid"),
}
"""Views and shifts.  Insets have a chosen place in the scene, the others are crops that nobody chose."""

BOXES, GLOSS = 3, 1
"""Material of the boxes, and which of its lobes is the glossy one."""

LIGHT = "light"


def chunks(preset: Any) -> Sequence[dict[str, str]]:
    """One per view that the preset has replicas of, and shift; and where the light of boxes comes from."""
    views = preset["replicas"]
    rendered = [{"scene": view, "method": method} for view in views for method in RENDERED[view]]
    return rendered + [{"scene": view, "what": LIGHT} for view in (BOX, ROOM) if view in views]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """Errors of pixels, mean over the last half of a still camera's frames (replicas, n), and one last frame.

    Or shares of each pixel's light, by kind.
    """
    view = chunk["scene"]
    if "what" in chunk:
        return {LIGHT: shares(view, preset["trees"], rng)}
    sensor = solid.inset(view, preset["wide"]) if view in solid.INSETS else standard(view)
    method, replicas = indirect.METHODS[chunk["method"]], preset["replicas"][view]
    images = realtime.still(method, view, replicas, rng, sensor)["images"][1:]
    error = corners.relative(images, truth(view, preset["wide"])).mean(axis=0)
    return {"error": error, "image": images[-1, 0]}


def shares(view: str, trees: int, rng: np.random.Generator) -> Array:
    """Each pixel's indirect light from x_2 on a box, that which leaves x_1 by the glossy lobe, and all, (3, n)."""
    t = view_of(view, HYBRID, Counter()).tracer
    pixel = np.tile(np.arange(t.sensor.n), trees)
    tree = trace(t, rng.random((t.D, len(pixel))), pixel)
    L = indirect_light(tree).mean(axis=0)
    kinds = (t.scene.material[tree.x[1].prim] == BOXES, tree.at[0].lobe == GLOSS, np.ones(len(L), dtype=bool))
    return np.stack([(L * kind).reshape(trees, -1).sum(axis=0) for kind in kinds])


def truth(view: str, wide: int) -> Array:
    """The reference of indirect light, (n,); of an inset its middle, so many pixels wide."""
    image = reference(view, INDIRECT).mean
    if view not in solid.INSETS:
        return image
    aside = (solid.WIDE - wide) // 2
    return image.reshape(solid.WIDE, -1)[aside : aside + wide, aside : aside + wide].ravel()


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """Errors (replicas, n) and one frame by "view.shift.name", references by "view.reference"; what pixels see."""
    arrays: Arrays = {}
    for chunk, part in zip(chunks(preset), results, strict=True):
        kind = [chunk["method"]] if "method" in chunk else []
        arrays |= {".".join([chunk["scene"], *kind, key]): part[key] for key in part}
    arrays |= {f"{view}.reference": truth(view, preset["wide"]) for view in preset["replicas"]}
    for view in preset["replicas"]:
        arrays |= masks(view) if view != BOX else {}
    return arrays


def masks(view: str) -> Arrays:
    """Pixels that see a `box`, those that are `rough`, at an `edge` and `away` from any, by "view.name".

    At an edge another surface is within the distance test; away from it is farther than the radius of reuse.
    """
    edge = nearby.within(view, HYBRID.distance)
    away = ~nearby.around(edge, standard(view), REAL_TIME.radius)
    box = nearby.of_material(view, BOXES)
    beside = nearby.within(view, HYBRID.distance / NEARER)
    found = {"box": box, "rough": ~box, "edge": edge, "away": away, "beside": beside, "box's edge": edge & box}
    return {f"{view}.{name}": mask for name, mask in found.items()}


NEARER = 4
"""By what `beside` an edge is nearer than the distance test asks."""


# ---------------------------------------------------------------- verdicts


def check(a: Arrays) -> list[Claim]:
    """The glossy box; rough surfaces away from edges; the foot of a box; and beside them what other pixels say."""
    claims = [glossy(a), rough(a), distance_test(a)]
    return [*claims, *(beside(a, part, *where) for part, where in REPORTED.items())]


def glossy(a: Arrays) -> Claim:
    """Hybrid against reconnection where glossy boxes mirror each other."""
    everything = np.ones(len(a[f"{BOX}.reference"]), dtype=bool)
    both = pair(a, BOX, "hybrid", "reconnection", everything)
    less, more = criteria.ratio_below(*both, 0.8), criteria.ratio_above(*both, 1)
    part, why = "glossy boxes: relMSE, hybrid / reconnection", mirrored(a, BOX, slice(None))
    return Claim("GRIS-F06", less, part, counter=more, caveat=FACE, reason=why)


def rough(a: Arrays) -> Claim:
    """Hybrid against reconnection on rough surfaces away from edges."""
    part = "rough surfaces away from edges: relMSE, hybrid / reconnection"
    if f"{ROOM}.away" not in a:
        return Claim("GRIS-F06", None, part, reason=LATER)
    mask = a[f"{ROOM}.away"] & a[f"{ROOM}.rough"]
    found = criteria.ratio_within(*pair(a, ROOM, "hybrid", "reconnection", mask), 0.8, 1.25)
    return Claim("GRIS-F06", found, part, reason=f"{mask.sum()} pixels of three crops. {ONE_MAP}")


def distance_test(a: Arrays) -> Claim:
    """The hybrid shift with and without its distance test at the foot of a glossy box."""
    part = "foot of a glossy box: relMSE, with / without distance test"
    if f"{FOOT}.edge" not in a:
        return Claim("GRIS-F06", None, part, reason=LATER)
    both = pair(a, FOOT, "hybrid", "no distance test", a[f"{FOOT}.edge"])
    less, more = criteria.ratio_below(*both, 0.9), criteria.ratio_above(*both, 1)
    pixels = a[f"{FOOT}.edge"].sum()
    why = f"{pixels} pixels with another surface within {HYBRID.distance:g} of the room's height. {NARROW}"
    return Claim("GRIS-F06", less, part, counter=more, reason=why)


LATER = "One view fits the time of the quick preset; the paper preset judges the others."
FACE = (
    "Where glossy boxes mirror each other. On a box's face in a crop that nobody chose both shifts have nearly the "
    "same error: hardly any of its light is mirrored."
)
ONE_MAP = "With rough boxes both shifts are one map away from edges, bit for bit, and nothing is compared there."

NARROW = "Few bright pixels decide, and most of what the test saves is saved where surfaces are nearest (below)."

BOTH, TESTED = "hybrid / reconnection", "with / without distance test"
REPORTED: Mapping[str, tuple[str, str, str]] = {
    "face of a glossy box that mirrors rough walls": (ROOM, "box", BOTH),
    "foot of a glossy box": (FOOT, "edge", BOTH),
    "edges of the room with rough boxes": (MATT, "edge", BOTH),
    "foot of a glossy box, a quarter as near": (FOOT, "beside", TESTED),
    "foot of a glossy box, on the box": (FOOT, "box's edge", TESTED),
}
"""Other pixels: the view, the mask, and what is compared."""

OTHERS = {BOTH: "reconnection", TESTED: "no distance test"}


def mirrored(a: Arrays, view: str, mask: Any) -> str:
    """Where the light of those pixels comes from, in words; nothing if it is not known."""
    if f"{view}.{LIGHT}" not in a:
        return ""
    from_box, by_gloss, whole = a[f"{view}.{LIGHT}"][:, mask].sum(axis=1)
    return f"{from_box / whole:.0%} of the light comes by way of a box, {by_gloss / whole:.0%} by the glossy lobe."


def beside(a: Arrays, what: str, view: str, mask: str, compared: str) -> Claim:
    """Two shifts at other pixels, without a rule."""
    part = f"{what}: relMSE, {compared}"
    if f"{view}.{mask}" not in a:
        return Claim("GRIS-F06", None, part, reason=LATER)
    pixels = a[f"{view}.{mask}"]
    found = criteria.ratio_interval(*pair(a, view, "hybrid", OTHERS[compared], pixels))[2]
    why = f"{pixels.sum()} pixels. {mirrored(a, view, pixels)}".strip()
    return Claim("GRIS-F06", criteria.reported(found), part, reason=why)


# ---------------------------------------------------------------- picture


def draw(a: Arrays) -> "Picture":
    """Frames of the insets that are there, and the errors of all pixels that are compared."""
    insets = [view for view in solid.INSETS if f"{view}.reference" in a]
    picture, axes = style.panels(1, len(insets) + 1, width=4.1, height=4.0)
    for axis, view in zip(axes[0], insets, strict=False):
        images = {"reference": a[f"{view}.reference"]}
        images |= {LINES.get(method, method): a[f"{view}.{method}.image"] for method in RENDERED[view]}
        wide = int(np.sqrt(len(images["reference"])))
        style.crops(axis, images, side=wide, title=f"{view}, frame {realtime.FRAMES}")
    _errors(axes[0, -1], a)
    return picture


LINES = {"no distance test": "no distance\ntest"}
BARS: Mapping[str, tuple[str, tuple[str, ...]]] = {
    "glossy\nboxes": (BOX, ()),
    "foot": (FOOT, ("edge",)),
    "rough,\naway": (ROOM, ("away", "rough")),
    "edges of\nrough": (MATT, ("edge",)),
}
"""Pixels whose errors are drawn: a view, and the masks that hold there."""


def _errors(axis: "Axes", a: Arrays) -> None:
    places = [(name, *each) for name, each in BARS.items() if f"{each[0]}.reference" in a]
    for k, method in enumerate(RENDERED[FOOT]):
        rows = {i: _of(a, view, method, masks) for i, (_, view, masks) in enumerate(places) if method in RENDERED[view]}
        spread = [1.96 * e.std(ddof=1) / np.sqrt(len(e)) for e in rows.values()]
        look = {"yerr": spread, "error_kw": {"lw": 0.8}, **style.bar(method)}
        if rows:
            axis.bar([i + 0.27 * (k - 1) for i in rows], [e.mean() for e in rows.values()], 0.25, **look)
    axis.set_xticks(range(len(places)), [name for name, *_ in places])
    axis.set_yscale("log")
    axis.grid(visible=False, axis="x")
    axis.set(ylabel="relMSE of a frame", title="Errors (bars: 95%)")
    style.below(axis, ncols=2)


def _of(a: Arrays, view: str, method: str, masks: Sequence[str]) -> Array:
    """relMSE of those pixels, (replicas,)."""
    error = a[f"{view}.{method}.error"]
    of = np.logical_and.reduce([np.ones(error.shape[1], dtype=bool), *(a[f"{view}.{name}"] for name in masks)])
    return np.asarray(error[:, of].mean(axis=1))


FIGURE = Figure(
    id="GRIS-F06-3D",
    title="Both shifts with spatiotemporal reuse, in space",
    world="tracer3d",
    source="[GRIS Fig. 6c; 7.5, 9.2]",
    claims=("GRIS-F06",),
    conditions=(
        Conditions(
            ("GRIS-F06",),
            "[GRIS Fig. 6c; 9.1, 9.2]",
            Setup("real time", "still", "indirect", "Cornell box with glossy boxes"),
            Setup("real time", "still", "indirect", "CB3-glossy: two insets with boxes, and five crops of the film"),
        ),
    ),
    arm="method",
    presets={
        "quick": {"wide": 24, "trees": 16, "replicas": {BOX: 8}},
        "paper": {"wide": 36, "trees": 256, "replicas": {BOX: 32, FOOT: 32, ROOM: 48, MATT: 16}},
    },
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)
