"""Every bug of the zoo is caught with its exact bias; the right loop beside it is exact."""

import numpy as np
import pytest

from restir_ref.oracle.zoo import BUGS, exact_bias

WORST = {
    "inverted Jacobian": (-0.75, 0.75),
    "1/M over unequal supports": (-0.5, 0),
    "rejection not mirrored": (-0.4, 4 / 7),
    "null confidence 0": (0, 0.5551),
    "neighbour chosen by sample value": (-0.0222, 0.2139),
    "cap only in the denominator": (0, 4 / 7),
}
"""Smallest and largest relative bias over all cells of the reference scene, enumerated."""

every_bug = pytest.mark.parametrize("bug", BUGS.values(), ids=BUGS)


@every_bug
def test_the_right_loop_is_exactly_unbiased(bug) -> None:
    scene = bug.scene()
    assert abs(exact_bias(bug.right(scene), scene)).max() < 1e-13


@every_bug
def test_the_bug_is_caught_with_its_exact_bias(bug) -> None:
    scene = bug.scene()
    bias = exact_bias(bug.wrong(scene), scene)
    assert (bias.min(), bias.max()) == pytest.approx(WORST[bug.name], abs=5e-5)
    assert abs(bias).max() > 0.01


@every_bug
def test_every_bug_says_how_it_gets_in_what_it_looks_like_and_what_it_breaks(bug) -> None:
    assert min(len(bug.story), len(bug.symptom)) > 10
    assert bug.breaks.startswith("[GRIS")


def test_an_estimate_with_f_equal_to_the_target_sees_no_selection_bug() -> None:
    """Why the law is per cell: sum w is right whatever was chosen."""
    bug = BUGS["neighbour chosen by sample value"]
    scene = bug.scene()
    bias = exact_bias(bug.wrong(scene), scene)
    assert np.abs((bias * scene.v).sum(axis=-1)).max() > 0
