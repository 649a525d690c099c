"""GPT-F09-3D: the rack in space is flatland's drawn out, arms differ in their reservoirs, and one is not two."""

from collections import Counter

import numpy as np
import pytest

from figures.experiments.following import followed
from figures.gradient import gpt_f09 as flat
from figures.gradient import gpt_f09_3d as space
from flatland2d.scenes import rack
from restir_ref.gradient_loop import GRADIENT, PRIMAL
from restir_ref.squares import keeping
from restir_ref.transport.rays import arrive

pytestmark = pytest.mark.claims("GPT-F09", world="tracer3d")

QUICK = space.FIGURE.presets["quick"]


def arrays(seed=0, arms=space.ARMS):
    results = [space.compute(QUICK, {"reuse": arm}, rng=np.random.default_rng(seed)) for arm in arms]
    return space.combine(QUICK, results)


def test_a_level_ray_at_half_depth_meets_what_flatlands_ray_meets():
    """From the middle of the gap at every height, to the left and right: the same place, material and lamp."""
    flat_scene, deep = rack().scene, space.rack().scene
    y = np.array([0.1, 0.31, 0.45, 0.59, 0.65, 0.79, 0.9])
    for sign in (-1.0, 1.0):
        v, _, _ = arrive(flat_scene, np.stack([0 * y + 0.515, y]), np.stack([0 * y + sign, 0 * y]))
        w, _, _ = arrive(deep, np.stack([0 * y + 0.515, y, 0 * y + 0.5]), np.stack([0 * y + sign, 0 * y, 0 * y]))
        assert w.x[:2] == pytest.approx(v.x, abs=1e-9)
        assert (w.material == v.material).all()
        assert (deep.emission[:, w.prim] == flat_scene.emission[:, v.prim]).all()
        assert (deep.emission[:, w.prim] > 0).any()


def test_history_stays_in_place_under_a_camera_that_moves_by_fractions():
    views = space.moving(6, 3, GRADIENT, Counter())
    assert {group.follow for view in views for group in view.values()} == {keeping}
    by = np.stack([view[PRIMAL].by for view in views[1:]])
    assert (abs(by - np.rint(by)) > 0.1).any()


def test_arms_differ_in_their_differences_and_two_reservoirs_cost_more_rays():
    a = arrays()
    ours, one = (f"rack.{arm}" for arm in space.ARMS)
    assert a[f"{ours}.dx"].shape == a[f"{one}.dx"].shape == (2, 30)
    assert not np.array_equal(a[f"{ours}.dx"], a[f"{one}.dx"])
    assert space.dearer(a) > 1


def test_both_arms_are_those_of_flatland():
    assert all(flat.ARMS[arm] == partners for arm, partners in space.ARMS.items())


def made(ratio, rays, replicas=64):
    """Arrays whose variances, two reservoirs over one, are in that ratio, and their rays in the other."""
    swing = np.tile([-1.0, 1.0], replicas // 2)[:, None] * np.ones(4)
    found = {}
    for arm, scale, cost in zip(space.ARMS, (ratio**0.5, 1.0), (rays, 1.0), strict=True):
        noise = 1 + 1e-3 * np.random.default_rng(3).standard_normal(swing.shape)
        found |= {f"rack.{arm}.{name}": scale * swing * noise for name in ("dx", "dy")}
        found[f"rack.{arm}.rays"] = np.array(cost)
    return found


@pytest.mark.parametrize(
    ("ratio", "rays", "passed"), [(0.6, 1.4, (True, True)), (0.65, 1.5, (True, False)), (0.8, 1.0, (False, True))]
)
def test_equal_samples_need_seven_tenths_and_equal_rays_nine(ratio, rays, passed):
    found = [claim.outcome.passed for claim in space.check(made(ratio, rays))[:3:2]]
    assert tuple(found) == passed


def test_a_ratio_that_one_replica_decides_is_left_open():
    a = made(0.4, 1.0)
    a["rack.same sign.dx"][0] *= 12
    assert space.check(a)[0].outcome is None


@pytest.mark.parametrize(("row", "column", "seen"), [(540, 1257, (0.67, 0.67)), (540, 960, (0.0, 0.10))])
def test_the_bar_sees_both_lamps_and_the_floor_between_does_not(row, column, seen):
    s, rng, n = space.rack(), np.random.default_rng(1), 4000
    x, w, _ = s.pinhole().through(np.array([column + 0.5]), np.array([row + 0.5]))
    v, _, _ = arrive(s.scene, x, w)
    for share, wall in zip(seen, (0.005, 0.995), strict=True):
        lamp = np.stack([np.full(n, wall), rng.uniform(0.5, 0.8, n), rng.uniform(0.3, 0.7, n)])
        d = lamp - v.x
        far = np.linalg.norm(d, axis=0)
        _, t, _ = arrive(s.scene, np.repeat(v.x + 1e-6 * v.n, n, axis=1), d / far)
        assert (abs(t - far) < 1e-3).mean() == pytest.approx(share, abs=0.03)


def test_the_crop_is_on_the_bar():
    s = space.rack()
    last = followed(s, 12, 1)[0]
    assert (last.left + 6, last.top + 6) == (1257, 540)


def test_few_replicas_are_not_judged():
    assert [claim.outcome is None for claim in space.check(made(0.6, 1.4, replicas=32))[:4]] == [True] * 4


def test_the_paper_preset_lasts_three_caps():
    assert space.FIGURE.presets["paper"]["frames"] == 3 * GRADIENT.pixels.cap == 3 * GRADIENT.pairs.cap
