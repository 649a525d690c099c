"""ReSTIR PT in space is unbiased to 0.5%: both shifts, across pixels and along time, still and moving; path reuse too.

What `means` asks of a row of pixels, of the crops that all figures in space show.  Every case has two truths: the path
traced reference, whose standard error is added, and what the same frame's initial samples show, whose difference needs
no reference.  The one that leaves the smaller standard error judges, and the note says what the other one would leave.
The control reuses with 1/M weights, which take every neighbour for one that could have found the same path.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from benchmarks.jobs.comparing import Truth, biased, joined, judged, nothing, stored, sums
from benchmarks.jobs.job import Done, Job, Params, Row, parts
from figures.claims.figure import Arrays
from figures.experiments.references import Reference, reference
from figures.experiments.rendering import COLUMNS
from figures.experiments.solid import SIDE, approach
from figures.experiments.views import RULES, at_random, motion_vectors, setting, standard, tile_order, view
from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.integrals import Pixels, Reservoirs
from restir_ref.loop import REAL_TIME
from restir_ref.mis import WEIGHTS
from restir_ref.restir import initial, shade, spatial, temporal
from restir_ref.transport.baselines.path_reuse import path_reuse
from restir_ref.transport.restir_pt import PathIntegrals


@dataclass(frozen=True)
class Mode:
    """How many frames there are, whether the camera moves, rounds of spatial reuse, and the MIS weights of these."""

    frames: int
    moving: bool
    rounds: int
    across: str = REAL_TIME.across


TILED, CONTROL = "path reuse in tiles", "across pixels with 1/M weights"
MODES: Mapping[str, Mode] = MappingProxyType(
    {
        "across pixels": Mode(1, moving=False, rounds=1),
        "along time, still": Mode(5, moving=False, rounds=0),
        "along time and across pixels, moving": Mode(5, moving=True, rounds=1),
        CONTROL: Mode(1, moving=False, rounds=1, across="constant"),
    }
)
COUNTS: Mapping[str, tuple[int, ...]] = MappingProxyType(
    {"CB3": (16, 24, 16, 24), "CB3-glossy": (24, 24, 24, 48), "Ajar3": (32, 48, 72, 96)}
)
"""Chunks of every mode by scene: more where the light is rare, and of moving frames where it is rarest."""
CASES: Mapping[tuple[str, str, str], int] = MappingProxyType(
    {
        (scene, rule, mode): count
        for scene, counts in COUNTS.items()
        for mode, count in zip(MODES, counts, strict=True)
        for rule in (("hybrid",) if mode == CONTROL else RULES)
    }
    | {("CB3", "reconnection", TILED): 16, ("Ajar3", "reconnection", TILED): 144}
)
"""Scene, shift and mode of every case, and how many chunks it has."""
CELL = 6
"""Rows and columns of a cell, which stands for a pixel.

Where light is rare a pixel's images are skewed: the mean of a few hundred and its error err together, so that
z-scores of 2880 pixels spread wider than chance allows, also of what reuse adds, which needs no reference.
"""


def views(scene: str, rule: str, mode: Mode) -> list[PathIntegrals]:
    """The crops frame by frame; the last frame's are the reference's."""
    eyes = approach(setting(scene), mode.frames) if mode.moving else [standard(scene)] * mode.frames
    return [view(scene, RULES[rule], Counter(), eye) for eye in eyes]


def last_frame(images: Sequence[PathIntegrals], mode: Mode, index: Array, chance: Live) -> tuple[Array, Array]:
    """What the last frame shows, and what its initial samples show, grey, (N,) each."""
    history: Reservoirs | None = None
    for k, of in enumerate(images):
        here = Pixels(of, index)
        X = Y = initial(here, chance)
        if history is not None:
            there = motion_vectors(of, images[k - 1])[index % of.n]
            before = Pixels(images[k - 1], index - index % of.n + there)
            Y = temporal(X, here, history, [before], chance, mis=WEIGHTS[REAL_TIME.along], cap=REAL_TIME.cap)
        for _ in range(mode.rounds):
            near = at_random(of, index, REAL_TIME.neighbours, REAL_TIME.radius, chance)
            Y = spatial(Y, here, near, chance, mis=WEIGHTS[mode.across])
        history = Y
    return shade(Y, here).mean(axis=0), shade(X, here).mean(axis=0)


def tiled(of: PathIntegrals, replicas: int, chance: Live) -> Array:
    """Images by path reuse in tiles of 4 x 4, (replicas, n)."""
    order, size = tile_order(of)
    found = path_reuse(of.tracer, np.tile(order, replicas), chance, size).mean(axis=0)
    images = np.empty((replicas, of.n))
    images[:, order] = found.reshape(replicas, -1)
    return images


def cells(images: Array) -> Array:
    """Means of cells of images (R, n), (R, n / CELL^2)."""
    square = images.reshape(len(images), -1, CELL, SIDE // CELL, CELL)
    return np.asarray(square.mean(axis=(2, 4)).reshape(len(images), -1))


def in_cells(found: Reference) -> Truth:
    """A reference of crops as the truth for their cells; pixels err independently."""
    error = np.sqrt(cells(found.error[None] ** 2)[0]) / CELL
    return Truth(cells(found.mean[None])[0], error, found.image_error)


def compute(params: Params, *, rng: np.random.Generator) -> Arrays:
    """Images in cells, and what reuse adds to initial samples; as many replicas as fit the cache."""
    chance = Live(rng)
    if params["mode"] == TILED:
        of = view(params["scene"], RULES[params["rule"]], Counter())
        return stored(sums(cells(tiled(of, COLUMNS // of.n, chance))), "result")
    mode = MODES[params["mode"]]
    images = views(params["scene"], params["rule"], mode)
    n = images[-1].n
    index = np.arange(COLUMNS // n * n)
    result, own = (cells(each.reshape(-1, n)) for each in last_frame(images, mode, index, chance))
    return stored(sums(result - own), "added") | stored(sums(result), "result")


def chunks(share: float) -> Sequence[Params]:
    """Chunk by chunk, all cases in each."""
    every = sorted((part, *case) for case, count in CASES.items() for part in parts(count, share))
    return [{"scene": scene, "rule": rule, "mode": mode, "part": part} for part, scene, rule, mode in every]


def judge(done: Done) -> Sequence[Row]:
    """Every case by the better of its truths, controls by the reference."""
    rows = []
    for case in CASES:
        mine = [arrays for params, arrays in done if (params["scene"], params["rule"], params["mode"]) == case]
        rows.append(verdict(case, mine, in_cells(reference(case[0]))))
    return rows


def verdict(case: tuple[str, str, str], mine: list[Arrays], truth: Truth) -> Row:
    """One case's row."""
    what, result, scale = f"{', '.join(case)}: bias", joined(mine, "result"), float(truth.mean.mean())
    if case[2] == CONTROL:
        return biased(CLAIMS, what, result, truth, 0.01)
    if case[2] == TILED:
        return judged("COM-B02", f"{what} against the reference", result, truth, scale, EPS)
    added = joined(mine, "added")
    rows = [
        judged(CLAIMS, f"{what} against the reference", result, truth, scale, EPS),
        judged(CLAIMS, f"{what} against the frames' own initial samples", added, nothing(len(truth.mean)), scale, EPS),
    ]
    best, other = sorted(rows, key=lambda row: row.error)
    return replace(best, note=f"{best.note}; by the other truth SE {other.error:.2%}")


CLAIMS, EPS = "GRIS-A05, GRIS-C11", 0.005
JOB = Job("ReSTIR PT and path reuse in space against references or their own initial samples", chunks, compute, judge)
