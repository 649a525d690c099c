"""Laws of a query: what it blends, what it trusts, and what each of its weights is for."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from restir_ref.transport.cache.biases import self_shadow, view_path
from restir_ref.transport.cache.volume import CRUSHED, FLOOR, Volume, Weighting, chebyshev, crush, unlit, wrap
from tests.transport.cache.worlds import WORLDS, middle, volume
from tests.transport.rooms import directions, room

UNTRUSTING = Weighting(wrap=np.ones_like, visibility=lambda v, r1, r2: np.ones_like(v), crush=lambda weight: weight)
"""Multilinear interpolation alone."""


def filled(name: str, weighting: Weighting = UNTRUSTING, seed: int = 1) -> Volume:
    """A volume of random irradiance that sees everything."""
    v = volume(name, room(WORLDS[name][0]))
    E = np.random.default_rng(seed).random(v.E.shape)
    return replace(v, E=E, r=np.stack([np.full(v.r.shape[1:], v.grid.reach), np.full(v.r.shape[1:], v.grid.reach**2)]),
                   frames=1, weighting=weighting)  # fmt: skip


def queries(v: Volume, n: int = 300, seed: int = 2) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points around the probes, normals and directions."""
    ends = v.grid.place(np.array([0, v.grid.P - 1]))
    u = np.random.default_rng(seed).random((v.grid.d, n)) * 1.6 - 0.3
    return (
        ends[:, :1] + u * (ends[:, 1:] - ends[:, :1]),
        directions(v.grid.d, n, seed + 1),
        directions(v.grid.d, n, seed + 2),
    )


@pytest.mark.parametrize("name", WORLDS)
def test_a_query_of_even_light_is_that_light_whatever_the_weights(name):
    v = filled(name, Weighting())
    v = replace(v, E=np.full_like(v.E, 0.7))
    x, n, w = queries(v)
    np.testing.assert_allclose(v.irradiance(x, n, w, 0.1 * n), 0.7, rtol=1e-12)


@pytest.mark.parametrize("name", WORLDS)
def test_a_query_at_a_probe_is_that_probe(name):
    v = filled(name, Weighting())
    x = v.grid.place(np.arange(v.grid.P))
    n = directions(v.grid.d, v.grid.P, 3)
    texel, share = v.maps.irradiance.fetch(n)
    expected = sum(s * v.E[0, np.arange(v.grid.P), t] for t, s in zip(texel, share, strict=True))
    np.testing.assert_allclose(v.irradiance(x, n, n, 0 * x)[0], expected, rtol=1e-9)


@pytest.mark.parametrize("name", WORLDS)
def test_without_trust_a_query_is_linear_in_the_place_it_looks_at(name):
    v = filled(name)
    places = v.grid.place(np.arange(v.grid.P))
    v = replace(v, E=np.repeat(places.sum(axis=0)[None, :, None], v.maps.irradiance.K, axis=2))
    x, n, w = queries(v)
    b = 0.02 * directions(v.grid.d, x.shape[1], 9)
    inside = np.clip(x + b, places[:, :1], places[:, -1:])
    np.testing.assert_allclose(v.irradiance(x, n, w, b)[0], inside.sum(axis=0), rtol=1e-9)


@pytest.mark.parametrize("name", WORLDS)
def test_the_displacement_moves_corners_and_visibility_but_not_the_wrap_weight(name):
    seen = []

    def spied(cos):
        seen.append(cos)
        return np.ones_like(cos)

    v = filled(name, replace(UNTRUSTING, wrap=spied))
    x, n, w = queries(v)
    v.irradiance(x, n, w, 1e-9 * n)
    still = [each.copy() for each in seen]
    seen.clear()
    v.irradiance(x, n, w, 0 * n)
    np.testing.assert_array_equal(seen, still)


@pytest.mark.parametrize("name", WORLDS)
def test_a_query_is_linear_in_what_probes_hold(name):
    v, other = filled(name, Weighting(), 1), filled(name, Weighting(), 7)
    x, n, w = queries(v)
    both = replace(v, E=2 * v.E + 3 * other.E).irradiance(x, n, w, 0 * x)
    np.testing.assert_allclose(both, 2 * v.irradiance(x, n, w, 0 * x) + 3 * other.irradiance(x, n, w, 0 * x), rtol=1e-9)


def test_probes_that_take_no_part_are_not_heard():
    v = filled("plane", Weighting())
    loud = replace(v, E=np.where(np.arange(4)[:, None] == 2, 1e6, v.E))
    x, n, w = queries(v)
    muted = [replace(each, active=np.arange(4) != 2).irradiance(x, n, w, 0 * x) for each in (v, loud)]
    np.testing.assert_array_equal(*muted)
    assert not replace(v, active=np.zeros(4, dtype=bool)).irradiance(x, n, w, 0 * x).any()


# ---------------------------------------------------------------- weights


def test_the_wrap_weight_is_largest_in_front_and_never_nothing():
    cos = np.linspace(-1, 1, 101)
    assert wrap(np.array([1.0, 0.0, -1.0])).tolist() == pytest.approx([1.2, 0.45, 0.2])
    assert (np.diff(wrap(cos)) > 0).all()


def test_crushed_weights_join_the_others_without_a_jump():
    assert crush(np.array([CRUSHED])) == pytest.approx(CRUSHED)
    assert crush(np.array([CRUSHED * (1 - 1e-9)])) == pytest.approx(CRUSHED)
    assert crush(np.array([0.1, 0.0, 1.1])) == pytest.approx([0.1**3 / 0.04, 0, 1.1])


@pytest.mark.parametrize("exponent", [0.5, 1.0, 4.0])
def test_what_a_probe_sees_at_least_as_far_as_a_point_bounds_how_visible_the_point_is(exponent):
    """Chebyshev: the share of distances >= v is at most the bound before it is cubed, for v beyond the mean."""
    r = np.random.default_rng(1).random((1, 5000)) ** exponent
    v = np.linspace(r.mean() + 1e-9, 1, 200)
    bound = np.cbrt(chebyshev(v, np.full(200, r.mean()), np.full(200, (r**2).mean()), 0.0))
    assert ((r >= v[:, None]).mean(axis=1) <= bound).all()


def test_a_point_nearer_than_the_mean_is_visible_and_one_far_behind_a_flat_wall_is_at_the_floor():
    one = np.ones(3)
    assert chebyshev(np.array([0.5, 1.0, 2.0]), one, one).tolist() == [1, 1, FLOOR]
    assert partial(chebyshev, floor=0.0)(2 * one, one, one).tolist() == [0, 0, 0]


# ---------------------------------------------------------------- displacements


def test_the_self_shadow_bias_is_three_quarters_of_a_spacing_between_normal_and_view():
    n, o = np.array([[0.0], [1.0]]), np.array([[1.0], [0.0]])
    np.testing.assert_allclose(self_shadow(n, o, np.array([0.4, 0.2]))[:, 0], [0.8 * 0.15, 0.2 * 0.15])
    np.testing.assert_allclose(self_shadow(n, n, np.array([0.4, 0.2]))[:, 0], [0, 0.15])


def test_the_view_path_bias_stays_on_the_segment():
    o, length = directions(3, 100, 1), np.linspace(0.01, 2, 100)
    moved = np.linalg.norm(view_path(o, 0.3, length), axis=0)
    assert (moved < length).all()
    np.testing.assert_allclose(moved, np.minimum(0.3, length), rtol=1e-5)


# ---------------------------------------------------------------- bad input


@pytest.mark.parametrize(("scene", "maps"), [("plane", "solid"), ("solid", "plane")])
def test_a_grid_of_another_world_is_refused(scene, maps):
    space = WORLDS[scene][0]
    with pytest.raises(ValueError, match=f"the scene has {space.d} dimensions, the grid .*own world"):
        unlit(room(space), middle(WORLDS[maps][0].d), WORLDS[maps][1])
    with pytest.raises(ValueError, match=f"the scene has {space.d} dimensions, the grid {space.d}, the maps"):
        unlit(room(space), middle(space.d), WORLDS[maps][1])


def test_what_a_probe_stores_is_counted():
    assert volume("plane", room(WORLDS["plane"][0])).bytes_per_probe == 8 * (32 + 2 * 64)
    assert volume("solid", room(WORLDS["solid"][0])).bytes_per_probe == 8 * (64 + 2 * 256)
