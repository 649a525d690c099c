"""The headline: error at equal CPU time, offline ReSTIR PT by us against path tracing by Mitsuba 3.

    python benchmarks/headline.py                       all scenes
    python benchmarks/headline.py ajar --frames 2       one of them, and less of it
    python benchmarks/headline.py ajar --light indirect without what lamps light directly

For each of CROPS the mean of some frames of the offline preset is compared with Mitsuba's path tracing, whose samples
per pixel are as many as the same CPU time buys: every frame of ours is charged in full, Mitsuba's compiling and
loading not at all.  References are path traced by Mitsuba; their variance is subtracted.  One thread each.  The
crops were fixed before anything was measured: a scene's inset, and four around the points of thirds of the film.

The paper's offline figures measure the error of indirect light only [GRIS 9.3].  Mitsuba's is its picture less that of
the same paths cut off behind direct light, which costs it nothing here.  That takes out lamps that the camera sees as
well, which ours keeps; no crop sees one.

Mitsuba runs as `llvm_ad_rgb`, which needs LLVM 17 or newer (DRJIT_LIBLLVM_PATH names one); where there is none it is
`scalar_rgb`, and the table says so.  Exits with 1 if a requirement is missed.
"""

import figures  # noqa: F401  (BLAS gets one thread, which has to be said before NumPy loads)  # isort: skip

import argparse
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from time import process_time
from types import ModuleType
from typing import Any

import numpy as np

from figures.experiments.split_light import IndirectIntegrals
from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.integrals import Integrals
from restir_ref.metrics import MAP, SMALL, mape, rmse
from restir_ref.transport.paths import Tracer
from restir_ref.transport.restir_pt import PathIntegrals
from tracer3d.methods import PRESETS, Shot, resampled
from tracer3d.render import Job
from tracer3d.scenes import SCENES
from tracer3d.sensors import FILM
from tracer3d.witness import exported, mitsuba, rendered

SIZE = 64
METHOD, PRESET = "restir-pt", "offline"
SAMPLERS = ("independent", "multijitter")
SCENES_SHOWN = ("ajar", "cornell", "glossy_cornell")
ALL, INDIRECT = "all", "indirect"
LIGHTS: Mapping[str, Callable[[Tracer], Integrals]] = {ALL: PathIntegrals, INDIRECT: IndirectIntegrals}
"""What light counts, and our integrals of it."""

REQUIRED: Mapping[str, Mapping[str, float]] = {"ajar": {"MAPE": 0.6, "RMSE": 0.75}}
"""The most that our error may be of Mitsuba's with independent samples, geometric mean over the crops."""

FRAMES, ROUNDS, REFERENCE = 4, 8, 512
"""Frames that are averaged; rounds of a reference, from whose spread its variance is known, and paths of each."""
MANY, TRIES = 1024, 3
"""Paths per pixel that Mitsuba traces at once, and attempts to meet a time; the first is a small one."""
LEAST_LLVM = 17


def crops(scene: str) -> list[tuple[int, int]]:
    """Column and row of the film where each crop begins."""
    columns, rows = ([k * size // 3 - SIZE // 2 for k in (1, 2)] for size in FILM)
    return [SCENES[scene]().crop, *product(columns, rows)]


@dataclass(frozen=True, eq=False)
class Reference:
    """A picture (rows, columns), channels averaged, and the variance of its pixels."""

    mean: Array
    variance: Array


@dataclass(frozen=True, eq=False)
class Timed:
    """A picture (rows, columns), and the CPU seconds that it took."""

    image: Array
    seconds: float


# ---------------------------------------------------------------- errors


def corrected_rmse(image: Array, of: Reference) -> float:
    """sqrt(mean (I - R)^2 - mean var R)."""
    return float(np.sqrt(max(float(rmse(image, of.mean, MAP)) ** 2 - of.variance.mean(), 0.0)))


def corrected_mape(image: Array, of: Reference) -> float:
    """mean |I - R| / (.01 mean R + R), smaller by the share that R's variance has of its square."""
    scale = SMALL * of.mean.mean() + of.mean
    share = (of.variance / scale**2).mean() / ((image - of.mean) ** 2 / scale**2).mean()
    return float(mape(image, of.mean, MAP)) * float(np.sqrt(max(1 - share, 0.0)))


ERRORS: Mapping[str, Callable[[Array, Reference], float]] = {"MAPE": corrected_mape, "RMSE": corrected_rmse}


# ---------------------------------------------------------------- pictures


def ours(scene: str, crop: tuple[int, int], light: str, frames: int) -> Timed:
    """The mean of offline frames."""
    job = Job(scene, METHOD, PRESET, (SIZE, SIZE), crop)
    surfaces = job.setting(0).scene
    start = process_time()
    shots = (Shot(job.tracer(k, surfaces), Live(np.random.default_rng((1, k)))) for k in range(frames))
    images = resampled(LIGHTS[light])(shots, PRESETS[PRESET], job.size)
    mean = sum(image.mean(axis=0) for image in images) / frames
    return Timed(np.asarray(mean).reshape(SIZE, SIZE), process_time() - start)


@dataclass(frozen=True, eq=False)
class Theirs:
    """A crop, loaded into Mitsuba with a sampler; and the same, whose paths end behind direct light, if that is out."""

    mi: ModuleType
    scene: Any
    left_out: Any

    def shot(self, samples: int, seed: int) -> Timed:
        """So many paths per pixel or, where the sampler rounds, as many as it took."""
        start = process_time()
        image = rendered(self.mi, self.scene, samples, seed).mean(axis=0)
        seconds = process_time() - start
        if self.left_out is not None:
            image -= rendered(self.mi, self.left_out, samples, seed).mean(axis=0)
        return Timed(image, seconds)


def loaded(mi: ModuleType, scene: str, crop: tuple[int, int], light: str, sampler: str) -> Theirs:
    """Compiled and warm."""
    at = SCENES[scene]()
    depths = [at.depth, 1] if light == INDIRECT else [at.depth]
    scenes = [mi.load_dict(exported(mi, at.scene, at.pinhole(SIZE, SIZE, crop), depth, sampler)) for depth in depths]
    found = Theirs(mi, scenes[0], scenes[1] if light == INDIRECT else None)
    found.shot(4, 1)
    return found


def reference(of: Theirs, samples: int) -> Reference:
    """From independent rounds."""
    rounds = np.stack([of.shot(samples, 1000 + k).image for k in range(ROUNDS)])
    return Reference(rounds.mean(axis=0), rounds.var(axis=0, ddof=1) / ROUNDS)


def in_time(of: Theirs, seconds: float) -> Timed:
    """The mean of as many paths as take that long: the nearest of TRIES, each as large as the last one's rate says."""
    samples, shots = 64, []
    for k in range(TRIES):
        shots.append(many(of, samples, 100 * (k + 1)))
        samples = max(1, round(samples * seconds / shots[-1].seconds))
    return min(shots, key=lambda shot: abs(shot.seconds - seconds))


def many(of: Theirs, samples: int, seed: int) -> Timed:
    """The mean of shots of at most MANY paths."""
    parts = [MANY] * (samples // MANY) + [samples % MANY] * (samples % MANY > 0)
    shots = [of.shot(part, seed + k) for k, part in enumerate(parts)]
    image = sum(part * shot.image for part, shot in zip(parts, shots, strict=True)) / samples
    return Timed(np.asarray(image), sum(shot.seconds for shot in shots))


# ---------------------------------------------------------------- the table


@dataclass(frozen=True)
class Work:
    """Frames of ours that are averaged, and paths per pixel of each round of a reference."""

    frames: int
    reference: int


@dataclass(frozen=True)
class Row:
    """One crop and sampler: our errors over theirs, and their CPU time over ours."""

    scene: str
    crop: tuple[int, int]
    light: str
    sampler: str
    mine: Mapping[str, float]
    theirs: Mapping[str, float]
    seconds: float
    time: float

    @property
    def ratios(self) -> dict[str, float]:
        """Ours over theirs."""
        return {name: self.mine[name] / self.theirs[name] for name in ERRORS}

    def __str__(self) -> str:
        errors = "  ".join(f"{name} {self.mine[name]:.4f} / {self.theirs[name]:.4f}" for name in ERRORS)
        ratios = "  ".join(f"{name} {ratio:.3f}" for name, ratio in self.ratios.items())
        where = f"{self.scene:15} {self.crop!s:12} {self.light:9} {self.sampler:12}"
        return f"{where} {errors}  ours over theirs {ratios}  ({self.seconds:.1f} s, theirs {self.time:.3f} times that)"


def measured(mi: ModuleType, scene: str, crop: tuple[int, int], light: str, work: Work) -> Iterator[Row]:
    """A row for each sampler."""
    of = {sampler: loaded(mi, scene, crop, light, sampler) for sampler in SAMPLERS}
    truth, mine = reference(of["independent"], work.reference), ours(scene, crop, light, work.frames)
    for sampler in SAMPLERS:
        other = in_time(of[sampler], mine.seconds)
        our, their = ({name: error(each.image, truth) for name, error in ERRORS.items()} for each in (mine, other))
        yield Row(scene, crop, light, sampler, our, their, mine.seconds, other.seconds / mine.seconds)


def summary(rows: Sequence[Row]) -> Iterator[tuple[str, bool]]:
    """Geometric means over crops, and whether what is required of them holds."""
    kinds = dict.fromkeys((row.scene, row.light) for row in rows)
    for (scene, light), sampler, error in product(kinds, SAMPLERS, ERRORS):
        ratios = [row.ratios[error] for row in rows if (row.scene, row.light, row.sampler) == (scene, light, sampler)]
        mean = float(np.exp(np.mean(np.log(ratios))))
        most = REQUIRED.get(scene, {}).get(error, np.inf) if sampler == "independent" else np.inf
        bound = f"<= {most:g} {'ok' if mean <= most else 'MISSED'}" if np.isfinite(most) else ""
        what = f"{scene}, {light} light, {sampler}: {error}, ours over theirs, {len(ratios)} crops"
        yield f"{mean:8.3f}  {bound:14} {what}", mean <= most


def variant() -> str:
    """`llvm_ad_rgb` where there is a recent LLVM: with an older one the process would be aborted.

    Raises ImportError where Mitsuba is not installed.
    """
    mitsuba("scalar_rgb")
    try:
        mitsuba("llvm_ad_rgb")
    except ImportError as none:
        print(none)
        return "scalar_rgb"
    import drjit  # noqa: PLC0415

    major = int(drjit.detail.llvm_version()[0])
    if major < LEAST_LLVM:
        print(f"LLVM {major} is too old, {LEAST_LLVM} is needed: let DRJIT_LIBLLVM_PATH name one")
        return "scalar_rgb"
    return "llvm_ad_rgb"


def main(arguments: Sequence[str]) -> int:
    """Measure, print; 1 if a requirement is missed."""
    options = parser().parse_args(arguments)
    try:
        name = variant()
    except ImportError as missing:
        print(f"nothing is measured: {missing}")
        return 0
    mi, rows = mitsuba(name), []
    print(
        f"{METHOD}, {PRESET}, {options.frames} frames of {SIZE} x {SIZE} pixels, against {name}; errors ours / theirs"
    )
    work = Work(options.frames, options.reference)
    for scene, light in product(options.scenes or SCENES_SHOWN, options.light or LIGHTS):
        for crop in crops(scene):
            for row in measured(mi, scene, crop, light, work):
                rows.append(row)
                print(row, flush=True)
    said = list(summary(rows))
    print("\n".join(["", *(line for line, _ in said)]))
    return int(not all(holds for _, holds in said))


def parser() -> argparse.ArgumentParser:
    """The command line."""
    found = argparse.ArgumentParser(description="Error at equal CPU time against Mitsuba 3.")
    found.add_argument("scenes", nargs="*", choices=[*SCENES_SHOWN, []], metavar="SCENE", help=", ".join(SCENES_SHOWN))
    found.add_argument("--light", action="append", choices=[*LIGHTS], help="all, or indirect only; both without it")
    found.add_argument("--frames", type=int, default=FRAMES, help="of ours that are averaged")
    found.add_argument("--reference", type=int, default=REFERENCE, help=f"paths per pixel, {ROUNDS} times")
    return found


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
