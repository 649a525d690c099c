"""Laws of grids of probes: multilinear between them, the nearest point inside beyond them."""

import numpy as np
import pytest

from restir_ref.transport.cache.grid import Grid, over

GRIDS = {
    "line": Grid((0.5,), (0.25,), (5,)),
    "plane": Grid((-1.0, 2.0), (0.5, 0.1), (4, 3)),
    "solid": Grid((0.0, 0.0, 0.0), (1.0, 2.0, 3.0), (2, 3, 4)),
    "hyper": Grid((0.0, 1.0, 2.0, 3.0), (0.1, 0.2, 0.3, 0.4), (2, 1, 3, 2)),
    "one probe": Grid((0.3, 0.4), (0.1, 0.1), (1, 1)),
}


def within(g: Grid, n: int, seed: int) -> np.ndarray:
    """Points between the probes."""
    size = (np.array(g.counts) - 1) * g.spacing
    return np.array(g.origin)[:, None] + size[:, None] * np.random.default_rng(seed).random((g.d, n))


def blended(g: Grid, values: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Multilinear interpolation of values (.., P)."""
    return sum(values[..., probe] * weight for probe, weight in g.corners(x))


@pytest.mark.parametrize("name", GRIDS)
def test_places_themselves_are_interpolated_exactly(name):
    g, x = GRIDS[name], within(GRIDS[name], 500, 1)
    np.testing.assert_allclose(blended(g, g.place(np.arange(g.P)), x), x, atol=1e-12)


@pytest.mark.parametrize("name", GRIDS)
def test_weights_are_shares_of_2_to_the_d_corners(name):
    g = GRIDS[name]
    found = list(g.corners(within(g, 500, 2) * 3 - 1))
    assert len(found) == 2**g.d
    assert min(weight.min() for _, weight in found) >= 0
    np.testing.assert_allclose(sum(weight for _, weight in found), 1, rtol=1e-13)


@pytest.mark.parametrize("name", GRIDS)
def test_a_probe_alone_is_met_where_it_stands(name):
    g = GRIDS[name]
    values = np.random.default_rng(3).random(g.P)
    np.testing.assert_allclose(blended(g, values, g.place(np.arange(g.P))), values, rtol=1e-9)


@pytest.mark.parametrize("name", GRIDS)
def test_beyond_the_grid_the_nearest_point_inside_stands_for_a_point(name):
    g = GRIDS[name]
    ends = g.place(np.array([0, g.P - 1]))
    x = ends.mean(axis=1, keepdims=True) + np.random.default_rng(4).normal(scale=5, size=(g.d, 500))
    inside = np.clip(x, ends[:, :1], ends[:, 1:])
    places = g.place(np.arange(g.P))
    np.testing.assert_allclose(blended(g, places, x), inside, atol=1e-12)


def test_probes_are_numbered_with_the_last_axis_fastest():
    g = GRIDS["plane"]
    np.testing.assert_allclose(g.place(np.array([0, 1, 3])).T, [(-1, 2), (-1, 2.1), (-0.5, 2)])


def test_a_grid_over_a_box_has_it_in_its_cells():
    g = over((0, 1), (2, 2), (4, 2))
    assert (g.origin, g.spacing, g.counts) == ((0.25, 1.25), (0.5, 0.5), (4, 2))


def test_the_way_to_the_boundary_is_a_spacing_along_each_axis_and_less_in_none():
    g = GRIDS["plane"]
    w = np.array([[1.0, 0.0, -1.0, 0.6], [0.0, 1.0, 0.0, 0.8]])
    np.testing.assert_allclose(g.to_boundary(w), [0.5, 0.1, 0.5, 0.1 / 0.8])


def test_distances_are_clipped_at_one_and_a_half_diagonals():
    assert GRIDS["solid"].reach == pytest.approx(1.5 * np.sqrt(14))


BAD = {
    "no probes": (lambda: Grid((0, 0), (1, 1), (0, 3)), "number of probes along an axis must be a whole number >= 1"),
    "half a probe": (lambda: Grid((0, 0), (1, 1), (1.5, 3)), "is 1.5"),
    "no probes in a box": (lambda: over((0, 0), (1, 1), (0, 3)), "A volume without probes knows nothing."),
    "no spacing": (lambda: Grid((0, 0), (1, 0), (2, 2)), r"positive, finite distance apart .* \(1, 0\)"),
    "an empty box": (lambda: over((0, 0), (0, 1), (2, 2)), "positive, finite distance"),
    "a box inside out": (lambda: over((0, 0), (1, -1), (2, 2)), "positive, finite distance"),
    "an endless spacing": (lambda: Grid((0, 0), (1, np.inf), (2, 2)), "positive, finite distance"),
    "a spacing that is none": (lambda: Grid((0, 0), (1, np.nan), (2, 2)), "positive, finite distance"),
    "a place that is none": (lambda: Grid((0, np.nan), (1, 1), (2, 2)), "must be finite, but is"),
    "axes that do not match": (lambda: Grid((0, 0), (1, 1), (2,)), "one number per axis"),
    "no axes": (lambda: Grid((), (), ()), "one number per axis"),
}


@pytest.mark.parametrize("name", BAD)
def test_a_grid_that_is_none_is_refused_with_its_numbers(name):
    make, words = BAD[name]
    with pytest.raises(ValueError, match=words):
        make()
