"""Real-time renderers: chains of frames, their camera still or moving two to three pixels per frame.

A moving inset of flatland is the middle of a wider row: what enters at the row's ends has no neighbours beyond them and
no history of its own, as happens at the ends of a film of 1920 pixels only.  Crops of space follow what they show.
"""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from figures.claims.figure import Arrays
from figures.experiments import solid
from figures.experiments.flatland import displaced
from figures.experiments.rendering import estimates, film, means, path_tracing, samples_of_equal_cost
from figures.experiments.views import HYBRID, Traced, in_space, motion_vectors, setting, view
from flatland2d.sensors import Pinhole
from restir_ref.batch import Array
from restir_ref.chance import Chance, Live
from restir_ref.transport.baselines.restir_gi import RadianceIntegrals
from restir_ref.transport.counting import rays
from restir_ref.transport.paths import RECONNECTION, Connectability, Sensor, Tracer
from restir_ref.transport.restir_pt import PathIntegrals, ReconnectionAtX2

FRAMES = 20
"""Frames of a chain; the last one is judged, or of a still camera the last half."""

STEP = 0.001
"""Units of length that the camera moves per frame."""

MARGIN = 64
"""Pixels rendered on either side of a moving inset: about as far as anything moves in a chain."""

MOTION_RAYS = 2
"""Rays of a pixel's motion vector.  Replicas share it here, but each is charged for its own."""

TREES_IN_A_FRAMES_TIME: Mapping[str, int] = MappingProxyType(
    {
        "cornell": 6,
        "glossy_cornell": 11,
        "ajar": 7,
        "crease": 7,
        "occluders": 6,
        "checker": 7,
        "rack": 6,
        "glass_disc": 11,
        "distant_caustic": 10,
        "clear_coat": 9,
    }
)
"""Path trees that take as long as one hybrid frame per pixel, rounded up: CPU time, measured once (5.6 to 10.3)."""


@dataclass(frozen=True)
class Method:
    """What ReSTIR shares between pixels: a rule of connections, and integrals with their shift."""

    rule: Connectability
    integrals: Callable[[Tracer], Traced] = PathIntegrals


METHODS: Mapping[str, Method] = MappingProxyType(
    {
        "hybrid": Method(HYBRID),
        "no distance test": Method(Connectability(HYBRID.roughness, 0.0)),
        "reconnection": Method(RECONNECTION, ReconnectionAtX2),
        "ReSTIR GI": Method(RECONNECTION, RadianceIntegrals),
    }
)


def moved(method: Method, scene: str, replicas: int, rng: np.random.Generator, sensor: Pinhole | None = None) -> Arrays:
    """The last frame of a moving camera, (replicas, n), and its rays per pixel; as the standard sensor unless told."""
    asked = Counter[str]()
    views = [method.integrals(view(scene, method.rule, asked, each).tracer) for each in approach(scene, sensor)]
    *_, (images, cost) = costed(views, asked, replicas, Live(rng))
    return {"images": judged(scene, images), "rays": np.array(cost)}


def still(method: Method, scene: str, replicas: int, rng: np.random.Generator, sensor: Sensor | None = None) -> Arrays:
    """The first frame and the last half of a still camera's, (1 + FRAMES // 2, replicas, n), and rays per pixel."""
    asked = Counter[str]()
    of = method.integrals(view(scene, method.rule, asked, sensor).tracer)
    frames = list(costed([of] * FRAMES, asked, replicas, Live(rng)))
    kept = [frames[0], *frames[FRAMES // 2 :]]
    return {"images": np.stack([images for images, _ in kept]), "rays": np.array(frames[-1][1])}


def costed(views: Sequence[Traced], asked: Counter[str], replicas: int, chance: Chance) -> list[tuple[Array, float]]:
    """Every frame of the real-time preset, (replicas, n), with its rays per pixel."""
    found, spent = [], rays(asked)
    for of, images in zip(views, film(views, replicas, chance, sources=motion_vectors), strict=True):
        found.append((images, (rays(asked) - spent) / (replicas * of.n) + MOTION_RAYS))
        spent = rays(asked)
    return found


def approach(scene: str, sensor: Pinhole | None = None) -> Sequence[Sensor]:
    """The sensors of a camera that arrives at the scene's standard sensor unless told, FRAMES in all."""
    return solid.approach(setting(scene), FRAMES) if in_space(scene) else widened(scene, sensor)


def judged(scene: str, images: Array) -> Array:
    """What of the images of `approach` the standard sensor sees, (..., n)."""
    return images if in_space(scene) else inset(images)


def widened(scene: str, sensor: Pinhole | None = None) -> list[Pinhole]:
    """The sensors of a camera that arrives at the scene's inset unless told, MARGIN pixels wider on both sides."""
    last: Pinhole = sensor or setting(scene).pinhole()
    return sideways(replace(last, n=last.n + 2 * MARGIN, first=last.first - MARGIN))


def sideways(last: Pinhole) -> list[Pinhole]:
    """The sensors of a camera that moves sideways by STEP per frame, FRAMES in all."""
    forward = np.subtract(last.towards, last.eye) / np.linalg.norm(np.subtract(last.towards, last.eye))
    side = STEP * np.array([forward[1], -forward[0]])
    return [displaced(last, (k - FRAMES + 1) * side) for k in range(FRAMES)]


def inset(images: Array) -> Array:
    """The middle of wider images, (..., n)."""
    return images[..., MARGIN:-MARGIN]


def trees(scene: str, count: int, rng: np.random.Generator) -> Arrays:
    """Independent images of one path tree per pixel, (count, n), and rays per tree."""
    asked = Counter[str]()
    found = estimates(path_tracing(1), view(scene, HYBRID, asked), asked, count, Live(rng))
    return {"images": found.images, "rays": np.array(found.rays)}


def at_equal_rays(trees: Arrays, rays_ours: float) -> Array:
    """Means of as many path trees as cost at least so many rays, (groups, n)."""
    return means(trees["images"], samples_of_equal_cost(rays_ours, float(trees["rays"])))


def at_equal_time(trees: Arrays, scene: str) -> Array:
    """Means of as many path trees as take the time of a frame, (groups, n)."""
    return means(trees["images"], TREES_IN_A_FRAMES_TIME[scene])


def paired(errors: Array, others: Array) -> tuple[Array, Array]:
    """As many replicas of both."""
    R = min(len(errors), len(others))
    return errors[:R], others[:R]
