"""Motion vectors go back to where the previous film showed a point, and history behind moving posts stays unbiased."""

from dataclasses import replace

import numpy as np
import pytest

from flatland2d import PLANE, SCENES, Pinhole
from flatland2d.motion import Motion, motion, sources
from flatland2d.scenes import LAMP, chain, matte, room
from restir_ref.chance import Live
from restir_ref.transport.rays import arrive
from restir_ref.transport.scene import scene as compiled
from tests.flatland.renderings import bias, current, disocclusion, previous

every_scene = pytest.mark.parametrize("scene", SCENES)

EDGE_CASES = 2e-3
"""Share of pixels whose centre grazes a corner, where floating point may see the one or the other surface."""


def cameras(scene: str) -> tuple[Pinhole, Pinhole]:
    """The whole film now, and before: the eye elsewhere, and turned."""
    setting = SCENES[scene]()
    now = setting.pinhole(1920, 0)
    (x, y), (X, Y) = setting.eye, setting.towards
    return now, replace(now, eye=(x - 0.004, y + 0.003), towards=(X + 0.006, Y - 0.002))


def moved(scene: str) -> tuple[Pinhole, Pinhole, Motion]:
    """Both cameras, and the motion between them."""
    now, before = cameras(scene)
    return now, before, motion(SCENES[scene]().scene, now, before)


def test_projecting_what_a_ray_meets_gives_its_place_on_the_film() -> None:
    rng = np.random.default_rng(1)
    camera = Pinhole((0.3, 0.6), (0.9, 0.1), 200, 0.8, first=700)
    pixel, u = rng.integers(0, 200, 5000), rng.random((1, 5000))
    x, w, _ = camera.ray(pixel, u)
    assert np.abs(camera.project(x + rng.uniform(0.01, 3, 5000) * w) - (pixel + u[0])).max() < 1e-9
    assert (camera.project(x - w) == np.inf).all()


@pytest.mark.parametrize("side", [-1, 1])
def test_a_point_level_with_the_eye_is_nowhere_on_the_film(side) -> None:
    camera = Pinhole((0.0, 0.0), (0.0, 1.0), film=64, n=64)
    assert camera.project(np.array([[side], [0.0]])) == np.inf
    assert np.isfinite(camera.project(np.array([[side], [1e-9]])))


def back_projection_errors(now: Pinhole, before: Pinhole, m: Motion, scene: str) -> np.ndarray:
    """Pixels between a centre and where the current film shows what the previous one showed at its place."""
    pixel = np.flatnonzero(m.seen)
    u = (m.place - m.source)[pixel]
    v, _, _ = arrive(SCENES[scene]().scene, *before.ray(m.source[pixel], u[None])[:2])
    return np.abs(now.project(v.x) - (pixel + 0.5))


@pytest.mark.claims("COM-A10")
@every_scene
def test_the_previous_film_shows_at_its_place_what_the_centre_sees_now(scene) -> None:
    now, before, m = moved(scene)
    assert m.seen.mean() > 0.9
    assert back_projection_errors(now, before, m, scene).max() < 1e-6


def test_a_camera_that_forgets_to_turn_is_noticed() -> None:
    now, before, m = moved("cornell")
    straight = replace(before, towards=now.towards)
    assert back_projection_errors(now, straight, m, "cornell").max() > 0.1


@every_scene
def test_disoccluded_is_what_the_previous_eye_did_not_see_or_the_crop_did_not_hold(scene) -> None:
    _, before, m = moved(scene)
    eye = np.broadcast_to(np.array(before.eye)[:, None], m.x.shape)
    shown = SCENES[scene]().scene.visible(eye, m.x) & (m.place >= 0) & (m.place < before.n)
    assert (shown != m.seen).mean() <= EDGE_CASES


def shelf(height: float) -> Motion:
    """A floor seen under the end of a shelf, now from aside, before from above, where the shelf hides it."""
    facets = [*room(0), *chain([(0.4, height), (0.5, height)], 0), *chain(LAMP, 0, 8.0)]
    now = Pinhole((0.9, 0.2), (0.5 - 0.5 * height, 0.0), 8, 0.1 * height, film=8)
    return motion(compiled(PLANE, [matte(0.5)], facets), now, Pinhole((0.5 - 0.5 * height, 0.9), (0.5, 0.0), 8, film=8))


@pytest.mark.parametrize("height", [1e-2, 1e-4, 1e-6, 1e-8])
def test_what_a_thing_hides_was_not_seen_however_close_it_lies_behind_it(height) -> None:
    m = shelf(height)
    assert (m.x[1] == pytest.approx(0, abs=1e-3 * height)) & (m.x[0] < 0.5).all()
    assert not m.seen.any()


def test_a_point_within_the_clearance_is_the_same() -> None:
    assert shelf(1e-11).seen.all()


def test_posts_and_the_ends_of_the_film_hide_some_pixels() -> None:
    _, _, m = moved("occluders")
    assert 0 < (~m.seen[100:-100]).sum() < (~m.seen).sum() < 100


@pytest.mark.claims("COM-A10")
@pytest.mark.parametrize("step", [3.0, -2.0, 0.25])
def test_a_camera_that_slides_along_a_wall_moves_it_by_whole_or_fractional_pixels(step) -> None:
    scene = SCENES["furnace"]().scene
    now = Pinhole((0.5, 0.6), (0.5, 0.0), 64, 0.5, first=900)
    per_pixel = 2 * 0.5 * 0.6 / now.film
    before = replace(now, eye=(0.5 + step * per_pixel, 0.6), towards=(0.5 + step * per_pixel, 0.0))
    m = motion(scene, now, before)
    offset = m.place - (np.arange(64) + 0.5)
    assert np.abs(np.abs(offset) - abs(step)).max() < 1e-9
    assert (np.abs(m.source - np.arange(64) - np.round(offset))[m.seen] == 0).all()


def test_sources_are_pixels_of_the_same_replica_wherever_the_cameras_look() -> None:
    scene, rng = SCENES["cornell"]().scene, np.random.default_rng(2)
    for _ in range(50):
        now, before = (Pinhole(tuple(rng.uniform(0.1, 0.9, 2)), tuple(rng.uniform(0, 1, 2)), 24) for _ in range(2))
        index = rng.permutation(24 * 5)
        found = sources(motion(scene, now, before), index)
        assert (found // 24 == index // 24).all()


def test_a_still_camera_takes_every_pixel_from_itself() -> None:
    now, _ = cameras("occluders")
    assert (sources(motion(SCENES["occluders"]().scene, now, now), np.arange(3840)) == np.arange(3840)).all()


def test_a_crop_that_grows_finds_history_only_where_the_smaller_one_was() -> None:
    before = Pinhole((0.5, 0.6), (0.5, 0.0), 32, 0.5, first=900)
    m = motion(SCENES["furnace"]().scene, replace(before, n=64), before)
    assert m.seen[:32].all()
    assert not m.seen[32:].any()


# ---------------------------------------------------------------- temporal reuse behind posts

REPLICAS = 600


@pytest.mark.claims("GRIS-A16")
def test_history_of_a_moving_camera_is_unbiased_where_posts_have_moved_away_and_elsewhere() -> None:
    image, hidden = disocclusion("hybrid", REPLICAS, Live(np.random.default_rng(3)), previous)
    assert 4 <= hidden.sum() <= 8
    for pixels in (hidden, ~hidden):
        assert bias(image.added[:, pixels], image.initial[:, pixels]).is_none(0.01)


@pytest.mark.claims("GRIS-A16")
def test_history_rated_with_the_current_camera_is_dark_where_posts_have_moved_away() -> None:
    image, hidden = disocclusion("hybrid", REPLICAS, Live(np.random.default_rng(3)), current)
    found = bias(image.added[:, hidden], image.initial[:, hidden])
    assert found.bias < -0.2
    assert found.z < -8
