"""Which bugs are like a table of biases, and which bugs have a table at all."""

from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from restir_ref.audit import likeness
from restir_ref.audit.estimator import TOLERANCE, facts_of
from restir_ref.audit.facts import Facts
from restir_ref.audit.known import digest, kept, known_signatures, needing_the_same
from restir_ref.audit.likeness import Signature, lookalikes, signatures
from restir_ref.batch import Array
from restir_ref.oracle.scenes import Parts, Scene, one_frame, reference_scene, three_pixel_scene, two_technique_scene
from restir_ref.oracle.zoo import BUGS, Bug
from restir_ref.oracle.zoo.candidates import changed

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


# ---------------------------------------------------------------- every bug in every loop


@cache
def scene_of(make: Callable[[], Scene]) -> Scene:
    return make()


@cache
def table(parts: Parts, make: Callable[[], Scene]) -> Array:
    """Bias per cell of a loop on a scene that ships, anew."""
    return likeness.table_of(parts, scene_of(make))


@cache
def kept_tables(make: Callable[[], Scene]) -> tuple[Signature, ...]:
    return tuple(known_signatures(scene_of(make), TOLERANCE))


def answers(bug: Bug, named: Callable[[Array], set[str]]) -> dict[str, str]:
    """What becomes of a bug in every loop: silent; not the only one; named exactly; named wrongly, or not at all."""
    found = {}
    for loop, right, wrong in likeness.loops(bug):
        bias = table(wrong, bug.scene)
        if abs(bias).max() <= TOLERANCE:
            found[loop] = "silent"
        elif abs(table(right, bug.scene)).max() > TOLERANCE:
            found[loop] = "not alone"
        else:
            names = named(bias)
            found[loop] = "named" if bug.name in names else "wrong" if names else "none"
    return found


def exactly(bug: Bug) -> Callable[[Array], set[str]]:
    return lambda bias: {each.bug for each in lookalikes(bias, kept_tables(bug.scene), TOLERANCE)}


@pytest.mark.parametrize("name", BUGS)
def test_every_bug_is_named_exactly_in_every_loop_that_shows_it(name) -> None:
    """By the tables that ship, held against the zoo as it is."""
    bug = BUGS[name]
    found = answers(bug, exactly(bug))
    assert found["its own loop"] == "named"
    assert set(found.values()) <= {"named", "silent", "not alone"}, found
    assert [loop for loop, said in found.items() if said == "not alone"] in ([], ["one frame, constant weights"])


@pytest.mark.parametrize("name", BUGS)
def test_who_is_named_beside_it_has_the_same_table(name) -> None:
    """None wrongly: a name is given where the bug of that name, put into that loop, cannot be told apart."""
    bug = BUGS[name]
    bias = table(bug.wrong, bug.scene)
    for each in lookalikes(bias, kept_tables(bug.scene), TOLERANCE):
        loops = {loop: wrong for loop, _, wrong in likeness.loops(BUGS[each.bug])}
        np.testing.assert_allclose(table(loops[each.loop], bug.scene), bias, atol=1e-9)


def test_a_zoo_that_has_changed_since_is_noticed() -> None:
    """Twin: W clamped elsewhere is not named by the tables that ship."""
    bug = BUGS["everything faded"]
    other = replace(bug, wrong=replace(bug.wrong, draw=changed(lambda W, x, coin: 0.8 * W)))
    assert answers(other, exactly(bug))["its own loop"] == "none"


def test_bugs_show_in_many_loops_so_that_there_is_something_to_be_named() -> None:
    said = Counter(said for bug in BUGS.values() for said in answers(bug, exactly(bug)).values())
    assert said["named"] > 6 * len(BUGS)


@pytest.mark.parametrize("make", SCENES, ids=lambda make: make.__name__)
def test_every_scene_that_ships_has_kept_tables(make) -> None:
    assert digest(scene_of(make)) in kept()["tables"]
    assert len({each.bug for each in kept_tables(make)}) > 30


def test_other_scenes_are_told_apart() -> None:
    assert len({digest(make()) for make in SCENES}) == 3
    assert digest(reference_scene()) == digest(reference_scene())


def facts(bug: Bug, scene: Scene) -> Facts:
    return facts_of(replace(bug.wrong, steps=one_frame)(scene), scene, 100_000)


@pytest.mark.parametrize("name", [*BUGS][::4])
def test_a_bug_is_among_those_that_need_what_it_needs(name) -> None:
    """On its own scene; in every loop, on other scenes, by `benchmarks/audit_rates.py matrix`."""
    found = facts(BUGS[name], BUGS[name].scene())
    assert abs(found.bias).max() <= TOLERANCE or name in needing_the_same(found)


def test_a_need_that_no_bug_has_names_none() -> None:
    found = facts(BUGS["W clamped"], reference_scene())
    assert needing_the_same(found) == ("W clamped",)
    assert needing_the_same(replace(found, gone=("lit", "small W"))) == ()
