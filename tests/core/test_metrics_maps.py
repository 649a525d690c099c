"""Metrics over two axes: the same numbers as in a row, and structure along either axis."""

import numpy as np
import pytest

from restir_ref.metrics import (
    MAP,
    correlation,
    mape,
    mape_with_floor,
    neighbour_correlation,
    rel_mse,
    rmse,
    tile_contrast,
)

METRICS = (mape, mape_with_floor, rel_mse, rmse)


def noise(*shape, seed=1):
    return np.random.default_rng(seed).standard_normal(shape)


@pytest.mark.claims("COM-M01", "COM-M02", "COM-M03", part="images of rows and columns", world="tracer3d")
@pytest.mark.parametrize("metric", METRICS)
def test_errors_of_a_map_are_those_of_its_pixels_in_a_row(metric):
    image, reference = abs(noise(3, 6, 8)), 1 + abs(noise(6, 8, seed=2))
    flat = metric(image.reshape(3, 48), reference.reshape(48))
    assert metric(image, reference, MAP) == pytest.approx(flat, rel=1e-12)


@pytest.mark.parametrize("metric", [mape, rel_mse])
def test_a_mean_row_by_row_is_noticed(metric):
    image, reference = abs(noise(3, 6, 8)), 10.0 ** np.arange(-3, 3)[:, None] * (1 + abs(noise(6, 8, seed=2)))
    by_row = metric(image, reference).mean(axis=-1)
    assert (abs(by_row / metric(image, reference, MAP) - 1) > 0.1).all()


@pytest.mark.claims("COM-M10", part="images of rows and columns", world="tracer3d")
def test_neighbour_correlation_of_a_map_is_over_all_pairs_along_either_axis():
    e = noise(5, 7)
    for r in (1, 2, 3):
        a = np.concatenate([e[:, :-r].ravel(), e[:-r].ravel()])
        b = np.concatenate([e[:, r:].ravel(), e[r:].ravel()])
        assert neighbour_correlation(e, 3, MAP)[r - 1] == pytest.approx(correlation(a, b), rel=1e-12)


def test_streaks_show_along_them_and_not_across():
    streaks = noise(64, 1, seed=3) + 0.1 * noise(64, 64)
    along, across = (neighbour_correlation(streaks, 2, (axis,)) for axis in (-1, -2))
    assert along.min() > 0.9
    assert abs(across).max() < 4 / np.sqrt(64)


@pytest.mark.claims("COM-M10", part="tiles of rows and columns", world="tracer3d")
def test_the_contrast_of_square_tiles_is_seen_where_they_are():
    tiled = noise(500, 8, 8, seed=4).repeat(4, axis=-1).repeat(4, axis=-2) + noise(500, 32, 32)
    assert tile_contrast(tiled, 4, MAP) == pytest.approx(0.5, abs=0.02)
    assert abs(tile_contrast(noise(500, 32, 32), 4, MAP)) < 0.01


def test_tiles_that_begin_elsewhere_are_missed():
    """A third of the pairs inside then belong to two tiles, and none of those across."""
    tiled = noise(500, 8, 8, seed=4).repeat(4, axis=-1).repeat(4, axis=-2) + noise(500, 32, 32)
    assert tile_contrast(tiled[..., 2:, 2:], 4, MAP) == pytest.approx(1 / 3 - 1 / 2, abs=0.02)


def test_rows_of_tiles_alone_have_half_the_contrast():
    level = noise(500, 8, 1, seed=4).repeat(4, axis=-2) + 0 * noise(500, 32, 32) + noise(500, 32, 32)
    assert tile_contrast(level, 4, (-2,)) == pytest.approx(0.5, abs=0.03)
    assert abs(tile_contrast(level, 4, (-1,))) < 0.03
    assert tile_contrast(level, 4, MAP) == pytest.approx(0.25, abs=0.03)


@pytest.mark.parametrize(
    ("measure", "asked", "said"), [(neighbour_correlation, 5, "reach"), (tile_contrast, 5, "tiles")]
)
def test_what_leaves_the_shorter_axis_is_refused(measure, asked, said):
    with pytest.raises(ValueError, match=f"{said} must .* in an image of 5"):
        measure(noise(9, 5), asked, MAP)
