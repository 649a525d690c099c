"""ReSTIR PT is unbiased to 0.5%: both shifts, along time and across pixels, still and moving.

Replicas are independent renderings of the inset by a frame's loop; only the last frame of each counts, frames
of one chain are never averaged.  Two comparisons: what reuse adds to the same frame's initial samples,
which needs no reference and has mean 0; and the mean against the path traced reference, whose
standard error is added.  Both for the image's mean, for eight blocks of pixels, and for all pixels at
once.  After some frames of both kinds of reuse a pixel has little left of its own sample, and the
first comparison is the noisier one: it is left out there.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.jobs.comparing import Truth, joined, judged, nothing, stored, sums
from benchmarks.jobs.job import Done, Job, Params, Row, parts
from figures.claims.figure import Arrays
from figures.experiments.references import reference
from flatland2d.motion import motion, sources
from flatland2d.scenes import INSET, SCENES
from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.integrals import Pixels, Reservoirs
from restir_ref.loop import REAL_TIME, random_in_row
from restir_ref.restir import initial, shade, spatial, temporal
from restir_ref.transport.paths import Tracer
from restir_ref.transport.restir_pt import PathIntegrals
from tests.transport.paths import RULES

CHUNKS, REPLICAS = {"cornell": 32, "glossy_cornell": 32, "ajar": 128, "clear_coat": 32}, 64
"""Chunks by scene, of 64 replicas of 128 pixels: 2048, and 8192 where the light is rare, as much as 0.5% takes."""
SHIFTS = ("hybrid", "reconnection")


@dataclass(frozen=True)
class Mode:
    """How many frames there are, how far the eye moves between them, rounds of spatial reuse in each.

    `effort` multiplies the chunks: a single frame is noisier.
    """

    frames: int
    step: float
    rounds: int
    effort: float = 1.0


MODES: Mapping[str, Mode] = {
    "across pixels": Mode(1, 0.0, 1, effort=1.5),
    "along time, still": Mode(4, 0.0, 0),
    "along time, moving": Mode(4, 0.002, 0),
    "along time and across pixels, still": Mode(4, 0.0, 1),
    "along time and across pixels, moving": Mode(4, 0.002, 1),
}


def views(scene: str, rule: str, mode: Mode) -> list[PathIntegrals]:
    """The inset frame by frame; the last frame's eye is the reference's."""
    setting = SCENES[scene]()
    here = setting.pinhole()
    eyes = [(here.eye[0] - mode.step * back, here.eye[1]) for back in reversed(range(mode.frames))]
    return [PathIntegrals(Tracer(setting.scene, replace(here, eye=eye), setting.depth, RULES[rule])) for eye in eyes]


def last_frame(images: Sequence[PathIntegrals], rounds: int, index: Array, chance: Live) -> tuple[Array, Array]:
    """What the last frame shows, and what its initial samples show, (N,) each."""
    history: Reservoirs | None = None
    for at, of in enumerate(images):
        here = Pixels(of, index)
        X = Y = initial(here, chance)
        if history is not None:
            Y = temporal(X, here, history, [came_from(of, images[at - 1], index)], chance, cap=REAL_TIME.cap)
        for _ in range(rounds):
            near = random_in_row(of, index, REAL_TIME.neighbours, REAL_TIME.radius, chance)
            Y = spatial(Y, here, near, chance)
        history = Y
    return shade(Y, here)[0], shade(X, here)[0]


def came_from(now: PathIntegrals, before: PathIntegrals, index: Array) -> Pixels:
    """The previous frame's columns that motion vectors name."""
    moved = motion(now.tracer.scene, now.tracer.sensor, before.tracer.sensor)  # type: ignore[arg-type]
    return Pixels(before, sources(moved, index))


def compute(params: Params, *, rng: np.random.Generator) -> Arrays:
    """What reuse adds to initial samples, and the result."""
    mode = MODES[params["mode"]]
    images = views(params["scene"], params["rule"], mode)
    result, own = (each.reshape(REPLICAS, INSET) for each in last_frame(images, mode.rounds, columns(), Live(rng)))
    return stored(sums(result - own), "added") | stored(sums(result), "result")


def columns() -> Array:
    """All pixels of all replicas."""
    return np.arange(REPLICAS * INSET)


def chunks(share: float) -> Sequence[Params]:
    """Chunk by chunk, all cases in each."""
    cases = [(scene, rule, mode) for scene in CHUNKS for rule in SHIFTS for mode in MODES]
    every = [(part, case) for case in cases for part in parts(round(CHUNKS[case[0]] * MODES[case[2]].effort), share)]
    return [{"scene": case[0], "rule": case[1], "mode": case[2], "part": part} for part, case in sorted(every)]


def judge(done: Done) -> Sequence[Row]:
    """Every case by both comparisons."""
    rows = []
    for case in dict.fromkeys((params["scene"], params["rule"], params["mode"]) for params, _ in done):
        mine = [arrays for params, arrays in done if (params["scene"], params["rule"], params["mode"]) == case]
        truth, where = reference(case[0]), ", ".join(case)
        scale = float(truth.mean.mean())
        exact = Truth(truth.mean, truth.error, truth.image_error)
        added, result = joined(mine, "added"), joined(mine, "result")
        rows.append(judged(CLAIMS, f"{where}: bias against the reference", result, exact, scale, EPS))
        if MODES[case[2]].frames == 1 or not MODES[case[2]].rounds:
            own = f"{where}: bias against the frames' own initial samples"
            rows.append(judged(CLAIMS, own, added, nothing(INSET), scale, EPS))
    return rows


CLAIMS, EPS = "GRIS-A05, GRIS-C11", 0.005
JOB = Job("ReSTIR PT against its own initial samples and against references, by replicas", chunks, compute, judge)
