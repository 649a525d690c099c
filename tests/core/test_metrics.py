"""Error metrics: values of hand cases, what each is invariant to, and what each tells apart."""

from itertools import product
from math import prod

import numpy as np
import pytest

from restir_ref import metrics
from restir_ref.batch import Array
from restir_ref.decorrelation import annealed, energy
from restir_ref.metrics import (
    MAP,
    ROW,
    band_powers,
    bias_and_variance,
    box_covariance,
    low_frequency_ratio,
    mape,
    mape_with_floor,
    neighbour_correlation,
    power_spectrum,
    rel_mse,
    rmse,
    rmse_over_images,
    tile_contrast,
)

R = np.array([1.0, 3.0])
IMAGE = np.array([2.0, 3.0])
HAND = {
    mape: (1 / 1.02 + 0) / 2,
    mape_with_floor: (1 / 1.01 + 0) / 2,
    rel_mse: (1 / (1 + 0.02**2) + 0) / 2,
    rmse: np.sqrt(0.5),
}


@pytest.mark.claims("COM-M01", "COM-M02", "COM-M03", "GRIS-C14", "DDGIR-E10")
@pytest.mark.parametrize("metric", HAND, ids=lambda metric: metric.__name__)
def test_a_hand_case_has_its_value_and_leading_axes_stay(metric):
    assert metric(IMAGE, R) == pytest.approx(HAND[metric], rel=1e-12)
    assert metric(np.stack([R, IMAGE]), R) == pytest.approx([0, HAND[metric]], rel=1e-12)


@pytest.mark.claims("COM-M02")
def test_of_the_two_mapes_only_one_depends_on_the_scale_of_the_image():
    assert mape(100 * IMAGE, 100 * R) == pytest.approx(mape(IMAGE, R), rel=1e-12)
    assert rel_mse(100 * IMAGE, 100 * R) == pytest.approx(rel_mse(IMAGE, R), rel=1e-12)
    assert abs(mape_with_floor(100 * IMAGE, 100 * R) / mape_with_floor(IMAGE, R) - 1) > 0.005


@pytest.mark.parametrize("metric", HAND, ids=lambda metric: metric.__name__)
def test_stacked_references_are_scaled_by_their_own_means(metric):
    apart = [metric(IMAGE, R), metric(100 * IMAGE, 30 * R)]
    assert metric(np.stack([IMAGE, 100 * IMAGE]), np.stack([R, 30 * R])) == pytest.approx(np.array(apart), rel=1e-12)


def test_a_mean_that_stacked_references_share_is_noticed():
    both, shared = np.stack([R, 30 * R]), np.full((2, 1), np.stack([R, 30 * R]).mean())
    found = (abs(np.stack([IMAGE, 100 * IMAGE]) - both) / (0.01 * shared + both)).mean(axis=-1)
    assert abs(found / mape(np.stack([IMAGE, 100 * IMAGE]), both) - 1).max() > 0.01


@pytest.mark.parametrize("metric", HAND, ids=lambda metric: metric.__name__)
def test_black_pixels_divide_nothing_by_zero(metric):
    assert np.isfinite(metric(np.array([0.1, 1.0]), np.array([0.0, 1.0])))


def noise(*shape: int, seed: int = 1) -> Array:
    """White noise of variance 1."""
    return np.random.default_rng(seed).standard_normal(shape)


def squared_error(image: Array, reference: Array) -> Array:
    """mean (I - R)^2."""
    return np.asarray(rmse(image, reference) ** 2)


def change_by_fireflies(metric, spread: float) -> float:
    """Relative change of an error when one noisy pixel in a thousand is 100 times as bright; noise has mean 1."""
    reference = np.linspace(1.0, 3.0, 100_000)
    shape = 1 / spread**2
    image = reference * np.random.default_rng(7).gamma(shape, 1 / shape, reference.shape)
    fireflies = image * np.where(np.arange(len(image)) % 1000 == 0, 100, 1)
    return float(metric(fireflies, reference) / metric(image, reference) - 1)


@pytest.mark.claims("GRIS-C14")
@pytest.mark.parametrize("spread", [0.05, 0.2, 1.0])
def test_fireflies_change_mape_by_less_than_a_fiftieth_of_what_they_change_the_squared_error(spread):
    limit = change_by_fireflies(squared_error, spread) / 50
    assert 0 < change_by_fireflies(mape, spread) < limit
    assert change_by_fireflies(rel_mse, spread) > limit


# ---------------------------------------------------------------- many images of the same


@pytest.mark.claims("COM-M04", "MCMC-E15")
def test_the_rmse_over_images_is_each_pixel_s_and_no_average_difference():
    images = np.array([[2.0, 3.0], [5.0, 3.0]])
    assert rmse_over_images(images, R) == pytest.approx(np.sqrt((1 + 16) / 2) / 2, rel=1e-12)
    assert rmse_over_images(np.stack([images, images + 1]), R).shape == (2,)
    assert abs(rmse_over_images(images, R) / abs(images - R).mean() - 1) > 0.1


THREE = np.array([[1.0, 5.0, 4.0], [3.0, -1.0, 0.0]])
"""Deviations -1, 3, 2 and their opposites: covariances of pixels 01: -6, 02: -4, 12: 12."""


@pytest.mark.claims("COM-M04", "MCMC-E16")
@pytest.mark.parametrize(("radius", "sums"), [(1, [-6, (-6 + 12) / 2, 12]), (8, [(-6 - 4) / 2, 3, (12 - 4) / 2])])
def test_a_box_covariance_leaves_the_pixel_out_and_ends_with_the_image(radius, sums):
    reference = np.array([1.0, 2.0, 3.0])
    assert box_covariance(THREE, reference, radius) == pytest.approx(np.mean(sums) / 4, rel=1e-12)
    both = box_covariance(np.stack([THREE, 2 * THREE]), reference, radius)
    assert both == pytest.approx(np.mean(sums) / 4 * np.array([1, 4]), rel=1e-12)


@pytest.mark.claims("COM-M04")
def test_the_box_covariance_of_a_map_is_the_double_sum_that_defines_it():
    images, reference = noise(5, 4, 7), 2 + noise(4, 7)
    places = list(product(range(4), range(7)))
    pairs = {i: [j for j in places if j != i and max(abs(i[0] - j[0]), abs(i[1] - j[1])) <= 2] for i in places}
    by_pixel = [np.mean([np.cov(images[:, *i], images[:, *j])[0, 1] for j in near]) for i, near in pairs.items()]
    expected = np.mean(by_pixel) / reference.mean() ** 2
    assert box_covariance(images, reference, 2, MAP) == pytest.approx(expected, rel=1e-12)


def covariances_of_white_noise() -> tuple[float, float]:
    """Mean and standard error over 64 groups of 10 images."""
    found = box_covariance(noise(64, 10, 96), np.ones(96))
    return float(found.mean()), float(found.std(ddof=1) / 8)


@pytest.mark.claims("COM-M04", "MCMC-E16")
def test_white_noise_has_no_covariance_unless_pixels_are_paired_with_themselves(monkeypatch):
    mean, error = covariances_of_white_noise()
    assert error < 0.002
    assert abs(mean) < 4 * error
    right = metrics._box_sum
    monkeypatch.setattr(metrics, "_box_sum", lambda values, *box: right(values, *box) + values)
    mean, error = covariances_of_white_noise()
    assert mean > 20 * error


def test_the_covariance_of_one_image_is_refused():
    with pytest.raises(ValueError, match="here is 1: pass at least 2 replicas"):
        box_covariance(THREE[:1], R)


@pytest.mark.claims("COM-M05")
def test_squared_bias_and_variance_add_up_to_the_mean_squared_error():
    images, reference = 1 + 0.3 * noise(2, 64, 50), 1 + 0.1 * noise(50)
    split = bias_and_variance(images, reference)
    squared = ((images - reference) ** 2).mean(axis=1)
    assert split.bias2 + split.variance == pytest.approx(squared, rel=1e-12)


def planted(bias: float) -> tuple[Array, Array]:
    """64 images of 20 000 pixels with noise of 5 %, too bright by a share, and their reference."""
    reference = 1 + np.arange(20_000) / 20_000
    return reference * (1 + bias + 0.05 * noise(64, 20_000)), reference


@pytest.mark.claims("COM-M05")
def test_a_bias_of_one_per_cent_is_recovered_within_a_tenth_and_its_error_s_share_taken_off():
    images, reference = planted(0.01)
    split = bias_and_variance(images, reference)
    assert np.sqrt((split.bias2 / reference**2).mean()) == pytest.approx(0.01, rel=0.1)
    assert np.sqrt((split.variance / reference**2).mean()) == pytest.approx(0.05, rel=0.01)
    raw = ((images.mean(axis=0) - reference) / reference) ** 2
    assert np.sqrt(raw.mean()) > 1.1 * 0.01


@pytest.mark.claims("COM-M05")
def test_without_a_bias_none_is_found():
    images, reference = planted(0)
    assert abs((bias_and_variance(images, reference).bias2 / reference**2).mean()) < 0.001**2


def test_bias_and_variance_of_too_few_replicas_are_refused():
    with pytest.raises(ValueError, match="at least 64 replicas, but here are 63: take more"):
        bias_and_variance(np.ones((63, 2)), R)


# ---------------------------------------------------------------- spectra


def wave(k: int, n: int = 64) -> Array:
    """cos(2 pi k x / n)."""
    return np.cos(2 * np.pi * k * np.arange(n) / n)


@pytest.mark.parametrize(("axes", "shape"), [(ROW, (3, 50)), (MAP, (3, 6, 9))])
def test_the_mean_power_is_the_mean_square(axes, shape):
    e = noise(*shape)
    assert power_spectrum(e, axes).mean(axis=axes) == pytest.approx((e**2).mean(axis=axes), rel=1e-12)


def test_a_wave_has_its_power_at_its_frequency():
    S = power_spectrum(3 * wave(5))
    assert S[[5, -5]] == pytest.approx(9 * 64 / 4, rel=1e-12)
    assert np.delete(S, [5, -5]).max() < 1e-12


@pytest.mark.claims("COM-M08")
def test_bands_part_where_differences_weigh_as_much_as_the_image():
    """2 sin(pi k / 64) < .5 for |k| <= 5, which is 11 of 64 frequencies."""
    e = 3 + 2 * wave(4) + wave(10)
    low, high = (9 + 2 * 4 / 4) * 64 / 11, (2 / 4) * 64 / 53
    assert band_powers(e, 0.5) == (pytest.approx(low, rel=1e-12), pytest.approx(high, rel=1e-12))
    tall = np.repeat(e[:, None], 8, axis=1)  # all its power is along one axis
    D = (4 * np.sin(np.pi * np.arange(n) / n) ** 2 for n in (64, 8))
    kept = (np.add.outer(*D) < 0.25).sum()
    assert band_powers(tall, 0.5, MAP)[0] == pytest.approx(low * 8 * 11 / kept, rel=1e-12)


WHITE = {"rows": (ROW, (6000, 128)), "maps": (MAP, (600, 32, 32))}


@pytest.mark.claims("COM-M08")
@pytest.mark.parametrize(("axes", "shape"), WHITE.values(), ids=WHITE)
def test_white_noise_is_flat_in_both_bands_and_smoothed_noise_is_not(axes, shape):
    e = noise(*shape)
    powers = [band.mean() / (e**2).mean() for band in band_powers(e, 0.4, axes)]
    assert powers == pytest.approx([1, 1], abs=0.05)
    smooth = e + np.roll(e, 1, axis=-1)
    assert band_powers(smooth, 0.4, axes)[0].mean() / (smooth**2).mean() > 1.5


@pytest.mark.claims("COM-M09")
def test_the_low_frequency_ratio_of_waves_counts_frequencies_and_not_the_mean():
    """16 of 63 frequencies of a row are in the lowest quarter, and 196 of 4095 of a map."""
    row = 7 + 3 * wave(8) + 2 * wave(9)
    assert low_frequency_ratio(row) == pytest.approx(9 / 16 / (13 / 63), rel=1e-12)
    x, y = np.meshgrid(np.arange(64), np.arange(64))
    disc = ((x - 32) ** 2 + (y - 32) ** 2 <= 64).sum() - 1
    for k, l, low in ((3, 4, 1), (8, 0, 1), (6, 6, 0), (0, 9, 0)):
        ripple = np.cos(2 * np.pi * (k * x + l * y) / 64)
        assert low_frequency_ratio(5 + ripple, MAP) == pytest.approx(low * 4095 / disc, rel=1e-12, abs=1e-12)


SHAPES = {"rows": (ROW, (128,), 300), "maps": (MAP, (64, 64), 5)}
MASKS, REACH, GAP = 40, 3, 8


def white_masks(shape: tuple[int, ...]) -> Array:
    """Masks (MASKS, n) with all values k / n in random order."""
    n = prod(shape)
    return np.random.default_rng(3).permuted(np.tile(np.arange(n) / n, (MASKS, 1)), axis=1)


def blue_masks(shape: tuple[int, ...], sweeps: int, acceptance=annealed) -> Array:
    """The same after swaps that mostly lower the energy, at sites GAP apart, so that no two swaps share neighbours."""
    masks, rng = white_masks(shape), np.random.default_rng(4)
    place = np.stack(np.unravel_index(np.arange(prod(shape)), shape))
    steps = np.array([step for step in product(range(-REACH, REACH + 1), repeat=len(shape)) if any(step)]).T
    near = np.ravel_multi_index(tuple(place[:, :, None] + steps[:, None]), shape, mode="wrap")
    distance, lattice = np.sqrt((steps**2).sum(axis=0)), place[:, (place % GAP == 0).all(axis=0)]
    rounds = sweeps * GAP ** len(shape)
    for k in range(rounds):
        sites = np.ravel_multi_index(tuple(lattice + rng.integers(0, GAP, (len(shape), 1))), shape, mode="wrap")
        a, b = rng.permutation(sites).reshape(2, -1)
        v = np.stack([masks[:, a], masks[:, b]])
        around = np.stack([masks[:, near[a]], masks[:, near[b]]])
        e, e_new = (energy(distance, each[..., None] - around).sum(axis=(0, -1)) for each in (v, v[::-1]))
        swapped = rng.random(e.shape) < acceptance(e, e_new, 0.05 * (1 - k / rounds))
        masks[:, a], masks[:, b] = np.where(swapped, v[::-1], v)
    return masks


def mean_ratio(masks: Array, shape: tuple[int, ...], axes) -> float:
    return float(low_frequency_ratio(masks.reshape(MASKS, *shape), axes).mean())


@pytest.mark.claims("COM-M09", "MCMC-E11")
@pytest.mark.parametrize(("axes", "shape", "sweeps"), SHAPES.values(), ids=SHAPES)
def test_white_masks_have_low_frequencies_and_annealed_ones_lack_them(axes, shape, sweeps):
    white, blue = white_masks(shape), blue_masks(shape, sweeps)
    assert 0.8 <= mean_ratio(white, shape, axes) <= 1.2
    assert mean_ratio(blue, shape, axes) < 0.2
    assert np.array_equal(np.sort(blue), np.sort(white))


@pytest.mark.claims("COM-M09")
def test_masks_annealed_the_wrong_way_are_not_blue():
    warm = blue_masks((128,), 20, acceptance=lambda e, e_new, temperature: annealed(e_new, e, temperature))
    assert mean_ratio(warm, (128,), ROW) > 1.5


@pytest.mark.parametrize(("errors", "alpha"), [(noise(7), 0.5), (noise(64), 0.0), (noise(64), 2.1)])
def test_an_empty_band_is_refused_with_the_image_s_size(errors, alpha):
    with pytest.raises(ValueError, match=f"empty in an image of {len(errors)} pixels: take a larger image, or another"):
        band_powers(errors, alpha), low_frequency_ratio(errors)


# ---------------------------------------------------------------- structure

TILES = np.repeat([1.0, 1.0, -1.0, -1.0, 1.0], 16)
"""Five tiles; across their four borders the signs agree twice."""


@pytest.mark.claims("COM-M10")
def test_neighbour_correlations_of_constructed_fields_are_their_sums():
    r = np.arange(1, 9)
    assert neighbour_correlation(np.resize([2.0, -2.0], 50)) == pytest.approx((-1.0) ** r, rel=1e-12)
    assert neighbour_correlation(TILES) == pytest.approx(5 * (16 - r) / (80 - r), rel=1e-12)
    ramp = np.array([1.0, 2.0, 3.0])
    assert neighbour_correlation(np.stack([ramp, -5 * ramp]), 2) == pytest.approx(
        [8 / np.sqrt(5 * 13), 3 / np.sqrt(1 * 9)], rel=1e-12
    )


@pytest.mark.claims("COM-M10")
def test_the_contrast_of_tiles_is_inner_minus_border_correlation():
    assert tile_contrast(TILES) == pytest.approx(1 - 0, rel=1e-12)
    assert tile_contrast(np.repeat([3.0, -3.0, 3.0], 4), tile=4) == pytest.approx(1 + 1, rel=1e-12)
    assert tile_contrast(np.stack([TILES, -TILES])) == pytest.approx(1, rel=1e-12)
    e = np.array([1.0, 3.0, 3.0, 3.0, 4.0, 4.0])  # pairs inside: 1 3, 3 3, 4 4; across: 3 3, 3 4
    across = (9 + 12) / np.sqrt((9 + 9) * (9 + 16))
    inside = (3 + 9 + 16) / np.sqrt((1 + 9 + 16) * (9 + 9 + 16))
    assert tile_contrast(e, tile=2) == pytest.approx(inside - across, rel=1e-12)


@pytest.mark.claims("COM-M10")
def test_white_noise_has_no_structure_and_tiles_that_begin_elsewhere_are_missed():
    e = noise(4000, 80)
    assert abs(neighbour_correlation(e)).max() < 4 / np.sqrt(e.size)
    assert abs(tile_contrast(e)) < 4 / np.sqrt(4000 * 4)
    tiled = e + noise(4000, 5, seed=2).repeat(16, axis=1)
    assert tile_contrast(tiled) == pytest.approx(0.5, abs=0.02)
    assert abs(tile_contrast(tiled[:, 8:])) < 0.05


def test_the_covariance_of_stacked_scenes_is_relative_to_the_mean_of_each():
    scenes, R = noise(2, 64, 20), np.stack([np.full(20, 2.0), np.full(20, 0.5)])
    apart = [box_covariance(images, reference) for images, reference in zip(scenes, R, strict=True)]
    assert box_covariance(scenes, R) == pytest.approx(np.array(apart), rel=1e-12)


@pytest.mark.parametrize("reach", [0, 80])
def test_a_reach_beyond_the_image_is_refused(reach):
    with pytest.raises(ValueError, match=f"1 .. 79 pixels in an image of 80, but is {reach}"):
        neighbour_correlation(TILES, reach)


@pytest.mark.parametrize("tile", [1, 80])
def test_tiles_without_inside_or_border_are_refused(tile):
    with pytest.raises(ValueError, match=f"2 .. 79 pixels in an image of 80, but have {tile}"):
        tile_contrast(TILES, tile)
