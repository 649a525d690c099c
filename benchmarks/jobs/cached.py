"""DDGI resampling is secondary DDGI in expectation: light from all surfaces, a cache's, against quadrature.

Rows of Lambert and glossy surfaces and of a crease, lit by a field in closed form.  Candidates alone, and two frames of
temporal and spatial reuse whose weights see obstacles, without a bound and with one and its residual.  Controls leave
the residual out, and visibility.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import Any

import numpy as np

from benchmarks.jobs.comparing import Truth, biased, joined, judged, refined, stored, sums
from benchmarks.jobs.job import Done, Job, Params, Row, parts
from figures.claims.figure import Arrays
from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.integrals import Pixels
from restir_ref.mis import WEIGHTS
from restir_ref.transport.cache.integrals import lit, unseen
from restir_ref.transport.cache.shading import bounded, plain
from tests.flatland.cached import lighted, replicated
from tests.transport.cache.gathered import Drawn, drawn, gathered, reused, shown

SCENES = ("matte_cornell", "glossy_cornell", "crease", "ajar")
CHUNKS, REPLICAS, FRAMES, CELLS = 64, 256, 2, (4096, 8192)
BOUND, EPS, LEAST = 10.0, 0.005, 0.01
HIDDEN = "occluders"
"""The scene of the control without visibility."""

WAYS: Mapping[str, Mapping[str, Any]] = MappingProxyType(
    {
        "candidates": {},
        "reuse": {},
        "reuse, G_max = 10": {"G_max": BOUND},
        "no residual": {"G_max": BOUND},
        "no visibility": {"sight": unseen},
    }
)
CONTROLS: Mapping[str, str] = MappingProxyType({"no residual": "crease", "no visibility": HIDDEN})


def chunks(share: float) -> Sequence[Params]:
    """Quadrature, then chunk by chunk."""
    exact: list[Params] = [{"scene": scene, "way": "quadrature", "part": 0} for scene in (*SCENES, HIDDEN)]
    listed = [(scene, way) for scene in SCENES for way in WAYS if way not in CONTROLS]
    listed += [(scene, way) for way, scene in CONTROLS.items()]
    return exact + [{"scene": s, "way": w, "part": k} for k in parts(CHUNKS, share) for s, w in listed]


def compute(params: Params, *, rng: np.random.Generator) -> Arrays:
    """Sums over REPLICAS images, or the image by coarse and fine quadrature, (2, n)."""
    if params["way"] == "quadrature":
        of = lighted(params["scene"], 1).of
        return {"images": np.stack([gathered(of, cells)[0] for cells in CELLS])}
    return stored(sums(replicated(image(params["scene"], params["way"], Live(rng)))), "sums")


def image(scene: str, way: str, chance: Live) -> Array:
    """The last frame of a way, (C, N)."""
    here = lighted(scene, REPLICAS, **WAYS[way])
    frame = drawn(here, chance) if way == "candidates" else loop(here, way, chance)
    return np.asarray(bounded(frame.X, here, plain, chance) if way == "no residual" else shown(here, frame, chance))


def loop(here: Pixels, way: str, chance: Live) -> Drawn:
    """Frames of reuse; without visibility inputs are counted, and the last one looks."""
    if way != "no visibility":
        return reused(here, chance, FRAMES)
    frame = reused(here, chance, FRAMES, WEIGHTS["constant"])
    return replace(frame, X=lit(frame.X, here))


def judge(done: Done) -> Sequence[Row]:
    """No bias of any way in any scene, and certain bias of the controls."""
    exact = {params["scene"]: truth(arrays) for params, arrays in done if params["way"] == "quadrature"}
    rows: list[Row] = []
    for scene, way in dict.fromkeys((p["scene"], p["way"]) for p, _ in done if p["way"] != "quadrature"):
        found = joined([a for p, a in done if (p["scene"], p["way"]) == (scene, way)], "sums")
        scale, what = float(exact[scene].mean.mean()), f"{scene}, {way}: bias against quadrature"
        if way in CONTROLS:
            rows.append(biased("DDGIR-A03, DDGIR-E09", what, found, exact[scene], LEAST))
        else:
            rows.append(judged("DDGIR-A02, DDGIR-A03, DDGIR-E09", what, found, exact[scene], scale, EPS))
    return rows


def truth(arrays: Arrays) -> Truth:
    """The finer quadrature, its change as error."""
    return refined(arrays["images"])


JOB = Job("DDGI resampling against quadrature", chunks, compute, judge)
