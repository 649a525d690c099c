"""The plane's two sensors: crops of one film, the layout of the map, and views that show nothing."""

from dataclasses import replace

import numpy as np
import pytest

from flatland2d import SCENES, FluenceMap, Pinhole
from flatland2d.sensors import FILM, check_view, facing
from restir_ref.transport.scene import Ball, Facet, scene
from tests.transport.rooms import MATTE
from tests.transport.spaces import SPACES

EYE, TOWARDS = (0.5, 0.7), (0.45, 0.2)


def slope(camera: Pinhole, pixel, u) -> np.ndarray:
    """Place on the film: tangent of the angle to the axis, clockwise."""
    _, w, weight = camera.ray(np.atleast_1d(pixel), np.atleast_2d(u))
    assert (weight == 1).all()
    axis = np.subtract(TOWARDS, EYE) / np.linalg.norm(np.subtract(TOWARDS, EYE))
    right = np.array([axis[1], -axis[0]])
    return (right @ w) / (axis @ w)


def test_the_film_spans_the_field_of_view():
    camera = Pinhole(EYE, TOWARDS, FILM, half=0.5)
    assert slope(camera, [0, FILM - 1], [[0.0, 1.0]]) == pytest.approx([-0.5, 0.5])
    assert slope(camera, FILM // 2, 0.0) == pytest.approx([0], abs=1e-15)


def test_pixels_tile_the_film():
    camera, pixel = Pinhole(EYE, TOWARDS, 64), np.arange(63)
    assert np.allclose(slope(camera, pixel, np.ones((1, 63))), slope(camera, pixel + 1, np.zeros((1, 63))), atol=1e-15)
    widths = np.diff(slope(camera, np.arange(64), np.zeros((1, 64))))
    assert np.allclose(widths, widths[0])


def test_a_crop_sees_what_the_whole_film_sees_there():
    whole, crop = Pinhole(EYE, TOWARDS, FILM), Pinhole(EYE, TOWARDS, 64, first=896)
    pixel, u = np.arange(64), np.random.default_rng(1).random((1, 64))
    assert all((a == b).all() for a, b in zip(crop.ray(pixel, u), whole.ray(pixel + 896, u), strict=True))


def test_rays_start_at_the_eye_with_unit_directions():
    x, w, _ = Pinhole(EYE, TOWARDS, 64).ray(np.arange(64), np.full((1, 64), 0.3))
    assert (x == np.array(EYE)[:, None]).all()
    assert np.allclose(np.linalg.norm(w, axis=0), 1)


def test_the_map_s_first_row_is_at_the_bottom_and_rows_follow_one_another():
    fluence = FluenceMap((1.0, 2.0), (5.0, 4.0), 4, 2)
    x, _, _ = fluence.ray(np.arange(8), np.full((3, 8), 0.5))
    assert fluence.n == 8
    assert x[0].tolist() == [1.5, 2.5, 3.5, 4.5] * 2
    assert x[1].tolist() == [2.5] * 4 + [3.5] * 4


def test_the_map_s_places_stay_in_their_pixel_and_directions_go_all_around():
    fluence, u = FluenceMap((0.0, 0.0), (2.0, 1.0), 2, 1), np.random.default_rng(2).random((3, 10_000))
    x, w, weight = fluence.ray(np.arange(10_000) % 2, u)
    assert (np.floor(x[0]) == np.arange(10_000) % 2).all()
    assert (weight == 2 * np.pi).all()
    assert np.abs(w.mean(axis=1)).max() < 4 / np.sqrt(2 * 10_000)
    assert np.allclose(np.linalg.norm(w, axis=0), 1)


# ---------------------------------------------------------------- what a sensor sees


@pytest.mark.parametrize("name", SCENES)
def test_every_scene_is_looked_at_from_where_fronts_are_seen(name):
    setting = SCENES[name]()
    assert (facing(setting.scene, setting.pinhole(64)) == 1).all()
    check_view(setting.scene, setting.fluence(8, 8))


def test_an_eye_in_a_box_in_a_ball_or_out_of_doors_is_refused():
    setting = SCENES["glass_disc"]()
    light = Facet(((-9, 9), (9, 9)), 0, (1.0,))
    bowl = scene(SPACES["plane"], [MATTE], [light], [Ball((0, 0), 1.0)])
    views = {
        "box": (SCENES["cornell"]().scene, Pinhole((0.3, 0.2), (0.3, 0.3), 8)),
        "ball": (bowl, Pinhole((0, 0.5), (0, 1), 8)),
        "outside": (setting.scene, Pinhole((5, 5), (0, 0), 8, first=956)),
        "nothing": (bowl, Pinhole((0, -2), (0, -3), 8)),
    }
    for name, (of, camera) in views.items():
        with pytest.raises(ValueError, match="only backs of surfaces, or nothing"):
            check_view(of, camera)
        assert (facing(of, camera) < 1).all(), name


# ---------------------------------------------------------------- mistakes of users

CAMERA, MAP = Pinhole(EYE, TOWARDS, 64), FluenceMap((0.0, 0.0), (1.0, 1.0), 4, 4)
BAD = {
    "begins at 0 and has 0": (CAMERA, {"n": 0}),
    "begins at 0 and has -3": (CAMERA, {"n": -3}),
    "begins at -1 and has 64": (CAMERA, {"first": -1}),
    "0 .. 1919, but begins at 1900": (CAMERA, {"first": 1900}),
    "positive and finite, but is 0": (CAMERA, {"half": 0.0}),
    "positive and finite, but is -0.6": (CAMERA, {"half": -0.6}),
    "positive and finite, but is nan": (CAMERA, {"half": np.nan}),
    "positive and finite, but is inf": (CAMERA, {"half": np.inf}),
    "needs a direction to look in": (CAMERA, {"towards": EYE}),
    "direction to look in": (CAMERA, {"eye": (np.nan, 0.0)}),
    "0 columns and 4 rows": (MAP, {"columns": 0}),
    "4 columns and -1 rows": (MAP, {"rows": -1}),
    "low below high": (MAP, {"high": (1.0, 0.0)}),
    "needs low below high": (MAP, {"low": (np.nan, 0.0)}),
}


@pytest.mark.parametrize("said", BAD)
def test_a_sensor_that_cannot_be_is_refused_with_its_value(said):
    sensor, change = BAD[said]
    with pytest.raises(ValueError) as error:  # noqa: PT011
        replace(sensor, **change)
    assert said in str(error.value)
