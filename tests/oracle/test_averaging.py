"""The mean of n independent frames has the variance of one over n, exactly: replicas of one run share nothing.

Outcomes of all replicas are enumerated together, so that a decision that two of them share would be seen.
"""

from collections.abc import Callable

import numpy as np
import pytest

from figures.experiments.gradients import averaged
from restir_ref import gradient_loop
from restir_ref.batch import Array, take
from restir_ref.gradient_loop import PRIMAL, SAME_SIGN, GradientPreset, first, in_space, sampled, shaded, step
from restir_ref.loop import Preset
from restir_ref.oracle.enumeration import outcomes
from restir_ref.oracle.film import film_scene
from tests.oracle.places import placed_scene
from tests.oracle.test_area import PRESET, group, pair_group

N = 2
"""Pixels, and pairs."""


def moments(estimate: Callable, count: int) -> tuple[Array, Array, Array]:
    """Means, variances and covariances, (N,) and (N, N), of the mean over `count` replicas that run together."""
    first_moment, second, total = np.zeros(N), np.zeros((N, N)), 0.0
    for outcome in outcomes(estimate, count * N):
        means, p = averaged(outcome.result[0].reshape(-1, N), count), outcome.probability
        first_moment += p @ means
        second += np.einsum("l,li,lj->ij", p, means, means)
        total += p.sum()
    assert total == pytest.approx(1, rel=1e-12)
    covariance = second - np.outer(first_moment, first_moment)
    return first_moment, np.diag(covariance), covariance


def differences(seed: int, neighbours: int) -> Callable:
    """Of both signs, from trees that they share, after reuse in space."""
    frame = film_scene(seed).now
    at = pair_group(frame, "positive", "negative")

    def estimate(index, chance):
        X = first(at, index, gradient_loop.sampled(frame, chance, 1, len(index) // N), chance)
        if neighbours:
            X = in_space(at, X, PRESET.pairs, SAME_SIGN, chance)
        return shaded(at, X)

    return estimate


def image(seed: int) -> Callable:
    """Of two frames of area reservoirs, as the baseline without gradients has them."""
    scene = placed_scene(seed, suffixes=1)
    views = [{PRIMAL: group({PRIMAL: frame})} for frame in scene.frames]
    alone = GradientPreset(Preset(1, 0, 1, 1, 3.0), PRESET.pairs)

    def estimate(index, chance):
        replicas, last = len(index) // N, None
        for view in views:
            last = view, step(view, chance, alone, replicas, last)
        return shaded(views[-1][PRIMAL], last[1][PRIMAL])

    return estimate


CASES = {
    "differences, 2 instances": (differences, {"neighbours": 1}, 2),
    "differences without neighbours, 3 instances": (differences, {"neighbours": 0}, 3),
    "image of two frames, 2 instances": (image, {}, 2),
}


@pytest.mark.claims("GPT-A13", part="the variance of a mean, exactly")
@pytest.mark.parametrize(("of", "how", "count"), CASES.values(), ids=CASES)
def test_the_mean_of_independent_instances_has_their_variance_over_their_number(of, how, count) -> None:
    mean, variance, covariance = moments(of(1, **how), 1)
    mean_of, variance_of, covariance_of = moments(of(1, **how), count)
    assert (variance > 0.01).all()
    assert mean_of == pytest.approx(mean, abs=1e-12)
    assert variance_of == pytest.approx(variance / count, rel=1e-12)
    assert covariance_of == pytest.approx(covariance / count, rel=1e-11)


def of_the_first_replica(image, chance, trees, replicas):
    """A mistake: the second of two instances has the trees of the first."""
    drawn = sampled(image, chance, trees, replicas)
    columns = np.arange(replicas * N)
    return [(take(x, of := columns - columns % (2 * N) + columns % N), mW.take(of)) for x, mW in drawn]


def test_instances_that_share_their_trees_are_noticed(monkeypatch) -> None:
    _, variance, _ = moments(differences(1, 1), 1)
    monkeypatch.setattr(gradient_loop, "sampled", of_the_first_replica)
    _, variance_of, _ = moments(differences(1, 1), 2)
    assert (variance_of > 1.1 * variance / 2).all()
