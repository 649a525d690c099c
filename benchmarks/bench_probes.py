"""What a volume of probes costs: a query and an update as multiples of a ray's time, a frame of 8 x 8 x 8, memory.

A ray's time is that of the same scene's rays to the nearest surface, in batches of the same size.  Every number is a
ratio of CPU times of one run, the least of interleaved repeats, but for seconds and bytes, which say so.  Takes 30 s.
"""

import sys
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np
from bench_resampling import Row, keep_freed_memory, print_sections
from bench_transport import cpu, rng

import flatland2d.directions
import flatland2d.probe_rooms
import tracer3d.directions
import tracer3d.probe_rooms
from flatland2d.scenes import SCENES
from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.transport.cache.biases import self_shadow
from restir_ref.transport.cache.grid import Grid
from restir_ref.transport.cache.maps import Maps
from restir_ref.transport.cache.update import Updating, update
from restir_ref.transport.cache.volume import Volume, unlit
from restir_ref.transport.rays import arrive
from restir_ref.transport.scene import Scene
from tracer3d.scenes import SCENES as SPACE

COLUMNS, REPEATS = 2**15, 7


@dataclass(frozen=True, eq=False)
class Lit:
    """A scene, a volume that has seen two updates of it, how it is updated, and places to ask from."""

    scene: Scene
    volume: Volume
    how: Updating
    x: Array
    w: Array


def lit(scene: Scene, grid: Grid, maps: Maps, rays: int) -> Lit:
    """Places are the middle of the grid, moved at random by half its size."""
    how, chance = Updating(rays=rays), Live(rng())
    v = update(update(unlit(scene, grid, maps), scene, how, chance), scene, how, chance)
    ends = grid.place(np.array([0, grid.P - 1]))
    x = ends.mean(axis=1, keepdims=True) + (rng().random((grid.d, COLUMNS)) - 0.5) * (ends[:, 1:] - ends[:, :1]) / 2
    return Lit(scene, v, how, x, scene.space.sphere(rng().random((grid.d - 1, COLUMNS))))


def flat() -> Lit:
    """The matte Cornell room of flatland, 16 x 16 probes."""
    setting = SCENES["matte_cornell"]()
    return lit(setting.scene, flatland2d.probe_rooms.probes(setting), flatland2d.directions.MAPS, 64)


def solid() -> Lit:
    """The matte Cornell box, 8 x 8 x 8 probes."""
    setting = SPACE["matte_cornell"]()
    return lit(setting.scene, tracer3d.probe_rooms.probes(setting), tracer3d.directions.MAPS, 128)


WORLDS: Mapping[str, Callable[[], Lit]] = {"flatland, 16 x 16": flat, "space, 8 x 8 x 8": solid}


def costs(make: Callable[[], Lit]) -> Iterator[Row]:
    """Rows of one world."""
    on = make()
    at, _, _ = arrive(on.scene, on.x, on.w)
    b = self_shadow(at.n, on.scene.space.to_world(at.n, at.o), on.volume.spacing)
    runs = {
        "ray": lambda: on.scene.intersect(on.x, on.w),
        "query": lambda: on.volume.irradiance(at.x, at.n, at.n, b),
        "update": lambda: update(on.volume, on.scene, on.how, Live(rng())),
    }
    found = cpu(runs, REPEATS)
    ray, rays = found["ray"] / COLUMNS, int(on.volume.active.sum()) * on.how.rays
    yield Row("a query, in rays", found["query"] / COLUMNS / ray)
    yield Row(f"an update per ray of a probe ({on.how.rays} each), in rays", found["update"] / rays / ray)
    yield Row("an update per probe, in rays", found["update"] / on.volume.active.sum() / ray)
    yield Row(f"seconds of CPU for a frame's update of all {on.volume.grid.P} probes", found["update"], most=2.0)
    yield Row("bytes per probe", on.volume.bytes_per_probe, most=8192)


SECTIONS = {f"A volume of probes in {name}": partial(costs, make) for name, make in WORLDS.items()}


def main() -> int:
    """Print all rows, grouped; 1 if a requirement is missed."""
    keep_freed_memory()
    return print_sections(SECTIONS)


if __name__ == "__main__":
    sys.exit(main())
