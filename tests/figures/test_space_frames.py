"""Laws of frames in space: cameras that arrive, insets and their middles, light in two parts, surfaces near by."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from figures.experiments import arriving, nearby, offline, solid
from figures.experiments.references import INDIRECT, reference
from figures.experiments.views import HYBRID, setting, standard, view
from figures.gris import gris_f07_3d as windows
from figures.gris import gris_f17_3d as shifts
from figures.gris.gris_f07flat import one_pass
from flatland2d import SCENES
from flatland2d.sensors import FILM
from restir_ref.chance import Live
from restir_ref.mis import WEIGHTS
from restir_ref.transport.baselines.restir_di import indirect_light
from restir_ref.transport.paths import radiance, trace
from restir_ref.transport.rays import arrive
from tracer3d.gbuffer import gbuffer

INSETS = list(solid.INSETS)

# ---------------------------------------------------------------- cameras and insets


@pytest.mark.parametrize("scene", ["CB3", "Ajar3"])
def test_crops_of_any_size_are_approached_as_the_standard_ones_are(scene):
    of = setting(scene)
    assert arriving.approach(of, solid.crops(of), 4) == solid.approach(of, 4)


def off_centre(scene: str, frames: int) -> float:
    """How far what an inset's last centre sees is from the first frame's centre, in pixels."""
    of, last = setting(scene), arriving.seen(scene, 20)
    first = arriving.approach(of, last, frames)[0].crops()[0]
    (crop,) = last.crops()
    x, w, _ = crop.through(np.array([crop.left + 10]), np.array([crop.top + 10]))
    return float(np.abs(first.project(arrive(of.scene, x, w)[0].x)[:, 0] - 10).max())


@pytest.mark.parametrize("scene", INSETS)
def test_an_inset_follows_what_its_centre_sees(scene):
    assert off_centre(scene, arriving.FRAMES) <= 0.5 + 1e-9


def test_an_inset_that_stays_on_the_film_loses_what_it_shows(monkeypatch):
    monkeypatch.setattr(arriving, "_corner", lambda of, crop, now: (crop.left, crop.top))
    assert off_centre(INSETS[0], arriving.FRAMES) > 20


@pytest.mark.parametrize("scene", INSETS)
def test_the_middle_of_an_inset_is_what_a_smaller_one_sees(scene):
    small, whole = arriving.seen(scene, 20), standard(scene)
    pixel, u = np.arange(small.n), np.full((2, small.n), 0.25)
    same = arriving.middle(scene, np.arange(whole.n), 20)
    assert np.allclose(small.ray(pixel, u)[1], whole.ray(same, u)[1], rtol=0, atol=1e-14)
    assert not np.allclose(small.ray(pixel, u)[1], whole.ray(same + 1, u)[1], rtol=0, atol=1e-6)


def test_crops_have_no_middle():
    image = np.arange(standard("CB3").n)
    assert arriving.middle("CB3", image, 20) is image


# ---------------------------------------------------------------- light in two parts


def test_direct_truth_and_indirect_references_make_all_light():
    whole, rest = reference("CB3-glossy"), reference("CB3-glossy", INDIRECT)
    last = replace(standard("CB3-glossy").pinhole, width=4, height=4)
    crop, pixels = standard("CB3-glossy"), np.arange(16)
    here = np.concatenate([k * solid.SIDE**2 + pixels // 4 * solid.SIDE + pixels % 4 for k in range(solid.COUNT)])
    direct = arriving.direct_truth("CB3-glossy", replace(crop, pinhole=last), np.random.default_rng(5))["images"]
    expected = whole.mean[here]
    assert abs((rest.mean[here] + direct).mean() / expected.mean() - 1) < 0.01
    assert abs(rest.mean[here].mean() / expected.mean() - 1) > 0.1


def test_light_that_a_delta_lobe_mirrors_is_not_direct():
    film = SCENES["glass_disc"]().pinhole(FILM, 0)  # the crops of space see no mirrored lamp
    t = replace(view("glass_disc", HYBRID, Counter(), film).tracer, depth=1)
    tree = trace(t, np.random.default_rng(2).random((t.D, 8 * film.n)), np.tile(np.arange(film.n), 8))
    assert np.array_equal(arriving.direct_light(tree) + indirect_light(tree), radiance(tree))
    mirrored = (tree.at[0].p == 0) & (radiance(tree) > 0).any(axis=0)
    assert mirrored.any()
    assert not arriving.direct_light(tree)[:, mirrored].any()


# ---------------------------------------------------------------- surfaces near by


def test_pixels_know_whether_another_surface_is_within_reach():
    v, reach = gbuffer(setting("Crease3").scene, standard("Crease3")), HYBRID.distance
    apart = np.sort(v.x, axis=0)[1]  # of floor and wall, from each other's plane
    near = nearby.within("Crease3", reach)
    assert not near[apart >= reach].any()
    assert near[apart < 0.9 * reach].all()
    assert near[apart >= reach / 2].any()


def test_an_inset_of_boxes_sees_nothing_else_and_its_foot_sees_the_floor_too():
    assert nearby.of_material("CB3-glossy, box", 3).all()
    assert 0 < nearby.of_material("CB3-glossy, foot", 3).mean() < 1


def test_pixels_around_others_stay_within_their_crop_and_the_radius():
    sensor = standard("CB3")
    mask = np.zeros(sensor.n, dtype=bool)
    mask[solid.SIDE**2] = True  # the second crop's first pixel
    found = nearby.around(mask, sensor, 3.0).reshape(-1, solid.SIDE, solid.SIDE)
    row, column = np.nonzero(found[1])
    assert not found[[0, 2, 3, 4]].any()
    assert (row**2 + column**2).max() == 9
    assert found[1].sum() == 11  # a quarter of the disk: 4 + 3 + 3 + 1


# ---------------------------------------------------------------- both shifts


def differing(scene: str) -> list[bool]:
    """Whether frames of both shifts differ in anything, crop by crop, in small crops."""
    crops = standard(scene)
    small = replace(crops, pinhole=replace(crops.pinhole, width=8, height=8))
    one, other = (
        offline.render(offline.METHODS[m], scene, 1, np.random.default_rng(3), small)["images"].reshape(-1, 64)
        for m in shifts.SHIFTS
    )
    return [not np.array_equal(a, b) for a, b in zip(one, other, strict=True)]


@pytest.mark.parametrize("scene", shifts.ONE_MAP)
def test_one_shift_is_rendered_only_where_both_are_one_map(scene):
    assert not any(differing(scene))


def test_with_rough_boxes_the_shifts_differ_only_in_crops_with_an_edge():
    edge = nearby.within("CB3", HYBRID.distance).reshape(-1, solid.SIDE, solid.SIDE)[:, :8, :8]
    assert differing("CB3") == edge.any(axis=(1, 2)).tolist()
    assert edge.any()


# ---------------------------------------------------------------- passes over groups


def groups(n: int):
    """Samples of a window of 3 x 3 pixels, n of each."""
    chance = Live(np.random.default_rng(1))
    around = windows.window(windows.FOOT, 40, 3)
    return around[0], [windows.samples(around, chance) for _ in range(n)]


@pytest.mark.parametrize("mis", WEIGHTS)
def test_a_pass_over_groups_is_the_pass_over_all_their_samples(mis):
    here, found = groups(3)
    ours = windows.one_pass(found, here, mis, Live(np.random.default_rng(2)))
    whole, _ = one_pass([each for group in found for each in group], here, mis, Live(np.random.default_rng(2)))
    assert np.allclose(ours, whole, rtol=1e-12, atol=0)


def test_a_pass_over_unequal_groups_is_another_one():
    here, found = groups(2)
    found[1] = found[1][:5]
    ours = windows.one_pass(found, here, "talbot", Live(np.random.default_rng(2)))
    whole, _ = one_pass([each for group in found for each in group], here, "talbot", Live(np.random.default_rng(2)))
    assert not np.allclose(ours, whole, rtol=1e-3, atol=0)
