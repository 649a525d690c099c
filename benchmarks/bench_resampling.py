"""What generality costs: the resampler against hand-written passes, its growth, its memory, the oracle.

Every number is a ratio of things measured in one run, the median over interleaved repeats, beside the
requirement it must meet, if there is one.  Exits with 1 if a requirement is missed.  Takes 10 s.
"""

import gc
import sys
import tracemalloc
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from statistics import median
from time import perf_counter
from typing import Any
from unittest.mock import patch

import numpy as np
from handwritten import Array, Band, Called, State, band
from handwritten import spatial as spatial_by_hand
from handwritten import temporal as temporal_by_hand

from restir_ref import WEIGHTS, Live, Pixels, Reservoirs, initial, spatial, temporal
from restir_ref.batch import map_leaves
from restir_ref.oracle.enumeration import outcomes
from restir_ref.oracle.scenes import Loop, Scene, reference_scene, spatial_loop, three_pixel_scene, two_frame_loop
from restir_ref.restir import M_CAP
from toy1d import Line, quotient, two_pixels

Run = Callable[[], Any]

PIXELS = 2**16
SIZES = [2**k for k in range(12, 19)]
REPEATS = 25
SLOWEST = 0.45
"""Least speed of the generic passes relative to hand-written ones with everything inlined."""


@dataclass(frozen=True)
class Row:
    """One measured number and the interval it must lie in; `claims` are the rows of the ledger that it is about."""

    what: str
    value: float
    least: float = -np.inf
    most: float = np.inf
    claims: str = ""

    @property
    def met(self) -> bool:
        """The requirement holds, or there is none."""
        return self.least <= self.value <= self.most

    def __str__(self) -> str:
        bounds = [f"{sign} {bound:g}" for sign, bound in ((">=", self.least), ("<=", self.most)) if np.isfinite(bound)]
        verdict = ("ok" if self.met else "MISSED") if bounds else ""
        about = f"  [{self.claims}]" if self.claims else ""
        return f"{self.value:12.4g}  {' '.join(bounds):>8}  {verdict:6}  {self.what}{about}"


def main() -> int:
    """Print all rows, grouped; 1 if a requirement is missed."""
    keep_freed_memory()
    return print_sections(SECTIONS)


def print_sections(sections: Mapping[str, Callable[[], Iterator["Row"]]]) -> int:
    """Measure and print section by section; 1 if a requirement is missed."""
    missed = 0
    for title, rows in sections.items():
        print(f"\n{title}")
        for row in rows():
            print(row, flush=True)
            missed += not row.met
    print(f"\n{missed} requirements missed" if missed else "\nall requirements met")
    return int(missed > 0)


def keep_freed_memory() -> None:
    """Teach glibc not to return freed arrays to the system, so that page faults do not decide who wins.

    Freeing one large block raises its thresholds for the rest of the run; elsewhere this does nothing.
    """
    np.empty(31 << 20, dtype=np.uint8)


def times(runs: Mapping[Any, Run], repeats: int) -> dict[Any, Array]:
    """Seconds of every run, (repeats,), interleaved, forth and back, after one warm-up."""
    for run in runs.values():
        run()
    gc.collect()
    forth = list(runs)
    taken = [{name: seconds(runs[name]) for name in forth[:: (-1) ** k]} for k in range(repeats)]
    return {name: np.array([each[name] for each in taken]) for name in runs}


def seconds(run: Run) -> float:
    """Wall time of one run."""
    start = perf_counter()
    run()
    return perf_counter() - start


# ---------------------------------------------------------------- a frame on an image


@dataclass(frozen=True, eq=False)
class Frames:
    """Two frames of n pixels with fresh samples, a history, three neighbours and motion for each."""

    before: Band
    now: Band
    there: Pixels
    here: Pixels
    X: Reservoirs
    Y: Reservoirs
    neighbours: Sequence[Array]
    motion: Array


def frames(n: int) -> Frames:
    """Neighbours at most 16 pixels away, motion by at most 2."""
    rng, index = np.random.default_rng(1), np.arange(n)
    before, now = band(n), band(n, phase=0.02)
    there, here = Pixels(before.line(), index), Pixels(now.line(), index)
    neighbours = [(index + rng.integers(-16, 17, n)) % n for _ in range(3)]
    motion = (index + rng.integers(-2, 3, n)) % n
    Y = spatial(initial(there, Live(rng)), there, around(there, neighbours), Live(rng))
    return Frames(before, now, there, here, initial(here, Live(rng)), Y, neighbours, motion)


def around(here: Pixels, neighbours: Sequence[Array]) -> list[Pixels]:
    """The neighbours in the same image."""
    return [Pixels(here.of, j) for j in neighbours]


def rng() -> np.random.Generator:
    """The same random numbers for every run."""
    return np.random.default_rng(7)


def draw(n: int) -> Array:
    """Uniform numbers as `Live` draws them."""
    return np.asarray(rng().random(n))


def state(X: Reservoirs) -> State:
    """The arrays of reservoirs."""
    return X.x, X.W, X.c


def passes(on: Frames) -> dict[str, dict[str, Run]]:
    """Each pass as generic code, by hand with everything inlined, and by hand with the world's methods."""
    before, now = (Called(image.line(), np.arange(PIXELS)) for image in (on.before, on.now))
    X, Y = state(on.X), state(on.Y)
    near, motion = around(on.here, on.neighbours), [Pixels(on.there.of, on.motion)]
    return {
        "spatial, 3 neighbours, defensive": {
            "generic": lambda: spatial(on.X, on.here, near, Live(rng())),
            "inlined": lambda: spatial_by_hand(on.now, X, on.neighbours, draw),
            "called": lambda: spatial_by_hand(now, X, on.neighbours, draw),
        },
        "temporal, 1 source, Talbot": {
            "generic": lambda: temporal(on.X, on.here, on.Y, motion, Live(rng())),
            "inlined": lambda: temporal_by_hand(on.now, X, on.before, Y, on.motion, draw, cap=M_CAP),
            "called": lambda: temporal_by_hand(now, X, before, Y, on.motion, draw, cap=M_CAP),
        },
    }


# ---------------------------------------------------------------- the four questions


def speed() -> Iterator[Row]:
    """Speed of the generic passes relative to the hand-written ones, and that they do the same work."""
    for name, runs in passes(frames(PIXELS)).items():
        calls = {kind: evaluations(run) for kind, run in runs.items()}
        targets, shifts = calls["generic"]
        more = np.ptp(list(calls.values()), axis=0).max()
        yield Row(f"{name}: {targets:g} targets, {shifts:g} shifts per pixel; by hand more or less", more, most=0)
        W = runs["generic"]().W
        worst = max(np.max(np.abs(runs[kind]()[1] - W) / np.maximum(W, 1e-300)) for kind in ("inlined", "called"))
        yield Row(f"{name}: largest relative difference of W", worst, most=1e-12)
        t = times(runs, REPEATS)
        inlined, called = (median(t[kind] / t["generic"]) for kind in ("inlined", "called"))
        yield Row(f"{name}: speed relative to hand-written code, all inlined (aim .8)", inlined, least=SLOWEST)
        yield Row(f"{name}: the same if both call toy1d's methods", called)


def evaluations(run: Run) -> tuple[float, float]:
    """Targets and shifts per pixel that a run asks a Line or a Band for."""
    n: Counter[str] = Counter()

    def counting(what: str, method: Callable[..., Any]) -> Callable[..., Any]:
        def counted(self: Any, columns: Array, *rest: Any) -> Any:
            n[what] += len(columns)
            return method(self, columns, *rest)

        return counted

    with ExitStack() as counters:
        for of, name, what in (
            (Line, "target", "targets"),
            (Line, "shift", "shifts"),
            (Band, "target", "targets"),
            (Band, "moved", "shifts"),
        ):
            counters.enter_context(patch.object(of, name, counting(what, getattr(of, name))))
        run()
    return n["targets"] / PIXELS, n["shifts"] / PIXELS


def growth() -> Iterator[Row]:
    """Slope of log time over log pixels of a whole frame."""
    t = times({n: partial(frame, frames(n)) for n in SIZES}, repeats=9)
    middle = [median(t[n]) for n in SIZES]
    exponent = np.polyfit(np.log(SIZES), np.log(middle), 1)[0]
    yield Row(f"exponent of the time of a frame in its pixels, {SIZES[0]} to {SIZES[-1]}", exponent, most=1.05)
    largest, smallest = middle[-1] / SIZES[-1], middle[0] / SIZES[0]
    yield Row("time per pixel at the most pixels, relative to the fewest", largest / smallest)


def frame(on: Frames) -> Reservoirs:
    """A frame of ReSTIR: fresh samples, their history, their neighbours."""
    chance = Live(rng())
    X = initial(on.here, chance)
    X = temporal(X, on.here, on.Y, [Pixels(on.there.of, on.motion)], chance)
    return spatial(X, on.here, around(on.here, on.neighbours), chance)


def memory() -> Iterator[Row]:
    """Bytes of the reservoirs and of a pass over them."""
    on = frames(PIXELS)
    sizes: list[int] = []
    map_leaves(lambda leaf: sizes.append(leaf.nbytes), on.Y)
    yield Row("bytes per reservoir", sum(sizes) / PIXELS)
    for name, runs in passes(on).items():
        runs["generic"]()
        gc.collect()
        gc.disable()
        tracemalloc.start()
        runs["generic"]()
        kept, peak = tracemalloc.get_traced_memory()
        tracemalloc.stop()
        gc.enable()
        yield Row(f"{name}: bytes per reservoir at the peak of the pass, its result included", peak / PIXELS)
        yield Row(f"{name}: of these left to the garbage collector", kept / PIXELS, most=1)


def oracle() -> Iterator[Row]:
    """Time per leaf of the enumeration, relative to one run of the same loop and to a small matrix product."""
    A = np.random.default_rng(1).random((32, 32))
    for name, (loop, scene) in ENUMERATED.items():
        leaves = enumerate_all(loop, scene)
        t = times(
            {
                "leaves": partial(enumerate_all, loop, scene),
                "live": partial(once, loop, leaves * scene.now.n),
                "products": lambda: [A @ A for _ in range(1000)],
            },
            REPEATS,
        )
        live, products = (median(t["leaves"] / t[unit]) for unit in ("live", "products"))
        yield Row(f"{name}, {leaves} leaves: time per leaf, in live runs of the loop", live)
        yield Row(f"{name}: time per leaf, in products of 32 x 32 matrices", products * 1000 / leaves)


def enumerate_all(loop: Loop, scene: Scene) -> int:
    """The number of leaves."""
    return sum(len(outcome.probability) for outcome in outcomes(loop, scene.now.n))


def once(loop: Loop, columns: int) -> Reservoirs:
    """One live run of as many columns."""
    return loop(np.arange(columns), Live(rng()))


def enumerated() -> dict[str, tuple[Loop, Scene]]:
    """Loops for the oracle."""
    two, three, cells = reference_scene(), three_pixel_scene(), Scene([quotient(two_pixels(), 8)])
    return {
        "two frames": (two_frame_loop(two), two),
        "three pixels, two passes": (spatial_loop(three, WEIGHTS["defensive"], 2), three),
        "two pixels of 8 cells, three passes": (spatial_loop(cells, WEIGHTS["defensive"], 3), cells),
    }


ENUMERATED = enumerated()
SECTIONS: Mapping[str, Callable[[], Iterator[Row]]] = {
    f"Speed of the generic passes on {PIXELS} reservoirs": speed,
    "Growth": growth,
    "Memory": memory,
    "Exact oracle": oracle,
}

if __name__ == "__main__":
    sys.exit(main())
