"""Laws of what the two notebooks of flatland show, without any notebook."""

import numpy as np
import pytest

from figures.experiments.rendering import path_tracing
from notebooks import frames, shift_mappings
from restir_ref import Live

# ---------------------------------------------------------------- shift mappings


@pytest.mark.parametrize("roughness", [0.05, 0.1, 0.2, 0.5])
@pytest.mark.parametrize("pixels", [-60, 30, 60])
@pytest.mark.parametrize("shift", shift_mappings.SHIFTS)
def test_the_factors_of_a_table_multiply_to_the_jacobian_of_the_shift(shift, pixels, roughness):
    p = shift_mappings.in_corridor(shift, pixels, roughness)
    product = np.prod([factor for *_, factor in shift_mappings.parts(p)])
    assert p.J > 0
    assert product == pytest.approx(p.J, rel=1e-9)


def test_leaving_out_a_factor_is_noticed():
    p = shift_mappings.in_corridor("reconnection", 60, 0.1)
    factors = [factor for *_, factor in shift_mappings.parts(p)]
    for k in range(len(factors)):
        assert abs(np.prod(factors[:k] + factors[k + 1 :]) / p.J - 1) > 0.01


def test_the_hybrid_shift_jumps_where_walls_get_rough_enough():
    found = [shift_mappings.in_corridor("hybrid", 60, r) for r in (0.1, 0.19, 0.2, 0.5)]
    assert [p.c for p in found] == [4, 4, 2, 2]
    lost = [shift_mappings.in_corridor("reconnection", 60, r).J for r in (0.05, 0.1, 0.2, 0.5)]
    assert lost == sorted(lost)
    assert lost[1] < 0.02
    assert lost[-1] > 0.9


def test_a_shift_to_the_same_pixel_changes_nothing():
    for shift in shift_mappings.SHIFTS:
        p = shift_mappings.in_corridor(shift, 0)
        assert (p.J, p.gain) == pytest.approx((1, 1), rel=1e-12)


@pytest.mark.parametrize("shift", shift_mappings.SHIFTS)
def test_there_and_back_is_where_one_was(shift):
    error, lost = shift_mappings.there_and_back("glossy_cornell", shift)
    assert error < 1e-9
    assert lost < 0.02


def test_reconnection_is_worst_on_gloss_and_replay_behind_a_slit():
    alike = {
        (scene, shift): shift_mappings.alike(shift_mappings.kept(scene, shift))
        for scene in ("glossy_cornell", "ajar")
        for shift in shift_mappings.SHIFTS
    }
    for scene, worst in (("glossy_cornell", "reconnection"), ("ajar", "replay")):
        others = [alike[scene, shift] for shift in shift_mappings.SHIFTS if shift != worst]
        assert alike[scene, worst] < min(others) - 0.03


# ---------------------------------------------------------------- frames


@pytest.mark.parametrize("camera", ["still", "fast"])
def test_films_change_no_mean(camera):
    found = frames.film("crease", "1", camera)
    d = (found.images - found.paths).mean(axis=(0, 2))
    error = d.std(ddof=1) / np.sqrt(d.size)
    assert error < 0.02 * found.paths.mean()
    assert abs(d.mean()) < 4 * error


@pytest.mark.parametrize("cap", frames.CAPS)
def test_confidence_is_four_times_that_of_a_new_sample_and_its_capped_history(cap):
    found, c = frames.film("ajar", cap, "still"), 0.0
    for measured in found.confidence:
        c = 4 * (1 + min(c, frames.CAPS[cap]))
        np.testing.assert_allclose(measured, c, rtol=1e-6)


def test_frames_improve_with_the_cap_and_freeze_without():
    late = {cap: frames.late(frames.film("ajar", cap, "still").images) for cap in frames.CAPS}
    assert late["1"][0] > late["5"][0] > late["20"][0]
    assert late["1"][2] < late["5"][2] < late["20"][2] < late["none"][2]
    assert late["none"][2] > 0.97


def test_a_high_cap_loses_to_path_tracing_where_the_camera_crosses_the_crease():
    error = {cap: frames.error(frames.film("crease", cap, "fast").images)[16:].mean() for cap in ("1", "20")}
    paths = frames.error(frames.film("crease", "20", "fast").paths)[16:].mean()
    assert error["1"] < 0.6 * paths < 0.7 * error["20"]


def test_the_reference_is_the_image_that_films_see():
    found, mean = frames.film("ajar", "5", "still").images, frames.reference("ajar").mean()
    d = found.mean(axis=(0, 2)) - mean
    assert abs(d.mean()) < 4 * d.std(ddof=1) / np.sqrt(d.size) + 0.05 * mean


def test_errors_are_those_of_independent_numbers():
    rng = np.random.default_rng(1)
    noise = 2 + rng.normal(size=(4, 64, 2000))
    np.testing.assert_allclose(frames.error(noise), 0.5, rtol=0.02)
    np.testing.assert_allclose(frames.error(frames.means(noise)), 0.5 / np.sqrt([1, 2, 3, 4]), rtol=0.02)
    assert abs(frames.likeness(noise)).max() < 0.02
    np.testing.assert_allclose(frames.likeness(np.repeat(noise[:1], 3, axis=0)), 1)


def test_a_still_camera_sees_the_same_view_in_every_frame():
    views = frames.images("ajar", "still")
    index = np.arange(views[0].n)
    first, last = (path_tracing(1)(of, index, Live(np.random.default_rng(1))) for of in (views[0], views[-1]))
    np.testing.assert_array_equal(first, last)
    assert frames.film("ajar", "20", "still").seen[1:].all()
    assert 0.5 < frames.film("crease", "20", "fast").seen[1:].mean() < 1
