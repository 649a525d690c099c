"""What real-time figures compare: moving cameras, indirect light alone, corners, and scenes where shifts differ."""

from collections import Counter

import numpy as np
import pytest

from figures.experiments import corners
from figures.experiments.flatland import TEN, moving
from figures.experiments.indirect import METHODS, darkened
from figures.experiments.realtime import FRAMES, MARGIN, STEP, costed, sideways, widened
from figures.experiments.rendering import film
from figures.experiments.split_light import without_direct
from figures.experiments.views import HYBRID, view
from figures.gris import gris_c10, gris_c12
from figures.gris.gris_f01 import CAUSTIC, GLOSSY, PIXELS
from figures.gris.gris_f01 import film as film_of
from figures.gris.gris_f12 import glossiest
from flatland2d import SCENES
from flatland2d.gbuffer import gbuffer
from flatland2d.sensors import FILM
from restir_ref.batch import Array
from restir_ref.transport.baselines.restir_gi import RadianceIntegrals
from restir_ref.transport.paths import leaves, trace
from restir_ref.transport.vectors import norm
from tests.core.stubs import live

# ---------------------------------------------------------------- cameras


@pytest.mark.parametrize("name", SCENES)
def test_a_camera_that_moves_sideways_arrives_where_it_is_told(name):
    assert sideways(SCENES[name]().pinhole()) == moving(name, FRAMES, STEP)
    assert [each.n for each in widened(name)] == [128 + 2 * MARGIN] * FRAMES


def test_whole_films_are_judged_at_pixels_in_equal_steps():
    assert set(np.diff(PIXELS)) == {FILM // 128}
    assert PIXELS[0] == FILM - 1 - PIXELS[-1]


def glossy(name) -> bool:
    """Whether the film shows a surface with a lobe that does not connect."""
    setting = SCENES[name]()
    seen = setting.scene.material[gbuffer(setting.scene, film_of(name)).prim]
    return bool((glossiest(setting.scene.materials)[np.unique(seen)] < HYBRID.roughness).any())


def test_restir_gi_is_judged_where_glossy_surfaces_are_seen():
    assert all(glossy(name) for name in GLOSSY)
    assert not glossy(CAUSTIC)


# ---------------------------------------------------------------- indirect light


@pytest.mark.parametrize("name", ["clear_coat", "glass_disc"])
def test_darkened_trees_have_the_leaves_that_restir_di_leaves_over(name):
    t = view(name, HYBRID, Counter(), SCENES[name]().pinhole(FILM, 0)).tracer
    tree = trace(t, live().uniform((t.D, 3000)), np.arange(3000) % FILM)
    found, expected, whole = leaves(darkened(tree)), without_direct(tree), leaves(tree)
    same = [(F == G).all() for (*_, F), (*_, G) in zip(found, expected, strict=True)]
    assert all(same)
    assert not all((F == G).all() for (*_, F), (*_, G) in zip(leaves(darkened(tree)), whole, strict=True))


def third_frames(integrals, rule) -> Array:
    """Third frames of a still camera beside furniture, 64 replicas."""
    of = integrals(view("crease", rule, Counter()).tracer)
    *_, images = film([of] * 3, 64, live())
    return images


def within(images: Array, truth: Array) -> bool:
    """|z| < 4 of the image's mean over replicas, with a standard error below 2%."""
    means = images.mean(axis=1) / truth.mean()
    error = means.std(ddof=1) / np.sqrt(len(means))
    return bool(error < 0.02 and abs(means.mean() - 1) < 4 * error)


def indirect() -> Array:
    """Indirect light of the same image, by radiosity."""
    setting = SCENES["crease"]()
    return corners.indirect_light(setting, setting.pinhole())


@pytest.mark.parametrize("name", METHODS)
def test_every_method_shares_indirect_light_alone_and_all_of_it(name):
    """ReSTIR GI is right in a scene of Lambert surfaces."""
    assert within(third_frames(METHODS[name].integrals, METHODS[name].rule), indirect())


def test_direct_light_left_in_is_noticed():
    assert not within(third_frames(RadianceIntegrals, METHODS["ReSTIR GI"].rule), indirect())


def test_a_frame_of_the_reconnection_shift_costs_fewer_rays_than_one_of_the_hybrid_shift():
    costs = {}
    for name in ("hybrid", "reconnection"):
        asked, method = Counter(), METHODS[name]
        of = method.integrals(view("glossy_cornell", method.rule, asked).tracer)
        *_, (_, costs[name]) = costed([of] * 3, asked, 4, live())
    assert 1 < costs["hybrid"] / costs["reconnection"] < 1.5


# ---------------------------------------------------------------- corners


def test_in_the_wedge_clearance_is_the_distance_to_the_corner_times_the_sine_of_its_angle():
    scene, sensor = SCENES[gris_c10.SCENE]().scene, gris_c10.wedge()
    s = norm(gbuffer(scene, sensor).x)
    assert corners.clearance(scene, sensor) == pytest.approx(s * np.sin(np.radians(gris_c10.ANGLE)), rel=1e-12)


def test_what_is_around_a_pixel_is_within_the_radius_of_it():
    mask = np.arange(100) == 40
    assert (np.flatnonzero(corners.around(mask, 20)) == np.arange(20, 61)).all()


def counted(sensor) -> dict[str, Array]:
    """Shifts, and connections shorter than 1%, 2.9% and 5% of the room."""
    rng = np.random.default_rng(1)
    return corners.connections(gris_c10.least(0), gris_c10.SCENE, [0.01, 0.029, 0.05], 64, rng, sensor)


def test_a_tenth_of_the_shifts_into_the_corner_of_the_wedge_connect_over_less_than_1_percent():
    near = corners.clearance(SCENES[gris_c10.SCENE]().scene, gris_c10.wedge()) < 0.01
    found = counted(gris_c10.wedge())
    one = found["short"][0]
    assert corners.share(one, found["shifts"], near) == pytest.approx(0.1, abs=0.05)
    assert one[~corners.around(near)].sum() == 0


def test_across_a_gap_of_3_percent_no_connection_is_shorter():
    one, almost, five = counted(SCENES[gris_c10.SCENE]().pinhole())["short"].sum(axis=1)
    assert (one, almost) == (0, 0)
    assert five > 100


# ---------------------------------------------------------------- scenes in which shifts differ


def test_judged_are_the_scenes_in_which_the_two_shifts_differ():
    shares = {scene: gris_c12.differing(scene, 8, 0) for scene in TEN}
    assert {scene for scene, share in shares.items() if share > gris_c12.LEAST} == set(gris_c12.JUDGED)
    assert shares["ajar"] == 0
