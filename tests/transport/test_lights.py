"""Lights: picked by power, sampled by area, one-sided, and densities converted between surfaces and directions."""

import numpy as np
import pytest

from restir_ref.batch import Array
from restir_ref.transport.materials import Layer, Material
from restir_ref.transport.rays import arrive, emitted, light_pdf, sample_light
from restir_ref.transport.scene import Facet, Scene, scene
from restir_ref.transport.space import Space, sphere_area
from tests.transport.rooms import MATTE, directions, facing_inwards, inside, room, simplex, soup
from tests.transport.spaces import SEEING, SPACES

every_space = pytest.mark.parametrize("space", SPACES.values(), ids=SPACES)
every_seen_space = pytest.mark.parametrize("space", SEEING.values(), ids=SEEING)


def lamp(space: Space) -> tuple[Scene, Array]:
    """One facet that emits towards the origin, and its corners (d, d)."""
    corners = facing_inwards(simplex(space.d)[: space.d] + 0.3, np.zeros(space.d))
    return scene(space, [MATTE], [Facet(corners.tolist(), 0, (1.0,))]), corners


def subtended(corners: Array) -> float:
    """Angle of a segment, or solid angle of a triangle, seen from the origin.  (Van Oosterom 1983)"""
    e = corners / np.linalg.norm(corners, axis=1, keepdims=True)
    if len(e) == 2:
        return float(np.arccos(e[0] @ e[1]))
    a, b, c = e
    return float(2 * np.arctan2(abs(np.linalg.det(e)), 1 + a @ b + b @ c + c @ a))


# ---------------------------------------------------------------- densities


def z_score(values: Array, truth: float) -> float:
    """Of the mean; too noisy to decide, above 0.3 %, is a failure."""
    error = values.std() / np.sqrt(values.size)
    assert error <= 0.003 * truth
    return float((values.mean() - truth) / error)


def seen_by_points(space: Space, n: int, power: int) -> Array:
    """Estimates cos' / (r^power p_A) of the measure that a light subtends at the origin, from points on it."""
    s, _ = lamp(space)
    rng = np.random.default_rng(1)
    light = sample_light(s, rng.random(n), rng.random((space.d - 1, n)))
    r = np.linalg.norm(light.y, axis=0)
    return -(light.n * light.y).sum(axis=0) / r / (r**power * light.pdf_area)


@pytest.mark.claims("COM-A03")
@every_seen_space
def test_points_on_a_light_give_the_measure_it_subtends(space):
    _, corners = lamp(space)
    assert abs(z_score(seen_by_points(space, 200_000, space.d - 1), subtended(corners))) < 4


@pytest.mark.claims("COM-A03")
@every_seen_space
def test_directions_that_meet_a_light_give_the_measure_it_subtends(space):
    s, corners = lamp(space)
    n = {2: 500_000, 3: 2_000_000}[space.d]
    _, _, met = arrive(s, np.zeros((space.d, n)), directions(space.d, n, 2))
    assert abs(z_score(met * sphere_area(space.d), subtended(corners))) < 4


def test_the_square_of_the_distance_in_the_plane_is_noticed():
    _, corners = lamp(SPACES["plane"])
    assert abs(z_score(seen_by_points(SPACES["plane"], 200_000, 2), subtended(corners))) > 8


@pytest.mark.claims("COM-A03")
@every_space
def test_the_density_of_a_light_that_a_ray_meets_is_that_of_sampling_the_point(space):
    s, n = room(space), 5000
    x, rng = inside(s, n, 3), np.random.default_rng(4)
    light = sample_light(s, rng.random(n), rng.random((space.d - 1, n)))
    r = np.linalg.norm(light.y - x, axis=0)
    w = (light.y - x) / r
    v, t, met = arrive(s, x, w)
    assert met.all()
    assert np.allclose(t, r)
    expected = light.pdf_area * r ** (space.d - 1) / -(light.n * w).sum(axis=0)
    assert np.allclose(light_pdf(s, v, t), expected, rtol=1e-9)


@every_space
def test_reciprocal_densities_of_lights_all_around_integrate_to_the_sphere(space):
    """E[1 / p(w)] = |S^(d-1)| if every direction meets a light."""
    s, n = room(space), 400_000
    x, rng = simplex(space.d).mean(axis=0)[:, None], np.random.default_rng(6)
    light = sample_light(s, rng.random(n), rng.random((space.d - 1, n)))
    v, r, _ = arrive(s, x.repeat(n, axis=1), (light.y - x) / np.linalg.norm(light.y - x, axis=0))
    p = light_pdf(s, v, r)
    assert abs(z_score(1 / p, sphere_area(space.d))) < 4


# ---------------------------------------------------------------- picking


def test_lights_are_picked_by_power_and_points_spread_evenly():
    plane = SPACES["plane"]
    facets = [
        Facet(((0, 0), (1, 0)), 0, (1.0, 3.0, 2.0)),
        Facet(((5, 5), (6, 5))),
        Facet(((0, 1), (3, 1)), 0, (1.0, 0.0, 1.0)),
    ]
    s = scene(plane, [Material([Layer("lambert", (0.5,) * 3)])], facets)
    pick = (np.arange(1000) + 0.5) / 1000
    light = sample_light(s, pick, pick[None] * 0 + 0.5)
    assert np.unique(light.y[1], return_counts=True)[1].tolist() == [500, 500]  # 2 x 1 and 2/3 x 3
    assert np.allclose(light.pdf_area, np.where(light.y[1] == 0, 0.5, 0.5 / 3))
    assert np.allclose(light.emission, np.where(light.y[1] == 0, np.array([[1], [3], [2]]), np.array([[1], [0], [1]])))


@every_space
def test_points_lie_on_their_light_and_their_density_integrates_to_one(space):
    s, n = room(space), 20_000
    rng = np.random.default_rng(7)
    light = sample_light(s, rng.random(n), rng.random((space.d - 1, n)))
    heights = (s.surfaces.maps @ light.y + s.surfaces.offsets)[-s.S :]
    assert np.abs(heights).min(axis=0).max() < 1e-14
    assert (heights > -1e-14).all()
    sizes = np.bincount(np.abs(heights).argmin(axis=0), 1 / light.pdf_area, s.S) / n
    assert np.allclose(sizes.sum(), (1 / light.pdf_area).mean())
    assert np.allclose(s.pdf_area, s.pdf_area[0])  # equal radiance: uniform over all walls
    assert np.allclose(
        np.diff(s.lights.upto, prepend=0) / s.lights.pdf_area * s.pdf_area[0], np.diff(s.lights.upto, prepend=0)
    )


@every_space
def test_the_last_number_still_picks_a_light(space):
    s = soup(space, 1)
    light = sample_light(s, np.array([0.0, 1 - 1e-16]), np.full((space.d - 1, 2), 0.3))
    assert np.isfinite(light.y).all()


# ---------------------------------------------------------------- one side


@every_space
def test_light_leaves_the_front_only_and_the_back_has_no_density(space):
    s, corners = lamp(space)
    middle = corners.mean(axis=0)[:, None]
    x = np.concatenate([0 * middle, 2 * middle], axis=1)
    v, r, met = arrive(s, x, np.concatenate([middle, -middle], axis=1) / np.linalg.norm(middle))
    assert met.all()
    assert v.front.tolist() == [True, False]
    assert emitted(s, v).tolist() == [[1.0, 0.0]]
    assert (light_pdf(s, v, r) > 0).tolist() == [True, False]


def test_surfaces_that_do_not_emit_and_balls_have_no_density():
    s = soup(SPACES["plane"], 1)
    v, r, met = arrive(s, np.random.default_rng(8).random((2, 2000)), directions(2, 2000, 9))
    dark = met & (v.prim > 0)
    assert (v.prim >= s.S).any()
    assert (light_pdf(s, v, r)[dark] == 0).all()
    assert (emitted(s, v)[:, dark] == 0).all()
