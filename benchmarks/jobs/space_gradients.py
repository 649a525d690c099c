"""Differences in space are unbiased to 1%: a checker floor under a moving camera, by the three ways to take them.

Every difference, along rows and along columns, is taken with the sign of the true one, over the mean of their sizes.
The truth is path tracing of every pixel for itself: it shifts nothing, so that it shares no shift with what it judges.
"""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType

import numpy as np

from benchmarks.jobs.job import Done, Job, Params, Row, parts
from benchmarks.jobs.signing import probed
from figures.claims.figure import Arrays
from figures.experiments.following import followed, frugal, gathered, in_place, views_of
from figures.experiments.gradients import ADAPTIVE, METHODS, with_restir
from figures.experiments.rendering import POINTS, lattice_tracing
from figures.experiments.views import HYBRID
from restir_ref.chance import Live
from restir_ref.gradient_loop import GRADIENT, View, forward
from restir_ref.transport.paths import Tracer
from restir_ref.transport.restir_pt import PathIntegrals
from tracer3d.scenes import checker

SIDE, FRAMES, REPLICAS = 9, 3, 64
"""Rows and columns of the crop, whose 72 differences either way are eight blocks; frames, and replicas of a chunk."""

IN_PLACE, GATHERED = "with, in place", "with, gathered"
"""Pair reuse whose history stays where it is, or what lies elsewhere is moved into the square too.

The others move that of one overlapped pixel.
"""

WITH: Mapping[str, Callable[[View], View]] = MappingProxyType({IN_PLACE: in_place, GATHERED: gathered})
TRUTH, EPS = "truth", MappingProxyType({"dx": 0.01, "dy": 0.025})
"""What the truth's chunks are called, and the largest standard errors, for dy what its cost allows."""

CHUNKS: Mapping[str, int] = MappingProxyType(
    {TRUTH: 112, "with": 160, IN_PLACE: 90, GATHERED: 90, "after": 180, "path tracing": 108}
)
CLAIMS: Mapping[str, str] = MappingProxyType(
    {
        "with": "GPT-A02",
        IN_PLACE: "GPT-A02, GPT-A05",
        GATHERED: "GPT-A02, GPT-A05",
        "after": "COM-B07",
        "path tracing": "COM-B06",
    }
)


def compute(params: Params, *, rng: np.random.Generator) -> Arrays:
    """dx and dy of the last frame, (R, SIDE (SIDE - 1)); the truth's are of one moved lattice for each pixel."""
    s, method = checker(), params["method"]
    if method == TRUTH:
        of = PathIntegrals(Tracer(s.scene, followed(s, SIDE, 1)[0], s.depth, HYBRID))
        image = lattice_tracing()(of, np.arange(of.n), Live(rng))
        return {name: (image[i] - image[j])[None] for name, ((i, j), _) in forward((SIDE, SIDE)).items()}
    asked = Counter[str]()
    views = views_of(s, followed(s, SIDE, FRAMES), GRADIENT, ADAPTIVE, asked)
    history, render = (WITH[method], with_restir) if method in WITH else (frugal, METHODS[method])
    found = render([*map(history, views)], asked, REPLICAS, Live(rng))
    return {name: found[name] for name in EPS}


def chunks(share: float) -> Sequence[Params]:
    """Chunk by chunk, all methods in each, the truth first."""
    return [
        {"method": method, "part": part}
        for part in parts(max(CHUNKS.values()), share)
        for method, count in CHUNKS.items()
        if part < count
    ]


def judge(done: Done) -> Sequence[Row]:
    """Every method both ways against the differences of the truth."""
    rows = []
    for name, eps in EPS.items():
        found = {m: [arrays[name] for params, arrays in done if params["method"] == m] for m in CHUNKS}
        rows += [
            probed(claims, f"Checker3, moving, {m}: bias of {name}", found[m], found[TRUTH], eps)
            for m, claims in CLAIMS.items()
        ]
    return rows


JOB = Job(f"Differences in space against those of {POINTS}-point lattices", chunks, compute, judge)
