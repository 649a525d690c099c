"""Which bugs are like a table of biases, and which bugs have a table at all."""

from dataclasses import replace

import numpy as np
import pytest

from restir_ref.audit import likeness
from restir_ref.audit.estimator import TOLERANCE, facts_of
from restir_ref.audit.facts import Facts
from restir_ref.audit.known import digest, known_signatures, needing_the_same
from restir_ref.audit.likeness import Signature, lookalikes, signatures
from restir_ref.oracle.scenes import Scene, one_frame, reference_scene, three_pixel_scene, two_technique_scene
from restir_ref.oracle.zoo import BUGS, Bug

BIAS = np.array([[0.3, 0.0]])


def test_a_bug_is_named_for_exactly_the_same_table_and_for_no_other() -> None:
    near = [Signature("twice", "", 2 * BIAS), Signature("almost", "", BIAS + 1e-6), Signature("same", "own", BIAS)]
    assert [(each.bug, each.loop) for each in lookalikes(BIAS, near, TOLERANCE)] == [("same", "own")]
    assert lookalikes(BIAS, near[:2], TOLERANCE) == ()


def test_a_bug_is_named_once_with_its_first_loop() -> None:
    twice = [Signature("same", "own", BIAS), Signature("same", "one frame", BIAS)]
    assert [each.loop for each in lookalikes(BIAS, twice, TOLERANCE)] == ["own"]


ONE_OVER_M = BUGS["1/M over unequal supports"]
TWICE = {
    "the bug": (ONE_OVER_M, True),
    "no bug": (replace(ONE_OVER_M, wrong=ONE_OVER_M.right), False),
    "biased without the bug": (replace(ONE_OVER_M, right=ONE_OVER_M.wrong), False),
}


@pytest.mark.parametrize("name", TWICE)
def test_a_bug_has_a_table_in_loops_that_are_biased_by_nothing_else(name, monkeypatch) -> None:
    bug, shown = TWICE[name]
    monkeypatch.setattr(likeness, "BUGS", {bug.name: bug})
    found = list(signatures(reference_scene(), TOLERANCE))
    assert bool(found) == shown
    assert all(abs(each.bias).max() > TOLERANCE for each in found)


def test_a_table_of_just_this_bias_is_the_same_at_tolerance_zero() -> None:
    bias = np.array([[0.5, -0.25]])
    assert lookalikes(bias, [Signature("a bug", "a loop", bias)], 0.0)
    assert not lookalikes(bias, [Signature("a bug", "a loop", 1.1 * bias)], 0.0)


SCENES = (reference_scene, three_pixel_scene, two_technique_scene)


@pytest.mark.parametrize("make", SCENES, ids=lambda make: make.__name__)
def test_the_kept_tables_are_those_of_the_zoo(make) -> None:
    """Every bug's own loop and one frame, anew; the others are made by the same lines."""
    scene = make()
    tables = {(each.bug, each.loop): each.bias for each in known_signatures(scene, TOLERANCE)}
    assert tables
    for name in [*BUGS][::5]:
        for loop, right, wrong in [*likeness.loops(BUGS[name])][1:3]:
            bias = likeness._table(wrong, scene)
            shown = abs(likeness._table(right, scene)).max() <= TOLERANCE < abs(bias).max()
            assert ((name, loop) in tables) == shown, (name, loop)
            if shown:
                np.testing.assert_allclose(tables[name, loop], bias, atol=1e-12)


def test_other_scenes_are_told_apart() -> None:
    assert len({digest(make()) for make in SCENES}) == 3
    assert digest(reference_scene()) == digest(reference_scene())


def facts(bug: Bug, scene: Scene) -> Facts:
    return facts_of(replace(bug.wrong, steps=one_frame)(scene), scene, 100_000)


@pytest.mark.parametrize("name", [*BUGS][::4])
def test_a_bug_is_among_those_that_need_what_it_needs(name) -> None:
    found = facts(BUGS[name], BUGS[name].scene())
    assert abs(found.bias).max() <= TOLERANCE or name in needing_the_same(found)


def test_a_need_that_no_bug_has_names_none() -> None:
    found = facts(BUGS["W clamped"], reference_scene())
    assert needing_the_same(found) == ("W clamped",)
    assert needing_the_same(replace(found, gone=("lit", "small W"))) == ()
