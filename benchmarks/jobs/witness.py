"""Path tracing agrees with Mitsuba 3: .5% of the mean, channel by channel, and 2% of each of 16 blocks of the inset.

Both estimate the same insets to a standard error of at most .5% in every block.  Mitsuba's Smith term is separable and
ours is height-correlated: CB3, whose lobes are the roughest, is compared with both, and what the two differ by, from
the same random numbers, is a row of its own.  Controls, which must be found wrong: boxes of another roughness, one
bounce less, and 3% more light.

What Mitsuba finds is published for the tests, which compare with it whether or not it is installed.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from types import ModuleType

import numpy as np

from benchmarks.jobs.job import Done, Job, Params, Row, parts
from figures.claims.figure import Arrays
from restir_ref.batch import Array
from tests.tracer3d.witnesses import (
    BLOCKS,
    WITNESSED,
    Limits,
    Means,
    agrees,
    convicted,
    difference,
    means,
    ours,
    theirs,
    with_separable_smith,
)
from tracer3d.scenes import Setting, cornell
from tracer3d.witness import mitsuba


@dataclass(frozen=True)
class Count:
    """Per part: points of a block by us, paths per pixel by Mitsuba."""

    points: int
    samples: int


PARTS = 32
COUNTS: Mapping[str, Count] = {
    "cornell": Count(2**12, 64),
    "glossy_cornell": Count(2**15, 96),
    "matte_cornell": Count(2**11, 32),
    "glass_ball": Count(2**13, 128),
    "ajar": Count(2**16, 384),
    "frosted_ball": Count(2**14, 192),
}
ROUGH = ("cornell",)
"""Scenes whose lobes are so rough that the Smith terms differ by more than the standard error."""
EVIDENCE = Limits(image=0.005, block=0.02, block_error=0.005)


def other_boxes() -> Setting:
    """CB3 with boxes of roughness .45 for .5."""
    return cornell(roughness=0.45)


def one_bounce_less() -> Setting:
    """CB3 at depth 3."""
    return replace(cornell(), depth=3)


def brighter_lamp() -> Setting:
    """CB3 with 3% more light."""
    at = cornell()
    lights = replace(at.scene.lights, emission=1.03 * at.scene.lights.emission)
    return replace(at, scene=replace(at.scene, emission=1.03 * at.scene.emission, lights=lights))


CONTROLS: Mapping[str, Callable[[], Setting]] = {
    each.__doc__.rstrip(".") if each.__doc__ else "": each for each in (other_boxes, one_bounce_less, brighter_lamp)
}
CONTROL_POINTS = 2**12


@cache
def library() -> ModuleType:
    """Mitsuba, one path after the other: it needs nothing else on the machine."""
    return mitsuba("scalar_rgb")


def compute(params: Params, *, rng: np.random.Generator) -> Arrays:
    """One round of each: ours, ours with the separable Smith term from the same numbers, and Mitsuba's."""
    name, seed = params["scene"], int(rng.integers(2**31))
    if name in CONTROLS:
        return {"ours": mine(CONTROLS[name](), CONTROL_POINTS, seed)}
    at, count = WITNESSED[name](), COUNTS[name]
    found = {"ours": mine(at, count.points, seed), "theirs": theirs(library(), at, count.samples, 1, rng)}
    if name in ROUGH:
        with with_separable_smith():
            found["separable"] = mine(at, count.points, seed)
    return found


def mine(at: Setting, points: int, seed: int) -> Array:
    """One round of ours, (1, 3, BLOCKS)."""
    return ours(at, [points] * BLOCKS, 1, np.random.default_rng(seed))


def chunks(share: float) -> Sequence[Params]:
    """Round by round, all scenes in each; two at least, for an error."""
    every = range(max(2, len(parts(PARTS, share))))
    return [{"scene": scene, "part": part} for part in every for scene in (*WITNESSED, *CONTROLS)]


def of(done: Done, scene: str, which: str) -> Array:
    """All rounds of a scene, (rounds, 3, BLOCKS)."""
    return np.concatenate([arrays[which] for params, arrays in done if params["scene"] == scene])


def judge(done: Done) -> Sequence[Row]:
    """Every scene, the Smith terms apart, and the controls."""
    rows = []
    for scene in WITNESSED:
        truth = means(of(done, scene, "theirs"))
        rows.append(agreement(scene, means(of(done, scene, "ours")), truth))
        if scene in ROUGH:
            rows.append(agreement(f"{scene}, separable Smith term", means(of(done, scene, "separable")), truth))
            rows.append(smith(scene, of(done, scene, "ours"), of(done, scene, "separable")))
    truth = means(of(done, "cornell", "theirs"))
    return rows + [control(name, means(of(done, name, "ours")), truth) for name in CONTROLS]


CLAIMS = "COM-B01"


LIMIT = f"<= {EVIDENCE.image:.1%} in every channel, blocks <= {EVIDENCE.block:.0%}, SE <= {EVIDENCE.block_error:.1%}"


def agreement(what: str, mine: Means, truth: Means) -> Row:
    """Ours over theirs."""
    d = difference(mine, truth)
    value, error = float(d.image[3]), float(d.image_error[3])
    what = f"{what}: ours over Mitsuba's, less 1"
    return Row(CLAIMS, what, value, LIMIT, agrees(d, EVIDENCE), PARTS, error, str(d))


def control(what: str, mine: Means, truth: Means) -> Row:
    """What is wrong must be found wrong."""
    d = difference(mine, truth)
    value, error = float(d.image[3]), float(d.image_error[3])
    what = f"control, {what}: ours over Mitsuba's, less 1"
    return Row(CLAIMS, what, value, "convicted", convicted(d, EVIDENCE), PARTS, error, str(d))


def smith(scene: str, correlated: Array, apart: Array) -> Row:
    """The correlated Smith term over the separable one; from the same numbers, so the error is that of differences."""
    base = apart.mean()
    each = (correlated - apart).mean(axis=(1, 2)) / base
    blocks = correlated.mean(axis=(0, 1)) / apart.mean(axis=(0, 1)) - 1
    error = float(each.std(ddof=1) / np.sqrt(len(each)))
    what = f"{scene}: the height-correlated Smith term over the separable one, less 1"
    note = f"blocks {blocks.min():+.2%} .. {blocks.max():+.2%}"
    return Row(CLAIMS, what, float(each.mean()), "reported", True, len(each), error, note)


PUBLISHED = "tests/tracer3d/mitsuba.npz"


def publish(done: Done, root: Path) -> None:
    """Means of blocks and of the image by Mitsuba, with their errors."""
    arrays = {}
    for scene in WITNESSED:
        found = means(of(done, scene, "theirs"))
        arrays.update({f"{scene}.{part}": value for part, value in vars(found).items()})
    np.savez(root / PUBLISHED, **arrays)


JOB = Job("Path tracing in space against Mitsuba 3", chunks, compute, judge)
