"""GRIS Fig. 15, columns 2 and 3: ReSTIR DI takes most of the noise out of direct light, and leaves the indirect noise.

Sixty-four lamps behind slats.  One path tree per pixel and frame, whose direct light is replaced by ReSTIR DI
with 32 candidates, history and three neighbours, its weights 1/Z with visibility; the last frame of a moving camera
is shown.  Direct light alone has an exact reference, radiosity's first bounce.  Against it, ReSTIR DI is also run with
weights 1/M, which are not to be trusted where shadows end.
"""

from collections import Counter
from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims import criteria
from figures.claims.figure import Arrays, Claim, Conditions, Figure, Setup
from figures.experiments import realtime
from figures.experiments.references import reference
from figures.experiments.rendering import means, samples_of_equal_cost
from figures.experiments.views import motion_vectors, view
from figures.report import style
from flatland2d import SCENES
from flatland2d.radiosity import render
from flatland2d.sensors import Pinhole
from restir_ref.batch import Array
from restir_ref.chance import Chance, Live
from restir_ref.integrals import Pixels, Reservoirs
from restir_ref.loop import REAL_TIME, random_in_row
from restir_ref.metrics import mape
from restir_ref.mis import Weights
from restir_ref.restir import shade
from restir_ref.transport.baselines.restir_di import (
    BIASED,
    DEBIASED,
    LightIntegrals,
    direct_light,
    indirect_light,
    light_integrals,
)
from restir_ref.transport.counting import rays
from restir_ref.transport.paths import RECONNECTION, Tracer, Tree, first_hit, leaves, trace
from restir_ref.transport.scene import Scene

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Picture

SCENE = "many_lights"
PARTS = ("direct light", "whole image")
HOW = ("path tracing", "ReSTIR DI")
RAYS_OF_DIRECT_LIGHT = 3
"""Path tracing of direct light: from the eye, to a lamp, and a BSDF sample."""


def shadow_edges(scene: Scene, sensor: Pinhole, radius: int = 20) -> Array:
    """The quarter of the pixels that differ most in which lamps they see from those within a radius; (n,) bool."""
    v, _, _ = first_hit(Tracer(scene, sensor, 1, RECONNECTION), np.full((1, sensor.n), 0.5), np.arange(sensor.n))
    lamps = scene.lights.corners.mean(axis=0).T
    sees = np.array([scene.visible(v.x, np.broadcast_to(lamp[:, None], v.x.shape)) for lamp in lamps])
    near = [sees[:, max(i - radius, 0) : i + radius + 1] for i in range(sensor.n)]
    change = np.array([(sees[:, i : i + 1] != each).mean() for i, each in enumerate(near)])
    return np.asarray(change >= np.quantile(change, 0.75))


def chunks(preset: Any) -> Sequence[Any]:
    """Groups of independent runs."""
    return [{"group": k} for k in range(preset["groups"])]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """Images (part, how, run, pixel), rays per pixel of a tree and of ReSTIR DI; in some groups direct light by 1/M."""
    tree, ours, rays_of_both = last_frame(preset, DEBIASED["1/Z"], Live(rng))
    everything, rest = np.asarray(sum(F for _, _, F in leaves(tree))), indirect_light(tree)
    images = np.stack([[everything - rest, ours], [everything, ours + rest]]).mean(axis=2)
    shape = (preset["replicas"], -1)
    found = {"images": realtime.inset(images.reshape(2, 2, *shape)), "rays": rays_of_both}
    if chunk["group"] >= preset["biased"]:
        return found
    _, dark, _ = last_frame(preset, BIASED, Live(rng))
    return found | {"biased": realtime.inset(dark.mean(axis=0).reshape(shape))}


def last_frame(preset: Any, mis: Weights, chance: Chance) -> tuple[Tree, Array, Array]:
    """Of a moving camera's last frame: trees, their direct light by ReSTIR DI (C, N), rays per pixel of both (2,)."""
    asked = Counter[str]()
    views = [view(SCENE, RECONNECTION, asked, each) for each in realtime.widened(SCENE)[-preset["frames"] :]]
    n, index = views[0].n, np.arange(preset["replicas"] * views[0].n)
    history: Reservoirs | None = None
    before: list[Pixels] = []
    for paths, following in pairwise(views):
        t = paths.tracer
        of = light_integrals(t, chance.uniform((t.D, len(index))), index % n)
        history = one_frame(of, index, mis, chance, history, before)
        before = [Pixels(of, index - index % n + motion_vectors(following, paths)[index % n])]
    t, start = views[-1].tracer, rays(asked)
    tree = trace(t, chance.uniform((t.D, len(index))), index % n)
    traced, of = rays(asked), LightIntegrals(t.scene, n, tree.x[0], tree.T[0])
    shown = shade(one_frame(of, index, mis, chance, history, before), Pixels(of, index))
    of_tree, of_light = (traced - start) / len(index), (rays(asked) - traced) / len(index) + realtime.MOTION_RAYS
    return tree, shown, np.array([of_tree, of_light])


def one_frame(
    of: LightIntegrals, index: Array, mis: Weights, chance: Chance, history: Reservoirs | None, before: Sequence[Pixels]
) -> Reservoirs:
    """Direct light with the neighbours of the real-time preset."""
    near = random_in_row(of, index, REAL_TIME.neighbours, REAL_TIME.radius, chance)
    return direct_light(Pixels(of, index), near, mis, chance, history, before)


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """All images, costs, and references (part, pixel)."""
    setting = SCENES[SCENE]()
    scene, sensor = setting.scene, setting.pinhole()
    return {
        "images": np.concatenate([result["images"] for result in results], axis=2),
        "biased": np.concatenate([result["biased"] for result in results if "biased" in result]),
        "rays": np.mean([result["rays"] for result in results], axis=0),
        "reference": np.stack([render(scene, sensor, 1), reference(SCENE).mean]),
        "edges": shadow_edges(scene, sensor),
    }


def errors(a: Arrays) -> Array:
    """MAPE (part, how, replica)."""
    return np.stack([mape(images, truth) for images, truth in zip(a["images"], a["reference"], strict=True)])


def check(a: Arrays) -> list[Claim]:
    """Ratios of errors, what the same rays would have bought, and means."""
    direct, whole = errors(a)
    ratios = [float(each[1].mean() / each[0].mean()) for each in (direct, whole)]
    T = samples_of_equal_cost(float(a["rays"][1]) + 1, RAYS_OF_DIRECT_LIGHT)
    averaged = mape(means(a["images"][0, 0], T), a["reference"][0]).mean()
    reason = (
        f"Frame against frame, as in the paper.  ReSTIR DI traces {a['rays'][1]:.0f} rays per pixel, a tree "
        f"{a['rays'][0]:.1f} rays; to the mean of {T} samples of direct light, which cost the same, the ratio is "
        f"{direct[1].mean() / averaged:.2f}."
    )
    return [
        Claim(
            "GRIS-F15di",
            criteria.ratio_below(direct[1], direct[0], 0.4),
            "MAPE of direct light",
            counter=criteria.ratio_above(direct[1], direct[0], 1),
            reason=reason,
        ),
        Claim("GRIS-F15di", criteria.above(ratios[1] / ratios[0], 1), "MAPE ratio, whole image / direct light"),
        *check_means(a),
    ]


def check_means(a: Arrays) -> list[Claim]:
    """No bias with weights that see obstacles, too dark at the edges of shadows with 1/M."""
    edges, (direct, whole) = a["edges"], a["reference"]

    def unbiased(images: Array, truth: Array, eps: float = 0.005) -> criteria.Outcome:
        return criteria.unbiased(images.mean(axis=1), float(truth.mean()), eps)

    ours, edge = a["images"][0, 1], float(direct[edges].mean())
    dark = criteria.biased(a["biased"][:, edges].mean(axis=1), edge, -1, -0.01)
    return [
        Claim("COM-B04", unbiased(ours, direct), "1/Z with visibility: image"),
        Claim("COM-B04", unbiased(ours[:, edges], direct[edges], 0.01), "1/Z with visibility: edges of shadows"),
        Claim("COM-B04", dark, "1/M: edges of shadows"),
        Claim("COM-B08", unbiased(a["images"][1, 1], whole), "whole image"),
    ]


def draw(a: Arrays) -> "Picture":
    """Images as strips, errors, and means of direct light along the row."""
    picture, axes = style.panels(1, 3, width=4.2, height=3.4)
    draw_images(axes[0, 0], a)
    draw_errors(axes[0, 1], errors(a))
    draw_means(axes[0, 2], a)
    return picture


def draw_images(axis: "Axes", a: Arrays) -> None:
    """The first run: without ReSTIR DI, with it, and the truth, of both parts."""
    rows = [row for images, truth in zip(a["images"], a["reference"], strict=True) for row in (*images[:, 0], truth)]
    labels = [f"{part}, {how}" for part in ("direct", "whole") for how in (*HOW, "reference")]
    style.strips(axis, rows, labels, 2 * a["reference"].max(), len(rows[0]))
    axis.plot([0, len(rows[0])], [3, 3], color=style.PAPER, ls="-", marker="", lw=3)
    axis.set(xlabel="pixel", title="One frame")


def draw_errors(axis: "Axes", error: Array) -> None:
    """MAPE of both parts."""
    for how, name in enumerate(HOW):
        place = np.arange(2) + 0.36 * (how - 0.5)
        bars = axis.bar(place, error[:, how].mean(axis=1), 0.34, **style.bar(name))
        axis.bar_label(bars, fmt="%.2f")
    axis.set_xticks([0, 1], PARTS)
    axis.set(ylabel="MAPE", title="Error of a frame", ylim=(0, 1.3 * error.mean(axis=2).max()))
    axis.legend(loc="upper right", ncols=2)


def draw_means(axis: "Axes", a: Arrays) -> None:
    """Mean direct light of all runs, 1/Z with visibility and 1/M, over the truth."""
    truth = a["reference"][0]
    for images, name, label in ((a["images"][0, 1], "1/Z", "1/Z with visibility"), (a["biased"], "1/M", "1/M")):
        look = style.look(name, marker="", label=label)
        mean, error = images.mean(axis=0) / truth, images.std(axis=0, ddof=1) / np.sqrt(len(images)) / truth
        axis.fill_between(np.arange(len(truth)), mean - 2 * error, mean + 2 * error, color=look["color"], alpha=0.3)
        axis.plot(mean, **look)
    axis.axhline(1, **style.look("truth"))
    edges = np.flatnonzero(a["edges"])
    axis.plot(
        edges, np.full(len(edges), 0.5), color=style.INK, marker="|", ls="", markevery=1, label="edges of shadows"
    )
    axis.set(
        xlabel="pixel", ylabel="mean / truth, ± 2 standard errors", title="Direct light by ReSTIR DI", ylim=(0.4, 1.45)
    )
    axis.legend(loc="upper left")


FIGURE = Figure(
    id="GRIS-F15di",
    title="ReSTIR DI in the light of many lamps",
    world="flatland2d",
    source="[GRIS Fig. 15; 9.3]",
    claims=("GRIS-F15di", "COM-B04", "COM-B08"),
    conditions=(
        Conditions(
            ("GRIS-F15di",),
            "[GRIS Fig. 15; 9.3]",
            Setup("real time", "moving", "direct by ReSTIR DI", "large scenes, with and without ReSTIR DI"),
            Setup("real time", "moving", "direct by ReSTIR DI", "floor below 64 lamps behind slats (FS15)"),
        ),
        Conditions(
            ("COM-B04", "COM-B08"),
            "baselines, not tied to a figure",
            Setup("real time", "moving", "direct by ReSTIR DI", "light of many lamps"),
            Setup("real time", "moving", "direct by ReSTIR DI", "floor below 64 lamps behind slats (FS15)"),
        ),
    ),
    presets={
        "quick": {"groups": 18, "biased": 4, "replicas": 32, "frames": 8},
        "paper": {"groups": 64, "biased": 16, "replicas": 32, "frames": 12},
    },
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)
