"""Gradient renderers: views of a camera with their pairs, and what three methods make of their differences.  [GPT 4-5]

Rows of flatland move as in all real-time figures, and are judged by the inset in their middle.  Maps of its fluence
stand still, and leave out the light that the map's own rays meet.  Their crops are fixed here, before anything was
measured: a twentieth of a unit around a corner or an edge that the scene has.
"""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any

import numpy as np

from figures.claims.figure import Arrays
from figures.experiments.realtime import MARGIN, MOTION_RAYS, approach
from figures.experiments.references import reference
from figures.experiments.views import HYBRID, setting
from flatland2d.motion import motion
from flatland2d.sensors import FluenceMap
from restir_ref.batch import Array
from restir_ref.chance import Chance, Live
from restir_ref.gradient import gradient_after
from restir_ref.gradient_loop import (
    GRADIENT,
    PRIMAL,
    GradientPreset,
    Group,
    View,
    forward,
    nearer,
    pairs_of,
    shaded,
    step,
)
from restir_ref.images import alike_among, random_in_disk
from restir_ref.integrals import Pixels, Reservoirs
from restir_ref.loop import Around, random_in_row
from restir_ref.restir import initial, shade
from restir_ref.transport.baselines.gradient_path_tracing import difference, grown, radiance_of
from restir_ref.transport.counting import counted, rays
from restir_ref.transport.distinct import distinct
from restir_ref.transport.edges import TRIES, edges, like_pairs, seen
from restir_ref.transport.paths import Sensor, Tracer
from restir_ref.transport.restir_pt import PathIntegrals, ScatteredIntegrals
from restir_ref.transport.scene import Scene

MAPS: Mapping[str, tuple[float, float]] = MappingProxyType(
    {"occluders": (0.5, 0.45), "ajar": (0.98, 0.33), "checker": (0.5, 0.025), "rack": (0.48, 0.6)}
)
"""Middles of the crops of maps: the corner of a post, the slit of the door, two squares of the floor, a bar's end."""

CROP, SIDE = 0.05, 24
"""Width of a crop of a map, in units of length, and its pixels along a side."""

MAP_FRAMES = 10
"""Frames of a map, the last of which is judged."""


@dataclass(frozen=True)
class Spatial:
    """Which pairs reuse in space, "none", "all" or the "edges", and among whom: "random" or "aligned" neighbours.

    [GPT 4.3.2]
    """

    who: str
    whom: str


ADAPTIVE, DENSE, NONE = Spatial("edges", "aligned"), Spatial("all", "random"), Spatial("none", "random")


# ---------------------------------------------------------------- views


def sensors_of(name: str) -> Sequence[Sensor]:
    """The sensors of all frames of "scene row" or "scene map"."""
    scene, _, kind = name.partition(" ")
    if kind == "row":
        return approach(scene)
    (x, y), half = MAPS[scene], CROP / 2
    return [FluenceMap((x - half, y - half), (x + half, y + half), SIDE, SIDE)] * MAP_FRAMES


def views_of(name: str, preset: GradientPreset, spatial: Spatial, asked: Counter[str]) -> list[View]:
    """Every frame with its pairs along the row, or in both directions of a map."""
    sensors = sensors_of(name)
    scene, found = name.partition(" ")[0], {}
    for sensor, before in zip(sensors, [sensors[0], *sensors], strict=False):
        if id(sensor) not in found:
            found[id(sensor)] = gradient_view(scene, (sensor, before), asked, preset, spatial)
    return [found[id(sensor)] for sensor in sensors]


def gradient_view(
    scene: str, moves: tuple[Sensor, Sensor], asked: Counter[str], preset: GradientPreset, spatial: Spatial
) -> View:
    """The frame of the first sensor after that of the second: its pixels, and its pairs in every direction."""
    s, sensor = setting(scene), moves[0]
    kind = ScatteredIntegrals if isinstance(sensor, FluenceMap) else PathIntegrals
    image = kind(Tracer(counted(s.scene, asked), sensor, s.depth, HYBRID))
    by, depth = displacement(s.scene, *moves)
    view = {PRIMAL: Group({PRIMAL: image}, image.shape, by, around(image.shape), np.ones(image.n, dtype=bool))}
    for name, (ends, shape) in forward(image.shape).items():
        active, choice = reusing(s.scene, sensor, (ends, shape), spatial)
        view[name] = Group(pairs_of(image, ends, preset.partners), shape, nearer(by, depth, ends), choice, active)
    return view


def reusing(scene: Scene, sensor: Sensor, pairs: tuple[Array, Sequence[int]], spatial: Spatial) -> tuple[Array, Around]:
    """Which pairs reuse in space, and their choice of neighbours."""
    (ends, shape), g = pairs, seen(scene, sensor)
    everybody = np.ones(ends.shape[1], dtype=bool)
    active = {"none": ~everybody, "all": everybody, "edges": edges(g, ends)}
    random = around(shape)
    return active[spatial.who], {"random": random, "aligned": alike_among(like_pairs(g, ends), random, TRIES)}[
        spatial.whom
    ]


def around(shape: Sequence[int]) -> Around:
    """Random neighbours in a row, or in an image."""
    return random_in_row if len(shape) == 1 else random_in_disk((shape[0], shape[1]))


def displacement(scene: Scene, sensor: Any, before: Any) -> tuple[Array, Array]:
    """Where `before` showed what pixels see, (film, n) in pixels from where they are, and their depths (n,)."""
    depth = seen(scene, sensor).t
    if sensor == before:
        return np.zeros((sensor.film_numbers, sensor.n)), depth
    return (motion(scene, sensor, before).place - np.arange(sensor.n) - 0.5)[None], depth


# ---------------------------------------------------------------- methods


def with_restir(
    views: Sequence[View], asked: Counter[str], replicas: int, chance: Chance, preset: GradientPreset = GRADIENT
) -> Arrays:
    """Gradient with ReSTIR: differences and image of the last frame, and its rays per pixel.  [GPT 4.2-4.4]"""
    spent, last = 0, None
    for view in views:
        spent = rays(asked)
        last = view, step(view, chance, preset, replicas, last)
    view, history = last  # type: ignore[misc]
    found = {name: grey(shaded(group, history[name]), replicas) for name, group in view.items()}
    return found | {"rays": np.array((rays(asked) - spent) / (replicas * view[PRIMAL].n) + MOTION_RAYS)}


def after_restir(
    views: Sequence[View], asked: Counter[str], replicas: int, chance: Chance, preset: GradientPreset = GRADIENT
) -> Arrays:
    """Gradient after ReSTIR: the image's own samples shifted to their neighbours.  [GPT 4.1]"""
    spent, last = 0, None
    for view in views:
        spent, alone = rays(asked), {PRIMAL: view[PRIMAL]}
        last = alone, step(alone, chance, preset, replicas, last)
    view, X = views[-1], last[1][PRIMAL][PRIMAL]  # type: ignore[index]
    return differences(view, X, replicas) | {
        "rays": np.array((rays(asked) - spent) / (replicas * view[PRIMAL].n) + MOTION_RAYS)
    }


def path_traced(views: Sequence[View], asked: Counter[str], replicas: int, chance: Chance) -> Arrays:
    """Gradient-domain path tracing: one path tree per pixel, one leaf of which is shifted.  [GPT 5, B.2]"""
    view = views[-1]
    X = initial(Pixels(view[PRIMAL].of[PRIMAL], np.arange(replicas * view[PRIMAL].n)), chance)
    return differences(view, X, replicas) | {"rays": np.array(rays(asked) / (replicas * view[PRIMAL].n))}


def whole_trees(views: Sequence[View], asked: Counter[str], replicas: int, chance: Chance) -> Arrays:
    """Gradient-domain path tracing that shifts all leaves of its trees, and traces once what they share.  [KMA15]"""
    view = views[-1]
    n, image = view[PRIMAL].n, view[PRIMAL].of[PRIMAL]
    assert isinstance(image, PathIntegrals)
    seen_once = replace(image, tracer=replace(image.tracer, scene=distinct(image.tracer.scene)))
    trees = grown(seen_once, np.arange(replicas * n), chance)
    found = {PRIMAL: grey(radiance_of(trees), replicas)}
    for name, (ends, _) in forward(view[PRIMAL].shape).items():
        i, j = ((np.arange(replicas)[:, None] * n + end).ravel() for end in ends)
        found[name] = grey(difference(trees, Pixels(seen_once, i), Pixels(seen_once, j)), replicas)
    return found | {"rays": np.array(rays(asked) / (replicas * n))}


def differences(view: View, X: Reservoirs, replicas: int) -> Arrays:
    """The image and its differences from its own samples; (replicas, n) each."""
    image, n = view[PRIMAL].of[PRIMAL], view[PRIMAL].n
    found = {PRIMAL: grey(shade(X, Pixels(image, np.arange(replicas * n))), replicas)}
    for name, (ends, _) in forward(view[PRIMAL].shape).items():
        i, j = ((np.arange(replicas)[:, None] * n + end).ravel() for end in ends)
        found[name] = grey(gradient_after(X, Pixels(image, i), Pixels(image, j)), replicas)
    return found


def grey(estimates: Array, replicas: int) -> Array:
    """The mean over channels, (replicas, n)."""
    return np.asarray(estimates.mean(axis=0).reshape(replicas, -1))


def temporal_only(views: Sequence[View], asked: Counter[str], replicas: int, chance: Chance) -> Arrays:
    """The same with a history and no neighbours, which in easy places is the better image."""
    alone = replace(GRADIENT, pixels=replace(GRADIENT.pixels, rounds=0))
    return after_restir(views, asked, replicas, chance, alone)


Method = Callable[[Sequence[View], Counter[str], int, Chance], Arrays]

METHODS: Mapping[str, Method] = MappingProxyType(
    {"with": with_restir, "after": after_restir, "path tracing": whole_trees}
)


def rendered(
    name: str,
    method: Method,
    replicas: int,
    rng: np.random.Generator,
    preset: GradientPreset = GRADIENT,
    spatial: Spatial = ADAPTIVE,
) -> Arrays:
    """The last frame of a view by one method: what the inset shows of it."""
    asked = Counter[str]()
    views = views_of(name, preset, spatial, asked)
    return {key: inner(name, key, each) for key, each in method(views, asked, replicas, Live(rng)).items()}


def inner(name: str, key: str, images: Array) -> Array:
    """Pixels, or pairs, of the inset of a row; a map is all there is."""
    return images[..., MARGIN:-MARGIN] if name.endswith("row") and images.ndim > 1 else images


# ---------------------------------------------------------------- errors


def spread(parts: Sequence[Array]) -> Array:
    """Squared distance from the mean over replicas of every one, whose mean is the variance; (R,).

    Of unbiased estimates (R, n) in every direction it is the expected squared error, and needs no reference.
    """
    R = len(parts[0])
    return np.asarray(sum(((each - each.mean(axis=0)) ** 2).mean(axis=-1) for each in parts) * R / (R - 1))


def true_differences(scene: str) -> Array:
    """Of the row's reference, forwards."""
    return np.diff(reference(scene).mean)


def error(images: Array, truth: Array) -> Array:
    """Squared error over the mean of the squared truth, of every replica; (R,)."""
    return np.asarray(((images - truth) ** 2).mean(axis=-1) / (truth**2).mean())


def averaged(images: Array, count: int) -> Array:
    """Means of `count` images each, (R // count, n): what a cheap method does with the rays of a dear one."""
    kept = images[: len(images) // count * count]
    return np.asarray(kept.reshape(-1, count, images.shape[-1]).mean(axis=1))
