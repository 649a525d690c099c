"""ReSTIR PT in space is unbiased to 0.5%: both shifts, across pixels and along time, still and moving; path reuse too.

What `means` asks of a row of pixels, of the crops that all figures in space show.  Every case has two truths: the path
traced reference, whose standard error is added, and what the same frame's initial samples, or trees, show without
reuse, whose difference needs no reference.  The one that leaves the smaller standard error judges, and the note says
what the other one would leave.  (Behind the door all is Lambert of one albedo, where path reuse moves light inside its
tiles only: the difference of image means is 0 but for rounding, and blocks, whose borders cut tiles, are what is
sampled.)  The control reuses with 1/M weights, which take every neighbour for one that could have found the same path.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from benchmarks.jobs.comparing import Truth, biased, joined, judged, stored, sums
from benchmarks.jobs.job import Done, Job, Params, Row, parts
from figures.claims.figure import Arrays
from figures.experiments.references import Reference, reference
from figures.experiments.solid import SIDE, approach
from figures.experiments.views import RULES, at_random, motion_vectors, setting, standard, tile_order, view
from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.integrals import Pixels, Reservoirs
from restir_ref.loop import REAL_TIME
from restir_ref.mis import WEIGHTS
from restir_ref.restir import initial, shade, spatial, temporal
from restir_ref.transport.baselines.path_reuse import path_reuse
from restir_ref.transport.paths import radiance, trace
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
        TILED: Mode(1, moving=False, rounds=0),
    }
)
REPLICAS = 3
COUNTS: Mapping[str, tuple[int, ...]] = MappingProxyType(
    {"CB3": (16, 16, 20, 24, 16), "CB3-glossy": (16, 24, 40, 54, 0), "Ajar3": (40, 40, 108, 108, 24)}
)
"""Chunks of every mode by scene: more where the light is rare, and of moving frames where it is rarest."""
ONE_SHIFT: Mapping[str, tuple[str, ...]] = MappingProxyType({CONTROL: ("hybrid",), TILED: ("reconnection",)})
CASES: Mapping[tuple[str, str, str], int] = MappingProxyType(
    {
        (scene, rule, mode): count
        for scene, counts in COUNTS.items()
        for mode, count in zip(MODES, counts, strict=True)
        for rule in ONE_SHIFT.get(mode, tuple(RULES))
        if count
    }
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


def tiled(of: PathIntegrals, index: Array, seed: int) -> tuple[Array, Array]:
    """What path reuse in tiles of 4 x 4 shows, and what the same trees show without it, grey, (N,) each."""
    order, size = tile_order(of)
    at = index - index % of.n + order[index % of.n]
    chances = [Live(np.random.default_rng(seed)) for _ in range(2)]
    trees = trace(of.tracer, chances[1].uniform((of.tracer.D, len(at))), at % of.n)
    images = np.empty((2, len(at)))
    for image, L in zip(images, (path_reuse(of.tracer, at % of.n, chances[0], size), radiance(trees)), strict=True):
        image[at] = L.mean(axis=0)
    return images[0], images[1]


def cells(images: Array) -> Array:
    """Means of cells of images (R, n), (R, n / CELL^2)."""
    square = images.reshape(len(images), -1, CELL, SIDE // CELL, CELL)
    return np.asarray(square.mean(axis=(2, 4)).reshape(len(images), -1))


def in_cells(found: Reference) -> Truth:
    """A reference of crops as the truth for their cells; pixels err independently."""
    error = np.sqrt(cells(found.error[None] ** 2)[0]) / CELL
    return Truth(cells(found.mean[None])[0], error, found.image_error)


def compute(params: Params, *, rng: np.random.Generator) -> Arrays:
    """REPLICAS images in cells, and what reuse adds to the same frame's own samples."""
    images = views(params["scene"], params["rule"], MODES[params["mode"]])
    n = images[-1].n
    index = np.arange(REPLICAS * n)
    if params["mode"] == TILED:
        found = tiled(images[-1], index, int(rng.integers(2**32)))
    else:
        found = last_frame(images, MODES[params["mode"]], index, Live(rng))
    result, own = (cells(each.reshape(-1, n)) for each in found)
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
    claims, added = COM if case[2] == TILED else CLAIMS, joined(mine, "added")
    none = Truth(0 * truth.mean, np.full(len(truth.mean), ROUNDING * scale), ROUNDING * scale)
    rows = [
        judged(claims, f"{what} against the reference", result, truth, scale, EPS),
        judged(claims, f"{what} against the frames' own samples", added, none, scale, EPS),
    ]
    best, other = sorted(rows, key=lambda row: row.error)
    return replace(best, note=f"{best.note}; by the other truth SE {other.error:.2%}")


CLAIMS, COM, EPS, ROUNDING = "GRIS-A05, GRIS-C11", "COM-B02", 0.005, 1e-12
JOB = Job("ReSTIR PT and path reuse in space against references or their own samples", chunks, compute, judge)
