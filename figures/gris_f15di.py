"""GRIS Fig. 15, columns 2 and 3: ReSTIR DI takes most of the noise out of direct light, and leaves the indirect noise.

Sixty-four lamps behind slats.  One path tree per pixel and frame, whose direct light is replaced by ReSTIR DI
with 32 candidates, history and three neighbours, its weights 1/Z with visibility; the last frame of a run is shown.
Direct light alone has an exact reference, quadrature over the lamps.
"""

from collections import Counter
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from figures import criteria, style
from figures.figure import Arrays, Claim, Figure
from figures.flatland import means, samples_of_equal_cost, view
from figures.references import reference
from flatland2d.radiosity import cut, gather
from flatland2d.sensors import Pinhole
from restir_ref.batch import Array, take
from restir_ref.chance import Live
from restir_ref.integrals import Pixels, Reservoirs
from restir_ref.loop import REAL_TIME, random_in_row
from restir_ref.metrics import mape
from restir_ref.restir import shade
from restir_ref.transport.counting import rays
from restir_ref.transport.paths import RECONNECTION, Tracer, leaves, trace
from restir_ref.transport.restir_di import DEBIASED, LightIntegrals, direct_light, indirect_light
from restir_ref.transport.scene import Scene

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Picture

SCENE = "many_lights"
PARTS = ("direct light", "whole image")
HOW = ("path tracing", "ReSTIR DI")
RAYS_OF_DIRECT_LIGHT = 3
"""Path tracing of direct light: from the eye, to a lamp, and a BSDF sample."""


def direct_image(scene: Scene, sensor: Pinhole, film: int, per_lamp: int = 16) -> Array:
    """Direct light from panels of the lamps, `film` points per pixel; (n,)."""
    u = np.tile((np.arange(film) + 0.5) / film, sensor.n)[None]
    t = Tracer(scene, sensor, 1, RECONNECTION)
    v = trace(t, np.concatenate([u, np.full((t.D - 1, u.size), 0.5)]), np.repeat(np.arange(sensor.n), film)).x[0]
    panels = cut(scene, per_lamp)
    lamps = take(panels, np.flatnonzero(panels.emission > 0))
    arriving = gather(scene, lamps, lamps.emission, v.x, v.prim, v.n)
    return np.asarray(arriving.reshape(sensor.n, film).mean(axis=1))


def chunks(preset: Any) -> Sequence[Any]:
    """Groups of independent runs."""
    return [{"group": k} for k in range(preset["groups"])]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """Images of the last frame (part, how, replica, pixel), and rays per pixel of a tree and of ReSTIR DI beside it."""
    asked, chance = Counter[str](), Live(rng)
    paths = view(SCENE, RECONNECTION, asked)
    t, index = paths.tracer, np.arange(preset["replicas"] * paths.n)
    history: Reservoirs | None = None
    before: list[Pixels] = []
    for _ in range(preset["frames"]):
        start = rays(asked)
        tree = trace(t, chance.uniform((t.D, len(index))), index % paths.n)
        of = LightIntegrals(t.scene, paths.n, tree.x[0], tree.T[0])
        here, traced = Pixels(of, index), rays(asked)
        near = random_in_row(of, index, REAL_TIME.neighbours, REAL_TIME.radius, chance)
        X = direct_light(here, near, DEBIASED["1/Z"], chance, history, before)
        history, before = X, [here]
    everything, rest, ours = np.asarray(sum(F for _, _, F in leaves(tree))), indirect_light(tree), shade(X, here)
    images = np.stack([[everything - rest, ours], [everything, ours + rest]]).mean(axis=2)
    cost = np.array([traced - start, rays(asked) - traced]) / len(index)
    return {"images": images.reshape(2, 2, preset["replicas"], paths.n), "rays": cost}


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """All images, costs, and references (part, pixel)."""
    tracer = view(SCENE, RECONNECTION, Counter()).tracer
    sensor = tracer.sensor
    assert isinstance(sensor, Pinhole)
    return {
        "images": np.concatenate([result["images"] for result in results], axis=2),
        "rays": np.mean([result["rays"] for result in results], axis=0),
        "reference": np.stack([direct_image(tracer.scene, sensor, film=8), reference(SCENE).mean]),
    }


def errors(a: Arrays) -> Array:
    """MAPE (part, how, replica)."""
    return np.stack([mape(images, truth) for images, truth in zip(a["images"], a["reference"], strict=True)])


def check(a: Arrays) -> list[Claim]:
    """Ratios of errors, and what the same rays would have bought."""
    direct, whole = errors(a)
    ratios = [float(each[1].mean() / each[0].mean()) for each in (direct, whole)]
    T = samples_of_equal_cost(float(a["rays"][1]) + 1, RAYS_OF_DIRECT_LIGHT)
    averaged = mape(means(a["images"][0, 0], T), a["reference"][0]).mean()
    reason = (
        f"Frame against frame, as in the paper.  ReSTIR DI traces {a['rays'][1]:.0f} shadow rays per pixel, a tree "
        f"{a['rays'][0]:.1f} rays; to the mean of {T} samples of direct light, which cost the same, the ratio is "
        f"{direct[1].mean() / averaged:.2f}."
    )
    return [
        Claim("GRIS-F15di", criteria.ratio_below(direct[1], direct[0], 0.4), "MAPE of direct light", reason=reason),
        Claim("GRIS-F15di", criteria.above(ratios[1] / ratios[0], 1), "MAPE ratio, whole image / direct light"),
    ]


def draw(a: Arrays) -> "Picture":
    """Images as strips, and errors."""
    picture, axes = style.panels(1, 2, width=4.8, height=3.4)
    draw_images(axes[0, 0], a)
    draw_errors(axes[0, 1], errors(a))
    return picture


def draw_images(axis: "Axes", a: Arrays) -> None:
    """The first run: without ReSTIR DI, with it, and the truth, of both parts."""
    rows = [row for images, truth in zip(a["images"], a["reference"], strict=True) for row in (*images[:, 0], truth)]
    axis.imshow(rows, vmin=0, vmax=2 * a["reference"].max(), aspect="auto", extent=(0, len(rows[0]), len(rows), 0))
    labels = [f"{part}, {how}" for part in ("direct", "whole") for how in (*HOW, "reference")]
    axis.set_yticks(np.arange(len(rows)) + 0.5, labels)
    axis.axhline(3, color="w", lw=3)
    axis.grid(visible=False)
    axis.set(xlabel="pixel", title="One frame")


def draw_errors(axis: "Axes", error: Array) -> None:
    """MAPE of both parts."""
    for how, name in enumerate(HOW):
        place = np.arange(2) + 0.36 * (how - 0.5)
        hatch = ("", "//")[how]
        bars = axis.bar(place, error[:, how].mean(axis=1), 0.34, label=name, hatch=hatch, color=style.COLOURS[3 * how])
        axis.bar_label(bars, fmt="%.2f")
    axis.set_xticks([0, 1], PARTS)
    axis.set(ylabel="MAPE", title="Error of a frame", ylim=(0, 1.3 * error.mean(axis=2).max()))
    axis.legend(loc="upper right", ncols=2)


FIGURE = Figure(
    id="GRIS-F15di",
    title="ReSTIR DI in the light of many lamps",
    world="flatland2d",
    source="[GRIS Fig. 15; 9.3]",
    claims=("GRIS-F15di",),
    presets={
        "quick": {"groups": 4, "replicas": 32, "frames": 12},
        "paper": {"groups": 16, "replicas": 64, "frames": 40},
    },
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)
