"""Offline ReSTIR PT, spatial reuse only: the mean of independent frames is unbiased and its error falls like 1/T.

FRAMES independent frames of the inset are averaged in groups of T = 1, 2, 4 .. 256, all disjoint; the mean
square error of all groups, over pixels, should fall with slope -1 over more than two decades of T.
"""

from collections.abc import Sequence
from dataclasses import replace

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
    images = shade(frame(here, Live(rng), replace(OFFLINE), random_in_row), here)[0].reshape(FRAMES, INSET)
    return {"frames": images} | stored(sums(images), "sums")


def chunks(share: float) -> Sequence[Params]:
    """Chunk by chunk, both shifts in each."""
    return [{"rule": rule, "part": part} for part in parts(CHUNKS, share) for rule in ("hybrid", "reconnection")]


def error(frames: Array, truth: Array, T: int) -> float:
    """Mean square error, relative to the truth, of the means of T frames, over all disjoint groups."""
    means = frames[: len(frames) // T * T].reshape(-1, T, frames.shape[1]).mean(axis=1)
    return float(np.mean((means / truth - 1) ** 2))


def judge(done: Done) -> Sequence[Row]:
    """The slope, and no bias."""
    found, rows = reference(SCENE), []
    truth = Truth(found.mean, found.error, found.image_error)
    for rule in dict.fromkeys(params["rule"] for params, _ in done):
        mine = [arrays for params, arrays in done if params["rule"] == rule]
        frames = np.concatenate([arrays["frames"] for arrays in mine])
        T = GROUPS[len(frames) // GROUPS >= 4]
        mse = [error(frames, truth.mean, int(each)) for each in T]
        slope = float(np.polyfit(np.log(T), np.log(mse), 1)[0])
        what, note = f"{SCENE}, {rule}: slope of the mean square error over iterations", f"T = {T[0]} .. {T[-1]}"
        holds = bool(abs(slope + 1) <= SLOPE and T[-1] / T[0] >= 100)
        rows.append(Row("GRIS-A06", what, slope, f"-1 +- {SLOPE}, 2 decades", holds, len(frames), note=note))
        scale = float(truth.mean.mean())
        rows.append(judged("GRIS-A06", f"{SCENE}, {rule}: bias of the mean", joined(mine, "sums"), truth, scale, EPS))
    return rows


JOB = Job("Offline rendering by spatial reuse only", chunks, compute, judge)
