"""Laws of the criteria: each can pass, each can fail, and nothing passes that is not a number."""

import math

import numpy as np
import pytest

from figures import criteria
from figures.criteria import Outcome

N = 2.0 ** np.arange(9)
REPLICATES = 1.0 + 1e-3 * np.random.default_rng(1).standard_normal(64)
NOISE = np.random.default_rng(2).standard_normal(64)

PASS = {
    "within": criteria.within(-1.05, -1, 0.1),
    "between": criteria.between(2, 1, 3),
    "below": criteria.below(0.9, 1),
    "above": criteria.above(1.1, 1),
    "equal": criteria.equal_to(1 + 1e-13, 1),
    "equal arrays": criteria.equal_to([1e6, 1e-7], [1e6, 0]),
    "slope": criteria.slope_within(N, 3 / N, -1, 1e-9),
    "unbiased": criteria.unbiased(REPLICATES, 1.0),
    "biased": criteria.biased(REPLICATES, 0.9, 0.1, 0.2),
    "ratio below": criteria.ratio_below(REPLICATES, 2 * REPLICATES, 0.6),
    "ratio above": criteria.ratio_above(REPLICATES, 2 * REPLICATES, 0.4),
    "all": criteria.all_of(criteria.below(0, 1), criteria.above(2, 1)),
}
FAIL = {
    "within": criteria.within(-1.2, -1, 0.1),
    "between": criteria.between(4, 1, 3),
    "below, at the limit": criteria.below(1, 1),
    "above, at the limit": criteria.above(1, 1),
    "equal": criteria.equal_to(1 + 1e-11, 1),
    "equal, another shape": criteria.equal_to([1.0, 1.0], 1.0),
    "equal bits": criteria.equal_to(1 + 1e-15, 1, tol=0),
    "slope": criteria.slope_within(N, 3 / N**2, -1, 0.1),
    "slope of too few points": criteria.slope_within(N[:5], 3 / N[:5], -1, 0.1),
    "slope over too few decades": criteria.slope_within(N[:6], 3 / N[:6], -1, 0.1),
    "slope of negative values": criteria.slope_within(N, -3 / N, -1, 0.1),
    "unbiased but wrong": criteria.unbiased(REPLICATES, 1.01),
    "unbiased but too noisy to decide": criteria.unbiased(1 + NOISE, 1.0),
    "unbiased of too few replicates": criteria.unbiased(REPLICATES[:63], 1.0),
    "biased but right": criteria.biased(REPLICATES, 1.0, -1, 1),
    "biased by too much": criteria.biased(REPLICATES, 0.5, 0.1, 0.2),
    "ratio below, barely": criteria.ratio_below(2 + NOISE, np.full(64, 2.0), 1.0),
    "ratio above, barely": criteria.ratio_above(2 + NOISE, np.full(64, 2.0), 1.0),
    "all": criteria.all_of(criteria.below(0, 1), criteria.above(0, 1)),
}
NAN = {
    "within": criteria.within(math.nan, 0, 1),
    "between": criteria.between(math.nan, 0, 1),
    "below": criteria.below(math.nan, 1),
    "above": criteria.above(math.nan, 1),
    "equal": criteria.equal_to(math.nan, math.nan),
    "slope": criteria.slope_within(N, np.full(9, np.nan), -1, 9),
    "unbiased": criteria.unbiased(np.full(64, np.nan), 1.0),
    "biased": criteria.biased(np.full(64, np.nan), 1.0, -9, 9),
    "ratio below": criteria.ratio_below(np.full(9, np.nan), np.ones(9), 9),
    "ratio above": criteria.ratio_above(np.zeros(9), np.zeros(9), -9),
}


@pytest.mark.parametrize("outcome", PASS.values(), ids=PASS)
def test_a_criterion_can_pass(outcome):
    assert outcome.passed is True


@pytest.mark.parametrize("outcome", FAIL.values(), ids=FAIL)
def test_a_criterion_can_fail(outcome):
    assert outcome.passed is False


@pytest.mark.parametrize("outcome", NAN.values(), ids=NAN)
def test_what_is_not_a_number_never_passes(outcome):
    assert outcome.passed is False


@pytest.mark.parametrize("outcome", [*PASS.values(), *FAIL.values(), *NAN.values()])
def test_an_outcome_is_plain_data_with_a_rule_in_words(outcome):
    assert type(outcome.measured) in (float, str)
    assert outcome.criterion


def test_the_slope_of_a_power_law_is_its_exponent():
    assert criteria.slope(N, 7 * N**-1.5) == pytest.approx(-1.5)


def test_the_bootstrap_throws_the_same_dice_every_time():
    assert criteria.ratio_interval(1 + 0.1 * NOISE, REPLICATES) == criteria.ratio_interval(1 + 0.1 * NOISE, REPLICATES)


@pytest.mark.parametrize(("a", "b"), [([1.0] * 7, [1.0] * 7), ([1.0] * 8, [1.0] * 9)])
def test_a_ratio_of_unpaired_or_few_replicates_is_refused(a, b):
    with pytest.raises(ValueError, match="paired replicates"):
        criteria.ratio_below(a, b, 1)


def test_measured_values_are_shown_short():
    assert criteria.show(Outcome(1 / 3, "", passed=True).measured) == "0.3333"
