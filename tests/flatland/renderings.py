"""Whole renderings of ReSTIR PT in flatland, each beside the initial samples of the same frames.

What reuse adds to a frame's own initial estimate has mean 0, whatever the scene: no reference is
needed, and most of the noise cancels.  Films are coarse unless told otherwise, so that shifts are
long and their mistakes large.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from flatland2d import SCENES, Pinhole
from flatland2d.motion import Motion, motion, sources
from restir_ref.batch import Array
from restir_ref.chance import Chance
from restir_ref.integrals import Pixels, Reservoirs
from restir_ref.loop import Preset, frame, random_in_row, spread_in_row
from restir_ref.restir import initial, shade, spatial, temporal
from restir_ref.transport.paths import RECONNECTION, Tracer
from restir_ref.transport.proofs.zoo import TRANSPORT_BUGS
from restir_ref.transport.restir_pt import PathIntegrals
from tests.transport.paths import HYBRID

RULES = {"hybrid": HYBRID, "reconnection": RECONNECTION}
NEIGHBOURS, REACH = 2, 10


@dataclass(frozen=True, eq=False)
class Paired:
    """What reuse adds to initial estimates, and those estimates; (replicas, n) each."""

    added: Array
    initial: Array


@dataclass(frozen=True)
class Bias:
    """Relative bias of a mean over replicas and pixels, its z-score, and its relative standard error."""

    bias: float
    z: float
    error: float

    def is_none(self, eps: float, sigma: float = 4.0) -> bool:
        """Whether no bias is seen, and one of a few eps would have been."""
        return self.error <= eps and abs(self.z) <= sigma


def bias(added: Array, base: Array) -> Bias:
    """The mean of `added` over that of `base`, both (replicas, ...)."""
    d, mean = added.reshape(len(added), -1).mean(axis=1), float(base.mean())
    error = float(d.std(ddof=1) / np.sqrt(len(d)))
    return Bias(float(d.mean()) / mean, float(d.mean()) / error, error / mean)


def spread(added: Array) -> float:
    """Standard deviation over pixels of each pixel's z-score, (replicas, n): 1 where no pixel is biased."""
    z = added.mean(axis=0) / (added.std(axis=0, ddof=1) / np.sqrt(len(added)))
    return float(z.std())


# ---------------------------------------------------------------- images, still and moving


def view(scene: str, n: int = 32) -> Pinhole:
    """The scene's whole field of view in n pixels."""
    setting = SCENES[scene]()
    return Pinhole(setting.eye, setting.towards, n, setting.half, 0, n)


def images(scene: str, rule: str, n: int = 32) -> PathIntegrals:
    """The scene's pixels."""
    setting = SCENES[scene]()
    return PathIntegrals(Tracer(setting.scene, view(scene, n), setting.depth, RULES[rule]))


def still(of: PathIntegrals, count: int) -> list[PathIntegrals]:
    """The same image, frame by frame."""
    return [of] * count


def moving(of: PathIntegrals, count: int, step: float = 0.01) -> list[PathIntegrals]:
    """The eye moves by `step` per frame."""
    x, y = camera(of).eye
    eyes = [(x + k * step, y) for k in range(count)]
    return [PathIntegrals(replace(of.tracer, sensor=replace(camera(of), eye=eye))) for eye in eyes]


def camera(of: PathIntegrals) -> Pinhole:
    """Where it is seen from."""
    sensor: Pinhole = of.tracer.sensor  # type: ignore[assignment]
    return sensor


def columns(of: PathIntegrals, replicas: int) -> Pixels:
    """All pixels, so many times."""
    return Pixels(of, np.arange(of.n * replicas))


# ---------------------------------------------------------------- frames

Before = Callable[[PathIntegrals, PathIntegrals], PathIntegrals]
"""(previous, current) -> what history is rated with."""


def previous(before: PathIntegrals, now: PathIntegrals) -> PathIntegrals:
    """History is rated with the camera that saw it."""
    return before


BUG = TRANSPORT_BUGS["history rated with the current camera"]


def current(before: PathIntegrals, now: PathIntegrals) -> PathIntegrals:
    """A mistake: with the current camera, in the same pixels of the film."""
    film, there = camera(before), camera(now)
    return BUG.wrong(replace(before.tracer, sensor=replace(film, eye=there.eye, towards=there.towards)))  # type: ignore[return-value]


@dataclass(frozen=True, eq=False)
class Stage:
    """After a stage of a frame: initial samples X, and reservoirs Y."""

    frame: int
    name: str
    here: Pixels
    X: Reservoirs
    Y: Reservoirs


@dataclass(frozen=True, eq=False)
class Past:
    """The previous frame's reservoirs, the image they were made for, and the one they are rated with."""

    Y: Reservoirs
    of: PathIntegrals
    rated: PathIntegrals


Pass = Callable[[Reservoirs, Pixels, Sequence[Past], Chance], Reservoirs]
"""(reservoirs, pixels, the past if there is one, chance) -> reservoirs."""


def frames(
    of: Sequence[PathIntegrals], replicas: int, chance: Chance, passes: Sequence[str], rated: Before = previous
) -> Iterator[Stage]:
    """Frame by frame, the stages of ReSTIR; `passes` names those that are done, in order."""
    past: list[Past] = []
    for k, now in enumerate(of):
        here = columns(now, replicas)
        X = Y = initial(here, chance)
        yield Stage(k + 1, "initial", here, X, Y)
        for name in passes:
            Y = PASSES[name](Y, here, past, chance)
            yield Stage(k + 1, name, here, X, Y)
        past = [Past(Y, now, rated(now, of[min(k + 1, len(of) - 1)]))]


def from_history(Y: Reservoirs, here: Pixels, past: Sequence[Past], chance: Chance) -> Reservoirs:
    """Temporal reuse along motion vectors; none in the first frame."""
    now: PathIntegrals = here.of  # type: ignore[assignment]
    for then in past:
        source = sources(moved(then.of, now), here.index)
        Y = temporal(Y, here, then.Y, [Pixels(then.rated, source)], chance)
    return Y


def from_neighbours(Y: Reservoirs, here: Pixels, past: Sequence[Past], chance: Chance) -> Reservoirs:
    """One round of spatial reuse with random neighbours."""
    now: PathIntegrals = here.of  # type: ignore[assignment]
    return spatial(Y, here, random_in_row(now, here.index, NEIGHBOURS, REACH, chance), chance)


def moved(before: PathIntegrals, now: PathIntegrals) -> Motion:
    """Motion of the pixels from one frame to the next."""
    return motion(now.tracer.scene, camera(now), camera(before))


PASSES: Mapping[str, Pass] = {"temporal": from_history, "spatial": from_neighbours}


def last(stages: Iterator[Stage]) -> Stage:
    """The last stage of all."""
    *_, end = stages
    return end


def paired(stage: Stage) -> Paired:
    """Its estimates beside the frame's initial ones; one channel."""
    n = stage.here.of.n  # type: ignore[attr-defined]
    base = shade(stage.X, stage.here)[0]
    return Paired((shade(stage.Y, stage.here)[0] - base).reshape(-1, n), base.reshape(-1, n))


# ---------------------------------------------------------------- a post moves before a wall

PAN, POST = 0.003, 10.213
"""The eye's step per frame, and the pixels that the near post moves by meanwhile; the wall moves by 5."""


def pan(rule: str, count: int, n: int = 32) -> list[PathIntegrals]:
    """`occluders` seen from an eye that rises, in crops of the film that follow the edge of the near post."""
    setting = SCENES["occluders"]()
    (x, y), film = setting.eye, setting.pinhole(n)
    views = [
        replace(film, eye=(x, y + k * PAN), towards=(1.0, y + k * PAN), first=round(706 + k * POST))
        for k in range(count)
    ]
    return [PathIntegrals(Tracer(setting.scene, view, setting.depth, RULES[rule])) for view in views]


def disocclusion(rule: str, replicas: int, chance: Chance, rated: Before = previous) -> tuple[Paired, Array]:
    """Frame 10 of the pan with temporal reuse, and which pixels (n,) were hidden in frame 9."""
    of = pan(rule, 10)
    return paired(last(frames(of, replicas, chance, ("temporal",), rated))), ~moved(*of[-2:]).seen


# ---------------------------------------------------------------- the matrix: scenes, shifts, loops


@dataclass(frozen=True)
class Loop:
    """Which passes, over which frames."""

    passes: tuple[str, ...]
    camera: Callable[[PathIntegrals, int], list[PathIntegrals]]
    count: int


LOOPS: Mapping[str, Loop] = MappingProxyType(
    {
        "spatial": Loop(("spatial", "spatial"), still, 1),
        "temporal, still": Loop(("temporal",), still, 4),
        "temporal, moving": Loop(("temporal",), moving, 4),
        "both, moving": Loop(("temporal", "spatial"), moving, 4),
    }
)
MATRIX = ("cornell", "glossy_cornell", "ajar", "clear_coat")


def rendering(scene: str, rule: str, loop: str, replicas: int, chance: Chance) -> Paired:
    """The last frame of a loop."""
    how = LOOPS[loop]
    return paired(last(frames(how.camera(images(scene, rule), how.count), replicas, chance, how.passes)))


# ---------------------------------------------------------------- averages of offline frames


def offline(scene: str, rule: str, n: int, count: int, chance: Chance, preset: Preset) -> Paired:
    """Independent offline frames of n pixels, beside other path trees of as many; (count, n)."""
    here = columns(images(scene, rule, n), count)
    X, Y = initial(here, chance, preset.trees), frame(here, chance, preset, spread_in_row)
    base, found = (shade(each, here)[0].reshape(count, n) for each in (X, Y))
    return Paired(found - base, base)


def error_slope(estimates: Array, longest: int = 128) -> float:
    """Log-log slope of the mean squared error of averages over T = 1 .. longest frames (count, n), around all."""
    T = 2 ** np.arange(int(np.log2(longest)) + 1)
    averages = [estimates.reshape(-1, each, estimates.shape[-1]).mean(axis=1) for each in T]
    return float(np.polyfit(np.log(T), np.log([each.var(axis=0, ddof=1).mean() for each in averages]), 1)[0])
