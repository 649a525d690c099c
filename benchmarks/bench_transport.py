"""What a frame of ReSTIR PT costs: beside path tracing of the same pixels, in CPU time and in rays.

Every number is a ratio of things measured in one run in CPU time, the least of interleaved repeats, for
others on the machine only add to it, beside the requirement it must meet, if there is one; paths per
second depend on the machine and are beside a loop of matrix products.  Exits with 1 if a requirement is
missed.  --profile shows where a frame's time goes.  Takes 30 s.
"""

import cProfile
import pstats
import sys
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise, product
from time import process_time
from typing import Any

import numpy as np
from bench_resampling import Row, keep_freed_memory, print_sections

from flatland2d.motion import motion, sources
from flatland2d.scenes import INSET, SCENES
from flatland2d.sensors import Pinhole
from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.integrals import Pixels, Reservoirs
from restir_ref.loop import REAL_TIME, frame, random_in_row
from restir_ref.restir import initial, shade
from restir_ref.transport.counting import counted
from restir_ref.transport.paths import Connectability, Tracer, radiance, trace
from restir_ref.transport.restir_pt import PathIntegrals

Run = Callable[[], Any]

HYBRID = Connectability(0.2, 0.02)
COLUMNS = 256 * INSET
SIZES = [2**k for k in range(10, 17)]
REPEATS, SHOWN = 15, 25
STEP = 0.002
"""How far the moving eye goes between two frames."""


def main(arguments: Sequence[str]) -> int:
    """Print all rows, grouped; 1 if a requirement is missed."""
    keep_freed_memory()
    if "--profile" in arguments:
        return profile()
    return print_sections(SECTIONS)


def cpu(runs: Mapping[Any, Run], repeats: int = REPEATS) -> dict[Any, float]:
    """Least CPU seconds of every run, interleaved, forth and back, after one warm-up."""
    for run in runs.values():
        run()
    forth = list(runs)
    taken = [{name: seconds(runs[name]) for name in forth[:: (-1) ** k]} for k in range(repeats)]
    return {name: min(each[name] for each in taken) for name in runs}


def seconds(run: Run) -> float:
    """CPU seconds of one run."""
    start = process_time()
    run()
    return process_time() - start


def rng() -> np.random.Generator:
    """The same random numbers for every run."""
    return np.random.default_rng(7)


# ---------------------------------------------------------------- a frame of many columns


@dataclass(frozen=True, eq=False)
class Frames:
    """A steady state: this frame's integrals, the previous frame's and its reservoirs, and motion vectors."""

    here: Pixels
    before: Pixels
    Y: Reservoirs


def tracer(scene: str, sensor: Pinhole, asked: Counter[str] | None = None) -> Tracer:
    """The scene seen by a sensor, which counts rays if asked to."""
    setting = SCENES[scene]()
    seen = setting.scene if asked is None else counted(setting.scene, asked)
    return Tracer(seen, sensor, setting.depth, HYBRID)


def frames(scene: str, step: float, columns: int = COLUMNS, asked: Counter[str] | None = None) -> Frames:
    """Three frames of history of an eye that moves by `step`."""
    view = SCENES[scene]().pinhole()
    eyes = [replace(view, eye=(view.eye[0] + step * k, view.eye[1])) for k in range(4)]
    *past, now = (PathIntegrals(tracer(scene, eye, asked)) for eye in eyes)
    index, chance = np.arange(columns), Live(rng())
    Y = initial(Pixels(past[0], index), chance)
    for then, of in pairwise(past):
        Y = frame(Pixels(of, index), chance, REAL_TIME, random_in_row, Y, [came_from(of, then, index)])
    here = Pixels(now, index)
    return Frames(here, came_from(now, past[-1], index) if step else here, Y)  # a still eye's history is its own


def came_from(now: PathIntegrals, then: PathIntegrals, index: Array) -> Pixels:
    """The previous frame's columns that motion vectors name."""
    seen: Pinhole = now.tracer.sensor  # type: ignore[assignment]
    earlier: Pinhole = then.tracer.sensor  # type: ignore[assignment]
    return Pixels(then, sources(motion(now.tracer.scene, seen, earlier), index))


def real_time(on: Frames) -> Array:
    """One real-time frame: fresh samples, history, three neighbours, shading."""
    return shade(frame(on.here, Live(rng()), REAL_TIME, random_in_row, on.Y, [on.before]), on.here)


def traced(t: Tracer, columns: int = COLUMNS) -> Array:
    """Plain path tracing, one tree per column."""
    return radiance(trace(t, rng().random((t.D, columns)), np.arange(columns) % t.sensor.n))


# ---------------------------------------------------------------- the questions


def paths() -> Iterator[Row]:
    """Paths per CPU-second, in words of this machine."""
    setting, A = SCENES["cornell"](), rng().random((64, 64))
    t = Tracer(setting.scene, setting.pinhole(), 4, HYBRID)
    found = cpu({"paths": partial(traced, t), "products": lambda: [A @ A for _ in range(1000)]})
    yield Row("paths per CPU-second in float64, cornell, depth 4 (aim 5e5)", COLUMNS / found["paths"])
    share = found["products"] / found["paths"] * COLUMNS / 1000
    yield Row("paths in the time of one product of 64 x 64 matrices", share)


STEPS = {"still": 0.0, "moving": STEP}
LIMITS = {2**15: 1.25, 2**13: 1.45}
"""Columns, and the limit of a frame's cost over its rays."""


def frame_cost() -> Iterator[Row]:
    """A hybrid real-time frame relative to path tracing of its pixels, and that relative to its rays."""
    for scene, columns in product(("cornell", "glossy_cornell"), LIMITS):
        plain = partial(traced, tracer(scene, SCENES[scene]().pinhole()), columns)
        runs: dict[str, Run] = {name: partial(real_time, frames(scene, STEPS[name], columns)) for name in STEPS}
        found = cpu({"plain": plain, **runs})
        for name, step in STEPS.items():
            where, cost = f"{scene}, {columns} columns, {name}", found[name] / found["plain"]
            yield Row(f"{where}: CPU time of a frame over path tracing", cost)
            ours, theirs = (asked.total() / columns for asked in ray_counts(scene, step, columns))
            yield Row(f"{where}: rays per pixel and frame over those of path tracing, {theirs:.2f}", ours / theirs)
            yield Row(f"{where}: the first over the second (aim 1.15)", cost * theirs / ours, most=LIMITS[columns])


def ray_counts(scene: str, step: float, columns: int) -> tuple[Counter[str], Counter[str]]:
    """Rays of a frame, and of path tracing its pixels."""
    asked: Counter[str] = Counter()
    on = frames(scene, step, columns, asked)
    asked.clear()
    real_time(on)
    ours = Counter(asked)
    asked.clear()
    traced(on.here.of.tracer, columns)  # type: ignore[attr-defined]
    return ours, asked


def growth() -> Iterator[Row]:
    """Slope of log CPU time over log columns of a frame."""
    found = cpu({n: partial(real_time, frames("cornell", 0.0, n)) for n in SIZES}, repeats=5)
    least = [found[n] for n in SIZES]
    exponent = np.polyfit(np.log(SIZES), np.log(least), 1)[0]
    yield Row(f"exponent of the CPU time of a frame in its columns, {SIZES[0]} to {SIZES[-1]}", exponent, most=1.05)
    most, fewest = least[-1] / SIZES[-1], least[0] / SIZES[0]
    yield Row("CPU time per column at the most columns, relative to the fewest", most / fewest)


def speed() -> Iterator[Row]:
    """Pixel-frames per second on one core."""
    found = {}
    for replicas in (64, 1):
        on = frames("cornell", STEP, replicas * INSET)
        found[replicas] = replicas * INSET / cpu({"frame": partial(real_time, on)})["frame"]
    what = "128 pixels of cornell, {} replicas at once: pixel-frames per CPU-second, hybrid, moving"
    yield Row(what.format(64), found[64], least=2e4, claims="COM-A08")
    yield Row(what.format(1), found[1])


def profile() -> int:
    """Functions of a frame by their own time."""
    for scene in ("cornell", "glossy_cornell"):
        on = frames(scene, STEP)
        seen = cProfile.Profile()
        seen.enable()
        for _ in range(5):
            real_time(on)
        seen.disable()
        print(f"\n{scene}, moving")
        pstats.Stats(seen).sort_stats("tottime").print_stats(SHOWN)
    return 0


SECTIONS: Mapping[str, Callable[[], Iterator[Row]]] = {
    "Path tracing": paths,
    "A hybrid real-time frame, 3 neighbours": frame_cost,
    "Growth": growth,
    "Speed": speed,
}

if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
