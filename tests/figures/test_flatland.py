"""What figures of flatland compare: equal rays, films with history, insets of wider rows, light in two parts."""

from collections import Counter

import numpy as np
import pytest

from figures.experiments import offline
from figures.experiments.flatland import TEN, moving
from figures.experiments.realtime import MARGIN, METHODS, STEP, costed, inset, widened
from figures.experiments.references import INDIRECT, reference
from figures.experiments.rendering import (
    POINTS,
    estimates,
    film,
    lattice_tracing,
    path_tracing,
    samples_of_equal_cost,
    spatial_only,
)
from figures.experiments.split_light import IndirectIntegrals, direct_film, without_direct
from figures.experiments.views import HYBRID, view
from figures.gris import gris_f14, gris_f17
from flatland2d import PLANE, SCENES
from flatland2d.scenes import LAMP, chain, matte, room
from flatland2d.sensors import Pinhole
from restir_ref.batch import Array
from restir_ref.counting import Counting
from restir_ref.integrals import Pixels
from restir_ref.loop import REAL_TIME, random_in_row, spread_in_row
from restir_ref.metrics import tile_contrast
from restir_ref.restir import initial, spatial
from restir_ref.transport.baselines.restir_di import indirect_light
from restir_ref.transport.counting import CLOSEST, SHADOW, counted
from restir_ref.transport.paths import Tracer, radiance, trace
from restir_ref.transport.restir_pt import PathIntegrals
from restir_ref.transport.scene import scene
from tests.core.stubs import live

COSTS = [(ours, tree) for ours in (0.5, 6.4, 12.8, 22.3, 1531.0) for tree in (5.4, 6.4, 8.61)]

# ---------------------------------------------------------------- equal rays


def favoured(samples) -> list[tuple[float, float]]:
    """Costs (ours, a tree) for which the other side would get fewer rays than we do."""
    return [(ours, tree) for ours, tree in COSTS if samples(ours, tree) * tree < ours]


def test_at_equal_rays_the_others_spend_at_least_as_many_but_less_than_a_tree_more():
    assert favoured(samples_of_equal_cost) == []
    assert all(samples_of_equal_cost(ours, tree) in (1, np.ceil(ours / tree)) for ours, tree in COSTS)


def test_rounding_to_the_nearest_tree_would_favour_us():
    assert favoured(lambda ours, tree: max(1, round(ours / tree)))


# ---------------------------------------------------------------- counted rays, by hand


def floor_below_a_lamp(depth: int, asked: Counter[str]) -> PathIntegrals:
    """Eight pixels of the floor of an empty room, all of which see the whole lamp."""
    lit_room = scene(PLANE, [matte(0.5)], [*room(0), *chain(LAMP, 0, 8.0)])
    return PathIntegrals(Tracer(counted(lit_room, asked), Pinhole((0.5, 0.5), (0.5, 0.0), 8), depth, HYBRID))


@pytest.mark.claims("COM-M06")
@pytest.mark.parametrize("depth", [1, 2, 3])
def test_a_path_tree_costs_one_ray_to_each_vertex_and_at_most_one_from_each_to_a_light(depth):
    asked = Counter()
    found = estimates(path_tracing(1), floor_below_a_lamp(depth, asked), asked, 5, live())
    assert asked[CLOSEST] == 5 * 8 * (1 + depth)
    assert 5 * 8 <= asked[SHADOW] <= 5 * 8 * depth  # a vertex on the ceiling is not below the lamp
    assert found.rays == asked.total() / (5 * 8)


@pytest.mark.claims("COM-M06")
def test_on_a_lit_floor_counts_are_those_made_by_hand():
    """Depth 1: a tree is 2 rays and one to the lamp; a shift is one to y_1 and one to the light it keeps."""
    asked, chance, N = Counter(), live(), 24
    here = Pixels(Counting(floor_below_a_lamp(1, asked), asked), np.arange(N))
    X = initial(here, chance)
    assert (asked[CLOSEST], asked[SHADOW], asked["shift"]) == (2 * N, N, 0)
    spatial(X, here, random_in_row(here.of, here.index, 3, 20, chance), chance)
    assert (asked[CLOSEST], asked[SHADOW], asked["shift"]) == (2 * N + 6 * N, N + 6 * N, 6 * N)


def test_every_frame_is_charged_and_history_costs_extra():
    asked = Counter()
    of = floor_below_a_lamp(1, asked)
    (_, first), (_, second), (_, third) = costed([of] * 3, asked, 4, live())
    assert second == third == first + 2 * 2  # two more shifts of two rays


# ---------------------------------------------------------------- films


def one_frame(around) -> Array:
    """A frame without history of 3 replicas."""
    return spatial_only(REAL_TIME, around)(view("cornell", HYBRID, Counter()), np.arange(3 * 128), live())


def test_a_film_of_one_frame_is_a_frame_without_history():
    (found,) = film([view("cornell", HYBRID, Counter())], 3, live())
    assert (found.ravel() == one_frame(random_in_row)).all()
    assert not (found.ravel() == one_frame(spread_in_row)).all()


def test_a_moving_camera_arrives_at_the_standard_inset_in_equal_steps():
    views = moving("crease", 5, STEP)
    eyes = np.array([each.eye for each in views])
    assert views[-1] == SCENES["crease"]().pinhole()
    assert np.linalg.norm(np.diff(eyes, axis=0), axis=1) == pytest.approx(STEP)


@pytest.mark.parametrize("name", SCENES)
def test_the_inset_is_the_middle_of_the_wider_row(name):
    wide, narrow = widened(name)[-1], SCENES[name]().pinhole()
    pixel, u = np.arange(narrow.n), np.full((1, narrow.n), 0.3)
    x, w, _ = wide.ray(pixel + MARGIN, u)
    assert (np.stack([x, w]) == np.stack(narrow.ray(pixel, u)[:2])).all()
    assert (inset(np.arange(wide.n)) == pixel + MARGIN).all()


@pytest.mark.parametrize("name", METHODS)
def test_every_method_makes_images_of_the_right_brightness(name):
    """Two frames; ReSTIR GI is right in a scene of Lambert surfaces."""
    asked, method = Counter(), METHODS[name]
    of = method.integrals(view("crease", method.rule, asked).tracer)
    *_, (images, _) = costed([of] * 2, asked, 64, live())
    assert within(images, reference("crease").mean)


def within(images: Array, truth: Array) -> bool:
    """|z| < 4 of the image's mean over replicas, with a standard error below 2%."""
    means = images.mean(axis=1) / truth.mean()
    error = means.std(ddof=1) / np.sqrt(len(means))
    return bool(error < 0.02 and abs(means.mean() - 1) < 4 * error)


# ---------------------------------------------------------------- light in two parts


@pytest.mark.parametrize("name", ["clear_coat", "glass_disc"])
def test_leaves_without_direct_light_are_what_restir_di_leaves_over(name):
    t = view(name, HYBRID, Counter(), SCENES[name]().pinhole(1920, 0)).tracer
    tree = trace(t, live().uniform((t.D, 5000)), np.arange(5000) % 1920)
    rest = {(k, nee): F for k, nee, F in without_direct(tree)}
    assert sum(rest.values()) == pytest.approx(indirect_light(tree), rel=1e-12)
    assert not rest[1, True].any()
    assert rest[1, False].any() == (name == "glass_disc")  # lamps mirrored by the disc
    assert sum(rest.values()).mean() < radiance(tree).mean()


def both_parts(name: str, integrals) -> Array:
    """Third frames of ReSTIR DI plus third frames of `integrals`, 64 replicas."""
    chance, of = live(), view(name, HYBRID, Counter())
    *_, light = direct_film([of] * 3, 64, chance)
    *_, rest = film([integrals(of.tracer)] * 3, 64, chance)
    return light + rest


@pytest.mark.parametrize("name", ["cornell", "clear_coat"])
def test_direct_and_indirect_light_make_the_whole_image(name):
    assert within(both_parts(name, IndirectIntegrals), reference(name).mean)


def test_direct_light_counted_twice_is_noticed():
    assert not within(both_parts("cornell", PathIntegrals), reference("cornell").mean)


# ---------------------------------------------------------------- indirect light, offline


def seen_offline(method: offline.Method, scene: str, count: int) -> Array:
    return offline.render(method, scene, count, np.random.default_rng(2))["images"]


COUNTS = {"path tracing": 128, "path reuse": 96, "reconnection": 16, "hybrid": 16}


@pytest.mark.parametrize("scene", ["cornell", "clear_coat"])
@pytest.mark.parametrize("name", offline.METHODS)
def test_offline_methods_make_indirect_light_of_the_right_brightness(name, scene):
    assert within(seen_offline(offline.METHODS[name], scene, COUNTS[name]), reference(scene, INDIRECT).mean)


def test_direct_light_in_an_offline_image_is_noticed():
    images = seen_offline(offline.Method(path_tracing(4), 4), "clear_coat", 64)
    assert not within(images, reference("clear_coat", INDIRECT).mean)


def test_rays_from_x_1_to_lights_are_not_charged():
    """On the lit floor a tree of depth 1 is two rays and one to the lamp."""
    asked = Counter()
    assert offline.lit(floor_below_a_lamp(3, asked).tracer, asked, live()) == 1


def test_a_lattice_of_trees_has_the_right_mean_and_less_variance_than_as_many_trees():
    of, pixel, chance = view("cornell", HYBRID, Counter()), np.arange(0, 128, 16), live()
    index = (pixel + 128 * np.arange(24)[:, None]).ravel()
    images, trees = (render(of, index, chance).reshape(24, 8) for render in (lattice_tracing(), path_tracing(1)))
    assert within(images, reference("cornell").mean[pixel])
    assert images.var(axis=0).mean() < 0.5 * trees.var(axis=0).mean() / POINTS


@pytest.mark.parametrize("name", TEN)
def test_shifts_differ_but_where_all_is_rough_and_nothing_near(name):
    assert (gris_f17.differing(name, 16, 1) == 0) == (name in gris_f17.ONE_MAP)


def test_shifts_that_differ_are_not_taken_for_one_map(monkeypatch):
    """A mistake: the glossy box among the scenes with one map."""
    monkeypatch.setattr(gris_f17, "ONE_MAP", (*gris_f17.ONE_MAP, "glossy_cornell"))
    some = {"images": np.ones((8, 128)), "rays": np.array(1.0)}
    results = [
        {chunk["what"]: np.array(float(chunk["scene"] == "glossy_cornell"))} if "what" in chunk else some
        for chunk in gris_f17.chunks({})
    ]
    with pytest.raises(ValueError, match="the same map"):
        gris_f17.combine({}, results)


# ---------------------------------------------------------------- traces of tiles


def smooth_errors(tile: int) -> Array:
    """Errors of 256 images of 128 pixels: one number per tile and noise, or a moving mean of noise without tiles."""
    rng = np.random.default_rng(1)
    if tile:
        return rng.standard_normal((256, 128 // tile)).repeat(tile, axis=1) + 0.3 * rng.standard_normal((256, 128))
    noise = rng.standard_normal((256, 131))
    return sum(noise[:, k : k + 128] for k in range(4))


def test_ranks_show_tiles_and_a_firefly_beside_a_border_does_not_look_like_one():
    errors = smooth_errors(0)
    assert tile_contrast(gris_f14.ranks(smooth_errors(16))) > 0.8
    errors[7, 32] += 300
    assert tile_contrast(errors) > 0.3
    assert abs(tile_contrast(gris_f14.ranks(errors))) < 0.05
