"""ReSTIR PT in flatland: reuse changes no mean; differences to the same frames' initial samples need no reference."""

import numpy as np
import pytest

from flatland2d import SCENES
from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.integrals import Pixels, Reservoirs
from restir_ref.loop import REAL_TIME, random_in_row
from restir_ref.mis import WEIGHTS, Weights
from restir_ref.restir import initial, shade, spatial, temporal
from restir_ref.transport.paths import Tracer
from restir_ref.transport.restir_pt import PathIntegrals
from tests.transport.paths import RULES

PIXELS, REPLICAS, BATCHES = 32, 128, 8


def images(scene: str, rule: str, x: float = 0.0) -> PathIntegrals:
    """The scene's pixels, seen from an eye moved by x."""
    setting = SCENES[scene]()
    view = setting.pinhole(PIXELS, 900)
    moved = type(view)((view.eye[0] + x, view.eye[1]), view.towards, PIXELS, view.half, view.first)
    return PathIntegrals(Tracer(setting.scene, moved, setting.depth, RULES[rule]))


def z_and_error(differences: list[Array], means: list[Array]) -> tuple[float, float]:
    """z of the mean difference over replicas, and its standard error relative to the image."""
    d = np.concatenate([each.reshape(REPLICAS, PIXELS).mean(axis=1) for each in differences])
    error = d.std(ddof=1) / np.sqrt(len(d))
    return float(d.mean() / error), float(error / np.mean(means))


def three_at_random(of: PathIntegrals, X: Reservoirs, chance: Live) -> list[Pixels]:
    """Three neighbours within 20 pixels."""
    return random_in_row(of, np.arange(len(X.W)), 3, REAL_TIME.radius, chance)


def spatially(scene: str, rule: str, mis: Weights, around=three_at_random) -> tuple[float, float]:
    """One pass of spatial reuse."""
    of, chance = images(scene, rule), Live(np.random.default_rng(11))
    here, found, means = Pixels(of, np.arange(PIXELS * REPLICAS)), [], []
    for _ in range(BATCHES):
        X = initial(here, chance)
        Y = spatial(X, here, around(of, X, chance), chance, mis=mis)
        found.append((shade(Y, here) - shade(X, here))[0])
        means.append(shade(X, here).mean())
    return z_and_error(found, means)


def over_frames(scene: str, rule: str, step: float) -> tuple[float, float]:
    """Temporal reuse over three frames of a camera that moves by `step`, with previous-frame integrals."""
    chance, found, means = Live(np.random.default_rng(12)), [], []
    for _ in range(BATCHES):
        history, before = None, None
        for frame in range(3):
            here = Pixels(images(scene, rule, frame * step), np.arange(PIXELS * REPLICAS))
            X = initial(here, chance)
            Y = X if history is None else temporal(X, here, history, [before], chance)
            history, before = Y, here
        found.append((shade(Y, here) - shade(X, here))[0])
        means.append(shade(X, here).mean())
    return z_and_error(found, means)


some_scene = pytest.mark.parametrize("scene", ["cornell", "glossy_cornell", "clear_coat"])
each_shift = pytest.mark.parametrize("rule", ["hybrid", "reconnection"])


@some_scene
@each_shift
def test_spatial_reuse_changes_no_mean(scene, rule) -> None:
    z, error = spatially(scene, rule, WEIGHTS["defensive"])
    assert error < 0.005
    assert abs(z) < 4


@some_scene
@each_shift
@pytest.mark.parametrize("step", [0.0, 0.002], ids=["still", "moving"])
def test_temporal_reuse_changes_no_mean(scene, rule, step) -> None:
    z, error = over_frames(scene, rule, step)
    assert error < 0.005
    assert abs(z) < 4


def brighter_of_two(of: PathIntegrals, X: Reservoirs, chance: Live) -> list[Pixels]:
    """A mistake: of two neighbours take the one whose own sample is brighter."""
    left, right = random_in_row(of, np.arange(len(X.W)), 2, REAL_TIME.radius, chance)
    p_left, p_right = (X.x.F.mean(axis=0)[at.index] * X.W[at.index] for at in (left, right))
    return [Pixels(of, np.where(p_left > p_right, left.index, right.index))]


def test_neighbours_chosen_by_their_samples_are_caught() -> None:
    z, error = spatially("cornell", "reconnection", WEIGHTS["defensive"], brighter_of_two)
    assert error < 0.005
    assert z > 8
