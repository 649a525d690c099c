"""ReSTIR PT is unbiased to 0.5%: both shifts, along time and across pixels, still and moving.

Replicas are independent renderings of the inset by a frame's loop; only the last frame of each counts, frames
of one chain are never averaged.  Two comparisons: what reuse adds to the same frame's initial samples,
which needs no reference and has mean 0; and the mean against the path traced reference, whose
standard error is added.  Both for the image's mean and for eight blocks of pixels.  The spread
of the pixels' z-scores is 1 without bias, and more where pixels err in both directions.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.jobs.job import Done, Job, Params, Row, parts
from figures.figure import Arrays
from figures.references import Reference, reference
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

CHUNKS, REPLICAS = {"cornell": 32, "glossy_cornell": 64, "ajar": 320, "clear_coat": 64}, 64
"""Chunks by scene, of 64 replicas of 128 pixels: 2048 to 20 480, as much as 0.5% takes."""
SHIFTS = ("hybrid", "reconnection")
BLOCKS = 8
EPS, SIGMA, SPREAD = 0.005, 4.0, 1.3


@dataclass(frozen=True)
class Mode:
    """How many frames there are, how far the eye moves between them, and rounds of spatial reuse in each."""

    frames: int
    step: float
    rounds: int


MODES: Mapping[str, Mode] = {
    "across pixels": Mode(1, 0.0, 1),
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
    """Of what reuse adds, and of the result: block means (2, REPLICAS, BLOCKS), sums over replicas (2, n)."""
    mode = MODES[params["mode"]]
    images = views(params["scene"], params["rule"], mode)
    result, initial_ = last_frame(images, mode.rounds, np.arange(REPLICAS * INSET), Live(rng))
    values = np.stack([result - initial_, result]).reshape(2, REPLICAS, INSET)
    blocks = values.reshape(2, REPLICAS, BLOCKS, -1).mean(axis=-1)
    return {"blocks": blocks, "sums": values.sum(axis=1), "squares": (values**2).sum(axis=1)}


def chunks(share: float) -> Sequence[Params]:
    """Chunk by chunk, all cases in each."""
    cases = [{"rule": rule, "mode": mode} for rule in SHIFTS for mode in MODES]
    every = [(part, scene) for scene, count in CHUNKS.items() for part in parts(count, share)]
    return [{"scene": scene, **case, "part": part} for part, scene in sorted(every) for case in cases]


# ---------------------------------------------------------------- verdicts


def z_and_error(samples: Array, truth: float, truth_error: float) -> tuple[float, float]:
    """z of a mean over replicas against the truth, and its standard error with the truth's."""
    error = np.hypot(samples.std(ddof=1) / np.sqrt(len(samples)), truth_error)
    return float((samples.mean() - truth) / error), float(error)


def spread(total: Array, square: Array, n: int, truth: Array | float, truth_error: Array | float) -> float:
    """Root mean square of the pixels' z-scores; sums over n replicas, (pixels,)."""
    mean = total / n
    error = np.hypot(np.sqrt((square / n - mean**2) / (n - 1)), truth_error)
    return float(np.sqrt(np.mean(((mean - truth) / error) ** 2)))


def judge(done: Done) -> Sequence[Row]:
    """Every case by both comparisons."""
    rows: list[Row] = []
    for case in dict.fromkeys((params["scene"], params["rule"], params["mode"]) for params, _ in done):
        mine = [arrays for params, arrays in done if (params["scene"], params["rule"], params["mode"]) == case]
        blocks = np.concatenate([arrays["blocks"] for arrays in mine], axis=1)
        sums, squares = (np.sum([arrays[name] for arrays in mine], axis=0) for name in ("sums", "squares"))
        truth, n = reference(case[0]), blocks.shape[1]
        spreads = [
            spread(sums[0], squares[0], n, 0.0, 0.0),
            spread(sums[1], squares[1], n, truth.mean, truth.error),
        ]
        rows += judged(", ".join(case), blocks, truth, spreads)
    return rows


def judged(case: str, blocks: Array, truth: Reference, spreads: Sequence[float]) -> list[Row]:
    """One case: the paired comparison, and the one with the reference."""
    by_block = truth.mean.reshape(BLOCKS, -1)
    error_by_block = np.sqrt((truth.error.reshape(BLOCKS, -1) ** 2).sum(axis=1)) / by_block.shape[1]
    zero = (np.zeros(BLOCKS), np.zeros(BLOCKS), 0.0)
    against = {
        "against the frames' own initial samples": zero,
        "against the reference": (by_block.mean(axis=1), error_by_block, truth.image_error),
    }
    rows = []
    for values, (what, (means, errors, image_error)), wide in zip(blocks, against.items(), spreads, strict=True):
        scale = truth.mean.mean()
        z, error = z_and_error(values.mean(axis=1), float(means.mean()), image_error)
        z_blocks = [z_and_error(values[:, b], means[b], errors[b]) for b in range(BLOCKS)]
        worst, power = max(abs(each) for each, _ in z_blocks), max(each for _, each in z_blocks) / by_block.mean()
        holds = error <= EPS * scale and max(abs(z), worst) <= SIGMA and wide <= SPREAD
        note = f"z {z:+.2f}; blocks |z| <= {worst:.2f}, SE <= {power:.2%}; z-spread of pixels {wide:.2f}"
        bias, limit = (values.mean() - means.mean()) / scale, f"|z| <= {SIGMA:g}, SE <= {EPS:.1%}, spread <= {SPREAD}"
        rows.append(Row(CLAIMS, f"{case}: bias {what}", bias, limit, bool(holds), len(values), error / scale, note))
    return rows


CLAIMS = "GRIS-A05, GRIS-C11"
JOB = Job("ReSTIR PT against its own initial samples and against references, by replicas", chunks, compute, judge)
