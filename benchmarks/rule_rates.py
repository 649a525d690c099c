"""How often the rules of evidence about differences turn red, without a bias and with one: slow, run by hand.

`python benchmarks/rule_rates.py JOB COUNT`, for JOB null 500, size 200 or planted 64.  The first two draw rows of
images from 96 000 path traced ones behind posts, with replacement: their mean is the truth, exactly.  `size` adds a
bias, and `planted` renders so many chunks of 64 images with mistakes in the code, and asks the reference.
"""

import sys
import time
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).parents[1]))

from benchmarks.jobs.comparing import BLOCKS, SIGMA, Sums, Truth, joined, of_image, spread, spread_by_chance, z_scores
from benchmarks.jobs.gradients import METHODS, REPLICAS, differences, summed, true_probe
from benchmarks.jobs.row_gradients import errors, kinds
from benchmarks.jobs.signing import signed
from figures.claims.figure import Arrays
from figures.experiments import gradients as renderers
from figures.experiments.flatland import moving
from figures.experiments.gradients import ADAPTIVE, Method, gradient_view, grey
from restir_ref.batch import Array
from restir_ref.chance import Chance, Live
from restir_ref.gradient_loop import GRADIENT, View, shaded, step
from restir_ref.integrals import Shifted
from restir_ref.transport.restir_pt import PathIntegrals

SCENE, POPULATION = "occluders", 1500
"""The row, and chunks of the images that are drawn from."""

COUNTS = (1024, 2048, 3072, 5120, 10_240, 23_040)
"""Images of a row."""

RULES = ("z-spread", "row", "blocks", "edges", "pooled", "all but z-spread")


def measures(found: Sums, truth: Truth) -> dict[str, tuple[float, float]]:
    """What every rule measures, and its limit."""
    errors2 = (truth.error.reshape(BLOCKS, -1) ** 2).sum(axis=1)
    z = z_scores(found.blocks, truth.mean.reshape(BLOCKS, -1).mean(axis=1), np.sqrt(errors2) * BLOCKS / len(truth.mean))
    edge, S, chance = errors(found, truth, SCENE)
    return {
        "z-spread": (spread(found, truth), spread_by_chance(found)),
        "row": (abs(of_image(found, truth)[0]), SIGMA),
        "blocks": (float(abs(z[0]).max()), SIGMA),
        "edges": (edge, SIGMA),
        "pooled": (S, chance),
    }


def red(found: Sums, truth: Truth) -> Counter[str]:
    """The rules that say that it is biased."""
    said = Counter(name for name, (value, limit) in measures(found, truth).items() if value > limit)
    return said + Counter(["all but z-spread"] if {*said} - {"z-spread"} else [])


# ---------------------------------------------------------------- draws


def rendered(method: Method, views: list[View], chunks: int, seed: int) -> list[Array]:
    """Chunks of signed differences, (REPLICAS, pairs) each."""
    true = differences(SCENE)
    images = (
        method(views, Counter(), REPLICAS, Live(np.random.default_rng([seed, part])))["dx"] for part in range(chunks)
    )
    return [signed(each[:, : len(true)], true) for each in images]


def row_of(frames: int) -> list[View]:
    """A row that stands still."""
    sensor = moving(SCENE, 1, 0.0)[0]
    return [gradient_view(SCENE, (sensor, sensor), Counter(), GRADIENT, ADAPTIVE)] * frames


def population() -> Array:
    """Path traced images, (N, pairs)."""
    return np.concatenate(rendered(METHODS["path tracing"], row_of(1), POPULATION, 7))


def drawn(images: Array, n: int, rng: np.random.Generator) -> Sums:
    """A row of n of them, in chunks."""
    some = images[rng.integers(0, len(images), n)]
    total = some.reshape(n // REPLICAS, REPLICAS, -1).sum(axis=1)
    return Sums(some.reshape(n, BLOCKS, -1).mean(axis=-1), total, (some**2).sum(axis=0))


def rates(images: Array, n: int, count: int, by: Array | float = 0.0) -> Counter[str]:
    """How many of `count` rows of n images each rule calls biased, whose truth is off by `by`."""
    rng, said = np.random.default_rng(n), Counter[str]()
    mean = images.mean(axis=0) - by
    truth = Truth(mean, np.zeros(len(mean)), 0.0)
    for _ in range(count):
        said += red(drawn(images, n, rng), truth)
    return said


def line(name: str, said: Counter[str], count: int) -> str:
    """Rates in per cent."""
    return f"{name:34}" + "".join(f"{said[rule] / count:>17.1%}" for rule in RULES)


HEAD = " " * 34 + "".join(f"{rule:>17}" for rule in RULES)


def null(count: int) -> None:
    """Without a bias."""
    images = population()
    print(HEAD)
    for n in COUNTS:
        print(line(f"{n} images", rates(images, n, count), count), flush=True)


def size(count: int) -> None:
    """With a bias of some standard errors, of one pair, loud or quiet, or of a stretch, changing its sign."""
    images, n = population(), 5120
    stretches = kinds(SCENE)[1]
    error, far = images.std(axis=0) / np.sqrt(n), np.concatenate(stretches)
    order = far[np.argsort(error[far])]
    one = {name: order[int(q * (len(far) - 1))] for name, q in {"loud": 0.9, "quiet": 0.1}.items()}
    pairs = np.arange(images.shape[1])
    sign = (-1.0) ** pairs
    biases = {f"a {kind} pair, {c}": c * (pairs == pair) for c in (4, 8, 16) for kind, pair in one.items()}
    biases |= {
        f"pairs {some[0]} to {some[-1]}, {c}, + and -": c * sign * np.isin(pairs, some)
        for c in (0.75, 1, 1.5)
        for some in stretches
    }
    print(HEAD)
    for name, bias in biases.items():
        print(line(name, rates(images, n, count, bias * error), count), flush=True)


# ---------------------------------------------------------------- mistakes in the code


def dimming(factor: float, which: Callable[[Array, Array, Shifted], Array]) -> type[PathIntegrals]:
    """A mistake: J times a factor where `which` says so, of the pixels from and to, and what is shifted."""

    class Dimming(PathIntegrals):
        def shift(self, x, index, to) -> Shifted:  # type: ignore[no-untyped-def]
            y = super().shift(x, index, to)
            return Shifted(y.x, np.where(which(index % self.n, to.index % self.n, y), factor, 1.0) * y.J)

    return Dimming


JACOBIANS: Mapping[str, type[PathIntegrals]] = {
    "nothing": PathIntegrals,
    "J .9": dimming(0.9, lambda i, j, y: i >= 0),
    "J .9 to the right": dimming(0.9, lambda i, j, y: j > i),
    "J .99 to the right": dimming(0.99, lambda i, j, y: j > i),
    "J .9 to the right, three bounces": dimming(0.9, lambda i, j, y: (j > i) & (y.x.k >= 3)),
    "J .99 to the right of even pixels": dimming(0.99, lambda i, j, y: (j > i) & (i % 2 == 0)),
}


def boosted(factor: float) -> Method:
    """Gradients with ReSTIR, a mistake in history: its W times a factor."""

    def render(views, asked, replicas, chance: Chance) -> Arrays:  # type: ignore[no-untyped-def]
        last = None
        for view in views:
            found = step(view, chance, GRADIENT, replicas, last)
            history = {
                name: {part: replace(X, W=factor * X.W) for part, X in each.items()} for name, each in found.items()
            }
            last = view, history
        return {name: grey(shaded(view, found[name]), replicas) for name, view in views[-1].items()}

    return render


def planted(count: int) -> None:
    """Mistakes in path tracing's shifts, and in history of five frames: measured and allowed."""
    print(" " * 40 + "".join(f"{rule:>18}" for rule in RULES[:-1]))
    for name, kind in JACOBIANS.items():
        renderers.PathIntegrals = kind  # type: ignore[misc]
        told(name, rendered(METHODS["path tracing"], row_of(1), count, 8))
    renderers.PathIntegrals = PathIntegrals  # type: ignore[misc]
    for factor in (1.0, 1.05):
        told(f"history times {factor}, frame 5", rendered(boosted(factor), row_of(5), count, 9))
    for name in ("w = 1/2", "one side"):
        told(name, rendered(METHODS[name], row_of(1), count, 8))


def told(name: str, images: list[Array]) -> None:
    """A line of the table."""
    found = joined([summed(each, "dx") for each in images], "dx")
    said = measures(found, true_probe(SCENE)).values()
    print(f"{name:40}" + "".join(f"{value:>10.2f} of {limit:.2f}" for value, limit in said), flush=True)


JOBS = {job.__name__: job for job in (null, size, planted)}

if __name__ == "__main__":
    start = time.process_time()
    JOBS[sys.argv[1]](int(sys.argv[2]))
    print(f"({time.process_time() - start:.0f} s)")
