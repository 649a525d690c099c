"""Parts that bugs of the zoo are made of, by themselves: right ones are right on scenes of any size."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.integrals import Pixels
from restir_ref.mis import WEIGHTS, Confidences, pairwise
from restir_ref.oracle.scenes import random_scene, reference_scene, three_pixel_scene, two_technique_scene
from restir_ref.oracle.zoo.checks import statistics
from restir_ref.oracle.zoo.inefficient import capped_after
from restir_ref.oracle.zoo.mutations import Clamping, Stepping
from restir_ref.oracle.zoo.selection import SELECTION_BUGS
from restir_ref.oracle.zoo.weights import swapped_pairwise
from restir_ref.restir import initial, temporal

SCENES = {scene.__name__: scene for scene in (reference_scene, three_pixel_scene, two_technique_scene)}
every_scene = pytest.mark.parametrize("scene", SCENES.values(), ids=SCENES)


@dataclass(frozen=True)
class Always:
    """Chance that always takes the same option."""

    option: int

    def choose(self, weights: Array) -> Array:
        return np.full(weights.shape[1], self.option)


def forth_and_back(kind, scene, option: int) -> tuple[Array, Array, Array]:
    """All cells of all pixels, where a step and the opposite one lead from each, and the product of both ratios T."""
    now = scene().made_of(kind).now
    K = now.cells.v.shape[-1]
    index, x = np.repeat(np.arange(now.n), K), np.tile(np.arange(K), now.n)
    y, T = now.propose(index, x, Always(option))
    back, T_back = now.propose(index, y, Always(1 - option))
    assert ((y >= 0) & (y < K)).all()
    return x, back, T * T_back


@every_scene
@pytest.mark.parametrize("option", [0, 1])
def test_a_step_is_undone_by_the_opposite_one_and_so_is_its_density(scene, option) -> None:
    x, back, T = forth_and_back(Stepping, scene, option)
    assert np.array_equal(back, x)
    assert pytest.approx(1, rel=1e-12) == T


@every_scene
def test_a_clamped_step_is_not(scene) -> None:
    x, back, _ = forth_and_back(Clamping, scene, 0)
    assert (back != x).any()


def dark(scene) -> np.ndarray:
    """Cells that are drawn and have no light, (n, K)."""
    return (scene.now.cells.pdf > 0).any(axis=0)[scene.now.ids(np.arange(scene.now.n))] & ~scene.support


@pytest.mark.parametrize("bug", SELECTION_BUGS, ids=lambda bug: bug.name)
def test_what_is_wrongly_selected_or_weighed_has_no_weight_where_there_is_no_light(bug) -> None:
    scenes = [random_scene(bug.scene(), rng=np.random.default_rng(seed)) for seed in range(20)]
    scene = next(each for each in scenes if dark(each).any())
    for parts in (bug.wrong, bug.right):
        assert not statistics(parts(scene), scene).first[dark(scene)].any()


@pytest.mark.parametrize("cap", [2.0, 5.0])
def test_a_cap_after_the_merge_bounds_the_result_and_a_cap_before_it_the_history(cap) -> None:
    before, now = reference_scene().frames
    index, chance = np.arange(before.n), Live(np.random.default_rng(1))
    X, Y = (initial(Pixels(of, index), chance) for of in (now, before))
    old, sources = replace(Y, c=9 * Y.c), [Pixels(before, index)]
    for merge, found in ((capped_after, cap), (temporal, 1 + cap)):
        assert (merge(X, Pixels(now, index), old, sources, chance, mis=WEIGHTS["talbot"], cap=cap).c == found).all()


@pytest.mark.parametrize("canonical", [[], [0, 1, 2]], ids=["none", "all"])
def test_pairs_with_swapped_counts_weigh_by_confidence_where_there_are_no_pairs(canonical) -> None:
    c = [np.array([k + 1.0]) for k in range(3)]
    m = [swapped_pairwise(i, lambda j: np.array([0.3 + j]), Confidences(c, canonical)) for i in range(3)]
    assert np.concatenate(m) == pytest.approx([1 / 6, 1 / 3, 1 / 2], rel=1e-12)


def test_pairs_with_swapped_counts_are_right_where_both_sides_have_seen_as_much() -> None:
    """As its story says, nothing shows while both have the same confidence."""

    def q(j: int) -> np.ndarray:
        return np.array([0.3 + j])

    for counts, same in (((2.0, 2.0), True), ((1.0, 3.0), False)):
        c = Confidences([np.array([count]) for count in counts], [0])
        m = [[float(weight(i, q, c)[0]) for i in range(2)] for weight in (swapped_pairwise, pairwise)]
        assert (pytest.approx(m[1], rel=1e-12) == m[0]) == same
