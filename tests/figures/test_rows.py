"""The rows of GPT-F07-ROWS: which frames its cameras see, and what is compared."""

from collections import Counter

import numpy as np
import pytest

from figures.experiments.following import gathered
from figures.gradient import gpt_f07_rows as rows
from restir_ref.area import MOVED
from restir_ref.gathering import gathering
from restir_ref.gradient_loop import PRIMAL
from restir_ref.squares import keeping


@pytest.fixture(scope="module")
def views():
    return rows.last_views("cornell", Counter(), 3)


def test_a_moving_camera_sees_fractions_of_pixels_and_one_at_rest_none(views):
    moved = np.concatenate([view[PRIMAL].by[np.isfinite(view[PRIMAL].by)] for view in views[1:]])
    assert (abs(moved - np.round(moved)) > 0.01).any()
    for view in rows.still(views):
        assert all((group.by == 0).all() for group in view.values())


def test_a_camera_at_rest_sees_the_last_frame_as_often_as_there_are_frames(views):
    standing = rows.still(views)
    assert len(standing) == 3
    assert len(rows.still(views * 5)) == rows.MAP_FRAMES
    assert all(view[PRIMAL].of is views[-1][PRIMAL].of for view in standing)


def test_history_is_kept_in_place_or_moved_or_gathers(views):
    assert {group.follow for view in rows.kept(views) for group in view.values()} == {keeping}
    assert {group.follow for view in rows.CAMERAS["moving, moved"](views) for group in view.values()} == {MOVED}
    assert {group.follow for view in views for group in gathered(view).values()} == {gathering}


def test_errors_are_variances_times_the_rays_of_all_images_that_are_averaged():
    dx = np.repeat([[1.0], [-1.0]], 4, axis=0)  # two averages of four images each, 1 and -1: variance 2
    a = {"s.c.path tracing.dx": dx, "s.c.path tracing.rays": np.array(3.0)}
    assert rows.error(a, "s", "c", "path tracing").mean() == pytest.approx(2 * 4 * 3)
