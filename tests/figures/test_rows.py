"""The rows of GPT-F07-ROWS: which frames its cameras see, what is compared, and when three of four rows decide."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from figures.claims.criteria import ratio_interval
from figures.experiments.following import gathered
from figures.experiments.realtime import MARGIN, STEP, widened
from figures.experiments.scenewise import CONTRARY, MET, UNDECIDED, in_enough, standing
from figures.gradient import gpt_f07_rows as rows
from restir_ref.area import MOVED
from restir_ref.gathering import gathering
from restir_ref.gradient_loop import GRADIENT, PRIMAL
from restir_ref.squares import keeping


@pytest.fixture(scope="module")
def views():
    return rows.moved("cornell", Counter(), 3)


def test_a_moving_camera_sees_fractions_of_pixels_and_one_at_rest_none(views):
    moved = np.concatenate([view[PRIMAL].by[np.isfinite(view[PRIMAL].by)] for view in views[1:]])
    assert (abs(moved - np.round(moved)) > 0.01).any()
    for view in rows.standing("cornell", Counter(), 3):
        assert all((group.by == 0).all() for group in view.values())


def test_a_camera_at_rest_sees_the_inset_of_the_moving_one_in_all_frames(views):
    standing, usual = rows.standing("cornell", Counter(), 15), widened("cornell")[-1]
    assert len(standing) == 15
    assert {view[PRIMAL].of[PRIMAL].tracer.sensor for view in standing} == {usual}
    assert views[-1][PRIMAL].of[PRIMAL].tracer.sensor == replace(usual, n=usual.n + MARGIN)


def test_who_is_judged_lasts_three_caps_of_pixels_and_of_pairs():
    asked = rows.FIGURE.presets["paper"]["frames"]
    assert asked[rows.REST] == asked[rows.KEPT] == 3 * GRADIENT.pixels.cap == 3 * GRADIENT.pairs.cap


def capped_average(frames, cap):
    """Variance of the mean of so many equal frames, where a history counts as `cap` of them at most."""
    variance = 1.0
    for k in range(1, frames):
        history = min(k, cap)
        variance = (history**2 * variance + 1) / (history + 1) ** 2
    return variance


@pytest.mark.parametrize(("frames", "above"), [(10, 4.1), (20, 2.05), (60, 1.02)])
def test_three_caps_of_frames_end_near_the_least_variance_and_half_a_cap_does_not(frames, above):
    """That is 1 / (2 cap + 1) of one frame's."""
    assert capped_average(frames, 20) == pytest.approx(above / 41, rel=0.01)


@pytest.mark.parametrize("scene", rows.SCENES)
def test_a_longer_motion_ends_as_the_usual_one_at_the_same_pace(scene):
    longer, usual = rows.approach(scene, 60), widened(scene)
    for mine, theirs in zip(longer[-len(usual) :], usual, strict=True):
        assert (mine.eye, mine.towards, mine.first) == (theirs.eye, theirs.towards, theirs.first)
    paces = np.linalg.norm(np.diff([each.eye for each in longer], axis=0), axis=1)
    assert paces == pytest.approx(STEP, rel=1e-9)


def test_new_things_enter_on_the_wide_side(views):
    for view in views[1:]:
        assert (view[PRIMAL].by > 0).all()  # all was further to the right before, where the row is wider
    n = views[-1][PRIMAL].n
    assert rows.inset("cornell", np.arange(n - 1)).tolist() == list(range(MARGIN, n - 1 - rows.ENTERING))


def test_history_is_kept_in_place_or_moved_or_gathers(views):
    assert {group.follow for view in rows.kept("cornell", Counter(), 3) for group in view.values()} == {keeping}
    assert {group.follow for view in views for group in view.values()} == {MOVED}
    assert {group.follow for view in views for group in gathered(view).values()} == {gathering}


def test_errors_are_variances_times_the_rays_of_all_images_that_are_averaged():
    dx = np.repeat([[1.0], [-1.0]], 4, axis=0)  # two averages of four images each, 1 and -1: variance 2
    a = {"s.c.path tracing.dx": dx, "s.c.path tracing.rays": np.array(3.0)}
    assert rows.error(a, "s", "c", "path tracing").mean() == pytest.approx(2 * 4 * 3)


# ---------------------------------------------------------------- some of several scenes


def pair(ratio, noise=0.0):
    """64 replicas whose ratio is that of their means, more or less certain."""
    swing = np.tile([-1.0, 1.0], 32)
    return ratio * (1 + noise * swing), np.ones(64) * (1 + 1e-9 * swing)


LOW, HIGH, OPEN = pair(0.5), pair(0.9), pair(0.79, noise=0.5)


def test_a_scene_is_met_by_all_its_comparisons_and_contrary_by_one():
    assert standing([(LOW, 0.8), (LOW, 0.8)]) == MET
    assert standing([(LOW, 0.8), (HIGH, 0.8)]) == standing([(OPEN, 0.8), (HIGH, 0.8)]) == CONTRARY
    assert standing([(LOW, 0.8), (OPEN, 0.8)]) == UNDECIDED
    low, high, _ = ratio_interval(*OPEN)
    assert low < 0.8 <= high


def test_a_scene_of_no_number_is_undecided():
    assert standing([((np.full(64, np.nan), LOW[1]), 0.8)]) == UNDECIDED


@pytest.mark.parametrize(
    ("scenes", "passed"),
    [
        ([LOW, LOW, LOW, HIGH], True),
        ([LOW, LOW, LOW, OPEN], True),
        ([LOW, LOW, HIGH, HIGH], False),
        ([OPEN, OPEN, HIGH, HIGH], False),
        ([LOW, LOW, OPEN, HIGH], None),
        ([OPEN, OPEN, OPEN, OPEN], None),
    ],
)
def test_three_of_four_hold_or_cannot_hold_any_more_or_leave_it_open(scenes, passed):
    claim = in_enough("GPT-F07", {str(k): [each] for k, each in enumerate(scenes)}, (0.8, 3), "rows", "why")
    assert (claim.outcome.passed if claim.outcome else None) is passed
    assert "why" in claim.reason


def test_few_replicas_decide_nothing():
    short = [(errors[:32], others[:32]) for errors, others in [LOW]]
    claim = in_enough("GPT-F07", {"a": short, "b": [LOW]}, (0.8, 1), "rows", "why")
    assert claim.outcome is None
    assert "32 replicas" in claim.reason
