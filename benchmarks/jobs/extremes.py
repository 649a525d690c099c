"""Ten million random paths, with their records and shifts, while every floating-point exception is an error.

A part of the primary numbers is replaced by the ends of [0, 1): corners of sampling routines.
"""

import warnings
from collections.abc import Sequence
from dataclasses import fields

import numpy as np

from benchmarks.jobs.job import Done, Job, Params, Row, parts
from benchmarks.jobs.roundtrips import REACH, film
from figures.claims.figure import Arrays
from flatland2d.scenes import SCENES, Setting
from flatland2d.sensors import FILM
from restir_ref.batch import Array, take
from restir_ref.transport.paths import Path, leaves, radiance, trace
from restir_ref.transport.record import record
from restir_ref.transport.shifts import shift_path
from tests.transport.paths import RULES

CHUNKS, BATCHES, BATCH = 30, 3, 8192
"""30 * 3 * 8192 paths per scene, 1.03e7 in all."""
ENDS = np.array([0.0, np.nextafter(1, 0), 0.5])
OFTEN = 0.02


def numbers(D: int, n: int, rng: np.random.Generator) -> Array:
    """Primary samples, in every eighth column with some numbers at 0, next to 1, or at one half; (D, n)."""
    u = rng.random((D, n))
    at = (rng.random((D, n)) < OFTEN * 8) & (np.arange(n) % 8 == 0)
    return np.where(at, rng.choice(ENDS, (D, n)), u)


def bad(path: Path, J: Array) -> int:
    """Columns with a number that is not finite, or negative where none may be."""
    wrong = ~(np.isfinite(J) & (J >= 0)) | (path.A <= 0)
    for field in fields(Path):
        wrong |= ~np.isfinite(getattr(path, field.name)).reshape(-1, len(J)).all(axis=0)
    return int((wrong | (path.F < 0).any(axis=0)).sum())


def compute(params: Params, *, rng: np.random.Generator) -> Arrays:
    """Numbers of paths, of bad columns, and of batches that raised."""
    setting = SCENES[params["scene"]]()
    counts, said = np.zeros(3, dtype=int), ""
    for _ in range(BATCHES):
        t = film(setting, "hybrid")
        i, u = rng.integers(REACH, FILM - REACH, BATCH), numbers(t.D, BATCH, rng)
        j = i + rng.integers(1, REACH + 1, BATCH) * rng.choice([-1, 1], BATCH)
        k, nee = rng.integers(1, t.depth + 1, BATCH), rng.random(BATCH) < 0.5
        with np.errstate(all="raise"), warnings.catch_warnings():
            warnings.simplefilter("error")
            try:
                counts += [BATCH, once(setting, u, i, j, k, nee), 0]
            except (FloatingPointError, Warning, ValueError) as error:
                counts += [BATCH, 0, 1]
                said = f"{params['scene']}: {error}"
    return {"counts": counts, "said": np.array(said)}


def once(setting: Setting, u: Array, i: Array, j: Array, k: Array, nee: Array) -> int:
    """Trace, record leaf (k, nee) and shift it by each rule, there and back; bad columns."""
    found = 0
    for rule in RULES:
        t = film(setting, rule)
        tree = trace(t, u, i)
        F = np.zeros((t.scene.C, len(i)))
        for at, by_light, value in leaves(tree):
            F = np.where((k == at) & (nee == by_light), value, F)
        x = record(t, tree, k, nee, F)
        lit = np.flatnonzero(F.any(axis=0))
        y, J = shift_path(t, take(x, lit), j[lit])
        back, J_back = shift_path(t, y, i[lit])
        found += bad(x, np.ones(len(i))) + bad(y, J) + bad(back, J_back)
        found += int((~np.isfinite(radiance(tree))).sum())
    return found


def chunks(share: float) -> Sequence[Params]:
    """Chunk by chunk, all scenes in each."""
    return [{"scene": scene, "part": part} for part in parts(CHUNKS, share) for scene in SCENES]


def judge(done: Done) -> Sequence[Row]:
    """Nothing raises, everything is finite, over all scenes."""
    paths, wrong, raised = np.sum([arrays["counts"] for _, arrays in done], axis=0).tolist()
    said = sorted({str(arrays["said"]) for _, arrays in done} - {""})
    scenes = len({params["scene"] for params, _ in done})
    where = f"{scenes} scenes, each path recorded and shifted there and back by {len(RULES)} shifts"
    found = {
        "batches in which floating point raised or warned": (raised, "; ".join(said)),
        "paths with a NaN, an infinity or a negative density or light": (wrong, where),
    }
    return [Row("", what, count, "0", count == 0, paths, note=note) for what, (count, note) in found.items()]


JOB = Job("Random paths while every floating-point exception and warning is an error", chunks, compute, judge)
