"""Laws of what the notebook of differences shows, without any notebook."""

import numpy as np
import pytest

from notebooks import differences as lesson
from restir_ref.poisson import l2
from restir_ref.poisson_l1 import l1


def error(image) -> float:
    return float(np.sqrt(((image - lesson.board()) ** 2).mean()))


@pytest.mark.parametrize("M", [4, 64])
def test_all_three_methods_estimate_one_difference(M):
    (after, one, two), errors = lesson.mean("shared_peak", M)
    assert abs(after - two) < 4 * np.hypot(errors[0], errors[2])
    assert abs(one - two) < 4 * np.hypot(errors[1], errors[2])


def test_one_reservoir_per_sign_has_no_floor_and_the_others_have():
    few, many = (lesson.estimates("shared_peak", M)[0].std(axis=1) for M in (16, 256))
    assert many[2] < 0.35 * few[2]
    assert (many[:2] > 0.7 * few[:2]).all()


def test_good_differences_mend_an_image_and_those_three_times_as_noisy_spoil_it():
    assert error(l2(*lesson.noisy(0.02, 0.002))) < 0.6 * error(lesson.noisy(0.02, 0.002)[0])
    assert error(l2(*lesson.noisy(0.02, 0.06))) > 1.1 * error(lesson.noisy(0.02, 0.06)[0])


def test_a_few_outliers_cost_l2_more_than_l1_and_many_do_not():
    few, many = (lesson.noisy(0.02, 0.0005, share) for share in (0.02, 0.4))
    assert error(l1(*few)) < 0.6 * error(l2(*few))
    assert error(l1(*many)) > 0.9 * error(l2(*many))


def test_rings_keep_every_frequency_but_the_first():
    k = np.sqrt(lesson.symbol((8, 8)))
    middles, power = lesson.rings(k, k**2)
    assert (np.diff(middles) > 0).all()
    assert power == pytest.approx(middles**2, rel=0.2)
