"""Gradient-domain path tracing by whole trees: what it estimates, and what its rays are."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from flatland2d import setting
from restir_ref.batch import take
from restir_ref.chance import Live
from restir_ref.integrals import Pixels
from restir_ref.transport.baselines.gradient_path_tracing import difference, grown, one_way, radiance_of
from restir_ref.transport.counting import CLOSEST, SHADOW, counted, rays
from restir_ref.transport.distinct import distinct, once
from restir_ref.transport.paths import RECONNECTION, REPLAY, Connectability, Tracer, radiance, trace
from restir_ref.transport.restir_pt import PathIntegrals, ScatteredIntegrals

HYBRID = Connectability(roughness=0.2, distance=0.02)


def row(scene="glossy_cornell", rule=HYBRID, n=16, wrapped=lambda scene: scene, depth=None) -> PathIntegrals:
    """A whole film of few pixels, which differ by more than noise."""
    room = setting(scene)
    sensor = replace(room.pinhole(n), film=n, first=0)
    return PathIntegrals(Tracer(wrapped(room.scene), sensor, depth or room.depth, rule))


def all_pairs(of: PathIntegrals, replicas: int) -> tuple[Pixels, Pixels]:
    left = (np.arange(replicas)[:, None] * of.n + np.arange(of.n - 1)).ravel()
    return Pixels(of, left), Pixels(of, left + 1)


def forest(of: PathIntegrals, replicas: int, seed: int = 1):
    return grown(of, np.arange(replicas * of.n), Live(np.random.default_rng(seed)))


def test_trees_carry_the_light_of_path_tracing() -> None:
    of = row()
    chance = Live(np.random.default_rng(1))
    plain = radiance(trace(of.tracer, chance.uniform((of.tracer.D, 3 * of.n)), np.arange(3 * of.n) % of.n))
    np.testing.assert_allclose(radiance_of(forest(of, 3)), plain, rtol=1e-12)


@pytest.mark.claims("GPT-F07", part="whole trees, unbiased")
@pytest.mark.parametrize("rule", [RECONNECTION, HYBRID, REPLAY])
@pytest.mark.parametrize("scene", ["glossy_cornell", "occluders"])
def test_differences_by_whole_trees_are_those_of_the_image(scene, rule) -> None:
    """Pair by pair within 4 standard errors, against differences of independent images."""
    of, replicas = row(scene, rule), 1000
    estimates = difference(forest(of, replicas), *all_pairs(of, replicas))[0].reshape(replicas, -1)
    steps = -np.diff(radiance_of(forest(of, 4 * replicas, seed=2))[0].reshape(4 * replicas, -1))
    off = estimates.mean(axis=0) - steps.mean(axis=0)
    noise = np.sqrt(estimates.var(axis=0) / replicas + steps.var(axis=0) / len(steps))
    assert abs(off / noise).max() < 4


def test_without_the_other_pixel_s_trees_differences_are_wrong() -> None:
    """Twice one side's half is off by many standard errors."""
    of, replicas = row("occluders"), 1000
    i, j = all_pairs(of, replicas)
    half = 2 * one_way(forest(of, replicas), i, j)[0].reshape(replicas, -1)
    steps = -np.diff(radiance_of(forest(of, 4 * replicas, seed=2))[0].reshape(4 * replicas, -1))
    noise = np.sqrt(half.var(axis=0) / replicas + steps.var(axis=0) / len(steps))
    assert abs((half.mean(axis=0) - steps.mean(axis=0)) / noise).max() > 8


@pytest.mark.parametrize("rule", [RECONNECTION, HYBRID, REPLAY])
def test_sums_over_leaves_are_those_of_shifting_each_leaf_by_itself(rule) -> None:
    """One kind (k, nee) of leaves at a time."""
    of = row("cornell", rule)
    trees, (i, j) = forest(of, 2), all_pairs(of, 2)
    total = np.zeros((1, len(i.index)))
    for k in range(of.tracer.depth + 1):
        for nee in (False, True):
            kind = np.flatnonzero((trees.X.x.k == k) & (trees.X.x.nee == nee))
            of_kind = replace(trees, X=take(trees.X, kind), tree=trees.tree.take(kind))
            total += one_way(of_kind, i, j) - one_way(of_kind, j, i)
    np.testing.assert_allclose(difference(trees, i, j), total, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("scene", ["cornell", "glossy_cornell", "occluders"])
def test_equal_rays_traced_once_change_no_bit_and_cost_less(scene) -> None:
    found, cost = [], []
    for share in (lambda scene: scene, distinct):
        asked = Counter[str]()
        of = row(scene, wrapped=lambda scene, asked=asked, share=share: share(counted(scene, asked)))
        trees = forest(of, 4)
        asked.clear()
        found.append(difference(trees, *all_pairs(of, 4)))
        cost.append(rays(asked))
    np.testing.assert_array_equal(*found)
    assert cost[1] < 0.85 * cost[0]


def test_by_reconnection_a_whole_tree_costs_a_ray_a_connection_and_the_light_samples_before_it() -> None:
    """Of a matte room at depth 3: y_1, its light sample, and x_2, whatever the number of leaves."""
    asked = Counter[str]()
    of = row("matte_cornell", RECONNECTION, wrapped=lambda scene: distinct(counted(scene, asked)), depth=3)
    trees, (i, j) = forest(of, 8), all_pairs(of, 8)
    asked.clear()
    one_way(trees, i, j)
    part = trees.of(i.index)
    c, k, nee = part.X.x.c, part.X.x.k, part.X.x.nee
    assert asked[CLOSEST] == len(np.unique(part.tree))
    lights = len(np.unique(part.tree[(c == 0) & nee & (k == 1)]))
    joined = len(np.unique(part.tree[c == 2]))
    assert set(np.unique(c)) == {0, 2}
    assert 0.8 * (lights + joined) < asked[SHADOW] <= lights + joined


def test_answers_to_equal_columns_are_asked_once_and_come_back_in_their_order() -> None:
    x = np.array([[1.0, 2.0, 1.0, -0.0, 0.0], [0.0, 1.0, 0.0, 1.0, 1.0]])
    sizes = []

    def answers(x, y):
        sizes.append(x.shape[-1])
        return x[0] + 10 * x[1], y[1]

    total, second = once(answers, x, x + 1)
    np.testing.assert_array_equal(total, x[0] + 10 * x[1])
    np.testing.assert_array_equal(second, x[1] + 1)
    assert sizes == [4]


def test_a_part_of_a_forest_is_its_trees_in_the_order_asked() -> None:
    of = row()
    trees = forest(of, 2)
    columns = np.array([9, 3, 30])
    np.testing.assert_array_equal(radiance_of(trees.of(columns)), radiance_of(trees)[:, columns])


def test_light_that_the_sensor_meets_may_be_left_out() -> None:
    of = row("cornell")
    scattered = ScatteredIntegrals(of.tracer)
    assert (forest(scattered, 4).X.x.k > 0).all()
    assert (forest(row("furnace"), 1).X.x.k == 0).any()
