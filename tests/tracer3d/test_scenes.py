"""Every scene is what its docstring says: closed or open, lamps, slit, step, ball, colours, and what is seen."""

from dataclasses import replace
from hashlib import sha256

import numpy as np
import pytest

from restir_ref.batch import Array
from restir_ref.transport.rays import arrive
from restir_ref.transport.scene import Scene
from tracer3d import SCENES
from tracer3d.scenes import Setting, two_rooms
from tracer3d.sensors import FILM, facing

every_scene = pytest.mark.parametrize("name", SCENES)
CLOSED = [name for name in SCENES if "cornell" not in name]
BOXES = [name for name in SCENES if "cornell" in name]


def escaping(name: str) -> float:
    """Share of 4000 directions from the eye, and of 4000 from where they arrive, in which nothing is met."""
    setting, rng = SCENES[name](), np.random.default_rng(1)
    s = setting.scene
    x = np.broadcast_to(np.array(setting.eye)[:, None], (3, 4000))
    v, _, met = arrive(s, x, s.space.sphere(rng.random((2, 4000))))
    inside = np.flatnonzero(met & v.front)
    local = s.space.sphere(rng.random((2, len(inside))))
    local[2] = abs(local[2]) + 1e-3
    w = s.space.to_world(v.n[:, inside], local / np.linalg.norm(local, axis=0))
    _, _, again = arrive(s, v.x[:, inside], w)
    return float(1 - np.concatenate([met, again]).mean())


@pytest.mark.parametrize("name", CLOSED)
def test_rooms_are_closed(name):
    assert escaping(name) == 0


@pytest.mark.parametrize("name", BOXES)
def test_the_cornell_box_is_open_and_has_32_triangles(name):
    assert escaping(name) > 0.1
    assert SCENES[name]().scene.S == 32


@every_scene
def test_insets_and_views_see_fronts(name):
    setting = SCENES[name]()
    sides = facing(setting.scene, setting.pinhole())
    assert (sides != 0).all()
    assert (sides > 0).mean() > (0.9 if name not in ("ajar", "ajar_ceiling", "many_lights") else 0.5)
    left, top = setting.crop
    assert left + 64 <= FILM[0]
    assert top + 64 <= FILM[1]


def materials_seen(name: str, sensor) -> set[int]:
    setting = SCENES[name]()
    v, _, met = arrive(setting.scene, *sensor.ray(np.arange(sensor.n), np.full((2, sensor.n), 0.5))[:2])
    return {*v.material[met].tolist()}


def distances_seen(name: str) -> Array:
    setting = SCENES[name]()
    sensor = setting.pinhole()
    _, t, _ = arrive(setting.scene, *sensor.ray(np.arange(sensor.n), np.full((2, sensor.n), 0.5))[:2])
    return t.reshape(sensor.shape)


@pytest.mark.parametrize("name", BOXES)
def test_the_inset_of_the_cornell_box_has_the_edge_of_a_box_in_it(name):
    assert {0, 3} <= materials_seen(name, SCENES[name]().pinhole())
    t = distances_seen(name)
    assert abs(np.diff(t, axis=1)).max() > 0.05


def test_left_is_red_and_right_is_green():
    setting = SCENES["matte_cornell"]()
    s, view = setting.scene, setting.view(64, 64)
    v, _, _ = arrive(s, *view.ray(np.arange(4096), np.full((2, 4096), 0.5))[:2])
    colour = s.materials.colour[:, v.material * s.materials.L].reshape(3, 64, 64)
    assert colour[0, 32, 2] > 4 * colour[1, 32, 2]
    assert colour[1, 32, 61] > 3 * colour[0, 32, 61]


def test_the_tall_box_stands_on_the_left_behind_the_low_one():
    s = SCENES["cornell"]().scene
    x = np.moveaxis(s.corners[:, :, s.material[: s.S] == 3], 1, 0).reshape(3, -1)
    heights = np.round(x[1], 9)
    tall, low = x[:, heights == 0.6], x[:, heights == 0.3]
    assert tall[0].mean() < 0.5 < low[0].mean()
    assert tall[2].mean() < low[2].mean()


@pytest.mark.parametrize(("name", "roughness"), [("cornell", 0.5), ("glossy_cornell", 0.15)])
def test_boxes_have_the_ledger_s_perceptual_roughness(name, roughness):
    m = SCENES[name]().scene.materials
    row = 3 * m.L + 1
    assert m.roughness[row] == roughness
    assert m.alpha[row] == pytest.approx(roughness**2)
    assert SCENES["matte_cornell"]().scene.materials.L == 1


# ---------------------------------------------------------------- the door


def through_the_wall(s: Scene, n: int = 20_000) -> tuple[Array, Array]:
    """Whether points of both rooms see each other, and whether the way between them leads through the slit; (n,)."""
    rng = np.random.default_rng(2)
    x, y = rng.uniform(0.05, 0.95, (2, 3, n))
    y[0] += 1
    # Aim at the wall about the slit, so that ways through it are not rare.
    at = np.stack([np.ones(n), rng.uniform(0, 1, n), rng.uniform(0.4, 0.7, n)])
    y = x + (at - x) * ((y[0] - x[0]) / (1 - x[0]))
    kept = ((y > 0.01) & (y < np.array([[1.99], [0.98], [0.99]]))).all(axis=0)
    x, y, at = x[:, kept], y[:, kept], at[:, kept]
    slit = (at[1] < 0.9) & (at[2] > 0.5) & (at[2] < 0.56)
    return s.visible(x, y), slit


def test_rooms_see_each_other_through_the_slit_only():
    clear, slit = through_the_wall(two_rooms())
    assert 0.05 < slit.mean() < 0.5
    assert (clear == slit).all()


def test_a_wider_slit_is_noticed():
    clear, slit = through_the_wall(two_rooms(0.07))
    assert (clear != slit).any()


@pytest.mark.parametrize("name", ["ajar", "ajar_ceiling"])
def test_the_lamp_is_beyond_the_door(name):
    setting = SCENES[name]()
    assert (setting.scene.lights.corners.mean(axis=0)[0] > 1.4).all()
    assert setting.eye[0] < 1


def test_the_ceiling_view_sees_the_ceiling():
    setting = SCENES["ajar_ceiling"]()
    sensor = setting.pinhole(48, 48)
    v, _, _ = arrive(setting.scene, *sensor.ray(np.arange(sensor.n), np.full((2, sensor.n), 0.5))[:2])
    assert (abs(v.x[1] - 1) < 1e-9).all()


def test_the_view_of_ajar_sees_the_slit():
    setting = SCENES["ajar"]()
    sensor = setting.view(192, 108)
    v, _, _ = arrive(setting.scene, *sensor.ray(np.arange(sensor.n), np.full((2, sensor.n), 0.5))[:2])
    assert (v.x[0] > 1 + 1e-6).sum() > 10


# ---------------------------------------------------------------- the others


def test_the_checker_has_squares_of_two_albedos_and_a_step():
    s = SCENES["checker"]().scene
    rng = np.random.default_rng(3)
    x = np.stack([rng.uniform(0.001, 0.999, 5000), np.full(5000, 0.5), rng.uniform(0.001, 0.999, 5000)])
    v, _, _ = arrive(s, x, np.repeat([[0.0], [-1.0], [0.0]], 5000, axis=1))
    assert (v.material == (np.floor(8 * x[0]) + np.floor(8 * x[2])).astype(int) % 2).all()
    assert v.x[1] == pytest.approx(0.1 * (x[0] >= 0.5), abs=1e-9)
    assert s.materials.colour[0, :2].tolist() == [0.8, 0.2]


def test_the_checker_s_inset_has_both_squares_and_the_step_in_it():
    assert {0, 1} <= materials_seen("checker", SCENES["checker"]().pinhole())
    setting = SCENES["checker"]()
    sensor = setting.pinhole()
    v, _, _ = arrive(setting.scene, *sensor.ray(np.arange(sensor.n), np.full((2, sensor.n), 0.5))[:2])
    assert {0.0, 0.1} <= set(np.round(v.x[1], 9))


def test_the_inset_of_the_crease_has_wall_and_floor_at_a_right_angle():
    setting = SCENES["crease"]()
    sensor = setting.pinhole()
    v, _, _ = arrive(setting.scene, *sensor.ray(np.arange(sensor.n), np.full((2, sensor.n), 0.5))[:2])
    found = {tuple(n) for n in np.round(v.n.T + 0.0, 9).tolist()}
    assert found == {(1.0, 0.0, 0.0), (0.0, 1.0, 0.0)}


def test_the_ball_of_glass_hangs_over_the_floor():
    s = SCENES["glass_ball"]().scene
    assert s.centres[1, 0] - s.radii[0, 0] == pytest.approx(0.11)
    assert s.materials.roughness[s.material[-1] * s.materials.L] == 0


def on_the_pane(setting: Setting) -> tuple[Array, Array, Array]:
    """Points of a small view (3, N), corners of the lamp, and where the pane, x = 1.45, mirrors these; (3, E, N) each.

    By hand: lines to the points from the corners' images behind the pane.
    """
    sensor = setting.pinhole(24, 24, (948, 528))
    v, _, met = arrive(setting.scene, *sensor.ray(np.arange(sensor.n), np.full((2, sensor.n), 0.5))[:2])
    assert met.all()
    corners = np.moveaxis(setting.scene.lights.corners, 1, 0).reshape(3, -1)[:, :, None]
    image = np.concatenate([2 * 1.45 - corners[:1], corners[1:]])
    x = np.broadcast_to(v.x[:, None], (3, corners.shape[1], sensor.n))
    at = image + (x - image) * (1.45 - image[0]) / (x[0] - image[0])
    return x, np.broadcast_to(corners, x.shape), at


def test_the_pane_mirrors_the_whole_lamp_onto_the_ball_in_the_middle_of_the_inset():
    setting = SCENES["distant_caustic"]()
    x, _, at = (each.reshape(3, -1) for each in on_the_pane(setting))
    away = x - setting.scene.centres[:, 0][:, None]
    assert np.allclose(np.linalg.norm(away, axis=0), 0.07)
    assert ((away * (at - x)).sum(axis=0) > 0).all()
    assert (np.abs(at[1] - 0.65) < 0.25).all()
    assert (np.abs(at[2] - 0.5) < 0.25).all()


def test_nothing_stands_between_the_ball_the_pane_and_the_lamp():
    setting = SCENES["distant_caustic"]()
    x, corners, at = (each.reshape(3, -1) for each in on_the_pane(setting))
    assert setting.scene.visible(x, at).all()
    assert setting.scene.visible(at, corners).all()


def test_64_lamps_are_behind_slats():
    s = SCENES["many_lights"]().scene
    assert len(s.lights.upto) == 128
    assert len(set(np.round(s.lights.emission[0], 9))) == 64
    rng = np.random.default_rng(4)
    y = s.lights.corners.mean(axis=0)[:, rng.integers(128, size=4000)]
    x = np.stack([rng.uniform(0.05, 0.95, 4000), np.full(4000, 0.3), rng.uniform(0.05, 0.95, 4000)])
    assert 0.3 < s.visible(x, y).mean() < 0.8


@every_scene
def test_lamps_shine_in_white_and_in_three_channels(name):
    emission = SCENES[name]().scene.lights.emission
    assert len(emission) == 3
    assert (emission == emission[0]).all()


# ---------------------------------------------------------------- unchanged


def digest(name: str) -> str:
    """Eight hex digits of everything a scene is made of, to nine decimals."""
    at = SCENES[name]()
    s, m = at.scene, at.scene.materials
    view = [*at.eye, *at.towards, *at.up, *at.crop, at.depth, at.half]
    parts = (
        s.corners,
        s.emission,
        s.material,
        s.centres,
        s.radii,
        m.kind,
        m.roughness,
        m.colour,
        m.weight,
        m.eta,
        view,
    )
    return sha256(b"".join((np.round(part, 9) + 0.0).tobytes() for part in map(np.float64, parts))).hexdigest()[:8]


DIGESTS = {
    "cornell": "9031b214",
    "glossy_cornell": "7e9c6d38",
    "matte_cornell": "5dc85b28",
    "ajar": "d50c2355",
    "ajar_ceiling": "7790f1b7",
    "checker": "ee0592e9",
    "crease": "4351fe54",
    "furnace": "69abb2f5",
    "glass_ball": "ad1c39d9",
    "distant_caustic": "28c2c2ca",
    "many_lights": "6d5118d1",
}
"""Whoever changes a scene on purpose changes its digest, and makes its references and results anew."""


@every_scene
def test_a_scene_changes_on_purpose_only(name):
    assert digest(name) == DIGESTS[name]


def test_a_lamp_a_hair_brighter_is_noticed(monkeypatch):
    right = SCENES["ajar"]()
    brighter = replace(right.scene, emission=right.scene.emission * 1.0001)
    monkeypatch.setattr("tests.tracer3d.test_scenes.SCENES", {"ajar": lambda: replace(right, scene=brighter)})
    assert digest("ajar") != DIGESTS["ajar"]
