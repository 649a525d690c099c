"""Every stage of every frame of the 64-pixel image has unbiased contribution weights, for four functions of the sample.

Mutations stand between temporal and spatial reuse.  [GRIS Def. 4.1, 6.3]
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from figures.claims.criteria import Outcome, biased, unbiased
from figures.experiments.chains import random_neighbour, three_of_radius_5
from restir_ref.batch import Array
from restir_ref.chance import Chance
from restir_ref.decorrelation import mutate
from restir_ref.integrals import Pixels, Reservoirs
from restir_ref.restir import initial, spatial, temporal
from tests.core.stubs import live
from toy1d import image_of_64
from toy1d.walking import walking

FRAMES = (1, 2, 5, 20)
REPLICAS = 64 * 50

Around = Callable[[Pixels, Reservoirs, Chance], Sequence[Pixels]]
Mutation = Callable[[Reservoirs, Pixels, Chance], Reservoirs]


def by_place(here: Pixels, X: Reservoirs, chance: Chance) -> Sequence[Pixels]:
    """Three random neighbours."""
    return three_of_radius_5(here, chance)


def by_sample(here: Pixels, X: Reservoirs, chance: Chance) -> Sequence[Pixels]:
    """A mistake: of two random neighbours the one whose sample is brighter here."""
    one, two = (random_neighbour(here, chance).index for _ in range(2))
    lit = [here.of.target(here.index, X.x.take(each)) for each in (one, two)]
    return [Pixels(here.of, np.where(lit[0] >= lit[1], one, two))]


def with_the_old_weight(X: Reservoirs, here: Pixels, chance: Chance) -> Reservoirs:
    """A mistake: an accepted proposal keeps the W of the sample that it replaces."""
    return replace(mutate(X, here, chance), W=X.W)


def stages(
    frames: int, chance: Chance, around: Around = by_place, mutation: Mutation = mutate
) -> Iterator[tuple[tuple[int, str], Reservoirs]]:
    """Reservoirs after every stage; caps and weights are those of the real-time preset."""
    here = Pixels(walking(image_of_64()), np.arange(64 * REPLICAS))
    history: list[Reservoirs] = []
    for t in range(1, frames + 1):
        X = initial(here, chance)
        yield (t, "initial"), X
        for Y in history:
            X = temporal(X, here, Y, [here], chance)
            yield (t, "temporal"), X
        X = mutation(X, here, chance)
        yield (t, "mutation"), X
        X = spatial(X, here, around(here, X, chance), chance)
        yield (t, "spatial"), X
        history = [X]


PROBES = {
    "constant": lambda pixel, x: np.ones_like(x),
    "half of the domain": lambda pixel, x: 1.0 * (x < 0.5),
    "p_hat": image_of_64().f,
    "bump": lambda pixel, x: np.exp(-(((x - 0.6) / 0.2) ** 2)),
}


@cache
def truth(probe: str) -> float:
    """The mean over pixels of int f, by the midpoint rule."""
    pixel, x = np.repeat(np.arange(64), 4000), np.tile((np.arange(4000) + 0.5) / 4000, 64)
    return float(PROBES[probe](pixel, x).mean())


def probed(X: Reservoirs, probe: str) -> Array:
    """The mean over pixels of f(X) W in 64 groups of replicas."""
    f = PROBES[probe](np.arange(64 * REPLICAS) % 64, X.x)
    return (f * X.W).reshape(64, -1).mean(axis=1)


def verdicts() -> dict[tuple[int, str, str], Outcome]:
    found = {at: X for at, X in stages(max(FRAMES), live(6)) if at[0] in FRAMES}
    return {(*at, probe): unbiased(probed(X, probe), truth(probe), 0.01) for at, X in found.items() for probe in PROBES}


@pytest.mark.claims("GRIS-E08", "GRIS-A05")
def test_after_every_stage_the_integral_of_any_function_is_unbiased_to_1_percent() -> None:
    found = verdicts()
    assert len(found) == 4 * (3 + 3 * 4)
    assert {at: each.measured for at, each in found.items() if not each.passed} == {}


MISTAKES = {"neighbours chosen by sample": {"around": by_sample}, "old weights": {"mutation": with_the_old_weight}}


@pytest.mark.claims("GRIS-E08", "GRIS-A05")
@pytest.mark.parametrize("mistake", MISTAKES)
def test_neighbours_chosen_by_their_samples_and_mutations_that_keep_the_weight_are_noticed(mistake) -> None:
    X = dict(stages(2, live(6), **MISTAKES[mistake]))[2, "spatial"]
    found, expected = probed(X, "p_hat"), truth("p_hat")
    assert biased(found, expected, 0.01, np.inf).passed or biased(found, expected, -1, -0.01).passed
