"""Gradient-domain ReSTIR is unbiased: differences of a checker floor and of occluders, still and moving.

What is rendered, and what is said of images and their means; differences are judged anew by `row_gradients`, for the
z-spread that `judge` asks for here calls path tracing biased as well.

The mean of dx over a row telescopes to nothing, so every difference is taken with the sign of the true one, over the
mean of their sizes: then the truth of the row is 1.  Replicas are independent; only the last frame of each counts.
Two mistakes stand beside: w = 1/2 also where a shift is undefined, and one pixel's samples without the other's.

Hazard: differences that are almost nothing have long tails, and then too few images make the z-scores of single pairs
large without a bias.  Behind the posts a twelfth of a pair's difference is in paths that one of its pixels has alone,
about one in 6000.  Beside the border of the floor, of a pair that moves, -110 times the row's mean stands once in 4000
images against +.02 in all others: what its square has of the border's own pair is chosen rarely, and weighs as much.
"""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from benchmarks.jobs.averaging import falling, squares
from benchmarks.jobs.comparing import Sums, Truth, biased, joined, judged, stored, sums
from benchmarks.jobs.job import Done, Job, Params, Row, parts
from benchmarks.jobs.signing import signed
from figures.claims.figure import Arrays
from figures.experiments.flatland import moving
from figures.experiments.following import gathered, in_place
from figures.experiments.gradients import (
    ADAPTIVE,
    Method,
    after_restir,
    gradient_view,
    grey,
    path_traced,
    with_restir,
)
from figures.experiments.references import reference
from restir_ref.batch import Array
from restir_ref.chance import Chance, Live
from restir_ref.gradient import gap, one_sided
from restir_ref.gradient_loop import GRADIENT, PRIMAL, View, forward
from restir_ref.integrals import Pixels, Reservoirs, held, shifted, times
from restir_ref.restir import initial

REPLICAS, PAIRS, LEAST = 64, 120, 0.01
"""Replicas of a chunk; pairs of the inset that count, eight blocks of 15; the least bias of a mistake."""

# ---------------------------------------------------------------- modes


def moved(view: View) -> View:
    """History of all overlapped pixels, moved into the square, which is a view's own way."""
    return view


@dataclass(frozen=True)
class Mode:
    """How many frames there are, how far the sensor moves from one to the next, and how history follows."""

    frames: int
    step: float = 0.0
    history: Callable[[View], View] = moved


STEP = 0.00035
"""Units of length: .7 pixels of the floor, .58 and .95 of what is behind the posts and of the posts."""

MODES: Mapping[str, Mode] = MappingProxyType(
    {
        "frame 1": Mode(1),
        "frame 5, still": Mode(5),
        "frame 20, still": Mode(20),
        "frame 5, moving": Mode(5, STEP),
        "frame 20, kept": Mode(20, STEP, in_place),
        "frame 20, gathered": Mode(20, STEP, gathered),
    }
)

# ---------------------------------------------------------------- methods

Estimate = Callable[[Reservoirs, Pixels, Pixels], Array]
"""Differences of pixels i and j, from the pixels' own samples; (C, N)."""


def halves(X: Reservoirs, i: Pixels, j: Pixels) -> Array:
    """A mistake: w = 1/2 everywhere, also where the shift is undefined.  [GPT Eq. 3]"""
    mine, other = (
        times(gap(Y.x, a, shifted(Y.x, a, b), b), Y.W) for Y, a, b in ((held(X, i), i, j), (held(X, j), j, i))
    )
    return np.asarray(mine - other) / 2


def one_side(X: Reservoirs, i: Pixels, j: Pixels) -> Array:
    """A mistake: samples of pixel i only.  [GPT Eq. 11]"""
    return one_sided(held(X, i), i, j)


def mistaken(estimate: Estimate) -> Method:
    """Differences of fresh samples of both pixels by another estimate."""

    def render(views: Sequence[View], asked: Counter[str], replicas: int, chance: Chance) -> Arrays:
        image = views[-1][PRIMAL].of[PRIMAL]
        pixel = np.arange(replicas * image.n)
        i, j = (Pixels(image, pixel.reshape(replicas, -1)[:, end].ravel()) for end in forward((image.n,))["dx"][0])
        return {"dx": grey(estimate(initial(Pixels(image, pixel), chance), i, j), replicas)}

    return render


METHODS: Mapping[str, Method] = MappingProxyType(
    {
        "with": with_restir,
        "after": after_restir,
        "path tracing": path_traced,
        "w = 1/2": mistaken(halves),
        "one side": mistaken(one_side),
    }
)
MISTAKES = ("w = 1/2", "one side")

# ---------------------------------------------------------------- cases

Case = tuple[str, str, str]
"""Scene, method and mode."""

CASES: Mapping[Case, tuple[int, float]] = MappingProxyType(
    {
        ("checker", "with", "frame 1"): (32, 0.005),
        ("checker", "with", "frame 5, still"): (16, 0.005),
        ("checker", "with", "frame 20, still"): (16, 0.005),
        ("checker", "with", "frame 5, moving"): (42, 0.005),
        ("checker", "with", "frame 20, kept"): (16, 0.005),
        ("checker", "with", "frame 20, gathered"): (16, 0.005),
        ("checker", "after", "frame 1"): (600, 0.005),
        ("checker", "after", "frame 5, still"): (16, 0.005),
        ("checker", "after", "frame 20, still"): (16, 0.005),
        ("checker", "after", "frame 5, moving"): (160, 0.005),
        ("checker", "after", "frame 20, kept"): (32, 0.01),
        ("checker", "after", "frame 20, gathered"): (16, 0.005),
        ("checker", "path tracing", "frame 1"): (32, 0.005),
        ("occluders", "with", "frame 1"): (360, 0.005),
        ("occluders", "with", "frame 5, still"): (48, 0.01),
        ("occluders", "with", "frame 20, still"): (32, 0.01),
        ("occluders", "with", "frame 5, moving"): (48, 0.01),
        ("occluders", "after", "frame 1"): (350, 0.005),
        ("occluders", "after", "frame 5, still"): (80, 0.01),
        ("occluders", "after", "frame 20, still"): (80, 0.01),
        ("occluders", "after", "frame 5, moving"): (84, 0.01),
        ("occluders", "path tracing", "frame 1"): (360, 0.005),
        ("occluders", "w = 1/2", "frame 1"): (16, LEAST),
        ("occluders", "one side", "frame 1"): (16, LEAST),
    }
)
"""Chunks, and the largest standard error, or the least bias of a mistake."""

CLAIMS: Mapping[tuple[str, str], str] = MappingProxyType(
    {
        ("checker", "with"): "GPT-A02, GPT-A05",
        ("checker", "after"): "COM-B07",
        ("checker", "path tracing"): "COM-B06",
        ("occluders", "with"): "GPT-A02",
        ("occluders", "after"): "GPT-A01, GPT-E11, COM-B07",
        ("occluders", "path tracing"): "GPT-A12, GPT-E03, COM-B06",
        ("occluders", "w = 1/2"): "GPT-E03",
        ("occluders", "one side"): "GPT-E11",
    }
)

FLOOR = ("checker", "after")
"""Its image is that of Area ReSTIR without gradients, and is judged too."""

IMAGES = ("frame 20, kept", "frame 20, gathered")
"""Modes in which the bias of the image is asked for."""

AVERAGED: Mapping[str, Sequence[str]] = MappingProxyType({"frame 1": ("image", "dx"), "frame 5, moving": ("image",)})
"""Modes in which the variance of means is, and of what."""


def compute(params: Params, *, rng: np.random.Generator) -> Arrays:
    """dx of the last frame with the signs of the truth, and where it is judged the image over its true mean."""
    scene, method, mode = params["scene"], params["method"], MODES[params["mode"]]
    asked, sensors = Counter[str](), moving(scene, mode.frames, mode.step)
    moves = zip(sensors, [sensors[0], *sensors], strict=False)
    views = [mode.history(gradient_view(scene, each, asked, GRADIENT, ADAPTIVE)) for each in moves]
    found = METHODS[method](views, asked, REPLICAS, Live(rng))
    kept = summed(signed(found["dx"][:, :PAIRS], differences(scene)), "dx")
    return kept | (summed(found[PRIMAL] / reference(scene).mean.mean(), "image") if (scene, method) == FLOOR else {})


def summed(images: Array, name: str) -> Arrays:
    """What a chunk keeps of images (R, n): their sums, and mean squares of means."""
    return stored(sums(images), name) | {f"{name}.squares": squares(images)}


def differences(scene: str) -> Array:
    """The true ones that count, (PAIRS,)."""
    return np.diff(reference(scene).mean)[:PAIRS]


def chunks(share: float) -> Sequence[Params]:
    """Chunk by chunk, all cases in each."""
    every = sorted((part, case) for case, (count, _) in CASES.items() for part in parts(count, share))
    return [{"scene": scene, "method": method, "mode": mode, "part": part} for part, (scene, method, mode) in every]


# ---------------------------------------------------------------- verdicts


def judge(done: Done) -> Sequence[Row]:
    """Every case against the reference; that mistakes are biased; and images and their means."""
    rows = []
    for case, (_, eps) in CASES.items():
        (scene, method, mode), what = case, ", ".join(case)
        mine = [a for p, a in done if (p["scene"], p["method"], p["mode"]) == case]
        verdict = biased if method in MISTAKES else unbiased
        rows.append(verdict(CLAIMS[scene, method], f"{what}: bias of dx", joined(mine, "dx"), true_probe(scene), eps))
        if (scene, method) == FLOOR:
            rows += images(mode, what, mine, eps)
    return rows


def images(mode: str, what: str, mine: list[Arrays], eps: float) -> list[Row]:
    """What is asked of the images of the floor in a mode."""
    claims, rows = "GPT-A13, COM-B05", []
    if mode in IMAGES:
        rows.append(unbiased(claims, f"{what}: bias of the image", joined(mine, "image"), true_image(FLOOR[0]), eps))
    return rows + [row for each in AVERAGED.get(mode, ()) for row in falling("GPT-A13", f"{what}, {each}", mine, each)]


def unbiased(claims: str, what: str, found: Sums, truth: Truth, eps: float) -> Row:
    """`judged`, of what is relative already."""
    return judged(claims, what, found, truth, 1.0, eps)


def true_probe(scene: str) -> Truth:
    """The signed differences of the reference."""
    of, true = reference(scene), differences(scene)
    error = np.hypot(of.error[1:], of.error[:-1])[:PAIRS] / abs(true).mean()
    return Truth(signed(true[None], true)[0], error, float(np.hypot.reduce(error) / PAIRS))


def true_image(scene: str) -> Truth:
    """The reference over its mean."""
    of = reference(scene)
    return Truth(*(each / of.mean.mean() for each in (of.mean, of.error)), of.image_error / of.mean.mean())


JOB = Job("Differences along rows against those of their references, by replicas", chunks, compute, judge)
