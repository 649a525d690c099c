"""Laws of directions as texels: weights sum to 1, centres are met exactly, interpolation is linear and has no seam."""

import numpy as np
import pytest

from flatland2d.directions import Bins, turned
from restir_ref.transport.cache.maps import Directions, fetched, gathering
from tests.transport.cache.worlds import WORLDS, live
from tests.transport.rooms import directions
from tracer3d.directions import Octahedral, folded, rays, rotation, spiral, unfolded

MAPS = {f"{name} {part}": getattr(maps, part) for name, (_, maps) in WORLDS.items() for part in ("irradiance", "depth")}
MAPS |= {f"{K} bins": Bins(K) for K in (1, 3)} | {f"{m} x {m}": Octahedral(m) for m in (2, 5)}


def read(maps: Directions, values: np.ndarray, w: np.ndarray) -> np.ndarray:
    """Interpolated values (K,) in directions w, (N,)."""
    return fetched(values[None, None], np.zeros(w.shape[-1], dtype=int), *maps.fetch(w))[0]


@pytest.mark.parametrize("name", MAPS)
def test_weights_are_shares_of_texels_that_exist(name):
    maps = MAPS[name]
    index, weight = maps.fetch(directions(len(maps.centres()), 2000, 1))
    assert index.min() >= 0
    assert index.max() < maps.K
    assert weight.min() >= 0
    np.testing.assert_allclose(weight.sum(axis=0), 1, rtol=1e-14)


@pytest.mark.parametrize("name", MAPS)
def test_a_texel_is_read_as_it_is_in_the_direction_of_its_centre(name):
    maps = MAPS[name]
    values = np.random.default_rng(2).random(maps.K)
    np.testing.assert_allclose(np.linalg.norm(maps.centres(), axis=0), 1, rtol=1e-14)
    np.testing.assert_allclose(read(maps, values, maps.centres()), values, rtol=1e-12)


@pytest.mark.parametrize("name", MAPS)
def test_interpolation_has_no_seam(name):
    """Between directions that are 1e-6 apart, values differ by no more than a texel's slope allows."""
    maps = MAPS[name]
    w = directions(len(maps.centres()), 20_000, 3)
    near = w + 1e-6 * directions(len(w), w.shape[1], 4)
    values = np.random.default_rng(5).random(maps.K)
    step = read(maps, values, w) - read(maps, values, near / np.linalg.norm(near, axis=0))
    assert np.abs(step).max() < 1e-6 * 4 * maps.K


def test_a_seam_is_noticed():
    """Texels beyond a side clamped instead of mirrored: the map tears along half its border."""

    class Torn(Octahedral):
        def texel(self, column, row):
            return np.clip(row, 0, self.m - 1) * self.m + np.clip(column, 0, self.m - 1)

    values, turn = np.random.default_rng(5).random(64), np.linspace(0.1, np.pi / 2 - 0.1, 99)
    sides = [np.stack([np.cos(turn), np.full(99, y), -np.sin(turn)]) for y in (1e-9, -1e-9)]
    tears = {
        maps: np.abs(np.subtract(*[read(maps, values, w) for w in sides])).max() for maps in (Octahedral(8), Torn(8))
    }
    assert tears[Octahedral(8)] < 1e-6
    assert tears[Torn(8)] > 0.1


def test_reading_over_a_side_is_reading_from_a_map_with_a_border_of_one_texel():
    m = 8
    inner = np.random.default_rng(6).random((m, m))
    bordered = np.zeros((m + 2, m + 2))
    bordered[1:-1, 1:-1] = inner
    bordered[0, 1:-1], bordered[-1, 1:-1] = inner[0, ::-1], inner[-1, ::-1]
    bordered[1:-1, 0], bordered[1:-1, -1] = inner[::-1, 0], inner[::-1, -1]
    bordered[0, 0], bordered[0, -1] = inner[-1, -1], inner[-1, 0]
    bordered[-1, 0], bordered[-1, -1] = inner[0, -1], inner[0, 0]
    w = directions(3, 5000, 7)
    at = (folded(w) + 1) / 2 * m + 0.5
    low = np.floor(at).astype(int)
    x, y = at - low
    expected = sum(
        np.where(i, x, 1 - x) * np.where(j, y, 1 - y) * bordered[low[1] + j, low[0] + i] for i in (0, 1) for j in (0, 1)
    )
    np.testing.assert_allclose(read(Octahedral(m), inner.reshape(-1), w), expected, rtol=1e-12)


def test_folding_undoes_unfolding():
    p = np.random.default_rng(8).uniform(-1, 1, (2, 5000))
    np.testing.assert_allclose(folded(unfolded(p)), p, atol=1e-14)
    np.testing.assert_allclose(np.abs(unfolded(p)).sum(axis=0), 1, rtol=1e-13)


@pytest.mark.parametrize("name", WORLDS)
def test_what_is_gathered_are_shares_of_rays(name):
    _, maps = WORLDS[name]
    for part, exponent in ((maps.irradiance, 1), (maps.depth, 50)):
        shares, known = gathering(part, maps.rays(200, live(9)), exponent)
        assert known.all()
        np.testing.assert_allclose(shares.sum(axis=0), 1, rtol=1e-12)


def test_texels_that_no_ray_tells_of_are_named():
    shares, known = gathering(Bins(4), turned(np.array([0.1])), 1)
    assert known.tolist() == [True, False, False, True]
    np.testing.assert_array_equal(shares[:, ~known], 0)


# ---------------------------------------------------------------- rays


@pytest.mark.parametrize("name", WORLDS)
def test_rays_are_uniform_turn_by_turn(name):
    """Means over turns of w and of w w^T are those of a uniform direction, 0 and 1 / d."""
    space, maps = WORLDS[name]
    chance = live(10)
    w = np.stack([maps.rays(7, chance) for _ in range(4000)])
    np.testing.assert_allclose(np.linalg.norm(w, axis=1), 1, rtol=1e-13)
    np.testing.assert_allclose(w.mean(axis=(0, 2)), 0, atol=0.02)
    np.testing.assert_allclose(np.einsum("tar,tbr->ab", w, w) / w[:, 0].size, np.eye(space.d) / space.d, atol=0.02)


@pytest.mark.parametrize(("name", "error"), [("plane", 1e-3), ("solid", 2e-2)])
def test_rays_are_more_even_than_independent_ones(name, error):
    """Of a hemisphere's cosine, C_d, 64 rays know all but `error`, in any direction; independent rays miss 10 %."""
    space, maps = WORLDS[name]
    n = directions(space.d, 500, 11)
    even = np.maximum(maps.rays(64, live(12)).T @ n, 0).sum(axis=0)
    alone = np.maximum(directions(space.d, 64, 13).T @ n, 0).sum(axis=0)
    expected = 64 * {2: 1 / np.pi, 3: 1 / 4}[space.d]
    assert np.abs(even / expected - 1).max() < error
    assert np.abs(alone / expected - 1).max() > 0.1


def test_a_rotation_is_one_and_turns_any_direction_into_any():
    turns = [rotation(u) for u in np.random.default_rng(14).random((500, 3))]
    for turn in turns:
        np.testing.assert_allclose(turn @ turn.T, np.eye(3), atol=1e-13)
        assert np.linalg.det(turn) > 0
    ends = np.stack([turn @ np.array([0, 0, 1.0]) for turn in turns])
    np.testing.assert_allclose(ends.T @ ends / len(ends), np.eye(3) / 3, atol=0.06)


def test_the_spiral_has_equal_areas_per_ray():
    np.testing.assert_allclose(spiral(9)[2], 1 - (2 * np.arange(9) + 1) / 9, rtol=1e-14)
    assert rays(9, live(15)).shape == (3, 9)
