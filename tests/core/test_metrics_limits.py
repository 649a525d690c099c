"""Metrics where nothing is to be measured: an image without errors, or without any light between its pixels."""

import numpy as np
import pytest

from restir_ref.batch import Array
from restir_ref.metrics import (
    MAP,
    ROW,
    band_powers,
    box_covariance,
    correlation,
    low_frequency_ratio,
    mape,
    mape_with_floor,
    rel_mse,
    rmse,
    tile_contrast,
)


@pytest.mark.parametrize(("shape", "axes"), [((3, 64), ROW), ((16, 16), MAP)])
def test_an_image_without_errors_has_neither_low_nor_high_frequencies(shape, axes) -> None:
    assert not low_frequency_ratio(np.zeros(shape), axes).any()


def test_images_without_errors_do_not_correlate() -> None:
    assert correlation(np.zeros(8), np.ones(8)) == 0
    assert tile_contrast(np.zeros((2, 64))) == 0


def test_a_box_of_one_pixel_has_no_other_and_no_covariance() -> None:
    assert box_covariance(np.array([[1.0, 2.0], [3.0, 5.0]]), np.ones(2), radius=0) == 0


def errors(*shape: int) -> Array:
    return np.random.default_rng(3).standard_normal(shape)


@pytest.mark.parametrize(("shape", "axes"), [((3, 64), ROW), ((2, 3, 64), ROW), ((3, 16, 16), MAP)])
def test_spectra_of_several_images_are_those_of_each(shape, axes) -> None:
    many = errors(*shape)
    images = [many[at] for at in np.ndindex(shape[: -len(axes)])]
    assert low_frequency_ratio(many, axes).shape == shape[: -len(axes)]
    for found, measure in ((low_frequency_ratio(many, axes), low_frequency_ratio), (high_band(many, axes), high_band)):
        assert found.ravel() == pytest.approx([float(measure(each, axes)) for each in images])


def high_band(errors: Array, axes: tuple[int, ...]) -> Array:
    return band_powers(errors, 0.5, axes)[1]


def test_the_mean_of_spectra_is_not_that_of_each() -> None:
    found = low_frequency_ratio(errors(3, 64))
    assert abs(found - found.mean()).max() > 0.1


def test_a_box_reaches_eight_pixels_unless_told_otherwise() -> None:
    images, reference = errors(5, 40), np.ones(40)
    assert box_covariance(images, reference) == box_covariance(images, reference, radius=8)
    assert box_covariance(images, reference) != box_covariance(images, reference, radius=9)


@pytest.mark.parametrize("metric", [mape, mape_with_floor, rel_mse, rmse])
def test_what_is_too_dark_and_what_is_too_bright_do_not_cancel(metric) -> None:
    reference = np.array([2.0, 2.0])
    one_way, both_ways = metric(np.array([2.5, 2.5]), reference), metric(np.array([1.5, 2.5]), reference)
    assert both_ways == one_way > 0
