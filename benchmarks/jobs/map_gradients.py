"""Gradient-domain ReSTIR on a map of fluence is unbiased along rows and columns: a corner of a post, still and moving.

The map moves by fractions of its pixels, and leaves out the light that its own rays meet.  Every difference is taken
with the sign of the true one, over the mean of their sizes, as in `gradients`.  The truth is path tracing of every
pixel for itself: it shifts nothing, so that it shares no shift with what it judges.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from benchmarks.jobs.gradients import Mode
from benchmarks.jobs.job import Done, Job, Params, Row, parts
from benchmarks.jobs.signing import probed
from figures.claims.figure import Arrays
from figures.experiments.following import gathered, in_place
from figures.experiments.gradients import ADAPTIVE, CROP, MAPS, gradient_view, with_restir
from figures.experiments.rendering import POINTS, lattice_tracing
from figures.experiments.views import HYBRID, setting
from flatland2d.sensors import FluenceMap
from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.gradient_loop import GRADIENT, View, forward
from restir_ref.transport.paths import Tracer, Tree, leaves
from restir_ref.transport.restir_pt import ScatteredIntegrals

SCENE, SIDE, REPLICAS = "occluders", 9, 32
"""The scene; rows and columns of the map, whose 72 differences either way are eight blocks; replicas of a chunk."""

STEP, ALONG = 0.35, np.array([1.0, 0.6])
"""Pixels that the map moves to the right in a frame, and how far it moves right and up for each."""

MODES: Mapping[str, Mode] = MappingProxyType(
    {
        "frame 1": Mode(1),
        "frame 5, still": Mode(5),
        "frame 20, still": Mode(20),
        "frame 5, kept": Mode(5, STEP, in_place),
        "frame 5, gathered": Mode(5, STEP, gathered),
        "frame 20, kept": Mode(20, STEP, in_place),
        "frame 20, gathered": Mode(20, STEP, gathered),
    }
)
DIRECTIONS, TRUTH, LATTICES = ("dx", "dy"), "truth", 16
"""What is judged; what the mode of the truth's chunks is called, and how many images each of them has."""

CASES: Mapping[str, tuple[int, float]] = MappingProxyType(
    {
        TRUTH: (12, 0.0),
        "frame 1": (200, 0.01),
        "frame 5, still": (32, 0.015),
        "frame 20, still": (16, 0.01),
        "frame 5, kept": (28, 0.015),
        "frame 5, gathered": (28, 0.015),
        "frame 20, kept": (24, 0.015),
        "frame 20, gathered": (24, 0.02),
    }
)
"""Chunks of every mode, and the largest standard error."""


# ---------------------------------------------------------------- the map


def placed(by: Array) -> FluenceMap:
    """A square about the middle of a crop of the figures, moved by some of its own pixels."""
    middle = np.array(MAPS[SCENE]) + by * CROP / SIDE
    low, high = (tuple(float(each) for each in middle + half) for half in (-CROP / 2, CROP / 2))
    return FluenceMap((low[0], low[1]), (high[0], high[1]), SIDE, SIDE)


def views_of(mode: Mode, asked: Counter[str]) -> list[View]:
    """Every frame with its pairs, of a map that arrives at its place; a pixel was `by` pixels away before."""
    by, views = mode.step * ALONG, []
    for k in range(1 - mode.frames, 1):
        sensor = placed(k * by)
        view = gradient_view(SCENE, (sensor, sensor), asked, GRADIENT, ADAPTIVE)
        views.append({name: replace(group, by=group.by + by[:, None]) for name, group in view.items()})
    return [*map(mode.history, views)]


def scattered_light(tree: Tree) -> Array:
    """All leaves but k = 0, (C, N)."""
    return np.asarray(sum(F for k, _, F in leaves(tree) if k > 0))


def lattices(rng: np.random.Generator) -> Arrays:
    """Differences both ways of images by one moved lattice for each pixel, (LATTICES, SIDE (SIDE - 1)) each."""
    s = setting(SCENE)
    of = ScatteredIntegrals(Tracer(s.scene, placed(0 * ALONG), s.depth, HYBRID))
    images = lattice_tracing(scattered_light)(of, np.arange(LATTICES * of.n), Live(rng)).reshape(LATTICES, -1)
    return {name: images[:, i] - images[:, j] for name, ((i, j), _) in forward((SIDE, SIDE)).items()}


# ---------------------------------------------------------------- the job


def compute(params: Params, *, rng: np.random.Generator) -> Arrays:
    """dx and dy of the last frame, (R, SIDE (SIDE - 1)) each."""
    if params["mode"] == TRUTH:
        return lattices(rng)
    asked = Counter[str]()
    found = with_restir(views_of(MODES[params["mode"]], asked), asked, REPLICAS, Live(rng))
    return {name: found[name] for name in DIRECTIONS}


def chunks(share: float) -> Sequence[Params]:
    """Chunk by chunk, all modes in each, the truth first."""
    every = sorted((part, k, mode) for k, mode in enumerate(CASES) for part in parts(CASES[mode][0], share))
    return [{"mode": mode, "part": part} for part, _, mode in every]


def judge(done: Done) -> Sequence[Row]:
    """Every mode both ways against the differences of the truth."""
    rows = []
    for name in DIRECTIONS:
        found = {mode: [arrays[name] for params, arrays in done if params["mode"] == mode] for mode in CASES}
        rows += [
            probed("GPT-A02", f"map of {SCENE}, {mode}: bias of {name}", found[mode], found[TRUTH], CASES[mode][1])
            for mode in MODES
        ]
    return rows


JOB = Job(f"Differences of a map of fluence against those of {POINTS}-point lattices", chunks, compute, judge)
