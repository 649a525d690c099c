"""Steps of random numbers and of angles: both keep p_hat, each with its own target."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from figures.mcmc import mcmc_e05
from figures.mcmc.mcmc_e05 import Base, Moved, base_paths, by_angles, by_numbers, over_angles, over_numbers
from flatland2d import SCENES
from restir_ref.batch import Array, where
from restir_ref.chance import Live
from restir_ref.transport.paths import RECONNECTION, Tracer

SIGMA, STEPS = 0.2, 16
Acceptance = Callable[[Base, Moved], Array]


def tracer(scene: str) -> Tracer:
    setting = SCENES[scene]()
    return Tracer(setting.scene, setting.pinhole(), setting.depth, RECONNECTION)


@cache
def base(scene: str) -> Base:
    return base_paths(tracer(scene), 128, Live(np.random.default_rng(1)))


MOVES: dict[str, Callable[[Tracer, Base, float, Live], Moved]] = {
    "numbers": lambda t, x, sigma, chance: by_numbers(t, x, sigma, chance)[0],
    "angles": by_angles,
}
TARGETS: dict[str, Acceptance] = {"numbers": over_numbers, "angles": over_angles}


def walk(scene: str, how: str, acceptance: Acceptance) -> Base:
    """Some steps from the base paths, accepted or not."""
    t, x, chance = tracer(scene), base(scene), Live(np.random.default_rng(2))
    for _ in range(STEPS):
        y = MOVES[how](t, x, SIGMA, chance)
        new = chance.uniform(x.C.shape) < acceptance(x, y)
        u, C, angle, q = where(new, (y.u, y.C, y.angle, y.q), (x.u, x.C, x.angle, x.q))
        x = replace(x, u=u, C=C, angle=angle, q=q)
    return x


def drift(scene: str, how: str, acceptance: Acceptance) -> float:
    """z of E[p_hat W (|angle'| - |angle|)], which is 0 where p_hat is stationary: W makes x a sample of p_hat."""
    x, y = base(scene), walk(scene, how, acceptance)
    by_replica = np.bincount(x.replica, x.C * x.W * (np.abs(y.angle) - np.abs(x.angle)))
    return float(by_replica.mean() / by_replica.std(ddof=1) * np.sqrt(len(by_replica)))


@pytest.mark.parametrize("how", TARGETS)
@pytest.mark.parametrize("scene", ["crease", "glossy_cornell"])
def test_the_right_target_keeps_the_distribution_of_angles(scene, how) -> None:
    assert abs(drift(scene, how, TARGETS[how])) < 4


@pytest.mark.parametrize(("how", "wrong"), [("numbers", over_angles), ("angles", over_numbers)])
def test_the_other_target_is_noticed(how, wrong) -> None:
    assert abs(drift("crease", how, wrong)) > 8


def test_a_step_of_no_length_is_the_same_path() -> None:
    t, x = tracer("glossy_cornell"), base("glossy_cornell")
    for move in MOVES.values():
        y = move(t, x, 0.0, Live(np.random.default_rng(3)))
        same = np.abs(y.C / x.C - 1) < 1e-6
        assert (~same).mean() < 1e-3  # edges, decided by the last digits
        assert y.q[same] == pytest.approx(x.q[same], rel=1e-6)


def test_the_figure_judges_every_scene_and_both_ways_of_matching() -> None:
    parts = [mcmc_e05.compute({"replicas": 16}, chunk, rng=np.random.default_rng(4)) for chunk in mcmc_e05.chunks({})]
    found = mcmc_e05.combine({}, parts)
    assert found["rates"].shape == (len(mcmc_e05.NAMES), len(mcmc_e05.SIGMAS), len(mcmc_e05.HOW), mcmc_e05.GROUPS)
    assert ((found["rates"] > 0) & (found["rates"] <= 1)).all()
    assert {claim.id for claim in mcmc_e05.check(found)} == set(mcmc_e05.FIGURE.claims)
