"""Laws of GPT-F07-REST-3D: what its whole views see, how long and where its cameras stand, and what is judged."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from figures.experiments.following import views_of
from figures.experiments.gradients import ADAPTIVE, METHODS
from figures.gradient import gpt_f07_3d as young
from figures.gradient import gpt_f07_rest_3d as rest
from restir_ref.gathering import gathering
from restir_ref.gradient_loop import GRADIENT
from restir_ref.squares import keeping
from tracer3d.sensors import FILM, facing

PAPER = rest.FIGURE.presets["paper"]
NAMES = PAPER["scenes"]
SIZE = PAPER["film"]


def setting(name):
    return rest.SCENES[name]()


# ---------------------------------------------------------------- what is seen


def corners(sensor):
    """Rays through the corners of what a sensor shows, (3, 4)."""
    x, y = np.array([[0, 1, 0, 1], [0, 0, 1, 1]]) * [[sensor.width], [sensor.height]]
    return sensor.through(sensor.left + x, sensor.top + y)[1]


@pytest.mark.parametrize("name", NAMES)
def test_a_whole_view_sees_what_the_film_of_its_scene_sees(name):
    s = setting(name)
    film = s.pinhole(*FILM, (0, 0))
    for camera in (rest.WHOLE, *rest.MOVING):
        (last,) = rest.CAMERAS[camera].sensors(s, SIZE, 1)
        assert last.eye == film.eye
        assert np.allclose(corners(last), corners(film), atol=1e-12)


@pytest.mark.parametrize("name", NAMES)
def test_a_crop_and_a_film_of_another_shape_see_something_else(name):
    s = setting(name)
    film = s.pinhole(*FILM, (0, 0))
    for other in (rest.crop(s, PAPER["crop"], 1)[0], s.view(32, 32), replace(s.view(32, 18), half=0.9 * s.half)):
        assert not np.allclose(corners(other), corners(film), atol=1e-3)


@pytest.mark.parametrize("name", NAMES)
def test_crops_are_those_that_were_fixed_before(name):
    s, side = setting(name), young.FIGURE.presets["paper"]["side"]
    assert PAPER["crop"] == [side, side]
    mine, theirs = (each.CAMERAS[young.STILL].sensors for each in (rest, young))
    assert mine(s, PAPER["crop"], 3) == theirs(s, side, 3)


# ---------------------------------------------------------------- for how long


def test_what_is_judged_at_rest_lasts_three_caps_of_pixels_and_of_pairs():
    assert {rest.CAMERAS[camera].frames for camera in rest.RESTING} == {"still"}
    assert PAPER["still"] == 3 * GRADIENT.pixels.cap == 3 * GRADIENT.pairs.cap
    assert young.FIGURE.presets["paper"]["frames"] < 3 * GRADIENT.pixels.cap


def test_what_moves_lasts_as_long_as_what_moves_elsewhere():
    assert {rest.CAMERAS[camera].frames for camera in rest.MOVING} == {"moving"}
    assert PAPER["moving"] == young.FIGURE.presets["paper"]["frames"]


@pytest.mark.parametrize("camera", rest.CAMERAS)
def test_a_camera_has_as_many_frames_as_are_asked_for_and_ends_at_its_place(camera):
    sensors = rest.CAMERAS[camera].sensors(setting("Ajar3"), SIZE, 6)
    assert len(sensors) == 6
    assert sensors[-1] == rest.CAMERAS[camera].sensors(setting("Ajar3"), SIZE, 1)[0]
    assert (len(set(sensors)) == 1) is (camera in rest.RESTING)


# ---------------------------------------------------------------- how it moves


@pytest.mark.parametrize("name", NAMES)
def test_what_a_moving_camera_looks_at_moves_by_half_a_pixel_along_either_axis_in_every_frame(name):
    s = setting(name)
    places = [each.project(np.array(s.towards)[:, None])[:, 0] for each in rest.around(s, SIZE, 9)]
    assert np.allclose(abs(np.diff(places, axis=0)), 0.5, atol=1e-9)
    slower = [rest.slid(s, SIZE, (k / 4, k / 4)).view(*SIZE) for k in range(3)]
    places = [each.project(np.array(s.towards)[:, None])[:, 0] for each in slower]
    assert np.allclose(abs(np.diff(places, axis=0)), 0.25, atol=1e-9)


def test_it_goes_round_and_is_nowhere_twice_before_it_is_back():
    sensors = rest.around(setting("CB3"), SIZE, 5)
    assert len(set(sensors)) == 4
    assert sensors[0] == sensors[-1]


def sees_backs(s, sensor):
    """Whether some pixel sees the back of a surface, as through a wall."""
    return bool((facing(s.scene, sensor) < 0).any())


@pytest.mark.parametrize("name", NAMES)
def test_a_camera_that_goes_round_stays_in_its_room(name):
    s = setting(name)
    assert not any(sees_backs(s, sensor) for sensor in rest.around(s, SIZE, 5))


@pytest.mark.parametrize("name", ["Ajar3", "Checker3"])
@pytest.mark.parametrize("way", [(-1, -1), (-1, 1), (1, -1), (1, 1)])
def test_a_camera_that_goes_on_by_half_a_pixel_is_out_of_a_closed_room_within_twenty_frames(name, way):
    s = setting(name)
    places = [tuple(0.5 * k * step for step in way) for k in range(1, PAPER["moving"])]
    assert any(out_of_the_room(s, by) for by in places)


def out_of_the_room(s, by):
    """Whether a slide is refused, as of one who sees nothing, or has its eye outside of the unit cube's rooms."""
    try:
        eye = np.array(rest.slid(s, SIZE, by).eye)
    except ValueError:
        return True
    return bool((eye[[0, 2]] < 0).any() or eye[2] > 1 or not 0 < eye[1] < 0.99)


def test_history_follows_by_either_option_in_motion():
    s = setting("Checker3")
    follow = {}
    for camera, each in rest.CAMERAS.items():
        (view,) = views_of(s, each.sensors(s, [8, 8], 1), GRADIENT, ADAPTIVE, Counter())
        follow[camera] = each.history(view)["dx"].follow
    assert [follow[camera] for camera in rest.MOVING] == [keeping, gathering]
    assert {follow[camera] for camera in rest.RESTING} == {keeping}


# ---------------------------------------------------------------- reuse


def test_a_radius_is_that_of_the_film():
    assert rest.reuse_on(FILM) == GRADIENT
    assert rest.reuse_on((192, 108)).pairs.radius == 2
    coarse = rest.reuse_on(SIZE)
    assert coarse.pixels == replace(GRADIENT.pixels, radius=1)
    assert coarse.pairs == replace(GRADIENT.pairs, radius=1)


@pytest.mark.parametrize("method", ["with", "after"])
@pytest.mark.parametrize(("camera", "radius"), [(rest.WHOLE, 1), (rest.STILL, 20)])
def test_neighbours_are_asked_for_within_that_radius(monkeypatch, method, camera, radius):
    asked = set()

    def spied(around):
        def found(of, index, count, reach, chance):
            asked.add(reach)
            return around(of, index, count, reach, chance)

        return found

    def views(*args):
        every = views_of(*args)
        return [{name: replace(group, around=spied(group.around)) for name, group in view.items()} for view in every]

    monkeypatch.setattr(rest, "views_of", views)
    preset = {"crop": [4, 4], "film": [8, 4], "still": 1, "replicas": 1}
    chunk = {"camera": camera, "scene": "Checker3", "method": method}
    rest.compute(preset, chunk, rng=np.random.default_rng(1))
    assert asked == {radius}


# ---------------------------------------------------------------- judging


def arrays(replicas, sizes):
    """Noise of all views; `sizes(camera, scene)` is what pair reuse has of the others' errors."""
    rng, found = np.random.default_rng(1), {"crop": np.array([32, 32]), "film": np.array([16, 9])}
    for camera, each in rest.CAMERAS.items():
        columns, rows = found[each.size]
        for scene in NAMES:
            for method in METHODS:
                size = sizes(camera, scene) if method == "with" else 1.0
                for name, n in {"dx": (columns - 1) * rows, "dy": columns * (rows - 1)}.items():
                    found[f"{camera}.{scene}.{method}.{name}"] = size * rng.normal(size=(replicas, n))
                found[f"{camera}.{scene}.{method}.rays"] = np.array(1.0)
    return found


def judged(sizes):
    """Verdicts of the crops at rest, the whole views at rest and those in motion; None where they are undecided."""
    a = arrays(64, sizes)
    claims = [rest.at_rest(a, camera, camera, "") for camera in rest.RESTING] + [rest.in_motion(a)]
    return [claim.outcome and claim.outcome.passed for claim in claims]


SMALL, LARGE = 0.5, 2.0


@pytest.mark.parametrize("mine", [rest.STILL, rest.WHOLE, rest.MOVING[0], rest.MOVING[1]])
def test_crops_whole_views_and_those_in_motion_are_judged_apart(mine):
    found = judged(lambda camera, scene: SMALL if camera == mine else LARGE)
    assert found == [mine == rest.STILL, mine == rest.WHOLE, mine in rest.MOVING]


@pytest.mark.parametrize(("met", "passed"), [(1, False), (2, True)])
def test_two_of_three_scenes_are_enough_and_one_is_not(met, passed):
    assert judged(lambda camera, scene: SMALL if scene in NAMES[:met] else LARGE) == [passed] * 3


@pytest.mark.parametrize("other", rest.OTHERS)
def test_one_of_the_others_that_is_as_good_is_enough_to_miss_it(other):
    a = arrays(64, lambda camera, scene: SMALL)
    good = {key: SMALL * each for key, each in a.items() if f".{other}.d" in key}
    claims = [rest.at_rest(a | good, camera, camera, "") for camera in rest.RESTING] + [rest.in_motion(a | good)]
    assert [claim.outcome.passed for claim in claims if claim.outcome] in ([False, False], [False, False, False])


def test_what_rays_cost_counts_at_rest_and_not_in_motion():
    a = arrays(64, lambda camera, scene: SMALL)
    dear = {key: np.array(8.0) for key in a if key.endswith("with.rays")}
    at_rest = [rest.at_rest(a | dear, camera, camera, "").outcome.passed for camera in rest.RESTING]
    assert at_rest == [False, False]
    assert rest.in_motion(a | dear).outcome.passed is True


def test_too_few_replicas_judge_nothing_and_have_the_same_parts():
    many, few = (rest.check(arrays(replicas, lambda camera, scene: SMALL)) for replicas in (64, 8))
    assert [claim.part for claim in many] == [claim.part for claim in few]
    assert len({claim.part for claim in many}) == len(many)
    assert [claim.outcome.passed for claim in many[:3]] == [True, True, True]
    assert all((claim.outcome is None) is not claim.part.endswith("how many") for claim in few)


# ---------------------------------------------------------------- edges


@pytest.mark.parametrize(("scene", "ratio"), [("Ajar3", 1.0), ("CB3", 1.5)])
def test_pairs_that_see_nothing_are_no_pairs_to_have_edges_among(scene, ratio):
    a = {"film": np.array(SIZE)}
    edge = np.concatenate(list(rest.edge_of(a, rest.WHOLE, scene).values()))
    found = rest.edge_pairs(a, rest.WHOLE, scene) / edge.mean()
    assert found == pytest.approx(1, abs=1e-12) if ratio == 1 else found > ratio


def test_edge_pairs_carry_the_variance_that_they_have():
    edge = {"dx": np.array([True, False, False]), "dy": np.array([False, True])}
    noise = np.random.default_rng(1).normal(size=(64, 1))
    a = {"v.with.dx": noise * [3.0, 1.0, 0.0], "v.with.dy": noise * [1.0, 0.0]}
    assert rest.at_edges(a, "v", "with", edge) == pytest.approx(9 / 11)
    assert rest.at_edges(a, "v", "with", {name: ~each for name, each in edge.items()}) == pytest.approx(2 / 11)
