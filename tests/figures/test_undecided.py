"""Laws of an interval against a limit: all below passes, all above fails, astride is undecided, whichever way."""

import numpy as np
import pytest

from figures.claims import criteria
from figures.claims.figure import Claim, verdict_of
from figures.experiments.replicas import ENOUGH, Window, compared, inside, over, placed, smaller, under
from figures.experiments.scenewise import CONTRARY, MET, UNDECIDED, standing

STANDS = {"reproduced": MET, "not reproduced": CONTRARY, "not judged": UNDECIDED}


def place(low: float, high: float, window: Window) -> str:
    return verdict_of(placed("A-1", (low, high, "found"), window, "part"))


CASES = [
    (under(1), (0.5, 0.9), "reproduced"),
    (under(1), (0.5, 1.1), "not judged"),
    (under(1), (1.0, 1.1), "not reproduced"),
    (over(1), (1.1, 2.0), "reproduced"),
    (over(1), (0.9, 2.0), "not judged"),
    (over(1), (0.5, 1.0), "not reproduced"),
    (inside(0.9, 1.1), (0.95, 1.05), "reproduced"),
    (inside(0.9, 1.1), (0.85, 1.05), "not judged"),
    (inside(0.9, 1.1), (1.05, 1.15), "not judged"),
    (inside(0.9, 1.1), (0.5, 2.0), "not judged"),
    (inside(0.9, 1.1), (0.5, 0.9), "not reproduced"),
    (inside(0.9, 1.1), (1.1, 2.0), "not reproduced"),
]


@pytest.mark.parametrize(("window", "ends", "verdict"), CASES)
def test_an_interval_passes_inside_fails_outside_and_is_undecided_astride(window, ends, verdict):
    assert place(*ends, window) == verdict


@pytest.mark.parametrize("window", [under(1), over(1), inside(0.9, 1.1)])
def test_no_number_is_a_failure_and_not_undecided(window):
    assert place(np.nan, np.nan, window) == "not reproduced"


def test_what_is_undecided_tells_what_was_measured_against_what():
    claim = placed("A-1", (0.5, 1.5, "1 (95% 0.5 to 1.5)"), under(1), "part")
    assert claim.reason == "Undecided: measured 1 (95% 0.5 to 1.5), asked ratio < 1 at 95%; more replicas would tell."


# ---------------------------------------------------------------- against the criteria with two answers


def arms(shift: float, noise: float, R: int = ENOUGH) -> tuple[np.ndarray, np.ndarray]:
    """Errors of two arms (R,) whose means are about `shift` and 1."""
    rng = np.random.default_rng(1)
    return shift * (1 + noise * rng.random(R)), 1 + noise * rng.random(R)


SHIFTS = [0.5, 0.9, 0.97, 1.0, 1.03, 1.1, 2.0]


@pytest.mark.parametrize("noise", [0.1, 3.0])
@pytest.mark.parametrize("shift", SHIFTS)
def test_nothing_passes_that_did_not_and_the_rest_fails_or_is_undecided(shift, noise):
    pair = arms(shift, noise)
    for window, before in (
        (under(1), criteria.ratio_below(*pair, 1)),
        (over(1), criteria.ratio_above(*pair, 1)),
        (inside(0.9, 1.1), criteria.ratio_within(*pair, 0.9, 1.1)),
    ):
        claim = compared("A-1", pair, window, "part")
        passed = claim.outcome is not None and claim.outcome.passed
        assert passed is before.passed
        assert window.rule == before.criterion


def test_all_three_answers_occur_above():
    found = {verdict_of(compared("A-1", arms(shift, 0.1), under(1), "part")) for shift in SHIFTS}
    assert found == set(STANDS)


@pytest.mark.parametrize("shift", SHIFTS)
def test_one_comparison_is_judged_as_a_scene_among_several_is(shift):
    pair = arms(shift, 1.0)
    verdict = verdict_of(smaller("A-1", pair, 1, "part"))
    assert STANDS[verdict.replace("refuted", "not reproduced")] == standing([(pair, 1)])


# ---------------------------------------------------------------- smaller


def test_a_smaller_one_keeps_its_caveat_a_larger_one_its_counter_and_an_undecided_one_neither():
    less, more, open_ = (smaller("A-1", arms(shift, 0.1), 1, "part", "so far") for shift in (0.5, 2.0, 1.0))
    assert verdict_of(less) == "reproduced with caveat"
    assert verdict_of(more) == "refuted"
    assert (open_.outcome, open_.counter, open_.caveat) == (None, None, "")


def test_too_few_replicas_are_no_matter_of_intervals():
    claim = smaller("A-1", arms(0.5, 0.1, ENOUGH - 1), 1, "part")
    assert "cannot tell" in claim.reason
    assert "Undecided" not in claim.reason


def old(pair: tuple[np.ndarray, np.ndarray]) -> Claim:
    """The rule of two answers: what is not below the limit has failed."""
    return Claim("A-1", criteria.ratio_below(*pair, 1))


def test_a_rule_of_two_answers_calls_a_failure_what_is_undecided():
    assert verdict_of(old(arms(1.0, 0.1))) == "not reproduced"
    assert verdict_of(smaller("A-1", arms(1.0, 0.1), 1, "part")) == "not judged"
