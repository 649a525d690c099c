"""Laws of space as figures see it: crops of a film as one image, cameras that follow them, neighbours, tiles."""

from collections import Counter

import numpy as np
import pytest

from figures.experiments import offline, solid
from figures.experiments.rendering import lattice_tracing, path_tracing
from figures.experiments.views import (
    HYBRID,
    SIDE,
    at_random,
    evenly,
    motion_vectors,
    setting,
    standard,
    tile_order,
    view,
)
from restir_ref.chance import Live
from restir_ref.transport.baselines.restir_di import indirect_light
from restir_ref.transport.rays import arrive
from tracer3d.motion import motion
from tracer3d.sensors import FILM, Mosaic

SCENES = list(solid.SCENES)


def small(name: str, wide: int = 8):
    """Two crops of a scene, a few pixels wide."""
    return Mosaic(setting(name).pinhole(wide, wide), ((960, 700), (1076, 1022)))


@pytest.mark.parametrize("name", SCENES)
def test_pixels_of_a_mosaic_see_what_those_of_its_crops_see(name) -> None:
    mosaic, rng = standard(name), np.random.default_rng(1)
    assert mosaic.n == solid.COUNT * solid.SIDE**2
    for k, crop in enumerate(mosaic.crops()):
        pixel, u = np.arange(crop.n), rng.random((2, crop.n))
        for ours, its in zip(mosaic.ray(pixel + k * crop.n, u), crop.ray(pixel, u), strict=True):
            assert np.array_equal(ours, its)


def test_crops_stand_on_the_film_apart_from_each_other() -> None:
    corners = np.array(standard("CB3").corners)
    assert ((corners >= 0) & (corners <= np.array(FILM) - solid.SIDE)).all()
    apart = np.abs(corners[:, None] - corners).max(axis=-1)[~np.eye(len(corners), dtype=bool)]
    assert apart.min() > 2 * solid.SIDE


def test_a_mosaic_without_crops_and_one_off_the_film_are_refused() -> None:
    camera = setting("CB3").pinhole(8, 8)
    with pytest.raises(ValueError, match="at least one crop"):
        Mosaic(camera, ())
    with pytest.raises(ValueError, match=r"columns of the film, 0 \.\. 1919"):
        Mosaic(camera, ((1915, 0),))


@pytest.mark.parametrize("choose", [at_random, evenly])
def test_neighbours_stay_in_their_crop_and_within_the_radius(choose) -> None:
    of = view("CB3", HYBRID, Counter())
    index = np.arange(2 * of.n)
    for near in choose(of, index, 6, 10, Live(np.random.default_rng(2))):
        (one, a), (two, b) = (np.divmod(each, solid.SIDE**2) for each in (index, near.index))
        assert np.array_equal(one, two)
        step = np.array(np.divmod(a, solid.SIDE)) - np.array(np.divmod(b, solid.SIDE))
        assert (step**2).sum(axis=0).max() <= 100
        assert (step[0] != 0).any()


@pytest.mark.parametrize("name", SCENES)
def test_crops_follow_what_their_centres_see(name) -> None:
    of, views = setting(name), solid.approach(setting(name), 20)
    assert views[-1] == standard(name)
    for first, last in zip(views[0].crops(), views[-1].crops(), strict=True):
        seen = centre(of, last)
        place = first.project(seen)[:, 0]
        assert np.abs(place - solid.SIDE / 2).max() <= 0.5 + 1e-9


def test_crops_that_stay_on_the_film_lose_what_they_show() -> None:
    of = setting("CB3")
    last = standard("CB3").crops()[0]
    stays = of.at(-19).pinhole(solid.SIDE, solid.SIDE, (last.left, last.top))
    assert np.abs(stays.project(centre(of, last))[:, 0] - solid.SIDE / 2).max() > 30


def centre(of, crop):
    x, w, _ = crop.through(np.array([crop.left + crop.width // 2]), np.array([crop.top + crop.height // 2]))
    return arrive(of.scene, x, w)[0].x


def test_motion_vectors_of_a_mosaic_are_those_of_its_crops() -> None:
    views = [view("CB3", HYBRID, Counter(), each) for each in solid.approach(setting("CB3"), 20)[-2:]]
    found = motion_vectors(views[1], views[0])
    one = solid.SIDE**2
    assert np.array_equal(found // one, np.arange(len(found)) // one)
    crops = zip(views[1].tracer.sensor.crops(), views[0].tracer.sensor.crops(), strict=True)
    for k, (now, before) in enumerate(crops):
        assert np.array_equal(
            found[k * one : (k + 1) * one] - k * one, motion(setting("CB3").scene, now, before).source
        )


def test_tiles_are_squares_of_one_crop() -> None:
    order, count = tile_order(view("CB3", HYBRID, Counter()))
    assert sorted(order) == list(range(len(order)))
    tiles = order.reshape(-1, count)
    row, column = tiles // solid.SIDE, tiles % solid.SIDE
    assert (np.ptp(row, axis=1) == SIDE - 1).all()
    assert (np.ptp(column, axis=1) == SIDE - 1).all()


def test_tiles_of_a_row_of_pixels_are_as_they_come() -> None:
    order, count = tile_order(view("cornell", HYBRID, Counter()))
    assert np.array_equal(order, np.arange(128))
    assert count == 16


def test_path_reuse_in_squares_has_the_mean_of_path_tracing() -> None:
    of, chance = view("CB3", HYBRID, Counter(), small("CB3")), Live(np.random.default_rng(4))
    truth = lattice_tracing(indirect_light)(of, np.arange(of.n), chance)
    images = np.concatenate([offline.reused(of, np.arange(40 * of.n), chance).reshape(40, of.n) for _ in range(3)])
    error = images.mean(axis=1).std(ddof=1) / 120**0.5
    assert error < 0.02 * truth.mean()
    assert abs(images.mean() - truth.mean()) < 4 * error
    by_crop = images.mean(axis=0).reshape(2, -1).mean(axis=1) / truth.reshape(2, -1).mean(axis=1)
    assert by_crop == pytest.approx([1, 1], abs=0.08)


def test_path_reuse_puts_every_pixel_back_in_its_place() -> None:
    of = view("CB3", HYBRID, Counter(), setting("CB3").view(16, 8))
    index, chance = np.arange(8 * of.n), Live(np.random.default_rng(8))
    black = lattice_tracing(indirect_light)(of, np.arange(of.n), chance) == 0
    assert 10 < black.sum() < of.n - 10
    assert not offline.reused(of, index, chance).reshape(8, of.n)[:, black].any()


def test_a_lattice_in_blocks_is_one_in_a_row_to_the_bit(monkeypatch) -> None:
    of = view("cornell", HYBRID, Counter())
    whole = lattice_tracing()(of, np.arange(8), Live(np.random.default_rng(5)))
    monkeypatch.setattr("figures.experiments.rendering.COLUMNS", 100)
    assert np.array_equal(whole, lattice_tracing()(of, np.arange(8), Live(np.random.default_rng(5))))


def test_a_lattice_agrees_with_independent_trees() -> None:
    of, rng = view("cornell", HYBRID, Counter()), np.random.default_rng(6)
    by_lattice = lattice_tracing()(of, np.arange(of.n), Live(rng)).mean()
    by_trees = np.array([path_tracing(16)(of, np.arange(of.n), Live(rng)).mean() for _ in range(16)])
    assert abs(by_lattice - by_trees.mean()) < 4 * by_trees.std(ddof=1) / 4
