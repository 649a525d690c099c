"""Reference images by long path tracing: all leaves of every tree, light and BSDF sampling combined by MIS.

Primary numbers are a lattice of 1021 points, moved at random for every pixel anew [Cranley 1976]: each
sample is uniform, so the mean is that of independent samples, with about a tenth of their variance; the
standard error comes from the spread over the moves.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from benchmarks.jobs.job import Done, Job, Params, Row, parts
from figures.figure import Arrays
from figures.references import PATH, Reference, fingerprint, save
from flatland2d.scenes import INSET, SCENES, Setting
from restir_ref.batch import Array
from restir_ref.transport.paths import RECONNECTION, Tracer, radiance, trace

POINTS, GENERATOR = 1021, 76
"""Points of the lattice, a prime, and its generator."""
LATTICES, CHUNKS = 10, 98
"""Lattices per chunk, and chunks per scene: 1 000 580 samples per pixel."""
PIXELS_AT_ONCE = 8
LIMIT = 1e-3
HOW = "path tracing, light and BSDF sampling combined by MIS, randomly moved lattices"


def lattice(D: int) -> Array:
    """x_k = (a^j k mod N)_j / N, k = 0 .. N-1: Korobov's lattice; (D, N)."""
    powers = np.array([pow(GENERATOR, j, POINTS) for j in range(D)])
    return np.asarray(powers[:, None] * np.arange(POINTS) % POINTS / POINTS)


def moved(t: Tracer, pixel: Array, rng: np.random.Generator) -> Array:
    """The mean radiance of each pixel (n,) over one lattice, moved at random for each; (n,)."""
    u = (lattice(t.D)[:, None] + rng.random((t.D, len(pixel), 1))) % 1
    L = radiance(trace(t, u.reshape(t.D, -1), pixel.repeat(POINTS)))
    return np.asarray(L[0].reshape(len(pixel), POINTS).mean(axis=1))


def image(setting: Setting, rng: np.random.Generator) -> Array:
    """One image of POINTS samples per pixel, (n,)."""
    t = Tracer(setting.scene, setting.pinhole(), setting.depth, RECONNECTION)
    first = range(0, INSET, PIXELS_AT_ONCE)
    return np.concatenate([moved(t, np.arange(at, at + PIXELS_AT_ONCE), rng) for at in first])


def chunks(share: float) -> Sequence[Params]:
    """Chunk by chunk, all scenes in each."""
    return [{"scene": scene, "part": part} for part in parts(CHUNKS, share) for scene in SCENES]


def compute(params: Params, *, rng: np.random.Generator) -> Arrays:
    """Independent images, (LATTICES, n)."""
    setting = SCENES[params["scene"]]()
    return {"images": np.array([image(setting, rng) for _ in range(LATTICES)])}


def references(done: Done) -> dict[str, Reference]:
    """Mean and standard error of all images of each scene."""
    found = {}
    for scene in dict.fromkeys(params["scene"] for params, _ in done):
        images = np.concatenate([arrays["images"] for params, arrays in done if params["scene"] == scene])
        root = np.sqrt(len(images))
        error, image_error = images.std(axis=0, ddof=1) / root, images.mean(axis=1).std(ddof=1) / root
        found[scene] = Reference(images.mean(axis=0), error, float(image_error), len(images) * POINTS, HOW)
    return found


def judge(done: Done) -> Sequence[Row]:
    """Standard errors below 0.1% at no less than 1e6 samples per pixel."""
    return [row(scene, found) for scene, found in references(done).items()]


def row(scene: str, found: Reference) -> Row:
    """One reference, judged."""
    error, worst = found.image_error / found.mean.mean(), np.max(found.error / found.mean)
    return Row(
        "COM-A09",
        f"{scene}: standard error of the reference's image mean",
        error,
        f"< {LIMIT:.1%} with >= 1e6 samples per pixel",
        bool(error < LIMIT and found.samples >= 1e6),
        found.samples,
        note=f"mean pixel {np.mean(found.error / found.mean):.2%}, worst pixel {worst:.2%}",
    )


def publish(done: Done, root: Path) -> None:
    """Store the references for the figures."""
    save(references(done), root / "figures" / PATH.name)


JOB = Job(
    "References of all scenes, path traced",
    chunks,
    compute,
    judge,
    lambda params: fingerprint(SCENES[params["scene"]]()),
)
