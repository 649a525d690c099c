"""Laws of the criteria: each can pass, each can fail, and nothing passes that is not a number."""

import math

import numpy as np
import pytest
from scipy.special import ndtr, stdtr

from figures.claims import criteria
from figures.claims.criteria import Outcome

N = 2.0 ** np.arange(9)
REPLICATES = 1.0 + 1e-3 * np.random.default_rng(1).standard_normal(64)
NOISE = np.random.default_rng(2).standard_normal(64)
BLOCKS = np.arange(1.0, 10.0) * (1 + 1e-3 * np.random.default_rng(3).standard_normal((64, 9)))
TRUTHS = np.arange(1.0, 10.0)

PASS = {
    "within": criteria.within(-1.05, -1, 0.1),
    "between": criteria.between(2, 1, 3),
    "below": criteria.below(0.9, 1),
    "above": criteria.above(1.1, 1),
    "equal": criteria.equal_to(1 + 1e-13, 1),
    "equal arrays": criteria.equal_to([1e6, 1e-7], [1e6, 0]),
    "slope": criteria.slope_within(N, 3 / N, -1, 1e-9),
    "unbiased": criteria.unbiased(REPLICATES, 1.0),
    "all unbiased": criteria.all_unbiased(BLOCKS, TRUTHS),
    "all unbiased, one of them exact": criteria.all_unbiased(BLOCKS * [0, *[1] * 8], TRUTHS * [0, *[1] * 8]),
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
    "all unbiased but one": criteria.all_unbiased(BLOCKS, TRUTHS * [*[1] * 8, 1.001]),
    "all unbiased but one too noisy": criteria.all_unbiased(BLOCKS + np.outer(NOISE, [*[0] * 8, 1]), TRUTHS),
    "all unbiased but light where none is": criteria.all_unbiased(BLOCKS, TRUTHS * [0, *[1] * 8]),
    "all unbiased of too few replicates": criteria.all_unbiased(BLOCKS[:63], TRUTHS),
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
    "all unbiased": criteria.all_unbiased(BLOCKS * [1, np.nan, *[1] * 7], TRUTHS),
    "biased": criteria.biased(np.full(64, np.nan), 1.0, -9, 9),
    "ratio below": criteria.ratio_below(np.full(9, np.nan), np.ones(9), 9),
    "ratio above": criteria.ratio_above(np.zeros(9), np.append(np.zeros(8), np.nan), -9),
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


# ---------------------------------------------------------------- families of checks

FAMILIES = {"an image and its blocks": 9, "a hundred checks": 100}


@pytest.mark.claims("COM-M07")
@pytest.mark.parametrize("replicates", [8, 64, 1000])
@pytest.mark.parametrize("checks", [1, 9, 10_000])
def test_a_family_s_limit_is_passed_as_rarely_as_that_of_one_check(checks, replicates):
    one = 2 * ndtr(-4)
    tail = 2 * stdtr(replicates - 1, -criteria.sidak(checks, replicates))
    assert 1 - (1 - tail) ** checks == pytest.approx(one, rel=1e-6)
    tail = 2 * ndtr(-criteria.sidak(checks))
    assert 1 - (1 - tail) ** checks == pytest.approx(one, rel=1e-6)
    assert criteria.sidak(1) == pytest.approx(4, rel=1e-12)


def synthetic(K, families, bias=0.0):
    """Estimates (64, K) of 1 .. 2 with a standard error of .2 %, the last column biased; one family after another."""
    rng, truth = np.random.default_rng(7), np.linspace(1, 2, K)
    factor = 1 + bias * (np.arange(K) == K - 1)
    for _ in range(families):
        yield truth * (factor + 0.016 * rng.standard_normal((64, K))), truth


@pytest.mark.claims("COM-M07")
@pytest.mark.parametrize("K", FAMILIES.values(), ids=FAMILIES)
def test_families_of_sound_estimates_raise_fewer_false_alarms_than_one_in_a_thousand(K):
    passed = [criteria.all_unbiased(*each).passed for each in synthetic(K, 2000)]
    assert len(passed) - sum(passed) <= 0.001 * len(passed)


@pytest.mark.claims("COM-M07")
def test_without_a_correction_a_hundred_checks_raise_more():
    passed = [
        criteria.all_of(*(criteria.unbiased(e, r) for e, r in zip(estimates.T, truth, strict=True))).passed
        for estimates, truth in synthetic(100, 300)
    ]
    assert len(passed) - sum(passed) > 0.005 * len(passed)


@pytest.mark.claims("COM-M07")
@pytest.mark.parametrize("K", FAMILIES.values(), ids=FAMILIES)
def test_a_bias_of_two_per_cent_in_one_check_always_fails_its_family(K):
    assert not any(criteria.all_unbiased(*each).passed for each in synthetic(K, 300, bias=0.02))


def noisy(share, seed):
    """Paired squared errors (64,) of two methods in the proportion `share` on the average, each a mean of several."""
    rng = np.random.default_rng(seed)
    scene = rng.gamma(4, 1 / 4, 64)
    return share * scene * rng.gamma(25, 1 / 25, 64), scene


@pytest.mark.claims("COM-M07")
def test_a_ratio_s_interval_holds_the_truth_nineteen_times_in_twenty():
    intervals = [criteria.ratio_interval(*noisy(0.5, seed)) for seed in range(300)]
    assert 0.92 <= np.mean([low <= 0.5 <= high for low, high, _ in intervals]) <= 0.97


@pytest.mark.claims("COM-M07")
def test_ratios_and_slopes_well_inside_their_limits_always_pass_and_beyond_never():
    for seed in range(100):
        assert criteria.ratio_below(*noisy(0.7, seed), 0.85).passed
        assert not criteria.ratio_below(*noisy(0.87, seed), 0.75).passed
        measured = (1 + 0.05 * np.random.default_rng(seed).standard_normal(9)) / N
        assert criteria.slope_within(N, measured, -1, 0.1).passed
        assert not criteria.slope_within(N, measured, -0.8, 0.1).passed


def test_several_families_share_one_limit():
    assert f"{criteria.sidak(9 * 14, 64):.3g} SE" in criteria.all_unbiased(BLOCKS, TRUTHS, families=14).criterion


def test_the_worst_of_a_family_is_named():
    assert "worst of 9, number 8" in criteria.all_unbiased(BLOCKS, TRUTHS * [*[1] * 8, 1.01]).measured


@pytest.mark.parametrize(("shape", "truths"), [((64,), 1), ((64, 9), 8), ((1, 9), 9), ((64, 0), 0)])
def test_a_family_of_the_wrong_shape_is_refused(shape, truths):
    with pytest.raises(ValueError, match=r"needs estimates \(R, K\), R > 1, and references \(K,\)"):
        criteria.all_unbiased(np.ones(shape), np.ones(truths))


def test_an_image_and_its_blocks_are_means_of_neighbouring_pixels():
    image = np.arange(16.0)
    assert criteria.mean_and_blocks(image).tolist() == [7.5, 0.5, 2.5, 4.5, 6.5, 8.5, 10.5, 12.5, 14.5]
    assert criteria.mean_and_blocks([image, 2 * image], 2).tolist() == [[7.5, 3.5, 11.5], [15, 7, 23]]
    with pytest.raises(ValueError, match="17 blocks need as many pixels, but the image has 16"):
        criteria.mean_and_blocks(image, 17)


def test_a_ratio_lies_within_bounds_only_with_its_whole_interval():
    rng = np.random.default_rng(1)
    others = rng.normal(1, 0.1, 400)
    equal = others + rng.normal(0, 0.1, 400)
    assert criteria.ratio_within(equal, others, 0.9, 1.1).passed
    assert not criteria.ratio_within(1.08 * equal, others, 0.92, 1.08).passed
    assert not criteria.ratio_within(equal[:8] * np.array([9, 0, 0, 0, 0, 0, 0, 0]), others[:8], 0.9, 1.1).passed
