"""The pinhole: what it projects it has seen, crops are parts of one film, and what cannot be seen is refused."""

from dataclasses import replace

import numpy as np
import pytest

from restir_ref.transport.paths import RECONNECTION, Tracer, radiance, trace
from tests.core.test_bad_input import Mistake, faults
from tests.tracer3d.views import AT_A_POINT, directed
from tracer3d import SCENES, Pinhole, check_view, setting
from tracer3d.scenes import Setting, two_rooms
from tracer3d.sensors import FILM, Mosaic, facing

NAN, INF = np.nan, np.inf
CAMERA = Pinhole((0.3, 0.6, 1.5), (0.9, 0.1, 0.2), 50, 30, 0.8, left=700, top=400)
every_scene = pytest.mark.parametrize("scene", SCENES)


def places(camera: Pinhole, n: int = 5000):
    """Random pixels, numbers, and points that their rays pass."""
    rng = np.random.default_rng(1)
    pixel, u = rng.integers(0, camera.n, n), rng.random((2, n))
    x, w, weight = camera.ray(pixel, u)
    return pixel, u, x + rng.uniform(0.01, 3, n) * w, weight


def test_projecting_what_a_ray_passes_gives_its_place_on_the_film():
    pixel, u, x, weight = places(CAMERA)
    place = np.stack([pixel % 50, pixel // 50]) + u
    assert abs(CAMERA.project(x) - place).max() < 1e-9
    assert (weight == 1).all()
    assert (CAMERA.project(2 * np.array(CAMERA.eye)[:, None] - x) == INF).all()


def test_columns_and_rows_taken_for_one_another_are_noticed():
    pixel, u, x, _ = places(CAMERA)
    assert abs(CAMERA.project(x)[::-1] - np.stack([pixel % 50, pixel // 50]) - u).max() > 1


def test_the_film_is_upright_and_not_mirrored():
    camera = Pinhole((0, 0, 1), (0, 0, 0), *FILM)
    middle, right, above = (camera.project(np.array([[x], [y], [0.0]]))[:, 0] for x, y in ((0, 0), (0.1, 0), (0, 0.1)))
    assert middle == pytest.approx([960, 540])
    assert right[0] > middle[0]
    assert right[1] == pytest.approx(middle[1])
    assert above[1] < middle[1]
    assert right[0] - middle[0] == pytest.approx(middle[1] - above[1])


def test_half_is_the_tangent_of_half_the_horizontal_field_of_view():
    camera = Pinhole((0, 0, 1), (0, 0, 0), *FILM, half=0.5)
    assert camera.project(np.array([[0.5, -0.5], [0, 0], [0, 0]]))[0] == pytest.approx([1920, 0], abs=1e-9)


def test_pixels_go_row_by_row_from_the_top_left():
    camera = Pinhole((0, 0, 1), (0, 0, 0), 4, 3, film=(4, 3))
    _, w, _ = camera.ray(np.arange(12), np.full((2, 12), 0.5))
    assert camera.shape == (3, 4)
    assert (np.diff(w[0].reshape(3, 4) / -w[2].reshape(3, 4), axis=1) > 0).all()
    assert (np.diff(w[1].reshape(3, 4) / -w[2].reshape(3, 4), axis=0) < 0).all()


def traced(t: Tracer, pixel, seed: int = 3):
    """Path trees of pixels from the same numbers."""
    return radiance(trace(t, np.random.default_rng(seed).random((t.D, len(pixel))), pixel))


def crop_and_film(scene: str, shift: int = 0):
    """Light of the inset's pixels: by the crop, and by the whole film, `shift` columns aside; (C, 256) each."""
    at = SCENES[scene]()
    (left, top), pixel = at.crop, np.arange(256)
    crop = Tracer(at.scene, at.pinhole(16, 16), at.depth, RECONNECTION)
    film = Tracer(at.scene, at.pinhole(*FILM, (0, 0)), at.depth, RECONNECTION)
    return traced(crop, pixel), traced(film, (top + pixel // 16) * FILM[0] + left + shift + pixel % 16)


@every_scene
def test_a_crop_is_that_part_of_the_film(scene):
    crop, film = crop_and_film(scene)
    assert crop.any()
    assert crop == pytest.approx(film, rel=1e-9, abs=1e-12)


def test_a_crop_that_begins_a_pixel_further_is_noticed():
    crop, film = crop_and_film("cornell", 1)
    assert abs(crop - film).max() > 1e-3 * crop.max()


def test_a_view_shows_what_the_film_shows_over_its_whole_height():
    at = SCENES["cornell"]()
    film, view = at.pinhole(*FILM, (0, 0)), at.view(16, 9)
    wide = film.ray(np.array([0, FILM[0] * FILM[1] - 1]), np.array([[0.0, 1.0], [0.0, 1.0]]))[1]
    assert view.ray(np.array([0, 143]), np.array([[0.0, 1.0], [0.0, 1.0]]))[1] == pytest.approx(wide, abs=1e-12)
    square = at.view(8, 8)
    corner = square.ray(np.array([0]), np.zeros((2, 1)))[1][:, 0]
    assert abs(corner[0]) == pytest.approx(abs(corner[1]), rel=1e-12)
    assert corner[1] / corner[2] == pytest.approx(wide[1, 0] / wide[2, 0], rel=1e-12)


def test_a_pinhole_of_one_point_sees_that_point():
    s = SCENES["crease"]().scene
    _, w, _ = directed((0.5, 0.9, 0.5), (0.5, 0.0, 0.5)).ray(np.array([0]), np.array([[0.9], [0.1]]))
    assert w[:, 0] == pytest.approx([0, -1, 0], abs=2 * AT_A_POINT)
    assert s.extent == 1


def test_facing_tells_fronts_backs_and_nothing_apart():
    s = SCENES["cornell"]().scene
    eyes = {1: (0.5, 0.5, 2.0), -1: (0.5, 0.5, -1.0), 0: (0.5, 0.5, 9.0)}
    for found, eye in eyes.items():
        assert facing(s, directed(eye, (0.5, 0.5, 10.0 if found == 0 else 0.0))) == [found]


# ---------------------------------------------------------------- mosaics

MOSAIC = Mosaic(CAMERA, ((3, 5), (700, 400), (1000, 20)))


def test_pixels_of_a_mosaic_are_those_of_its_crops_one_crop_after_the_other():
    crops = [replace(CAMERA, left=left, top=top) for left, top in MOSAIC.corners]
    assert MOSAIC.n == sum(crop.n for crop in crops)
    assert MOSAIC.shape == CAMERA.shape
    assert MOSAIC.numbers == MOSAIC.film_numbers == CAMERA.numbers == CAMERA.film_numbers
    u = np.random.default_rng(2).random((2, MOSAIC.n))
    parts = [crop.ray(np.arange(crop.n), each) for crop, each in zip(crops, np.split(u, 3, axis=1), strict=True)]
    for found, own in zip(MOSAIC.ray(np.arange(MOSAIC.n), u), zip(*parts, strict=True), strict=True):
        assert np.array_equal(found, np.concatenate(own, axis=-1))


def test_a_mosaic_of_no_crop_or_with_one_off_the_film_is_refused():
    with pytest.raises(ValueError, match="at least one crop"):
        replace(MOSAIC, corners=())
    with pytest.raises(ValueError, match="begins at 1900 and has 50"):
        replace(MOSAIC, corners=((3, 5), (1900, 5)))


# ---------------------------------------------------------------- complaints

HOME = setting("cornell")
FOR_POINTS = {
    f"{name} {at}": Mistake(lambda name=name, at=at: replace(CAMERA, **{name: at}), ValueError, f"{at}", remedy)
    for name, at, remedy in (
        ("eye", (0.5, 0.7), "a point of space has 3 coordinates"),
        ("towards", (0.5,), "a point of space has 3 coordinates"),
        ("up", (0.0, 1.0), "a point of space has 3 coordinates"),
        ("eye", (NAN, 0.0, 0.0), "needs a direction to look in"),
        ("towards", (INF, 0.0, 0.0), "needs a direction to look in"),
        ("towards", CAMERA.eye, "needs a direction to look in"),
        ("up", (0.0, 0.0, 0.0), "another direction"),
        ("towards", (0.3, 0.0, 1.5), "say up=(0, 0, -1)"),
    )
}
FOR_PIXELS = {
    f"{name} = {value!r}": Mistake(lambda name=name, v=value: replace(CAMERA, **{name: v}), ValueError, said, remedy)
    for name, value, said, remedy in (
        ("width", 0, "has 0", "needs columns of the film, 0 .. 1919"),
        ("height", NAN, "has nan", "needs rows of the film, 0 .. 1079"),
        ("left", 1900, "begins at 1900 and has 50", "move it, or make it smaller"),
        ("top", -1, "begins at -1", "move it, or make it smaller"),
        ("height", 1081, "has 1081", "0 .. 1079"),
        ("width", 2.5, "is 2.5", "It counts pixels."),
        ("top", 1.5, "is 1.5", "It counts pixels."),
        ("half", NAN, "is nan", "must be positive and finite"),
        ("half", 0.0, "is 0.0", "must be positive and finite"),
    )
}
FOR_SETTINGS = {
    "an eye in a box": Mistake(
        lambda: replace(HOME, eye=(0.34, 0.3, 0.37), towards=(0.34, 0.3, 0.0)),
        ValueError,
        "eye=(0.34, 0.3, 0.37)",
        "Move it",
    ),
    "an eye behind the back wall": Mistake(
        lambda: replace(HOME, eye=(0.4, 0.6, -1.0)), ValueError, "eye=(0.4, 0.6, -1.0)", "turn the facets round"
    ),
    "an eye that looks away": Mistake(
        lambda: replace(HOME, towards=(0.5, 0.5, 9.0)), ValueError, "towards=(0.5, 0.5, 9.0)", "looks past everything"
    ),
    "a pinhole in a box": Mistake(
        lambda: check_view(HOME.scene, directed((0.34, 0.3, 0.37), (0.34, 0.3, 0.0))), ValueError, "0.37", "Move it"
    ),
    "a crop off the film": Mistake(
        lambda: HOME.pinhole(64, 64, (1900, 0)), ValueError, "begins at 1900 and has 64", "0 .. 1919"
    ),
    "a depth of 0": Mistake(lambda: replace(HOME, depth=0), ValueError, "is 0", "1 is direct light"),
    "a door that is shut": Mistake(lambda: two_rooms(0.0), ValueError, "is 0.0", "must be in (0, 0.5)"),
    "a misspelt scene": Mistake(lambda: setting("cornel"), ValueError, "no scene 'cornel'", "did you mean 'cornell'?"),
    "another name": Mistake(lambda: setting("xyz"), ValueError, "no scene 'xyz'", "there are cornell, glossy_cornell"),
}
COMPLAINTS = FOR_POINTS | FOR_PIXELS | FOR_SETTINGS


@pytest.mark.parametrize("mistake", COMPLAINTS.values(), ids=COMPLAINTS)
def test_a_mistake_is_named_with_its_value_and_the_remedy(mistake):
    assert faults(mistake) == []


NEAR_MISSES = {
    "an eye on the floor": replace(setting("crease"), eye=(0.5, 0.0, 0.5)),
    "a depth of 1": replace(HOME, depth=1),
    "a narrow view": replace(HOME, half=1e-6),
    "the last pixel": replace(HOME, crop=(FILM[0] - 64, FILM[1] - 64)),
}


@pytest.mark.parametrize("at", NEAR_MISSES.values(), ids=NEAR_MISSES)
def test_a_near_miss_is_no_mistake_and_renders(at: Setting):
    t = Tracer(at.scene, at.pinhole(), at.depth, RECONNECTION)
    L = traced(t, np.arange(64))
    assert (np.isfinite(L) & (L >= 0)).all()
