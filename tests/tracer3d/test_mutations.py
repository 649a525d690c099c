"""Mutations in space are those of any dimension: own numbers, acceptances, densities per area."""

from functools import cache

import numpy as np
import pytest
from scipy.stats import chi2

from restir_ref.batch import pick, take
from restir_ref.chance import Live
from restir_ref.images import random_in_disk
from restir_ref.integrals import Pixels
from restir_ref.restir import initial, spatial
from restir_ref.transport import materials as mat
from restir_ref.transport.mutations import TwoRays
from restir_ref.transport.paths import first_hit, scatter
from restir_ref.transport.rays import arrive
from restir_ref.transport.retracing import traced
from restir_ref.transport.vectors import norm, normalize
from tests.tracer3d.views import tracer
from tests.transport.mutated import STEP, Moves, measured_ratio, moves, over_areas, own, retraced_acceptance, steep

SCENES = ("cornell", "glossy_cornell", "ajar")


@cache
def moved(scene: str) -> Moves:
    """Proposals from paths that have been reused, away from grazing angles."""
    of, chance = TwoRays(tracer(scene), STEP), Live(np.random.default_rng(1))
    here = Pixels(of, np.arange(of.n))
    X = initial(here, chance, 4)
    X = spatial(X, here, random_in_disk((32, 32))(of, here.index, 3, 10, chance), chance)
    m = moves(of, X, here, seed=2)
    kept = np.flatnonzero(steep(m))
    return Moves(m.t, m.i[kept], take(m.x, kept), take(m.x_new, kept), m.T[kept])


@pytest.mark.claims("MCMC-P01", "MCMC-E10", "MCMC-E14", "MCMC-A08")
@pytest.mark.parametrize("scene", SCENES)
def test_two_rays_accept_as_retracing_and_as_areas_do(scene) -> None:
    m = moved(scene)
    a = (m.x_new.F.mean(axis=0) / m.x.F.mean(axis=0)) * m.T
    assert len(a) > 50
    assert np.abs(a / retraced_acceptance(m) - 1).max() < 1e-9
    assert np.abs(a / over_areas(m) - 1).max() < 1e-8


@pytest.mark.claims("MCMC-A08")
@pytest.mark.parametrize("scene", SCENES)
def test_own_numbers_find_the_path_again(scene) -> None:
    m = moved(scene)
    y = traced(m.t, own(m.t, m.x_new, m.i), m.i, m.x.k, m.x.nee)
    assert (y.c == m.x.c).all()
    assert np.abs(y.F / m.x_new.F - 1).max() < 1e-8


def test_squared_distances_are_needed_in_space() -> None:
    m = moved("cornell")
    joined = (m.x.c <= m.x.k) & ~(m.x.nee & (m.x.c == m.x.k))
    r, r_new = (norm(x.far_z - x.z) for x in (m.x, m.x_new))
    a = m.x_new.F.mean(axis=0) / m.x.F.mean(axis=0) * m.T * np.where(joined, r_new / r, 1)  # as in the plane
    assert np.median(np.abs(a / retraced_acceptance(m) - 1)[joined]) > 1e-3


@pytest.mark.claims("MCMC-E10")
def test_the_ratio_of_transitions_is_that_of_finite_differences() -> None:
    m = moved("ajar")
    kept = np.flatnonzero((m.x.c <= m.x.k) & ~(m.x.nee & (m.x.c == m.x.k)) & steep(m, 0.02))
    m = Moves(m.t, m.i[kept], take(m.x, kept), take(m.x_new, kept), m.T[kept])
    assert len(kept) > 50
    assert np.abs(measured_ratio(m) / m.T - 1).max() < 1e-3


# ---------------------------------------------------------------- densities per area

FINER = 1e-5


@pytest.mark.claims("MCMC-E08")
def test_the_geometry_factor_is_the_change_of_directions_with_area() -> None:
    """g = cos / r^2 by finite differences along two directions of the surface that is met."""
    t, N = tracer("glossy_cornell"), 2000
    u, i = np.random.default_rng(3).random((t.D, N)), np.arange(N) % t.sensor.n
    v, _, _ = first_hit(t, u, i)
    y, r, met = arrive(t.scene, v.x, scatter(t, v, u, 1).w)
    flat = [axis[:, None] - y.n * y.n[k] for k, axis in enumerate(np.eye(3))]  # each axis, along the surface
    a = normalize(pick(flat, np.abs(y.n).argmin(axis=0)))
    b = np.cross(y.n, a, axis=0)
    d = [(normalize(y.x + FINER * e - v.x) - normalize(y.x - FINER * e - v.x)) / (2 * FINER) for e in (a, b)]
    found = norm(np.cross(*d, axis=0))
    good = np.flatnonzero(met & (y.o[-1] > 0.05) & (r > 0.05))
    assert np.abs(found / (y.o[-1] / r**2) - 1)[good].max() < 1e-5


@pytest.mark.claims("MCMC-E07")
def test_hit_points_are_as_dense_as_the_product_says() -> None:
    """Of one ray's x_2 on the left wall: a chi-squared test over cells of the wall, p_rho g integrated by midpoints."""
    t, N, cells, fine = tracer("cornell"), 200_000, 5, 12
    u, i = np.random.default_rng(4).random((t.D, N)), np.zeros(N, dtype=int)
    u[: t.sensor.numbers] = 0.5
    v, _, _ = first_hit(t, u, i)
    y, _, _ = arrive(t.scene, v.x, scatter(t, v, u, 1).w)
    wall = y.x[0] < 1e-9
    counts, _, _ = np.histogram2d(y.x[1][wall], y.x[2][wall], bins=[np.linspace(0, 1, cells + 1)] * 2)
    grid = (np.arange(cells * fine) + 0.5) / (cells * fine)
    points = np.stack(
        [np.zeros((cells * fine) ** 2), *(each.reshape(-1) for each in np.meshgrid(grid, grid, indexing="ij"))]
    )
    expected = N * density(t, v, points).reshape(cells, fine, cells, fine).mean(axis=(1, 3)) / cells**2
    kept = expected > 20
    assert kept.sum() > 8
    for by, right in ((1, True), (1.25, False)):
        off = (counts[kept] - by * expected[kept]) ** 2 / (by * expected[kept])
        assert bool(chi2.sf(off.sum(), kept.sum()) > 1e-4) is right


def density(t, v, points):
    """p_rho g at points of a wall, seen from one vertex; 0 where something stands between."""
    n = points.shape[1]
    v = take(v, np.zeros(n, dtype=int))
    w, r = normalize(points - v.x), norm(points - v.x)
    _, p = mat.evaluate_all(
        t.scene.materials, t.scene.space, v, mat.lobe_shares(t.scene.materials, v), t.scene.space.to_local(v.n, w)
    )
    cos = np.abs(w[0])
    return p * cos / r**2 * t.scene.visible(v.x, points + 1e-9 * np.eye(3)[:, :1])
