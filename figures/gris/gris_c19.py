"""GRIS 6.2: reuse must not look at the samples.  Confidence counts null samples too; neighbours are chosen blindly.

Left: six temporal merges of samples of which one in five finds light.  Right: one spatial pass on the 64-pixel image
from one of two random neighbours, the first one or the one whose sample has the larger target.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims import criteria
from figures.claims.figure import Arrays, Claim, Figure
from figures.experiments.chains import images, random_neighbour
from figures.experiments.exact import true_image
from figures.report import style
from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.integrals import Pixels, Reservoirs, target
from restir_ref.restir import initial, shade, spatial, temporal
from toy1d import Line, image_of_64

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture

LIT = 0.2
MERGES = 6
Edit = Callable[[Reservoirs], Reservoirs]
Choice = Callable[[Reservoirs, Pixels, Pixels], Pixels]
NAMES = ("null samples count", "only others count", "neighbour chosen blindly", "brighter neighbour")


def chunks(preset: Any) -> Sequence[Any]:
    """Blocks of groups of replicas."""
    return [{"block": b} for b in range(preset["blocks"])]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """Estimates over the truth in groups, (4, groups)."""
    groups, size, chance = preset["groups"] // preset["blocks"], preset["replicas"], Live(rng)
    here = Pixels(image_of_64(), np.arange(64 * groups * size))
    merged = [six_merges(edit, 64 * groups * size, chance) / LIT for edit in (as_it_is, forget_null)]
    chosen = [one_pass(here, choice, chance) for choice in (first, brighter)]
    return {"estimates": np.stack([each.reshape(groups, -1).mean(axis=1) for each in (*merged, *chosen)])}


def rarely_lit() -> Line:
    """f = 1 on [0, .2) and 0 up to 1."""
    return Line(lambda pixel, x: (x < LIT) * 1.0, np.zeros(1), np.ones(1))


def as_it_is(X: Reservoirs) -> Reservoirs:
    """Every sample has confidence 1, whatever it found."""
    return X


def forget_null(X: Reservoirs) -> Reservoirs:
    """The mistake: samples that found nothing are not counted."""
    return replace(X, c=np.where(rarely_lit().f(X.x, X.x) > 0, X.c, 0))


def six_merges(edit: Edit, columns: int, chance: Live) -> Array:
    """f(Y) W_Y after six temporal merges without a cap, (columns,)."""
    here = Pixels(rarely_lit(), np.arange(columns))
    Y = edit(initial(here, chance))
    for _ in range(MERGES):
        Y = temporal(edit(initial(here, chance)), here, Y, [Pixels(here.of, here.index)], chance, cap=np.inf)
    return np.asarray(shade(Y, here)[0])


def first(X: Reservoirs, a: Pixels, b: Pixels) -> Pixels:
    """A choice by position alone."""
    return a


def brighter(X: Reservoirs, a: Pixels, b: Pixels) -> Pixels:
    """The mistake: the neighbour whose own sample has the larger target."""
    p_a, p_b = (target(near, X.x[near.index]) for near in (a, b))
    return Pixels(a.of, np.where(p_a > p_b, a.index, b.index))


def one_pass(here: Pixels, choice: Choice, chance: Live) -> Array:
    """The image after reuse from one of two neighbours, over its mean; (replicas, 64)."""
    X = initial(here, chance)
    near = choice(X, random_neighbour(here, chance), random_neighbour(here, chance))
    return np.asarray(images(spatial(X, here, [near], chance), here) / true_image(image_of_64()).mean())


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """All groups, (4, groups)."""
    return {"estimates": np.concatenate([result["estimates"] for result in results], axis=1)}


def check(a: Arrays) -> list[Claim]:
    """Both rules are unbiased, both mistakes are not; without null samples the mean is 1 - .8^7."""
    counted, uncounted, blind, looking = a["estimates"]
    predicted = (1 - (1 - LIT) ** (MERGES + 1)) / LIT
    return [
        Claim("GRIS-A18", criteria.unbiased(counted, 1), NAMES[0]),
        Claim("GRIS-A18", criteria.biased(uncounted, 1, 0.01, np.inf), f"control: {NAMES[1]}"),
        Claim("GRIS-A18", criteria.unbiased(uncounted / predicted, 1), "the control over its own prediction, 1 - .8^7"),
        Claim("GRIS-C19", criteria.unbiased(blind, 1), NAMES[2]),
        Claim("GRIS-C19", criteria.biased(looking, 1, 0.01, np.inf), f"control: {NAMES[3]}"),
    ]


def draw(a: Arrays) -> "Picture":
    """Means with error bars; the truth is 1."""
    picture, axes = style.panels(1, 2, width=3.6, height=2.8)
    mean, error = a["estimates"].mean(axis=1), a["estimates"].std(axis=1, ddof=1) / np.sqrt(a["estimates"].shape[1])
    for axis, start, title in ((axes[0, 0], 0, "Six temporal merges"), (axes[0, 1], 2, "One spatial pass, 64 pixels")):
        pair = slice(start, start + 2)
        axis.errorbar([0, 1], mean[pair], 4 * error[pair], ls="", marker="o", color=style.BLUE, capsize=5)
        axis.axhline(1, **style.look("truth"))
        axis.legend(loc="upper center")
        axis.set_xticks([0, 1], [name.replace(" ", "\n", 1) for name in NAMES[pair]])
        axis.set(xlim=(-0.6, 1.6), xlabel="rule", ylabel="mean / truth (bars: 4 SE)", title=title)
        axis.set_ylim(0.9, 1.1 * mean[pair].max())
    return picture


FIGURE = Figure(
    id="GRIS-C19",
    title="Reuse must not look at the samples",
    world="toy1d",
    source="[GRIS 4.2, 6.2]",
    claims=("GRIS-A18", "GRIS-C19"),
    presets={
        "quick": {"groups": 64, "replicas": 96, "blocks": 2},
        "paper": {"groups": 64, "replicas": 960, "blocks": 16},
    },
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)
