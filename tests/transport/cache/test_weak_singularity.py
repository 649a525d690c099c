"""Beside a crease: points on the wall drawn evenly, their second moment by quadrature.  [DDGIR 3.5]"""

from functools import cache

import numpy as np
import pytest

from figures.claims.criteria import Outcome, slope, slope_within
from flatland2d import SCENES as FLAT
from restir_ref.batch import Array
from restir_ref.transport.cache.integrals import CacheIntegrals, Second, bound, connection
from restir_ref.transport.cache.leaving import Cache
from restir_ref.transport.rays import vertex
from restir_ref.transport.scene import Scene
from tests.transport.cache.fields import Uniform
from tracer3d import SCENES as SPACE

DISTANCES = np.geomspace(1e-3, 0.1, 7)
ROOMS = {"flatland": FLAT["matte_cornell"], "space": SPACE["crease"]}
WORLDS = list(ROOMS)


def spot(s: Scene, a: float, N: int, G_max: float) -> CacheIntegrals:
    """x_1 on the floor of a unit room, a from the wall x = 0, seen from above; N columns of it."""
    x = np.full((s.space.d, N), 0.5)
    x[0], x[1] = a, 0.0
    up = np.zeros_like(x)
    up[1] = 1
    _, prim = s.intersect(x + 1e-3 * up, -up)
    one = np.ones(N)
    v = vertex(s, x, prim, up)
    field = Uniform(s.space.d, s.C)
    return CacheIntegrals(Cache(s, field), v, one, np.ones((s.C, N)), (N,), G_max)


def wall(d: int) -> tuple[Array, Array]:
    """Points (d, K) of the wall x = 0, dense towards the foot of x_1, and the area of each."""
    n = {2: 4000, 3: 120}[d]
    s, sign = (np.arange(n) + 0.5) / n, np.array([-1.0, 1.0])
    y, dy = s**3, 3 * s**2 / n
    if d == 2:
        return np.stack([0 * y, y]), dy
    z, dz = (0.5 + 0.5 * np.outer(sign, y)).reshape(-1), np.tile(dy / 2, 2)
    Y, Z = np.meshgrid(y, z, indexing="ij")
    return np.stack([0 * Y, Y, Z]).reshape(3, -1), np.outer(dy, dz).reshape(-1)


def moments(world: str, a: float, G_max: float) -> tuple[float, float, float]:
    """int f b, int (f b)^2 and int f (1 - b) over a wall of area 1 that sends 1, b = min(1, G_max / G)."""
    s = ROOMS[world]().scene
    y, area = wall(s.space.d)
    K = y.shape[-1]
    of = spot(s, a, K, G_max)
    n = np.zeros_like(y)
    n[0] = 1
    at = connection(of, np.arange(K), Second(y, n, np.zeros(K, dtype=int), y, of.T, of.T, np.zeros(K, dtype=bool)))
    b = bound(G_max, at.G)
    return tuple(float((each[0] * area).sum()) for each in (at.f * b, (at.f * b) ** 2, at.f * (1 - b)))


@cache
def growth(world: str, G_max: float) -> Array:
    return np.array([moments(world, a, G_max)[1] for a in DISTANCES])


def unbounded_slope(world: str) -> Outcome:
    d = ROOMS[world]().scene.space.d
    return slope_within(DISTANCES, growth(world, np.inf), 1 - d, {2: 0.1, 3: 0.15}[d])


@pytest.mark.claims("DDGIR-P01")
def test_in_flatland_the_second_moment_grows_like_1_over_the_distance_to_the_crease() -> None:
    assert unbounded_slope("flatland").passed


@pytest.mark.claims("DDGIR-P01", world="tracer3d")
def test_in_space_the_second_moment_grows_like_1_over_the_squared_distance_to_the_crease() -> None:
    assert unbounded_slope("space").passed


@pytest.mark.claims("DDGIR-E09", part="second moments, by quadrature")
@pytest.mark.claims("DDGIR-P01", part="bounded")
@pytest.mark.claims("DDGIR-P01", part="bounded", world="tracer3d")
@pytest.mark.parametrize("G_max", [1.0, 4.0, 16.0])
@pytest.mark.parametrize("world", WORLDS)
def test_bounded_the_second_moment_stays(world, G_max) -> None:
    found = growth(world, G_max)
    assert slope(DISTANCES[:5], found[:5]) > -0.1
    assert found.max() < growth(world, np.inf).max() / 4


@pytest.mark.claims("DDGIR-E09", part="the two parts, by quadrature")
@pytest.mark.claims("DDGIR-E09", part="the two parts, by quadrature", world="tracer3d")
@pytest.mark.parametrize("world", WORLDS)
def test_what_the_bound_leaves_out_is_the_residual(world) -> None:
    whole, _, nothing = moments(world, 0.02, np.inf)
    assert nothing == 0
    for G_max in (1.0, 4.0, 16.0):
        ceil, _, floor = moments(world, 0.02, G_max)
        assert ceil + floor == pytest.approx(whole, rel=1e-12)
        assert 0 < floor < whole


@pytest.mark.parametrize("world", WORLDS)
def test_the_bound_is_a_length_to_the_power_minus_d_plus_1(world) -> None:
    """Scaling lengths by 2 divides G by 2^(d-1)."""
    d = ROOMS[world]().scene.space.d
    G = np.array([0.5, 3.0, 40.0])
    np.testing.assert_allclose(bound(4.0, G), bound(4.0 / 2 ** (d - 1), G / 2 ** (d - 1)))
    np.testing.assert_array_equal(bound(np.inf, G), 1)
