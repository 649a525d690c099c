"""Metrics where nothing is to be measured: an image without errors, or without any light between its pixels."""

import numpy as np
import pytest

from restir_ref.metrics import MAP, ROW, box_covariance, correlation, low_frequency_ratio, tile_contrast


@pytest.mark.parametrize(("shape", "axes"), [((3, 64), ROW), ((16, 16), MAP)])
def test_an_image_without_errors_has_neither_low_nor_high_frequencies(shape, axes) -> None:
    assert not low_frequency_ratio(np.zeros(shape), axes).any()


def test_images_without_errors_do_not_correlate() -> None:
    assert correlation(np.zeros(8), np.ones(8)) == 0
    assert tile_contrast(np.zeros((2, 64))) == 0


def test_a_box_of_one_pixel_has_no_other_and_no_covariance() -> None:
    assert box_covariance(np.array([[1.0, 2.0], [3.0, 5.0]]), np.ones(2), radius=0) == 0
