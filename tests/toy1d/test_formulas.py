"""Toys and pictures are, point by point, the formulas of their docstrings, written down here once more."""

from collections.abc import Callable, Mapping

import numpy as np
import pytest

from restir_ref.batch import Array
from tests.core.stubs import Always
from toy1d import TOYS, overstating_neighbours
from toy1d.pictures import PICTURES, noisy, speckled

PI = np.pi


def g(x: Array, centre: float, width: float) -> Array:
    return np.exp(-(((x - centre) / width) ** 2))


def colour(x: Array) -> Array:
    return np.array([1 + np.sin(2 * PI * x), 1 + np.cos(2 * PI * x), 0.5 + x])


NORMAL = 0.12 * np.sqrt(2)
Domain = Callable[[int], tuple[float, float]]
FORMULAS: Mapping[str, tuple[int, Callable[[int, Array], Array], Domain]] = {
    "two_pixels": (
        2,
        lambda i, x: [1 + 0.9 * np.sin(2 * PI * x), 0.2 + 3 * g(x, 0.6, 0.15)][i],
        lambda i: (0, 1),
    ),
    "known_densities": (
        2,
        lambda i, x: [1 + 0.9 * np.sin(2 * PI * x), 0.1 + g(x, 0.3, 0.08) + g(x, 0.75, 0.05) / 2][i],
        lambda i: (0, 1),
    ),
    "three_channels": (1, lambda i, x: colour(x).sum(axis=0) / 3, lambda i: (0, 1)),
    "overlapping_supports": (
        7,
        lambda i, x: 0.1 + g(x, 0.5 + 0.08 * (i - 3), NORMAL),
        lambda i: (0.2 + 0.08 * abs(i - 3), 0.8 + 0.08 * (i - 3)),
    ),
    "degrading_neighbours": (
        65,
        lambda i, x: np.maximum(1 - ((x - 0.5 - 0.0125 * (i - 32)) / 0.1) ** 2, 0) ** 2,
        lambda i: (0, 1),
    ),
    "overstating_neighbours": (7, lambda i, x: 0.1 + g(x, 0.5, NORMAL), lambda i: (0, 1)),
    "image_of_64": (
        64,
        lambda i, x: (1 + 0.6 * np.sin(4 * PI * i / 63)) * (0.05 + g(x, 0.15 + 0.7 * i / 63, 0.04)),
        lambda i: (0, 1),
    ),
    "ring_of_8": (8, lambda i, x: 0.02 + g(x, 0.5 + 0.2 * np.sin(2 * PI * i / 8), NORMAL), lambda i: (0, 1)),
    "shared_peak": (
        2,
        lambda i, x: 5 * g(x, 0, 0.3) + [0.6 * g(x, 1.2, 0.15), 0.4 * g(x, -1.3, 0.15)][i] + 0.05,
        lambda i: (-2, 2),
    ),
    "bare_peaks": (
        2,
        lambda i, x: 3 * g(x, 0, 0.2 * 2**0.5) + [0.5 * g(x, 1.2, 0.15 * 2**0.5), 0.3 * g(x, -1.2, 0.15 * 2**0.5)][i],
        lambda i: (-2, 2),
    ),
    "partial_shift": (2, lambda i, x: [1.5 - x, 0.4 + x][i], lambda i: [(0, 1), (0.16, 1.96)][i]),
    "two_pairs": (
        4,
        lambda i, x: [3 + x, 1 + x / 2, 4 - 2 * x, (1 + x) / 2][i],
        lambda i: (0.2 ** (1 / [1, 1.5, 0.5, 0.75][i]), 1),
    ),
}
"""Name -> how many pixels, their integrands, the ends of their domains."""

every_toy = pytest.mark.parametrize("name", FORMULAS)


def distance(name: str, by: float = 0.0) -> float:
    """Largest difference from the formula, relative to the largest value, of the integrand moved by a distance."""
    line, (n, formula, domain) = TOYS[name](), FORMULAS[name]
    assert line.n == n
    errors = []
    for i in range(n):
        low, high = domain(i)
        x = low + (high - low) * (np.arange(200) + 0.5) / 200
        truth = formula(i, x)
        errors.append(abs(line.f(np.full(200, i), x + by) - truth).max() / truth.max())
    return max(errors)


def test_every_toy_has_its_formula() -> None:
    assert set(FORMULAS) == set(TOYS)


@every_toy
def test_an_integrand_is_the_formula_of_its_docstring_and_no_other(name) -> None:
    assert distance(name) < 1e-12
    assert distance(name, 1e-3) > 1e-4


@every_toy
def test_a_domain_has_the_ends_of_its_docstring(name) -> None:
    line, (n, _, domain) = TOYS[name](), FORMULAS[name]
    ends = np.array([domain(i) for i in range(n)])
    assert np.transpose([line.low, line.high]) == pytest.approx(ends, rel=1e-14)


def test_the_colour_is_the_formula_of_its_docstring() -> None:
    x = (np.arange(100) + 0.5) / 100
    assert TOYS["three_channels"]().contribution(np.zeros(100, dtype=int), x) == pytest.approx(colour(x), rel=1e-12)


CHARTS = {"partial_shift": [1, 0.5], "two_pairs": [1, 1.5, 0.5, 0.75]}


@every_toy
def test_the_common_coordinate_is_a_power_of_the_position_or_the_position(name) -> None:
    line, x = TOYS[name](), np.linspace(0.3, 0.9, 7)
    for i, e in enumerate(CHARTS.get(name, [1])):
        pixel = np.full(7, i)
        assert line.chart.to(pixel, x) == pytest.approx(x**e, rel=1e-14)
        assert line.chart.back(pixel, x) == pytest.approx(x ** (1 / e), rel=1e-14)
        assert line.chart.slope(pixel, x) == pytest.approx(e * x ** (e - 1), rel=1e-14)


# ---------------------------------------------------------------- samplers


@pytest.mark.parametrize("share", [0.01, 0.5])
def test_neighbours_that_overstate_draw_a_fifth_of_the_domain_as_rarely_as_they_are_told(share) -> None:
    line, s = overstating_neighbours(share), np.array([0.2, 0.4, 0.5, 0.6, 0.9])
    outside = (1 - 0.2 * share) / 0.8
    assert line.pdf(np.full(5, 2), s) == pytest.approx([outside, share, share, outside, outside], rel=1e-12)
    assert line.pdf(np.full(5, 3), s).tolist() == [1.0] * 5


def test_neighbours_overstate_a_hundredfold_unless_told_otherwise() -> None:
    assert overstating_neighbours().pdf(np.array([2]), np.array([0.5])) == pytest.approx([0.01], rel=1e-12)


# ---------------------------------------------------------------- pictures


def test_the_row_has_a_slope_a_bump_two_steps_and_a_bar_of_four_pixels() -> None:
    x = (np.arange(256) + 0.5) / 256
    plain = PICTURES["slopes_and_steps"]() - (0.4 + 0.8 * x + 0.6 * g(x, 0.3, 0.06))
    expected = np.zeros(256)
    expected[128:179], expected[218:222] = -0.6, 0.8
    assert plain == pytest.approx(expected, abs=1e-12)


def test_the_map_has_a_shaded_disc_before_fields_of_eight_pixels() -> None:
    image = PICTURES["disc_and_checker"]()
    assert image.shape == (48, 48)
    y, x = np.indices((48, 48))
    r2 = ((x + 0.5 - 28) ** 2 + (y + 0.5 - 20) ** 2) / 196
    dark = (x // 8 % 2) == (y // 8 % 2)
    assert image[r2 >= 1].tolist() == np.where(dark, 0.3, 0.9)[r2 >= 1].tolist()
    assert image[r2 < 1] == pytest.approx(0.4 + 1.5 * np.sqrt(1 - r2[r2 < 1]), rel=1e-12)


class Uniformly(Always):
    """A chance that draws the same numbers each time."""

    def __init__(self, *u: float) -> None:
        self.u = np.array(u)

    def uniform(self, shape) -> Array:
        return np.broadcast_to(self.u, shape)


def test_noise_is_finite_at_the_smallest_of_uniform_numbers_and_none_at_the_middle() -> None:
    found = noisy(np.full(3, 2.0), 0.5, Uniformly(0, 0.5, 0.8413447460685429))
    assert found[0] == pytest.approx(2 - 0.5 * 37.5, abs=0.1)
    assert found[1:] == pytest.approx([2, 2.5], abs=1e-9)


def test_specks_take_half_of_their_share_from_either_end() -> None:
    u = [0, 0.0999, 0.1, 0.5, 0.8999, 0.9, 0.99]
    assert speckled(np.zeros(7), 0.2, 3, Uniformly(*u)).tolist() == [3, 3, 0, 0, 0, -3, -3]
