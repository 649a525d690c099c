"""What a picture can be rendered by: path tracing, path reuse and the ReSTIR family, frame by frame.

A method turns shots, one per frame, into images (C, n); what it remembers from frame to frame is its own.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from restir_ref.batch import Array
from restir_ref.chance import Chance
from restir_ref.images import Shape, random_in_disk, spread_in_disk, tiles
from restir_ref.integrals import Integrals, Pixels, Reservoirs
from restir_ref.loop import OFFLINE, REAL_TIME, Around, Preset, frame
from restir_ref.restir import shade
from restir_ref.transport.baselines.path_reuse import path_reuse
from restir_ref.transport.baselines.restir_di import DEBIASED, direct_light, indirect_light, light_integrals
from restir_ref.transport.baselines.restir_gi import RadianceIntegrals
from restir_ref.transport.paths import RECONNECTION, REPLAY, Connectability, Tracer, radiance, trace
from restir_ref.transport.restir_pt import PathIntegrals
from restir_ref.windows import over_windows, windowed
from tracer3d.motion import motion, sources

HYBRID = Connectability(0.2, 0.02)
"""Both vertices this rough, and this far apart in units of a room's height.  [GRIS 7.5]"""

PRESETS: Mapping[str, Preset] = MappingProxyType({"realtime": REAL_TIME, "offline": OFFLINE})

BLOCK, SIDE = 2**14, 4
"""Paths traced at once, and pixels along a tile of path reuse."""

WINDOW = 2**13
"""Columns that a pass looks at together: what memory a frame takes beside its reservoirs, and never what it gives."""


@dataclass(frozen=True)
class Shot:
    """What a frame is of, and its chance: frames know nothing of each other's random numbers."""

    tracer: Tracer
    chance: Chance
    window: int = WINDOW

    @property
    def pixels(self) -> Array:
        """All pixels, (n,)."""
        return np.arange(self.tracer.sensor.n)

    def over(self, work: Callable[[Tracer, Array, Chance], Array], pixel: Array, step: int = 1) -> Array:
        """work(tracer, pixel, chance), (C, N), in windows whose sizes are multiples of `step`."""

        def some(at: slice, chance: Chance) -> Array:
            return work(self.tracer, pixel[at], chance)

        return over_windows(some, len(pixel), self.chance, self.window, step)


Frames = Callable[[Iterable[Shot], Preset, Shape], Iterator[Array]]


@dataclass(frozen=True)
class Method:
    """What it is in words, its rule of connections, and its frames."""

    words: str
    rule: Connectability
    frames: Frames


def path_tracing(shots: Iterable[Shot], preset: Preset, shape: Shape) -> Iterator[Array]:
    """The preset's number of trees per pixel."""
    for shot in shots:
        images = (traced(shot.tracer, shot.pixels, shot.chance) for _ in range(preset.trees))
        yield np.asarray(sum(images) / preset.trees)


def traced(t: Tracer, pixel: Array, chance: Chance) -> Array:
    """One path tree for each of `pixel` (N,), in blocks; (C, N)."""

    def some(at: slice, chance: Chance) -> Array:
        part = pixel[at]
        return radiance(trace(t, chance.uniform((t.D, len(part))), part))

    return over_windows(some, len(pixel), chance, BLOCK)


def reuse_in_tiles(shots: Iterable[Shot], preset: Preset, shape: Shape) -> Iterator[Array]:
    """One tree per pixel, reused by its tile of 4 x 4 pixels."""
    order = tiles(shape, SIDE)
    for shot in shots:
        image = np.empty((shot.tracer.scene.C, len(order)))
        image[:, order] = shot.over(tiled, order, SIDE**2)
        yield image


def tiled(t: Tracer, pixel: Array, chance: Chance) -> Array:
    """One tree for each of `pixel` (N,), tile by tile, reused by its tile; (C, N)."""
    return path_reuse(t, pixel, chance, SIDE**2)


def resampled(make: Callable[[Tracer], Integrals]) -> Frames:
    """Initial samples, temporal and spatial reuse of path integrals."""

    def frames(shots: Iterable[Shot], preset: Preset, shape: Shape) -> Iterator[Array]:
        remembered: Memory | None = None
        for shot in shots:
            here, (history, before) = Pixels(make(shot.tracer), shot.pixels), recalled(remembered, shot)
            X = frame(here, shot.chance, preset, around(preset)(shape), history, before, passes=windowed(shot.window))
            yield shade(X, here)
            remembered = kept(preset, shot, here, X)

    return frames


def resampled_lights(shots: Iterable[Shot], preset: Preset, shape: Shape) -> Iterator[Array]:
    """ReSTIR DI for direct light, one path tree per pixel for the rest."""
    remembered: Memory | None = None
    for shot in shots:
        t, chance = shot.tracer, shot.chance
        of = light_integrals(t, chance.uniform((t.sensor.numbers, len(shot.pixels))), shot.pixels)
        here, (history, before) = Pixels(of, shot.pixels), recalled(remembered, shot)
        near = around(preset)(shape)(of, here.index, preset.neighbours, preset.radius, chance)
        X = direct_light(here, near, DEBIASED["talbot"], chance, history, before, passes=windowed(shot.window))
        yield shade(X, here) + shot.over(indirect, shot.pixels)
        remembered = kept(preset, shot, here, X)


def indirect(t: Tracer, pixel: Array, chance: Chance) -> Array:
    """What ReSTIR DI does not stand for, from one tree for each of `pixel` (N,); (C, N)."""
    return indirect_light(trace(t, chance.uniform((t.D, len(pixel))), pixel))


@dataclass(frozen=True, eq=False)
class Memory:
    """A frame's reservoirs, the integrals they belong to, and its shot."""

    shot: Shot
    here: Pixels
    X: Reservoirs


def kept(preset: Preset, shot: Shot, here: Pixels, X: Reservoirs) -> Memory | None:
    """What the next frame may reuse: nothing where the preset has no cap, and so no temporal reuse."""
    return None if np.isnan(preset.cap) else Memory(shot, here, X)


def recalled(memory: Memory | None, shot: Shot) -> tuple[Reservoirs | None, list[Pixels]]:
    """History and the columns of it that motion vectors name."""
    if memory is None:
        return None, []
    now, before = shot.tracer, memory.shot.tracer
    m = motion(now.scene, now.sensor, before.sensor)  # type: ignore[arg-type]
    return memory.X, [Pixels(memory.here.of, sources(m, shot.pixels))]


def around(preset: Preset) -> Callable[[Shape], Around]:
    """Random neighbours where frames have history, evenly spread ones where they have none.  [GRIS 8.3]"""
    return spread_in_disk if np.isnan(preset.cap) else random_in_disk


METHODS: Mapping[str, Method] = MappingProxyType(
    {
        "path": Method("path tracing", RECONNECTION, path_tracing),
        "path-reuse": Method("path reuse in tiles of 4 x 4 pixels", RECONNECTION, reuse_in_tiles),
        "restir-di": Method("ReSTIR DI, and path tracing for indirect light", RECONNECTION, resampled_lights),
        "restir-gi": Method("ReSTIR GI, biased where x_2 is glossy", RECONNECTION, resampled(RadianceIntegrals)),
        "restir-pt": Method("ReSTIR PT with the hybrid shift", HYBRID, resampled(PathIntegrals)),
        "restir-pt-reconnection": Method("the same, reconnecting at once", RECONNECTION, resampled(PathIntegrals)),
        "restir-pt-replay": Method("the same, replaying everything", REPLAY, resampled(PathIntegrals)),
    }
)
