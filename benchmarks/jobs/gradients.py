"""Gradient-domain ReSTIR is unbiased to 0.5%: differences of a checker floor, still and moving.

The mean of dx over a row telescopes to nothing, so every difference is taken with the sign of the true one, over the
mean of their sizes: then the truth of the row is 1.  Replicas are independent; only the last frame of each counts.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.jobs.comparing import Truth, joined, judged, stored, sums
from benchmarks.jobs.job import Done, Job, Params, Row, parts
from figures.claims.figure import Arrays
from figures.experiments.flatland import displaced
from figures.experiments.gradients import ADAPTIVE, after_restir, gradient_view, path_traced, with_restir
from figures.experiments.references import reference
from flatland2d.scenes import SCENES
from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.gradient_loop import GRADIENT

SCENE, REPLICAS, PAIRS = "checker", 64, 120
"""The scene, replicas of a chunk, and the pairs of the inset that count: eight blocks of 15."""


@dataclass(frozen=True)
class Mode:
    """How many frames there are, how far the eye moves between them, and how many chunks.

    A single frame is noisier and cheaper; .00035 is .7 pixels of the floor.
    """

    frames: int
    step: float
    chunks: int


MODES: Mapping[str, Mode] = {
    "frame 1": Mode(1, 0.0, 96),
    "frame 5, still": Mode(5, 0.0, 32),
    "frame 5, moving": Mode(5, 0.00035, 72),
    "frame 20, still": Mode(20, 0.0, 16),
}
METHODS = {"with": with_restir, "after": after_restir, "path tracing": path_traced}


def cases() -> list[tuple[str, str]]:
    """Methods and modes; path tracing has one frame."""
    return [(name, mode) for name in METHODS for mode in MODES if name != "path tracing" or mode == "frame 1"]


def compute(params: Params, *, rng: np.random.Generator) -> Arrays:
    """dx of the last frame with the signs of the truth."""
    mode, last = MODES[params["mode"]], SCENES[SCENE]().pinhole()
    asked = Counter[str]()
    sensors = [displaced(last, np.array([(k - mode.frames + 1) * mode.step, 0.0])) for k in range(mode.frames)]
    sensors = sensors if mode.step else [last] * mode.frames
    pairs = zip(sensors, [sensors[0], *sensors], strict=False)
    views = [gradient_view(SCENE, each, asked, GRADIENT, ADAPTIVE) for each in pairs]
    dx = METHODS[params["method"]](views, asked, REPLICAS, Live(rng))["dx"]
    return stored(sums(signed(dx)), "dx")


def signed(dx: Array) -> Array:
    """Differences (R, n) with the signs of the true ones, over their mean size."""
    true = np.diff(reference(SCENE).mean)[:PAIRS]
    return np.asarray(dx[:, :PAIRS] * np.sign(true) / abs(true).mean())


def chunks(share: float) -> Sequence[Params]:
    """Chunk by chunk, all cases in each."""
    every = [(part, case) for case in cases() for part in parts(MODES[case[1]].chunks, share)]
    return [{"method": case[0], "mode": case[1], "part": part} for part, case in sorted(every)]


def judge(done: Done) -> Sequence[Row]:
    """Every case against the differences of the reference."""
    error = reference(SCENE).error
    both = np.hypot(error[1:], error[:-1])[:PAIRS] / abs(np.diff(reference(SCENE).mean)[:PAIRS]).mean()
    truth = Truth(signed(np.diff(reference(SCENE).mean)[None])[0], both, float(np.hypot.reduce(both) / PAIRS))
    rows = []
    for case in cases():
        mine = [arrays for params, arrays in done if (params["method"], params["mode"]) == case]
        rows.append(judged(CLAIMS[case[0]], f"{', '.join(case)}: bias of dx", joined(mine, "dx"), truth, 1.0, EPS))
    return rows


CLAIMS = {"with": "GPT-A02, GPT-A05", "after": "GPT-A01, GPT-E11, COM-B07", "path tracing": "GPT-A12, COM-B06"}
EPS = 0.005
JOB = Job("Differences of a checker floor against those of its reference, by replicas", chunks, compute, judge)
