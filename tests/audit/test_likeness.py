"""Which bugs are like a table of biases, and which bugs have a table at all."""

from dataclasses import replace

import numpy as np
import pytest

from restir_ref.audit import likeness
from restir_ref.audit.estimator import TOLERANCE
from restir_ref.audit.likeness import Signature, lookalikes, signatures
from restir_ref.oracle.scenes import reference_scene
from restir_ref.oracle.zoo import BUGS

BIAS = np.array([[0.3, 0.0]])


def at(cosine: float) -> Signature:
    """A table of biases at an angle to BIAS."""
    return Signature(str(cosine), "", 7 * np.array([[cosine, np.sqrt(1 - cosine**2)]]))


@pytest.mark.parametrize(("cosine", "count"), [(0.91, 1), (0.89, 0), (-1.0, 0)])
def test_a_bug_is_like_another_from_nine_tenths_on(cosine, count) -> None:
    assert len(lookalikes(BIAS, [at(cosine)], TOLERANCE)) == count


def test_the_three_most_similar_bugs_are_named_in_order() -> None:
    found = lookalikes(BIAS, [at(c) for c in (0.93, 0.99, 0.91, 0.97, 0.95)], TOLERANCE)
    assert [each.bug for each in found] == ["0.99", "0.97", "0.95"]
    assert [each.likeness for each in found] == pytest.approx([0.99, 0.97, 0.95])


def test_beside_the_same_table_similar_ones_are_not_named() -> None:
    found = lookalikes(BIAS, [at(0.99), Signature("same", "", BIAS)], TOLERANCE)
    assert [(each.bug, each.same) for each in found] == [("same", True)]


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
    (found,) = likeness.lookalikes(bias, [likeness.Signature("a bug", "a loop", bias)], 0.0)
    assert found.same
    assert not likeness.lookalikes(bias, [likeness.Signature("a bug", "a loop", 1.1 * bias)], 0.0)[0].same
