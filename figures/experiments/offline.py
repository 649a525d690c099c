"""Offline renderers of indirect light, frame by independent frame, at equal samples, rays and time.

Direct light is out of the picture.  [GRIS 9.1, 9.3]  Path tracing is stored in units of UNIT trees: as many make an
image as its price allows.
"""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any

import numpy as np

from figures.claims.figure import Arrays
from figures.experiments.indirect import IndirectReconnection, darkened
from figures.experiments.references import INDIRECT, reference
from figures.experiments.rendering import Renderer, estimates, means, offline, path_tracing
from figures.experiments.split_light import IndirectIntegrals
from figures.experiments.views import HYBRID, tile_order, view
from restir_ref.batch import Array, total
from restir_ref.chance import Chance, Live
from restir_ref.integrals import Pixels, Reservoirs
from restir_ref.loop import OFFLINE
from restir_ref.restir import reuse_all
from restir_ref.transport.baselines.path_reuse import TileIntegrals, not_shared, rest_of_tile
from restir_ref.transport.baselines.restir_di import indirect_light
from restir_ref.transport.paths import RECONNECTION, Connectability, Sensor, Tracer, trace
from restir_ref.transport.restir_pt import PathIntegrals

UNIT = 4
"""Path trees in one stored image of path tracing."""

LIT = 64
"""Images from which rays towards lights are counted."""

TREES_IN_A_FRAMES_TIME = 72
"""Path trees that take as long as one offline frame per pixel: median over scenes of `make bench`, CPU time."""


@dataclass(frozen=True)
class Method:
    """A renderer, the integrals it renders, and how many path trees it begins per pixel."""

    render: Renderer
    trees: int
    rule: Connectability = RECONNECTION
    integrals: Callable[[Tracer], PathIntegrals] = PathIntegrals


def reused(of: PathIntegrals, index: Array, chance: Chance) -> Array:
    """One tree per pixel, reused by its tile, without direct light: `path_reuse` of darkened trees."""
    t, (order, tile) = of.tracer, tile_order(of)
    tree = darkened(trace(t, chance.uniform((t.D, len(index))), order[index % of.n]))
    here = Pixels(TileIntegrals(t, tree), np.arange(len(index)))
    kept = [Reservoirs(x, W, np.ones(len(W))) for x, W in here.of.candidates(here.index, chance)]
    images = [not_shared(tree), *(reuse_all(X, here, rest_of_tile(here, tile)) for X in kept)]
    shared, images_of = total(images).mean(axis=0), np.empty((len(index) // of.n, of.n))
    images_of[:, order] = shared.reshape(-1, of.n)
    return images_of.reshape(-1)


METHODS: Mapping[str, Method] = MappingProxyType(
    {
        "path tracing": Method(path_tracing(UNIT, indirect_light), UNIT),
        "path reuse": Method(reused, 1),
        "reconnection": Method(offline, OFFLINE.trees, RECONNECTION, IndirectReconnection),
        "hybrid": Method(offline, OFFLINE.trees, HYBRID, IndirectIntegrals),
    }
)


def chunks(scenes: Sequence[str], methods: Sequence[str]) -> list[dict[str, str]]:
    """One chunk per scene and method."""
    return [{"scene": scene, "method": method} for scene in scenes for method in methods]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """Images of one of the usual methods."""
    return render(METHODS[chunk["method"]], chunk["scene"], preset[chunk["method"]], rng)


def render(method: Method, scene: str, count: int, rng: np.random.Generator, sensor: Sensor | None = None) -> Arrays:
    """Independent images (count, n) of the scene's inset, or of another sensor, and rays per pixel of one.

    Rays towards lights from x_1 are not charged: their leaves are black.
    """
    asked, chance = Counter[str](), Live(rng)
    of = view(scene, method.rule, asked, sensor, method.integrals)
    spared = method.trees * lit(of.tracer, asked, chance)
    found = estimates(method.render, of, asked, count, chance)
    return {"images": found.images, "rays": np.array(found.rays - spared)}


def lit(t: Tracer, asked: Counter[str], chance: Chance) -> float:
    """Rays towards lights from x_1 per path tree, counted; a tree of one scattering event has two other rays."""
    shallow = PathIntegrals(replace(t, depth=1))
    return estimates(path_tracing(1), shallow, asked, max(1, LIT * 128 // shallow.n), chance).rays - 2


def combine(scenes: Sequence[str], methods: Sequence[str], results: Sequence[Arrays]) -> Arrays:
    """All images and rays by "scene.method.name", and references by "scene.reference"."""
    return combine_chunks(chunks(scenes, methods), results)


def combine_chunks(done: Sequence[Mapping[str, str]], results: Sequence[Arrays]) -> Arrays:
    """The same for any choice of scenes and methods."""
    arrays = {
        f"{chunk['scene']}.{chunk['method']}.{key}": part[key]
        for chunk, part in zip(done, results, strict=True)
        for key in part
    }
    return arrays | {
        f"{scene}.reference": reference(scene, INDIRECT).mean for scene in {chunk["scene"] for chunk in done}
    }


def after(a: Arrays, scene: str, method: str, T: int) -> Array:
    """Means of T frames, (groups, n)."""
    return means(a[f"{scene}.{method}.images"], T)


def traced(a: Arrays, scene: str, trees: float) -> Array:
    """Path tracing with at least so many trees, (groups, n)."""
    return means(a[f"{scene}.path tracing.images"], int(np.ceil(trees / UNIT)))


def equal_samples(T: int) -> float:
    """Trees of T frames."""
    return float(T * OFFLINE.trees)


def equal_rays(a: Arrays, scene: str, method: str, T: int) -> float:
    """Trees whose rays cost what T frames of a method do."""
    per_tree = float(a[f"{scene}.path tracing.rays"]) / UNIT
    return T * float(a[f"{scene}.{method}.rays"]) / per_tree


def equal_time(T: int) -> float:
    """Trees that take as long as T frames."""
    return float(T * TREES_IN_A_FRAMES_TIME)


def paired(errors: Array, others: Array) -> tuple[Array, Array]:
    """As many groups of both."""
    R = min(len(errors), len(others))
    return errors[:R], others[:R]
