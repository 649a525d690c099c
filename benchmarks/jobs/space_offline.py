"""Offline ReSTIR PT in space: what `offline` asks of a row of pixels, of a piece of the rough Cornell box.

It is the middle of the first crop, which stands where the low-discrepancy sequence of all figures in space put it.
The truth is path tracing of the same pixels by lattices, each a chunk.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from benchmarks.jobs.comparing import Truth
from benchmarks.jobs.job import Done, Job, Params, Row, parts
from benchmarks.jobs.offline import kept, rows_of
from figures.claims.figure import Arrays
from figures.experiments.rendering import lattice_tracing, offline
from figures.experiments.solid import SIDE
from figures.experiments.views import HYBRID, RULES, standard, view
from restir_ref.chance import Live
from restir_ref.transport.restir_pt import PathIntegrals

SCENE, CHUNKS, FRAMES = "CB3", 256, 16
"""4096 frames for each shift.

Of 1024 the hybrid shift's mean was off by -.30 +- .09% and its slope -.90; other 4160 had +.05 +- .04%, so that a
quarter is too few for a slope over two decades.
"""
TRUTH, TRUTHS, LATTICES, SMALL = "truth", 64, 4, 12
"""What chunks of the truth are called, how many there are, how many lattices each has; the piece is a square."""


def piece(rule: str) -> PathIntegrals:
    """The middle of the first crop."""
    crops = standard(SCENE)
    (left, top), inwards = crops.corners[0], (SIDE - SMALL) // 2
    sensor = replace(crops.pinhole, width=SMALL, height=SMALL, left=left + inwards, top=top + inwards)
    return view(SCENE, RULES.get(rule, HYBRID), Counter(), sensor)


def compute(params: Params, *, rng: np.random.Generator) -> Arrays:
    """FRAMES independent frames, or LATTICES images of the truth; (R, n)."""
    of = piece(params["rule"])
    render, count = (lattice_tracing(), LATTICES) if params["rule"] == TRUTH else (offline, FRAMES)
    return kept(render(of, np.arange(count * of.n), Live(rng)).reshape(count, of.n))


def chunks(share: float) -> Sequence[Params]:
    """The truth, then chunk by chunk both shifts in each."""
    truth = [{"rule": TRUTH, "part": part} for part in parts(TRUTHS, share)]
    return truth + [{"rule": rule, "part": part} for part in parts(CHUNKS, share) for rule in RULES]


def judge(done: Done) -> Sequence[Row]:
    """The slope, and no bias."""
    images = np.concatenate([arrays["frames"] for params, arrays in done if params["rule"] == TRUTH])
    root = np.sqrt(len(images))
    error, of_image = images.std(axis=0, ddof=1) / root, images.mean(axis=1).std(ddof=1) / root
    rest = [(params, arrays) for params, arrays in done if params["rule"] != TRUTH]
    return rows_of(rest, SCENE, Truth(images.mean(axis=0), error, float(of_image)))


JOB = Job("Offline rendering by spatial reuse only, in space", chunks, compute, judge)
