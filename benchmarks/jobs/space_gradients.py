"""Differences in space are unbiased to 1%: a checker floor under a moving camera, by the three ways to take them.

Every difference along a row is taken with the sign of the true one, over the mean of their sizes, as in `gradients`.
The truth is path tracing of every pixel for itself: it shifts nothing, so that it shares no shift with what it judges.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from types import MappingProxyType

import numpy as np

from benchmarks.jobs.comparing import Truth, joined, judged, stored, sums
from benchmarks.jobs.job import Done, Job, Params, Row, parts
from figures.claims.figure import Arrays
from figures.experiments.following import followed, frugal, in_place, views_of
from figures.experiments.gradients import ADAPTIVE, METHODS, with_restir
from figures.experiments.rendering import POINTS, lattice_tracing
from figures.experiments.views import HYBRID
from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.gradient_loop import GRADIENT
from restir_ref.transport.paths import Tracer
from restir_ref.transport.restir_pt import PathIntegrals
from tracer3d.scenes import checker

SIDE, FRAMES, REPLICAS = 9, 3, 64
"""Rows and columns of the crop, whose 72 differences along rows are eight blocks; frames, and replicas of a chunk."""

IN_PLACE = "with, in place"
"""Pair reuse whose history stays where it is, instead of one overlapped pixel's that is moved."""

CHUNKS: Mapping[str, int] = MappingProxyType({"truth": 32, "with": 96, IN_PLACE: 96, "after": 128, "path tracing": 112})
CLAIMS: Mapping[str, str] = MappingProxyType(
    {"with": "GPT-A02", IN_PLACE: "GPT-A02, GPT-A05", "after": "COM-B07", "path tracing": "COM-B06"}
)
EPS = 0.01


def compute(params: Params, *, rng: np.random.Generator) -> Arrays:
    """dx of the last frame, (R, SIDE (SIDE - 1)); the truth's are of one moved lattice for each pixel."""
    s, method = checker(), params["method"]
    if method == "truth":
        of = PathIntegrals(Tracer(s.scene, followed(s, SIDE, 1)[0], s.depth, HYBRID))
        image = lattice_tracing()(of, np.arange(of.n), Live(rng))
        return {"dx": np.diff(image.reshape(SIDE, SIDE)).reshape(1, -1)}
    asked = Counter[str]()
    views = views_of(s, followed(s, SIDE, FRAMES), GRADIENT, ADAPTIVE, asked)
    history, render = (in_place, with_restir) if method == IN_PLACE else (frugal, METHODS[method])
    return {"dx": render([*map(history, views)], asked, REPLICAS, Live(rng))["dx"]}


def chunks(share: float) -> Sequence[Params]:
    """Chunk by chunk, all methods in each, the truth first."""
    return [
        {"method": method, "part": part}
        for part in parts(max(CHUNKS.values()), share)
        for method, count in CHUNKS.items()
        if part < count
    ]


def signed(dx: Array, true: Array) -> Array:
    """Differences (R, n) with the signs of the true ones, over their mean size."""
    return np.asarray(dx * np.sign(true) / abs(true).mean())


def judge(done: Done) -> Sequence[Row]:
    """Every method against the differences of the truth."""
    found = {m: [arrays["dx"] for params, arrays in done if params["method"] == m] for m in CHUNKS}
    each = np.concatenate(found["truth"])
    true, root = each.mean(axis=0), np.sqrt(max(len(each) - 1, 1))
    probes = signed(each, true)
    truth = Truth(signed(true[None], true)[0], probes.std(axis=0) / root, float(probes.mean(axis=1).std() / root))
    rows = []
    for method, claims in CLAIMS.items():
        mine = [stored(sums(signed(dx, true)), "dx") for dx in found[method]]
        what = f"Checker3, moving, {method}: bias of dx"
        rows.append(judged(claims, what, joined(mine, "dx"), truth, 1.0, EPS))
    return rows


JOB = Job(f"Differences in space against those of {POINTS}-point lattices", chunks, compute, judge)
