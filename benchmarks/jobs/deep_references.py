"""The reference image of a glossy room with all bounces, for figures of caches, which know all of them.

Path tracing by randomly moved lattices, to a depth beyond which less than a thousandth of the light is left.  Rooms of
Lambert surfaces have radiosity, which figures compute themselves.
"""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.jobs.job import ROOT, Done, Job, Params, Row, parts
from benchmarks.jobs.references import LIMIT, image, traced
from figures.claims.figure import Arrays
from figures.experiments.deep import ALL_BOUNCES, DEEP, PATH
from figures.experiments.references import fingerprint, key_of, save
from flatland2d.scenes import SCENES

SCENE = "glossy_cornell"
CHUNKS, LATTICES = 16, 4


def chunks(share: float) -> Sequence[Params]:
    """Path tracing, chunk by chunk."""
    return [{"scene": SCENE, "part": part} for part in parts(CHUNKS, share)]


def compute(params: Params, *, rng: np.random.Generator) -> Arrays:
    """Independent images, (LATTICES, n)."""
    setting = replace(SCENES[params["scene"]](), depth=DEEP)
    return {"images": np.array([image(setting, rng) for _ in range(LATTICES)])}


def identity(params: Params) -> str:
    """The scene, and how deep it is traced."""
    return f"{fingerprint(params['scene'])}, depth {DEEP}"


def judge(done: Done) -> Sequence[Row]:
    """Errors below 0.1% of the image's mean."""
    found = traced(done, SCENE)
    error = found.image_error / found.mean.mean()
    what = f"{SCENE}, {DEEP} bounces: standard error of the reference's image mean"
    note = f"worst pixel {(found.error / found.mean).max():.2g}"
    return [Row("DDGIR-E01", what, error, f"< {LIMIT:.1%}", bool(error < LIMIT), found.samples, note=note)]


def publish(done: Done, root: Path) -> None:
    """Store the reference for the figures."""
    save({key_of(SCENE, ALL_BOUNCES): traced(done, SCENE)}, root / PATH.relative_to(ROOT))


JOB = Job("The reference image of a glossy room with all bounces", chunks, compute, judge, identity)
