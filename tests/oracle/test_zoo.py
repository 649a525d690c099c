"""Every bug of the zoo is caught with its exact bias; the right loop beside it is exact; who catches what is pinned."""

from collections import Counter
from functools import cache

import numpy as np
import pytest

from restir_ref.oracle.scenes import (
    Parts,
    one_frame,
    random_scene,
    reference_scene,
    three_pixel_scene,
    two_technique_scene,
)
from restir_ref.oracle.zoo import BUGS, CHECKS, INEFFICIENT, exact_bias, examine
from restir_ref.oracle.zoo.checks import OUTSIDE, statistics
from restir_ref.oracle.zoo.merging import merging, rated
from restir_ref.oracle.zoo.page import MEAN, VARIANCE
from restir_ref.oracle.zoo.passes import as_it_should_be
from restir_ref.oracle.zoo.selection import streaming
from restir_ref.resampling import gris
from restir_ref.streaming import offer
from tests.oracle.pinned import ALL, CAUGHT, SHORT, WORST, looked_up

every_bug = pytest.mark.parametrize("name", BUGS)
every_inefficient_one = pytest.mark.parametrize("name", INEFFICIENT)
every_one = pytest.mark.parametrize("name", ALL)


@cache
def speaking(right: Parts, size: str) -> list[str]:
    """Checks that find something in a right loop."""
    found = examine(right, right, SIZES[size]())
    return [check for check, each in found.items() if each.caught]


@cache
def right_bias(right: Parts, seed: int, size: str) -> float:
    """Largest bias of a right loop on a random scene, computed once for all bugs that replace a part of it."""
    scene = random_scene(SIZES[size](), rng=np.random.default_rng(seed))
    return float(abs(exact_bias(right(scene), scene)).max())


SIZES = {scene.__name__: scene for scene in (reference_scene, three_pixel_scene, two_technique_scene)}

# ---------------------------------------------------------------- each bug


@every_one
def test_the_right_loop_is_silent_under_every_check(name) -> None:
    assert speaking(ALL[name].right, ALL[name].scene.__name__) == []


@every_bug
def test_the_bug_is_caught_with_its_exact_bias(name) -> None:
    bias = looked_up(name).bias
    assert (bias.min(), bias.max()) == pytest.approx(WORST[name], abs=5e-5)
    assert abs(bias).max() > 0.01


@every_inefficient_one
def test_means_and_definition_stay_silent_about_what_is_only_inefficient(name) -> None:
    entry = looked_up(name)
    assert abs(entry.bias).max() < 1e-13
    assert {check for check, each in entry.found.items() if each.caught} & set(list(CHECKS)[: OUTSIDE - 1]) == set()


@every_inefficient_one
def test_the_variance_or_the_bound_speaks_about_what_is_only_inefficient(name) -> None:
    found = looked_up(name).found
    assert found["variance against the right loop"].caught or found["weight bound (Theorem A.4)"].caught


CONTROLS = [
    pytest.param("divided by M twice", marks=pytest.mark.claims("GRIS-E02")),
    pytest.param("1/p of the chosen candidate", marks=pytest.mark.claims("GRIS-E03")),
    pytest.param("1/T over unequal samplers", marks=pytest.mark.claims("GRIS-E05")),
    pytest.param("Jacobian left out", marks=pytest.mark.claims("GRIS-E07")),
    pytest.param("inverted Jacobian", marks=pytest.mark.claims("GRIS-E07")),
    pytest.param("contribution weights over all inputs", marks=pytest.mark.claims("GRIS-E16")),
    pytest.param("1/M over unequal supports", marks=pytest.mark.claims("GRIS-C03", "GRIS-E21")),
    pytest.param("streaming against the old sum", marks=pytest.mark.claims("GRIS-A01")),
    pytest.param("null confidence 0", marks=pytest.mark.claims("GRIS-A18")),
    pytest.param("neighbour chosen by sample value", marks=pytest.mark.claims("GRIS-C19")),
]


@pytest.mark.parametrize("name", CONTROLS)
def test_the_control_of_a_claim_is_off_by_more_than_a_percent_in_a_whole_pixel(name) -> None:
    assert abs(looked_up(name).found["mean with f = p_hat"].value) > 0.01


# ---------------------------------------------------------------- who catches what


@every_one
def test_who_catches_what_is_as_pinned(name) -> None:
    assert "".join(letter for letter, check in SHORT.items() if looked_up(name).found[check].caught) == CAUGHT[name]


def test_only_the_definition_per_cell_and_the_exact_mean_with_f_1_catch_every_biased_bug() -> None:
    caught = Counter(check for name in BUGS for check, each in looked_up(name).found.items() if each.caught)
    assert {check for check in CHECKS if caught[check] == len(BUGS)} == {"Definition 4.1 per cell", "mean with f = 1"}


def test_exact_means_and_variances_of_the_image_miss_but_the_shared_seeds() -> None:
    shared = ["one seed for two passes", "seeds of pixels and passes collide"]
    for check in (MEAN, VARIANCE):
        assert [name for name in BUGS if not looked_up(name).found[check].caught] == shared


def test_every_check_catches_something_that_looks_right_to_all_the_others_inside() -> None:
    inside = list(SHORT)[OUTSIDE:]
    alone = {"".join(letter for letter in inside if letter in letters) for letters in CAUGHT.values()}
    assert {"c", "b", "m", "f", "J"} <= alone
    assert alone & {"r", "mr"}


ONE_PASS = Parts(one_frame, spatial=ALL["streaming against the old sum"].wrong.spatial)


def test_a_mean_of_the_target_sees_no_wrong_selection_in_one_pass() -> None:
    """p_hat(Y) W_Y is sum w, whatever was selected; f = 1 and the cells tell."""
    found = examine(ONE_PASS, Parts(one_frame), reference_scene())
    assert abs(found["mean with f = p_hat"].value) < 1e-13
    assert abs(found["mean with f = 1"].value) > 0.003
    assert abs(found["Definition 4.1 per cell"].value) > 0.05


def test_nor_does_a_variance_of_it_or_a_mean_see_two_passes_that_share_a_seed() -> None:
    found = looked_up("one seed for two passes").found
    assert max(abs(found[blind].value) for blind in (MEAN, VARIANCE)) < 1e-13


# ---------------------------------------------------------------- many scenes


@every_one
def test_on_random_scenes_the_right_loop_is_exact_and_the_bug_shows_in_some(name) -> None:
    bug, biases = ALL[name], []
    for seed in range(4):
        scene = random_scene(bug.scene(), rng=np.random.default_rng(seed))
        assert right_bias(bug.right, seed, bug.scene.__name__) < 1e-12
        biases.append(abs(exact_bias(bug.wrong(scene), scene)).max())
    assert max(biases) > 0.01 if name in BUGS else max(biases) < 1e-12


def test_random_scenes_hold_what_bugs_need_to_show() -> None:
    scenes = [random_scene(reference_scene(), rng=np.random.default_rng(seed)).now.cells for seed in range(20)]
    for scene in scenes:
        assert len(np.unique(scene.v)) > 2
        assert (scene.shifts < 0).any()
    assert np.mean([((scene.p_hat == 0) & (scene.pdf[0] > 0)).any() for scene in scenes]) > 0.8
    assert np.mean([(scene.pdf[0] == 0).any() for scene in scenes]) > 0.7


# ---------------------------------------------------------------- one thing replaced

REBUILT = {"gris": gris, "gris, rated": rated(as_it_should_be), "gris, streaming": streaming(offer)}


@pytest.mark.parametrize("merge", REBUILT.values(), ids=REBUILT)
def test_rebuilt_passes_do_what_the_library_does_before_anything_is_broken(merge) -> None:
    scene = reference_scene()
    rebuilt, own = (statistics(parts(scene), scene) for parts in (merging(merge), Parts()))
    for name in ("first", "second", "least", "largest"):
        assert getattr(rebuilt, name) == pytest.approx(getattr(own, name), abs=1e-12), name


@every_one
def test_a_bug_differs_from_its_right_loop_in_few_parts(name) -> None:
    right, wrong = vars(ALL[name].right), vars(ALL[name].wrong)
    replaced = {part for part in right if right[part] is not wrong[part] and right[part] != wrong[part]}
    alike = [{"here", "near"}, {"along", "across"}, {"temporal", "spatial"}]
    alike += [{"along", "cap"}] * (wrong["cap"] == np.inf)  # whose weights cap what the pass does not
    assert len(replaced) == 1 or replaced in alike
