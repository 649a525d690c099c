"""What path tracing in space costs beside Mitsuba 3: paths per CPU-second of one thread, as ratios.

Both trace the same crop of CB3 at depth 4, by turns in one run; the least CPU time of each counts, for others on the
machine only add to it.  Exits with 1 if a requirement is missed, which Embree's is: shading alone takes half of a
path's time here, nearly as long as Mitsuba for all of it, and hits are refined in double precision.  Without Mitsuba
nothing is measured.  Takes 40 s.
"""

import sys
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from types import ModuleType

import numpy as np
from bench_resampling import Row, keep_freed_memory, print_sections
from bench_space import has_embree
from bench_transport import cpu, rng

from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.transport.paths import RECONNECTION, Tracer
from tracer3d.embree import with_embree
from tracer3d.methods import traced
from tracer3d.scenes import SCENES
from tracer3d.witness import exported, mitsuba, rendered

SCENE, DEPTH = "cornell", 4
SAMPLES = 16
"""Paths per pixel of an inset."""
REPEATS = 7

LEAST = {"pure NumPy": 0.55, "Embree": 0.8}
"""Of Mitsuba's paths per CPU-second; aim 1 for both."""


def main() -> int:
    """Print all rows; 1 if a requirement is missed."""
    keep_freed_memory()
    try:
        mi = mitsuba("scalar_rgb")
    except ImportError as missing:
        print(f"nothing is measured: {missing}")
        return 0
    return print_sections(sections(mi))


def paths_of(t: Tracer, pixel: Array) -> Array:
    """One path tree per column."""
    return traced(t, pixel, Live(rng()))


def paths(mi: ModuleType) -> Iterator[Row]:
    """Ours over theirs."""
    at = SCENES[SCENE]()
    sensor = at.pinhole()
    loaded = mi.load_dict(exported(mi, at.scene, sensor, DEPTH))
    pixel = np.tile(np.arange(sensor.n), SAMPLES)
    scenes = {"pure NumPy": at.scene, **({"Embree": with_embree(at.scene)} if has_embree() else {})}
    tracers = {name: Tracer(scene, sensor, DEPTH, RECONNECTION) for name, scene in scenes.items()}
    runs: dict[str, Callable[[], object]] = {name: partial(paths_of, t, pixel) for name, t in tracers.items()}
    found = cpu({**runs, "theirs": lambda: rendered(mi, loaded, SAMPLES, 1)}, REPEATS)
    for name in tracers:
        what = f"{SCENE}, depth {DEPTH}, by {name}: paths per CPU-second over those of Mitsuba's scalar_rgb (aim 1)"
        yield Row(what, found["theirs"] / found[name], least=LEAST[name])


def sections(mi: ModuleType) -> Mapping[str, Callable[[], Iterator[Row]]]:
    """All that is measured."""
    return {"Path tracing": partial(paths, mi)}


if __name__ == "__main__":
    sys.exit(main())
