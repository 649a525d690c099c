"""Reference images of the crops of space that figures show: long path tracing, of all light and of indirect light.

As in flatland, lattices of primary numbers, moved at random for every pixel; nobody else renders these crops, so what
they say of path tracing itself is left to the job `witness`.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.jobs.job import ROOT, Done, Job, Params, Row, parts
from benchmarks.jobs.references import traced
from figures.claims.figure import Arrays
from figures.experiments.references import INDIRECT, PATH, fingerprint, key_of, save
from figures.experiments.rendering import POINTS, Light, lattice_tracing
from figures.experiments.views import HYBRID, view
from restir_ref.chance import Live
from restir_ref.transport.baselines.restir_di import indirect_light
from restir_ref.transport.paths import radiance

LIGHTS: Mapping[str, Light] = {"": radiance, INDIRECT: indirect_light}
WANTED = (
    ("CB3", ""),
    ("CB3-glossy", ""),
    ("Ajar3", ""),
    ("GlassBall3", ""),
    ("CB3", INDIRECT),
    ("CB3-glossy", INDIRECT),
    ("CB3-glossy, box", INDIRECT),
    ("CB3-glossy, foot", INDIRECT),
)
COUNT, LIMIT = 8, 0.005


def chunks(share: float) -> Sequence[Params]:
    """One lattice per pixel each, scene by scene and light by light."""
    return [{"scene": scene, "light": light, "part": part} for part in parts(COUNT, share) for scene, light in WANTED]


def compute(params: Params, *, rng: np.random.Generator) -> Arrays:
    """One image, (1, n)."""
    of = view(params["scene"], HYBRID, Counter())
    image = lattice_tracing(LIGHTS[params["light"]])(of, np.arange(of.n), Live(rng))
    return {"images": image[None]}


def identity(params: Params) -> str:
    """The scene with its crops, and the light."""
    return f"{params['light']} {fingerprint(params['scene'])}"


def judge(done: Done) -> Sequence[Row]:
    """The error of every reference's mean, and of its pixels."""
    rows = []
    for scene, light in WANTED:
        found = traced([each for each in done if each[0]["light"] == light], scene)
        error, each = found.image_error / found.mean.mean(), found.error / np.maximum(found.mean, 1e-9)
        note = f"mean pixel {each.mean():.2g}, worst pixel {each.max():.2g}"
        what = f"{key_of(scene, light)}: standard error of the reference's image mean"
        rows.append(Row("", what, error, f"< {LIMIT:.1%}", bool(error < LIMIT), found.samples, note=note))
    return rows


def publish(done: Done, root: Path) -> None:
    """Store the references for the figures."""
    found = {}
    for scene, light in WANTED:
        mine = traced([each for each in done if each[0]["light"] == light], scene)
        found[key_of(scene, light)] = replace(mine, samples=len(done) // len(WANTED) * POINTS)
    save(found, root / PATH.relative_to(ROOT))


JOB = Job("Reference images of the crops of space", chunks, compute, judge, identity)
