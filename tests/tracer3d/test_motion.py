"""Motion vectors go back to where the previous film showed a point; whole and broken pixels; a camera that moves."""

from dataclasses import replace

import numpy as np
import pytest

from restir_ref.integrals import NOWHERE
from restir_ref.transport.rays import arrive
from tracer3d import SCENES, Pinhole
from tracer3d.motion import Motion, mosaic_sources, motion, overlaps, sources
from tracer3d.sensors import Mosaic

every_scene = pytest.mark.parametrize("scene", SCENES)

EDGE_CASES = 2e-3
"""Share of pixels whose centre grazes an edge, where floating point may see the one or the other surface."""


def moved(scene: str) -> tuple[Pinhole, Pinhole, Motion]:
    """The scene's view now and one frame earlier, and the motion between them."""
    setting = SCENES[scene]()
    now, before = setting.at(1).view(64, 36), setting.view(64, 36)
    return now, before, motion(setting.scene, now, before)


def back_projection_errors(now: Pinhole, before: Pinhole, m: Motion, scene: str) -> np.ndarray:
    """Pixels between a centre and where the current film shows what the previous one showed at its place."""
    pixel = np.flatnonzero(m.seen)
    source = m.source[pixel]
    u = m.place[:, pixel] - np.stack([source % before.width, source // before.width])
    v, _, _ = arrive(SCENES[scene]().scene, *before.ray(source, u)[:2])
    centre = np.stack([pixel % now.width, pixel // now.width]) + 0.5
    return np.abs(now.project(v.x) - centre)


@pytest.mark.claims("COM-A10", part="rows and columns", world="tracer3d")
@every_scene
def test_the_previous_film_shows_at_its_place_what_the_centre_sees_now(scene):
    now, before, m = moved(scene)
    _, _, met = arrive(SCENES[scene]().scene, *now.ray(np.arange(now.n), np.full((2, now.n), 0.5))[:2])
    assert m.seen[met].mean() > 0.9
    assert not m.seen[~met].any()
    assert back_projection_errors(now, before, m, scene).max() < 1e-6


@pytest.mark.parametrize("name", ["eye", "towards"])
def test_a_camera_that_moves_in_part_only_is_noticed(name):
    now, before, m = moved("cornell")
    assert back_projection_errors(now, replace(before, **{name: getattr(now, name)}), m, "cornell").max() > 0.01


@every_scene
def test_disoccluded_is_what_the_previous_eye_did_not_see_or_the_crop_did_not_hold(scene):
    now, before, m = moved(scene)
    s = SCENES[scene]().scene
    _, _, met = arrive(s, *now.ray(np.arange(now.n), np.full((2, now.n), 0.5))[:2])
    eye = np.broadcast_to(np.array(before.eye)[:, None], m.x.shape)
    inside = ((m.place >= 0) & (m.place < np.array([[64], [36]]))).all(axis=0)
    assert ((s.visible(eye, m.x) & inside & met) != m.seen).mean() <= EDGE_CASES


@every_scene
def test_every_camera_moves_by_two_to_four_pixels_of_the_film_per_frame(scene):
    setting = SCENES[scene]()
    now, before = (setting.at(frame).pinhole() for frame in (1, 0))
    m = motion(setting.scene, now, before)
    pixel = np.arange(now.n)
    far = np.hypot(*(m.place - np.stack([pixel % 64, pixel // 64]) - 0.5))[m.seen]
    assert 1.5 < np.median(far) < 5
    for moved in (setting.at(3), setting.at(1).at(2)):
        assert np.subtract(moved.eye, setting.eye) == pytest.approx(3 * np.subtract(now.eye, setting.eye))
        assert np.subtract(moved.towards, moved.eye) == pytest.approx(np.subtract(setting.towards, setting.eye))


def sliding(columns: float, rows: float, size: int = 16) -> Motion:
    """A camera that slides along the back wall of the furnace, by so many pixels to the right and down."""
    now = Pinhole((0.5, 0.5, 0.6), (0.5, 0.5, 0.0), size, size, 0.5, left=900, top=500)
    a = 2 * 0.5 * 0.6 / now.film[0]
    by = np.array([columns * a, -rows * a, 0])
    before = replace(now, eye=tuple(now.eye + by), towards=tuple(now.towards + by))
    return motion(SCENES["furnace"]().scene, now, before)


@pytest.mark.claims("COM-A10", part="whole and broken pixels", world="tracer3d")
@pytest.mark.parametrize(("columns", "rows"), [(3, 0), (0, -2), (2, 5), (0.25, -1.5)])
def test_a_camera_that_slides_along_a_wall_moves_it_by_whole_or_broken_pixels(columns, rows):
    m, pixel = sliding(columns, rows), np.arange(256)
    assert m.place[0] - pixel % 16 - 0.5 == pytest.approx(-columns, abs=1e-9)
    assert m.place[1] - pixel // 16 - 0.5 == pytest.approx(-rows, abs=1e-9)
    inside = ((m.place >= 0) & (m.place < 16)).all(axis=0)
    assert (m.seen == inside).all()


@pytest.mark.parametrize(("columns", "rows"), [(3, 0), (2, 5)])
def test_whole_pixels_have_one_source(columns, rows):
    m, index = sliding(columns, rows), np.arange(256)
    found = [(source, area) for source, area in overlaps(m, index) if (area > 1e-6).any()]
    whole = np.flatnonzero(m.seen)
    best = np.max([area for _, area in found], axis=0)
    assert best[whole] == pytest.approx(1, abs=1e-9)
    for source, area in found:
        assert (source[area > 0.5] == m.source[area > 0.5]).all()


def test_broken_pixels_have_four_whose_areas_are_those_of_the_overlaps():
    m = sliding(0.25, -1.5)
    found = overlaps(m, np.arange(256))
    middle = 8 * 16 + 8
    sources_, areas = zip(*((int(s[middle]), float(a[middle])) for s, a in found), strict=True)
    assert areas == pytest.approx([0.25 * 0.5, 0.75 * 0.5, 0.25 * 0.5, 0.75 * 0.5])
    assert np.subtract(sources_, middle).tolist() == [15, 16, 31, 32]


@every_scene
def test_areas_sum_to_one_inside_and_to_less_at_the_borders(scene):
    _, _, m = moved(scene)
    total = sum(area for _, area in overlaps(m, np.arange(64 * 36)))
    inside = ((m.place >= 0.5) & (m.place <= np.array([[63.5], [35.5]]))).all(axis=0)
    assert total[inside] == pytest.approx(1, abs=1e-12)
    assert (total[~inside] < 1).all()
    for source, area in overlaps(m, np.arange(64 * 36)):
        assert ((source == NOWHERE) == (area == 0)).all()


def test_sources_are_pixels_of_the_same_replica_wherever_the_cameras_look():
    s, rng = SCENES["crease"]().scene, np.random.default_rng(2)
    for _ in range(30):
        now, before = (
            Pinhole(tuple(rng.uniform(0.1, 0.9, 3)), tuple(rng.uniform(0, 1, 3)), 6, 4, film=(6, 4)) for _ in range(2)
        )
        index = rng.permutation(24 * 5)
        m = motion(s, now, before)
        for found in (sources(m, index), *(source for source, _ in overlaps(m, index))):
            assert (found // 24 == index // 24)[found != NOWHERE].all()


def test_a_still_camera_takes_every_pixel_from_itself():
    setting = SCENES["many_lights"]()
    now = setting.view(32, 18)
    index = np.arange(3 * now.n)
    assert (sources(motion(setting.scene, now, now), index) == index).all()


def test_crops_of_different_sizes_name_columns_of_the_previous_one():
    setting = SCENES["furnace"]()
    before = setting.pinhole(8, 8)
    m = motion(setting.scene, replace(before, width=16), before)
    assert m.seen.reshape(8, 16)[:, :8].all()
    assert not m.seen.reshape(8, 16)[:, 8:].any()
    assert (sources(m, np.arange(2 * 128)).reshape(2, 8, 16)[1, :, :8] == 64 + np.arange(64).reshape(8, 8)).all()


def test_every_crop_of_a_mosaic_takes_history_from_its_own():
    setting, corners = SCENES["crease"](), ((4, 8), (40, 20))
    now, before = (
        Mosaic(replace(each, width=12, height=8), corners)
        for each in (setting.at(1).view(64, 36), setting.view(64, 36))
    )
    found = mosaic_sources(setting.scene, now, before)
    alone = [motion(setting.scene, *pair).source for pair in zip(now.crops(), before.crops(), strict=True)]
    assert found.tolist() == [*alone[0], *(alone[1] + 12 * 8)]
