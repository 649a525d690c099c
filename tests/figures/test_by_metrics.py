"""Laws of images compared by two metrics: what each of them measures, and what both of them have to say."""

import numpy as np
import pytest

from figures.experiments import by_metrics
from figures.experiments.by_metrics import METRICS, MSE, RELATIVE, bands, best, off, units
from figures.experiments.scenewise import CONTRARY, MET, UNDECIDED
from restir_ref.metrics import MAP, rel_mse
from restir_ref.poisson import ALPHA

RIGHT = np.linspace(0, 3, 64).reshape(8, 8)
IMAGES = RIGHT + np.random.default_rng(1).normal(size=(16, 8, 8))


def test_in_total_the_metrics_are_the_mean_squared_error_and_the_relative_one():
    found = bands(IMAGES - RIGHT, RIGHT, ALPHA)["total"]
    assert found[MSE] == pytest.approx(((IMAGES - RIGHT) ** 2).mean(axis=MAP))
    assert found[RELATIVE] == pytest.approx(rel_mse(IMAGES, RIGHT, MAP))


def test_above_alpha_the_relative_error_is_that_of_the_image_of_relative_errors():
    """One wave: its power is in the high band alone, and dividing a constant reference out scales it."""
    wave, two = np.cos(np.pi * np.arange(8)) * np.ones((1, 8, 8)), np.full((8, 8), 2.0)
    found = bands(wave, two, ALPHA)
    assert found["low"][MSE] == pytest.approx(0, abs=1e-12)
    assert found["high"][MSE] == pytest.approx(64 / 63)  # all frequencies but the mean share it
    assert found["high"][RELATIVE] == pytest.approx(found["high"][MSE] / (4 * 1.0001))
    assert bands(wave, RIGHT, ALPHA)["low"][RELATIVE] > 1e-4  # what varies is not divided out of a frequency


def test_dark_pixels_are_measured_by_a_hundredth_of_the_mean():
    unit = units(RIGHT)
    assert (unit[MSE] == 1).all()
    assert unit[RELATIVE][0, 0] == pytest.approx(0.01 * RIGHT.mean())


@pytest.mark.parametrize(("cost", "biased"), [(1.0, 0.0), (3.0, 0.0), (3.0, 1.0)])
def test_errors_are_variance_at_its_cost_and_the_bias_of_what_has_one(cost, biased):
    found = (off(IMAGES, RIGHT, cost, biased) ** 2).mean(axis=0)
    bias = IMAGES.mean(axis=0) - RIGHT
    assert found == pytest.approx(cost * IMAGES.var(axis=0, ddof=1) + biased * bias**2)


def test_the_best_image_is_chosen_by_every_metric_for_itself_and_by_the_total():
    one, two = ({band: {m: np.full(4, value[m]) for m in METRICS} for band, value in each.items()} for each in POWERS)
    found = best([one, two])
    assert found["total"][MSE][0] == 1
    assert found["high"][MSE][0] == 9  # of the image that is best in total, though another one is better here
    assert found["total"][RELATIVE][0] == 2


POWERS = (
    {"total": {MSE: 1.0, RELATIVE: 5.0}, "high": {MSE: 9.0, RELATIVE: 5.0}},
    {"total": {MSE: 4.0, RELATIVE: 2.0}, "high": {MSE: 3.0, RELATIVE: 2.0}},
)


# ---------------------------------------------------------------- what both say

SWING = np.tile([-1.0, 1.0], 32)
KINDS = {"m": (0.5, 0.0), "x": (1.1, 0.0), "?": (0.79, 2.0)}
"""Ratios and their noise where a limit of .8 or 1 is met, where it is missed, and where nobody can say."""


def pair(kind, replicas=64):
    """Errors of ours and of the other's, whose ratio is of this kind."""
    middle, noise = KINDS[kind]
    return middle * (1 + noise * SWING)[:replicas], (np.ones(64) * (1 + 1e-9 * SWING))[:replicas]


def compared(kinds, replicas=64):
    """By metric: a letter each."""
    return {metric: pair(kind, replicas) for metric, kind in zip(METRICS, kinds, strict=True)}


def passed(claim):
    return claim.outcome.passed if claim.outcome else None


EITHER = [("mm", True), ("xx", False), ("mx", None), ("xm", None), ("m?", None), ("?x", None), ("??", None)]


@pytest.mark.parametrize(("kinds", "answer"), EITHER)
def test_one_comparison_holds_by_both_metrics_or_fails_by_both_or_is_open(kinds, answer):
    claim = by_metrics.smaller("GPT-F01", compared(kinds), 0.8, "part", "caveat")
    assert passed(claim) is answer
    assert all(metric in (claim.outcome.measured if claim.outcome else claim.reason) for metric in METRICS)
    assert claim.counter is None or claim.counter.passed is (kinds == "xx")


def test_what_differs_says_which_metric_says_what():
    claim = by_metrics.smaller("GPT-F01", compared("mx"), 0.8, "part")
    assert "MSE 0.5 " in claim.reason
    assert "relMSE 1.1 " in claim.reason


def scenes(by_scene, replicas=64):
    """Scenes of two letters each."""
    return {name: compared(kinds, replicas) for name, kinds in zip("abc", by_scene, strict=True)}


@pytest.mark.parametrize(
    ("by_scene", "answer"),
    [
        (("mm", "mm", "xx"), True),
        (("xx", "xx", "mm"), False),
        (("mm", "mx", "xm"), None),  # two of three by either metric, but not the same two
        (("xx", "mx", "xm"), None),
        (("mm", "mm", "mx"), True),
        (("xx", "xx", "xm"), False),
        (("mx", "mx", "mx"), None),  # all by one metric, none by the other
        (("xm", "xm", "xm"), None),
        (("mm", "m?", "x?"), None),
        (("xx", "x?", "m?"), None),
        (("??", "??", "??"), None),
    ],
)
def test_enough_scenes_hold_by_both_metrics_or_too_many_fail_by_both(by_scene, answer):
    claim = by_metrics.in_enough("GPT-F08", scenes(by_scene), (0.8, 2), "part", "why")
    assert passed(claim) is answer
    assert "why" in claim.reason


SAYS = {"MSE": "met: a, c; contrary: b", "relMSE": "met: b; contrary: a; undecided: c"}


def test_scenes_are_named_metric_by_metric():
    claim = by_metrics.in_enough("GPT-F08", scenes(("mx", "xm", "m?")), (0.8, 2), "part", "")
    assert all(f"{metric}: {said}" in claim.reason for metric, said in SAYS.items())


@pytest.mark.parametrize(
    ("by_scene", "answer"),
    [
        (("mm", "mm", "xx"), True),
        (("mm", "xx", "??"), True),  # half of those that are decided
        (("mm", "??", "??"), True),
        (("xx", "??", "??"), False),  # and its mirror
        (("xx", "xx", "mm"), False),
        (("mx", "mx", "xx"), None),
        (("xm", "xm", "??"), None),
        (("??", "??", "??"), None),
        (("m?", "??", "??"), None),
    ],
)
def test_often_is_in_half_of_the_cases_that_are_decided_by_both_metrics(by_scene, answer):
    claim = by_metrics.often("GPT-C03", scenes(by_scene), "part")
    assert passed(claim) is answer
    assert by_metrics.OFTEN in claim.reason


def test_few_replicas_decide_nothing():
    short = compared("mm", 32)
    for claim in (
        by_metrics.told("GPT-F08", short, "part"),
        by_metrics.smaller("GPT-F08", short, 0.8, "part"),
        by_metrics.in_enough("GPT-F08", {"a": compared("mm"), "b": short}, (0.8, 1), "part", ""),
        by_metrics.often("GPT-C03", {"a": compared("mm"), "b": short}, "part"),
    ):
        assert claim.outcome is None
        assert "32 replicas" in claim.reason


def test_too_many_contrary_scenes_cannot_be_enough_any_more():
    sorted_ = {MET: ["a"], CONTRARY: ["b"], UNDECIDED: ["c"]}
    assert [by_metrics.answer(sorted_, least) for least in (1, 2, 3)] == [True, None, False]
