"""Error metrics: values of hand cases, and what each is invariant to."""

import numpy as np
import pytest

from restir_ref.metrics import mape, mape_with_floor, rel_mse, rmse

R = np.array([1.0, 3.0])
IMAGE = np.array([2.0, 3.0])
HAND = {
    mape: (1 / 1.02 + 0) / 2,
    mape_with_floor: (1 / 1.01 + 0) / 2,
    rel_mse: (1 / (1 + 0.02**2) + 0) / 2,
    rmse: np.sqrt(0.5),
}


@pytest.mark.claims("COM-M01", "COM-M02", "COM-M03")
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
def test_black_pixels_divide_nothing_by_zero(metric):
    assert np.isfinite(metric(np.array([0.1, 1.0]), np.array([0.0, 1.0])))
