"""Differences of rows by a rule whose errors of the first kind are known, on images that nobody has looked at.

What is rendered, and all that is asked of images, is as in `gradients`, whose rule calls even path tracing biased.
Differences are judged by |z| <= 4 of the row, of its blocks and of every edge pair, and by the pooled error (`pooling`)
of each stretch of pairs between edges, away from them.  The z-spread of all pairs is told beside.

Rule, counts and their reasons were fixed before these images were made; `benchmarks/rule_rates.py` finds them.  Of rows
drawn from 96 000 path traced images whose mean is the truth, z-spreads turn all red that have 2048 images, and 65% of
those with 23 040; blocks 3% of the former and none of the latter, so that rows behind posts have more images than
before; the pooled error 1% of those with 1024, and none of 900 with 2048 to 5120.
What the rule does not see: pairs beside edges are judged in their block only, for in motion they share the edge's own
paths, which are chosen rarely and weigh much.  A bias of one of n pairs of a stretch is seen when it is
sqrt(n (S^2 - 1)) of their errors, 6 to 7, for what chance allows S.  A Jacobian a tenth too small one way is seen at
once, a hundredth also; but both ways it takes a twentieth off quiet differences only, and no rule here sees that.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from benchmarks.jobs.comparing import SIGMA, Sums, Truth, joined, judged
from benchmarks.jobs.gradients import CASES as EARLIER
from benchmarks.jobs.gradients import JOB as RENDERED
from benchmarks.jobs.gradients import MISTAKES, PAIRS, Case, true_probe
from benchmarks.jobs.job import Done, Params, Row, parts
from benchmarks.jobs.pooling import among, pooled, pooled_by_chance
from figures.claims.figure import Arrays
from figures.experiments.references import reference
from restir_ref.batch import Array

SERIES = 2
"""A parameter of every chunk, so that its random numbers are not those that the old rule was seen to fail on."""

MORE: Mapping[Case, tuple[int, float]] = MappingProxyType(
    {
        ("occluders", "with", "frame 5, still"): (104, 0.005),
        ("occluders", "with", "frame 20, still"): (48, 0.005),
        ("occluders", "with", "frame 5, moving"): (168, 0.005),
        ("occluders", "after", "frame 5, still"): (300, 0.005),
        ("occluders", "after", "frame 20, still"): (290, 0.005),
        ("occluders", "after", "frame 5, moving"): (330, 0.005),
    }
)
"""Chunks of cases that get more of them, and the largest standard error."""

CASES: Mapping[Case, tuple[int, float]] = MappingProxyType(EARLIER | MORE)

EDGE, REACH = 0.1, 4
"""An edge pair's true difference is more than this share of its light; how many pairs on either side are beside it."""


def chunks(share: float) -> Sequence[Params]:
    """Chunk by chunk, all cases in each."""
    every = sorted((part, case) for case, (count, _) in CASES.items() for part in parts(count, share))
    names = ("scene", "method", "mode")
    return [dict(zip(names, case, strict=True)) | {"part": part, "series": SERIES} for part, case in every]


def compute(params: Params, *, rng: np.random.Generator) -> Arrays:
    """What `gradients` renders."""
    return RENDERED.compute(params, rng=rng)


def judge(done: Done) -> Sequence[Row]:
    """What `gradients` says, but of differences by the rule of this job."""
    cases = {f"{', '.join(case)}: bias of dx": case for case in CASES}
    return [anew(row, cases[row.what], done) if row.what in cases else row for row in RENDERED.judge(done)]


def anew(row: Row, case: Case, done: Done) -> Row:
    """A row of `gradients` with this job's verdict; a mistake has to be seen as before, and is told the numbers."""
    scene, method, _ = case
    truth = true_probe(scene)
    found = joined([a for p, a in done if (p["scene"], p["method"], p["mode"]) == case], "dx")
    edge, S, chance = errors(found, truth, scene)
    note = f"{row.note}; pooled {S:.2f} of {chance:.2f}; edges |z| <= {edge:.2f}"
    if method in MISTAKES:
        return replace(row, note=note)
    plain = judged(row.claims, row.what, together(found), truth, 1.0, CASES[case][1])
    return replace(plain, holds=plain.holds and max(edge / SIGMA, S / chance) <= 1, note=note)


def errors(found: Sums, truth: Truth, scene: str) -> tuple[float, float, float]:
    """The largest |z| of edge pairs; the pooled error of a stretch, and what chance allows it: of the worst of them."""
    edge, stretches = kinds(scene)
    z = (found.mean - truth.mean)[edge] / np.hypot(found.error, truth.error)[edge]
    pools = []
    for some in stretches:
        part = among(found, some)
        S = pooled(part, Truth(truth.mean[some], truth.error[some], truth.image_error))
        pools.append((S, pooled_by_chance(part)))
    S, chance = max(pools, key=lambda pool: pool[0] / pool[1])
    return float(np.abs(z).max()), S, chance


def kinds(scene: str) -> tuple[Array, list[Array]]:
    """Edge pairs, and the stretches of pairs between them that are away from edges, all by their numbers."""
    true = reference(scene).mean[: PAIRS + 1]
    edge = np.flatnonzero(abs(np.diff(true)) > EDGE * (true[1:] + true[:-1]) / 2)
    away = np.flatnonzero((abs(np.arange(PAIRS)[:, None] - edge) > REACH).all(axis=1))
    return edge, np.split(away, np.flatnonzero(np.diff(away) > 1) + 1)


def together(found: Sums) -> Sums:
    """All images in one chunk: the row and its blocks stay, and the rule about z-spreads says nothing."""
    return replace(found, total=found.total.sum(axis=0, keepdims=True))


ASKS = f"""{RENDERED.asks}, images of series {SERIES}: the row, its blocks and every edge pair by |z|, pairs away from
edges by their pooled error, stretch by stretch; the z-spread is told, and judges images only""".replace("\n", " ")

JOB = replace(RENDERED, asks=ASKS, chunks=chunks, compute=compute, judge=judge)
