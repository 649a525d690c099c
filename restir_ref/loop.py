"""Whole frames of ReSTIR from the passes, with the paper's parameters as plain data.  [GRIS 6.3, 6.5, 8.3]"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from restir_ref.batch import Array
from restir_ref.chance import Chance
from restir_ref.guards import named
from restir_ref.integrals import NOWHERE, Image, Pixels, Reservoirs
from restir_ref.mis import WEIGHTS
from restir_ref.restir import initial, spatial, temporal

GOLDEN = (np.sqrt(5) - 1) / 2


@dataclass(frozen=True)
class Preset:
    """Parameters of a loop; `along` and `across` name the MIS weights of temporal and spatial reuse.

    >>> from dataclasses import replace
    >>> from restir_ref.loop import REAL_TIME
    >>> replace(REAL_TIME, cap=50, neighbours=5)
    Preset(trees=1, rounds=1, neighbours=5, radius=20, cap=50, along='talbot', across='defensive')
    """

    trees: int
    rounds: int
    neighbours: int
    radius: float
    cap: float
    along: str = "talbot"
    across: str = "defensive"


REAL_TIME = Preset(trees=1, rounds=1, neighbours=3, radius=20, cap=20)
"""One path tree, temporal reuse with M_c = 20, one round with 3 random neighbours within 20 pixels."""

OFFLINE = Preset(trees=32, rounds=3, neighbours=6, radius=10, cap=np.nan)
"""32 path trees resampled to one, 3 rounds with 6 neighbours within 10 pixels; no temporal reuse, so no cap."""


def unmutated(X: Reservoirs, here: Pixels, chance: Chance) -> Reservoirs:
    """Samples as they are."""
    return X


@dataclass(frozen=True)
class Passes:
    """Who runs the passes of a frame: `restir` itself, or the same over windows of columns (`windows`).

    mutation(X, here, chance)  changes samples between temporal and spatial reuse (`decorrelation.mutations`)
    """

    initial: Callable[..., Reservoirs]
    temporal: Callable[..., Reservoirs]
    spatial: Callable[..., Reservoirs]
    mutation: Callable[[Reservoirs, Pixels, Chance], Reservoirs] = unmutated


WHOLE = Passes(initial, temporal, spatial)
"""All columns at once."""

Around = Callable[[Image, Array, int, float, Chance], Sequence[Pixels]]
"""Chooses neighbours: (image, columns, how many, radius in pixels, chance) -> one Pixels each."""


def frame(
    here: Pixels,
    chance: Chance,
    preset: Preset,
    around: Around,
    history: Reservoirs | None = None,
    before: Sequence[Pixels] = (),
    *,
    passes: Passes = WHOLE,
) -> Reservoirs:
    """One frame: initial samples, temporal reuse if there is history, mutations, rounds of spatial reuse.

    history are the previous frame's reservoirs, `before` the columns of it that motion vectors
    name, in the previous frame's integrals.

    >>> import numpy as np
    >>> from restir_ref import Live, Pixels, shade
    >>> from restir_ref.loop import REAL_TIME, frame, random_in_row
    >>> from toy1d import image_of_64
    >>> row, chance = image_of_64(), Live(np.random.default_rng(1))
    >>> here = Pixels(row, np.arange(50 * row.n))  # 50 replicas
    >>> Y = frame(here, chance, REAL_TIME, random_in_row)
    >>> one = shade(Y, here).std()
    >>> for _ in range(4):
    ...     Y = frame(here, chance, REAL_TIME, random_in_row, Y, [here])
    >>> bool(shade(Y, here).std() < one)
    True
    """
    X = passes.initial(here, chance, preset.trees)
    if history is not None:
        along = named(WEIGHTS, preset.along, "MIS weight")
        X = passes.temporal(X, here, history, before, chance, mis=along, cap=preset.cap)
    X = passes.mutation(X, here, chance)
    for _ in range(preset.rounds):
        image: Image = here.of  # type: ignore[assignment]
        near = around(image, here.index, preset.neighbours, preset.radius, chance)
        X = passes.spatial(X, here, near, chance, mis=named(WEIGHTS, preset.across, "MIS weight"))
    return X


def random_in_row(of: Image, index: Array, count: int, radius: float, chance: Chance) -> list[Pixels]:
    """Neighbours uniform in -radius .. radius of a row of n pixels, mirrored at its ends.

    Within radius / 2 of an end a mirrored one can be the pixel itself, which is unbiased, only no news.
    Rows shorter than the radius are mirrored at both ends in turn.  Raises ValueError for a radius below 1.

    >>> import numpy as np
    >>> from restir_ref import Live
    >>> from restir_ref.loop import random_in_row
    >>> from toy1d import image_of_64
    >>> near = random_in_row(image_of_64(), np.array([0, 32, 63]), 2, 3, Live(np.random.default_rng(1)))
    >>> [each.index for each in near]
    [array([ 1, 35, 60]), array([ 3, 30, 62])]
    """
    return [_moved(of, index, u, radius) for u in chance.uniform((count, len(index)))]


def spread_in_row(of: Image, index: Array, count: int, radius: float, chance: Chance) -> list[Pixels]:
    """The same from the golden-ratio sequence with a random start per column: evenly spread.

    >>> import numpy as np
    >>> from restir_ref import Live
    >>> from restir_ref.loop import spread_in_row
    >>> from toy1d import image_of_64
    >>> near = spread_in_row(image_of_64(), np.array([32]), 4, 10, Live(np.random.default_rng(1)))
    >>> [int(each.index[0]) for each in near]
    [33, 24, 37, 29]
    """
    start = chance.uniform((len(index),))
    return [_moved(of, index, (start + k * GOLDEN) % 1, radius) for k in range(count)]


def alike_in_row(alike: Array) -> Around:
    """Random neighbours within the radius among those that see alike, alike (n, n) bool; else `NOWHERE`.

    A choice by G-buffers, never by samples.  [Bitterli 2020]
    """
    distance = np.abs(np.subtract.outer(np.arange(len(alike)), np.arange(len(alike))))

    def around(of: Image, index: Array, count: int, radius: float, chance: Chance) -> list[Pixels]:
        allowed = alike & (distance <= radius) & (distance > 0)
        choices, listed = allowed.sum(axis=1), np.argsort(~allowed, axis=1, kind="stable")
        pixel = index % of.n
        chosen = (chance.uniform((count, len(index))) * choices[pixel]).astype(int)
        near = np.where(choices[pixel] > 0, index - pixel + listed[pixel, chosen], NOWHERE)
        return [Pixels(of, each) for each in near]

    return around


def _moved(of: Image, index: Array, u: Array, radius: float) -> Pixels:
    """u in [0, 1) chooses one of the steps -radius .. -1, 1 .. radius, and mirrors make a wave of period 2 (n - 1)."""
    if not 1 <= radius < np.inf:
        raise ValueError(
            f"neighbours are 1 .. radius pixels away, but the radius is {radius}: take 1, or no neighbours."
        )
    reach = int(radius)
    step = np.floor(u * 2 * reach).astype(int) - reach
    pixel = index % of.n
    place = (pixel + step + (step >= 0)) % max(2 * (of.n - 1), 1)
    return Pixels(of, index - pixel + np.minimum(place, 2 * (of.n - 1) - place))
