"""Footprints by hand: areas whose roots are lengths, which add."""

import numpy as np
import pytest

from restir_ref.batch import Array
from restir_ref.transport.cache import footprint as module
from restir_ref.transport.cache.footprint import as_wide_as_in_space, footprint, pixel_footprint, widening

R, P, COS = np.array([[2.0], [3.0]]), np.array([[0.5], [0.25]]), np.array([[0.8], [0.6]])


def of_path(r: Array, p: Array, cos: Array, d: int) -> float:
    lengths = np.stack([widening(*each, d) for each in zip(r, p, cos, strict=True)])
    return float(footprint(lengths, d)[0])


@pytest.mark.claims("DDGIR-E07")
def test_footprints_of_one_and_two_segments_are_those_computed_by_hand() -> None:
    one, other = 2 / (0.5 * 0.8), 3 / (0.25 * 0.6)
    assert of_path(R[:1], P[:1], COS[:1], 2) == pytest.approx(one, rel=1e-12)
    assert of_path(R, P, COS, 2) == pytest.approx(one + other, rel=1e-12)
    one, other = 4 / (0.5 * 0.8), 9 / (0.25 * 0.6)
    assert of_path(R[:1], P[:1], COS[:1], 3) == pytest.approx(one, rel=1e-12)
    assert of_path(R, P, COS, 3) == pytest.approx((one**0.5 + other**0.5) ** 2, rel=1e-12)


def scaling(d: int, s: float) -> float:
    """How a path's footprint scales when the scene is scaled by s."""
    return of_path(s * R, P, COS, d) / of_path(R, P, COS, d)


@pytest.mark.claims("DDGIR-E07")
@pytest.mark.parametrize("d", [2, 3, 4])
def test_footprints_scale_like_areas(d) -> None:
    assert scaling(d, 3.0) == pytest.approx(3.0 ** (d - 1), rel=1e-12)


@pytest.mark.claims("DDGIR-E07", part="control")
def test_the_footprint_of_space_in_flatland_is_noticed(monkeypatch) -> None:
    monkeypatch.setattr(module, "power", lambda x, n: x**2)
    assert scaling(2, 3.0) != pytest.approx(3.0, rel=0.1)


def test_a_delta_lobe_widens_nothing() -> None:
    for d in (2, 3):
        assert of_path(R, np.array([[0.0], [0.25]]), COS, d) == of_path(R[1:], P[1:], COS[1:], d)


@pytest.mark.claims("DDGIR-E08", part="a_0")
def test_a_pixels_footprint_is_its_distance_to_the_power_over_the_whole_sphere_and_the_cosine() -> None:
    r, cos = np.array([2.0]), np.array([0.5])
    assert pixel_footprint(r, cos, 2)[0] == pytest.approx(2 / (2 * np.pi * 0.5), rel=1e-12)
    assert pixel_footprint(r, cos, 3)[0] == pytest.approx(4 / (4 * np.pi * 0.5), rel=1e-12)


@pytest.mark.claims("DDGIR-E08", part="scale invariance")
@pytest.mark.parametrize("d", [2, 3, 4])
def test_whether_a_path_has_spread_does_not_depend_on_the_scenes_scale(d) -> None:
    r, cos = np.array([2.0]), np.array([0.5])
    assert scaling(d, 7.0) == pytest.approx((pixel_footprint(7 * r, cos, d) / pixel_footprint(r, cos, d))[0], rel=1e-12)


@pytest.mark.claims("DDGIR-E08", part="threshold")
def test_the_threshold_of_space_as_a_length_is_that_of_any_dimension() -> None:
    assert as_wide_as_in_space(3) == pytest.approx(0.2, rel=1e-12)
    assert as_wide_as_in_space(2) == pytest.approx(0.7927, rel=1e-3)
    one, r = np.ones(1), np.array([1.7])
    lengths = [(as_wide_as_in_space(d) * pixel_footprint(r, one, d)[0]) ** (1 / (d - 1)) for d in (2, 3, 4)]
    assert lengths == pytest.approx([lengths[0]] * 3, rel=1e-12)
