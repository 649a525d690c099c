"""Offline ReSTIR PT, spatial reuse only: the mean of independent frames is unbiased and its error falls like 1/T.

FRAMES independent frames of the inset are averaged in groups of T = 1, 2, 4 .. 256, all disjoint; the mean
square error of all groups, over pixels, should fall with slope -1 over more than two decades of T.
"""

from collections.abc import Sequence

import numpy as np

from benchmarks.jobs.comparing import Truth, joined, judged, stored, sums
from benchmarks.jobs.job import Done, Job, Params, Row, parts
from figures.claims.figure import Arrays
from figures.experiments.references import reference
from flatland2d.scenes import INSET, SCENES
from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.integrals import Pixels
from restir_ref.loop import OFFLINE, frame, random_in_row
from restir_ref.restir import shade
from restir_ref.transport.paths import Tracer
from restir_ref.transport.restir_pt import PathIntegrals
from tests.transport.paths import RULES

SCENE, CHUNKS, FRAMES = "cornell", 64, 32
"""2048 frames for each shift."""
GROUPS = 2 ** np.arange(9)
EPS, SLOPE = 0.005, 0.07


def compute(params: Params, *, rng: np.random.Generator) -> Arrays:
    """FRAMES independent frames, (FRAMES, n)."""
    setting = SCENES[SCENE]()
    of = PathIntegrals(Tracer(setting.scene, setting.pinhole(), setting.depth, RULES[params["rule"]]))
    here = Pixels(of, np.arange(FRAMES * INSET))
    return kept(shade(frame(here, Live(rng), OFFLINE, random_in_row), here)[0].reshape(FRAMES, INSET))


def kept(images: Array) -> Arrays:
    """What a chunk stores of its frames (R, n)."""
    return {"frames": images} | stored(sums(images), "sums")


def chunks(share: float) -> Sequence[Params]:
    """Chunk by chunk, both shifts in each."""
    return [{"rule": rule, "part": part} for part in parts(CHUNKS, share) for rule in ("hybrid", "reconnection")]


def error(frames: Array, truth: Truth, T: int) -> float:
    """Mean square error, relative to the truth and less the truth's own, of the means of T frames.

    Over all disjoint groups of T.
    """
    means = frames[: len(frames) // T * T].reshape(-1, T, frames.shape[1]).mean(axis=1)
    return float(np.mean((means / truth.mean - 1) ** 2) - np.mean((truth.error / truth.mean) ** 2))


def judge(done: Done) -> Sequence[Row]:
    """The slope, and no bias."""
    found = reference(SCENE)
    return rows_of(done, SCENE, Truth(found.mean, found.error, found.image_error))


def rows_of(done: Done, scene: str, truth: Truth) -> list[Row]:
    """For each shift: the slope of the error over iterations, and no bias."""
    rows = []
    for rule in dict.fromkeys(params["rule"] for params, _ in done):
        mine = [arrays for params, arrays in done if params["rule"] == rule]
        frames = np.concatenate([arrays["frames"] for arrays in mine])
        T = GROUPS[len(frames) // GROUPS >= 4]
        mse = [error(frames, truth, int(each)) for each in T]
        slope = float(np.polyfit(np.log(T), np.log(mse), 1)[0])
        what, note = f"{scene}, {rule}: slope of the mean square error over iterations", f"T = {T[0]} .. {T[-1]}"
        holds = bool(abs(slope + 1) <= SLOPE and T[-1] / T[0] >= 100)
        rows.append(Row("GRIS-A06", what, slope, f"-1 +- {SLOPE}, 2 decades", holds, len(frames), note=note))
        scale = float(truth.mean.mean())
        rows.append(judged("GRIS-A06", f"{scene}, {rule}: bias of the mean", joined(mine, "sums"), truth, scale, EPS))
    return rows


JOB = Job("Offline rendering by spatial reuse only", chunks, compute, judge)
