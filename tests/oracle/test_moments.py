"""Moments propagated through passes are those of enumerating every outcome, zeros of the target included."""

import numpy as np
import pytest

from restir_ref.mis import WEIGHTS
from restir_ref.oracle import moments
from restir_ref.oracle.enumeration import outcomes
from restir_ref.oracle.moments import Moments, Source, drawn, operator, resampled
from restir_ref.oracle.scenes import reference_scene, spatial_loop, three_pixel_scene, two_technique_scene

every_weight = pytest.mark.parametrize("name", WEIGHTS)


def propagated(scene, mis, rounds: int) -> Moments:
    n, K = scene.v.shape
    Z, c = drawn(scene.now), 1
    for _ in range(rounds):
        order = [[(i + by) % n for by in range(n)] for i in range(n)]
        passes = [operator([Source(j * K, scene.now, j, c) for j in row], n * K, mis) for row in order]
        Z, c = resampled(Z, passes), n * c
    return Z


def enumerated(scene, mis, rounds: int) -> Moments:
    n, K = scene.v.shape
    mean, second = np.zeros(n * K), np.zeros((n * K, n * K))
    for outcome in outcomes(spatial_loop(scene, mis, rounds), n):
        X = outcome.result
        lanes = len(outcome.probability)
        Z = np.zeros((lanes, n * K))
        Z[np.repeat(np.arange(lanes), n), np.tile(np.arange(n), lanes) * K + X.x] = X.W
        mean += outcome.probability @ Z
        second += (Z.T * outcome.probability) @ Z
    return Moments(mean, second)


def error(name: str, rounds: int) -> float:
    scene = reference_scene()
    found, truth = (f(scene, WEIGHTS[name], rounds) for f in (propagated, enumerated))
    return float(max(abs(found.mean - truth.mean).max(), abs(found.second - truth.second).max()))


@every_weight
@pytest.mark.parametrize("rounds", [1, 2])
def test_first_and_second_moments_are_those_of_all_outcomes(name, rounds) -> None:
    assert error(name, rounds) < 1e-11


def test_counting_samples_of_zero_target_as_chosen_is_caught(monkeypatch) -> None:
    """A mistake that once stood here: Talbot hides it, 1/Z does not."""
    monkeypatch.setattr(moments.np, "where", lambda condition, a, b: a)
    assert error("1/Z", 2) > 0.1


def test_moments_of_initial_samples_know_one_technique_and_refuse_two() -> None:
    drawn(three_pixel_scene().now)
    with pytest.raises(ValueError, match="but this scene has 2"):
        drawn(two_technique_scene().now)
