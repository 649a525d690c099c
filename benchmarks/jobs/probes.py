"""Contribution weights after every stage of a frame: E[g(X) W] is the integral of g, for four probes g.

A camera moves through 20 frames with temporal and spatial reuse.  Each probe is a function of the path as
its pixel sees it; after a shift only the film number of u is certain, so the half domain and the bump are
functions of that.  W is near a constant over p_hat, so a constant probe has no finite variance where p_hat
may be as small as it likes: ours fades out where p_hat is far below FADED.  Truth is a sum over all
leaves of path tracing at the same camera.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from benchmarks.jobs.comparing import as_truth, joined, judged, stored, sums
from benchmarks.jobs.job import Done, Job, Params, Row, parts
from benchmarks.jobs.means import came_from
from benchmarks.jobs.references import lattice
from figures.claims.figure import Arrays
from flatland2d.scenes import INSET, SCENES
from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.integrals import Pixels, Reservoirs
from restir_ref.loop import REAL_TIME, random_in_row
from restir_ref.restir import initial, spatial, temporal
from restir_ref.transport.paths import Path, Tracer, leaves, trace
from restir_ref.transport.restir_pt import PathIntegrals
from tests.transport.paths import HYBRID

SCENE, STEP, WATCHED = "cornell", 0.002, (1, 2, 5, 20)
CHUNKS, REPLICAS, LATTICES, PIXELS_AT_ONCE = 64, 64, 1, 8
EPS = 0.01

Probe = Callable[[Array, Array], Array]
FADED = 0.1


def constant(p_hat: Array) -> Array:
    """Nearly 1 for the paths that carry light, 0 at p_hat = 0."""
    return np.asarray(p_hat / (p_hat + FADED))


PROBES: Mapping[str, Probe] = {
    "constant": lambda u, p_hat: constant(p_hat),
    "half domain": lambda u, p_hat: constant(p_hat) * (u < 0.5),
    "p_hat": lambda u, p_hat: p_hat,
    "bump": lambda u, p_hat: constant(p_hat) * np.exp(-(((u - 0.3) / 0.1) ** 2)),
}
"""g(film number, p_hat)."""


def view(number: int) -> PathIntegrals:
    """The camera at frame `number`, from 1."""
    setting = SCENES[SCENE]()
    here = setting.pinhole()
    moved = replace(here, eye=(here.eye[0] + STEP * (number - 1), here.eye[1]))
    return PathIntegrals(Tracer(setting.scene, moved, setting.depth, HYBRID))


def stages(index: Array, chance: Live) -> Iterator[tuple[int, str, Reservoirs]]:
    """Frame by frame, the reservoirs after each stage."""
    history: Reservoirs | None = None
    for number in range(1, WATCHED[-1] + 1):
        of = view(number)
        here = Pixels(of, index)
        Y = initial(here, chance)
        yield number, "initial", Y
        if history is not None:
            Y = temporal(Y, here, history, [came_from(of, view(number - 1), index)], chance, cap=REAL_TIME.cap)
            yield number, "temporal", Y
        Y = spatial(Y, here, random_in_row(of, index, REAL_TIME.neighbours, REAL_TIME.radius, chance), chance)
        yield number, "spatial", Y
        history = Y


def compute(params: Params, *, rng: np.random.Generator) -> Arrays:
    """Probes after every stage of the watched frames, or their truth."""
    return truths(rng) if params["of"] == "truth" else after_stages(rng)


def after_stages(rng: np.random.Generator) -> Arrays:
    """REPLICAS images of g(X) W, for every watched stage and probe."""
    found: Arrays = {}
    for number, stage, X in stages(np.arange(REPLICAS * INSET), Live(rng)):
        if number in WATCHED:
            x: Path = X.x
            for name, probe in PROBES.items():
                values = probe(x.u[0], x.F.mean(axis=0)) * X.W
                found |= stored(sums(values.reshape(REPLICAS, INSET)), f"{name}, {stage}, frame {number}")
    return found


def truths(rng: np.random.Generator) -> Arrays:
    """LATTICES images of sum_leaves g, for every watched frame and probe."""
    found: Arrays = {}
    for number in WATCHED:
        images: dict[str, list[Array]] = {name: [] for name in PROBES}
        for _ in range(LATTICES):
            for name, image in summed(view(number).tracer, rng).items():
                images[name].append(image)
        for name, each in images.items():
            found |= stored(sums(np.array(each)), f"{name}, frame {number}")
    return found


def summed(t: Tracer, rng: np.random.Generator) -> dict[str, Array]:
    """One image of each probe, (n,), over moved lattices."""
    found: dict[str, list[Array]] = {name: [] for name in PROBES}
    for at in range(0, t.sensor.n, PIXELS_AT_ONCE):
        pixel = np.arange(at, at + PIXELS_AT_ONCE)
        u = ((lattice(t.D)[:, None] + rng.random((t.D, PIXELS_AT_ONCE, 1))) % 1).reshape(t.D, -1)
        F = [each.mean(axis=0) for _, _, each in leaves(trace(t, u, pixel.repeat(u.shape[1] // PIXELS_AT_ONCE)))]
        for name, probe in PROBES.items():
            total = np.sum([probe(u[0], each) for each in F], axis=0)
            found[name].append(total.reshape(PIXELS_AT_ONCE, -1).mean(axis=1))
    return {name: np.concatenate(each) for name, each in found.items()}


def chunks(share: float) -> Sequence[Params]:
    """Chunk by chunk, truth and stages in each."""
    return [{"of": of, "part": part} for part in parts(CHUNKS, share) for of in ("truth", "stages")]


def judge(done: Done) -> Sequence[Row]:
    """Every probe after every stage."""
    exact = [arrays for params, arrays in done if params["of"] == "truth"]
    mine = [arrays for params, arrays in done if params["of"] == "stages"]
    names = sorted({key.rpartition(".")[0] for key in mine[0]} - {""})
    rows = []
    for name in names:
        probe, _, number = name.split(", ")
        truth = as_truth(joined(exact, f"{probe}, {number}"))
        what = f"{SCENE}, hybrid, moving: {name}"
        rows.append(judged("GRIS-E08, GRIS-A05", what, joined(mine, name), truth, float(truth.mean.mean()), EPS))
    return rows


JOB = Job("Four probes of the contribution weights after every stage of a frame", chunks, compute, judge)
