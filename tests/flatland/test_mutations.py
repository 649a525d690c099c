"""Mutations in flatland, row by row: densities per length, colour, and the preset of the thesis."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chisquare

from figures.experiments import mutated
from figures.experiments.mutated import ARMS, VIEWS, covariances
from flatland2d import PLANE, SCENES
from flatland2d.scenes import LAMP, block, chain
from restir_ref.batch import Array, ratio, take
from restir_ref.chance import Live
from restir_ref.decorrelation import Blue, Move, mutate
from restir_ref.integrals import Pixels
from restir_ref.metrics import box_covariance
from restir_ref.restir import initial, shade
from restir_ref.transport import materials as mat
from restir_ref.transport import mutations as module
from restir_ref.transport.materials import Layer, Material
from restir_ref.transport.mutations import TwoRays
from restir_ref.transport.paths import Tracer, first_hit, scatter
from restir_ref.transport.rays import arrive
from restir_ref.transport.scene import Facet
from restir_ref.transport.scene import scene as compiled
from restir_ref.transport.vectors import norm, normalize
from tests.transport.mutated import (
    STEP,
    Moves,
    measured_ratio,
    moves,
    over_areas,
    retraced_acceptance,
    reused,
    steep,
    tracer,
)
from tests.transport.paths import HYBRID
from toy1d import three_channels, walking

# ---------------------------------------------------------------- densities per length

FINER = 1e-5


@pytest.mark.claims("MCMC-E08")
def test_the_geometry_factor_is_the_change_of_directions_with_length() -> None:
    t, N = tracer("glossy_cornell"), 2000
    u, i = np.random.default_rng(3).random((t.D, N)), np.arange(N) % t.sensor.n
    v, _, _ = first_hit(t, u, i)
    y, r, met = arrive(t.scene, v.x, scatter(t, v, u, 1).w)
    along = FINER * np.stack([-y.n[1], y.n[0]])
    found = norm(normalize(y.x + along - v.x) - normalize(y.x - along - v.x)) / (2 * FINER)
    good = np.flatnonzero(met & (y.o[-1] > 0.05) & (r > 0.05))
    assert np.abs(found / (y.o[-1] / r) - 1)[good].max() < 1e-5
    assert np.abs(found / (y.o[-1] / r**2) - 1)[good].max() > 0.1


@pytest.mark.claims("MCMC-E07")
@pytest.mark.parametrize(("power", "right"), [(1, True), (2, False)])
def test_hit_points_are_as_dense_as_the_product_says(power, right) -> None:
    """x_2 on the ceiling from one x_1: a chi-squared test, p_rho g integrated by midpoints."""
    t, N, cells, fine = tracer("cornell"), 200_000, 20, 200
    u, i = np.random.default_rng(4).random((t.D, N)), np.zeros(N, dtype=int)
    u[: t.sensor.numbers] = 0.5
    v, _, _ = first_hit(t, u, i)
    y, _, _ = arrive(t.scene, v.x, scatter(t, v, u, 1).w)
    counts, _ = np.histogram(y.x[0][y.x[1] > 1 - 1e-9], np.linspace(0, 1, cells + 1))
    points = np.stack([(np.arange(cells * fine) + 0.5) / (cells * fine), np.ones(cells * fine)])
    there = take(v, np.zeros(cells * fine, dtype=int))
    w, r = normalize(points - there.x), norm(points - there.x)
    P = mat.lobe_shares(t.scene.materials, there)
    _, p = mat.evaluate_all(t.scene.materials, PLANE, there, P, PLANE.to_local(there.n, w))
    dense = p * np.abs(w[1]) / r**power * t.scene.visible(there.x, points - [[0], [1e-9]])
    expected = N * dense.reshape(cells, fine).mean(axis=1) / cells
    kept = expected > 20
    assert kept.sum() > 5
    others = [N - each[kept].sum() for each in (counts, expected)]
    p_value = chisquare([*counts[kept], others[0]], [*expected[kept], others[1]]).pvalue
    assert bool(p_value > 1e-4) is right


@pytest.mark.claims("MCMC-E10")
@pytest.mark.parametrize("scene", ["matte_cornell", "ajar"])
def test_the_ratio_of_transitions_is_that_of_finite_differences(scene) -> None:
    """All walls are Lambert, so that what leaves x_(c+1) does not change with where it is seen from."""
    of = TwoRays(tracer(scene), STEP)
    X, here = reused(of, 6, seed=1)
    m = moves(of, X, here, seed=2)
    kept = np.flatnonzero((m.x.c <= m.x.k) & ~(m.x.nee & (m.x.c == m.x.k)) & steep(m, 0.02))
    m = Moves(m.t, m.i[kept], take(m.x, kept), take(m.x_new, kept), m.T[kept])
    assert len(kept) > 50
    assert np.abs(measured_ratio(m) / m.T - 1).max() < 1e-3
    assert np.abs(measured_ratio(m) * m.T - 1).max() > 0.1


# ---------------------------------------------------------------- what changes with x_c


@pytest.mark.claims("MCMC-A06", "MCMC-F04")
def test_the_bsdf_at_the_vertex_behind_must_be_evaluated_again(monkeypatch) -> None:
    """Glossy boxes: without it acceptances are not those of retraced paths."""
    of = TwoRays(tracer("glossy_cornell", "reconnection"), STEP)
    X, here = reused(of, 3, seed=1)
    m = moves(of, X, here, seed=2)
    good = steep(m)
    assert np.abs(acceptance(m) / retraced_acceptance(m) - 1)[good].max() < 1e-10
    assert np.abs(acceptance(m) / over_areas(m) - 1)[good].max() < 1e-9
    right = module.beyond

    def stale(t, x, z, p_all, r):
        """f / p and p of the direction leaving x_(c+1) as if it were seen from along its normal."""
        up = np.zeros_like(z.o)
        up[-1] = 1
        return right(t, x, replace(z, o=up), p_all, r)

    monkeypatch.setattr(module, "beyond", stale)
    m = moves(of, X, here, seed=2)
    onward = (m.x.c < m.x.k) & steep(m)
    assert (np.abs(acceptance(m) / retraced_acceptance(m) - 1)[onward] > 1e-3).any()


def acceptance(m) -> Array:
    return np.asarray(m.x_new.F.mean(axis=0) / m.x.F.mean(axis=0) * m.T)


# ---------------------------------------------------------------- colour


@pytest.mark.claims("MCMC-P03", world="toy1d")
@pytest.mark.parametrize(("suffix", "grey"), [((1.0, 1.0, 1.0), True), ((0.9, 0.3, 0.1), False)])
def test_a_coloured_suffix_makes_partial_targets_change_the_luminance_on_the_line(suffix, grey) -> None:
    """The path's front f is mutated by its own mean; behind it the suffix colours what is shown."""
    line, chance = walking(three_channels()), Live(np.random.default_rng(1))
    here = Pixels(line, np.arange(500))
    X = initial(here, chance)
    Y = mutate(X, here, chance)
    before, after = (np.mean(np.array(suffix)[:, None] * shade(Z, here), axis=0) for Z in (X, Y))
    assert bool(np.abs(after / before - 1).max() < 1e-10) is grey
    assert np.abs(after / before - 1).max() > 1e-3 or grey


def coloured(lamp: tuple[float, float, float]) -> Tracer:
    """FS10 with a red base under its white coat, and a lamp of that colour."""
    coat = [Layer("lambert", (0.5, 0.2, 0.1), weight=0.6), Layer("ggx", (0.3,) * 3, 0.3, weight=0.4)]
    walls = Material([Layer("lambert", (0.6,) * 3)])
    facets = [*chain([(0, 0), (1, 0)], 1), *chain([(1, 0), (1, 1), (0, 1), (0, 0)], 0)]
    facets += block((0.6, 0.15), (0.8, 0.45), 1)
    facets += [Facet(each.corners, 0, lamp) for each in chain(LAMP, 0, 8.0)]
    setting = SCENES["clear_coat"]()
    return Tracer(compiled(PLANE, [walls, Material(coat)], facets), setting.pinhole(), setting.depth, HYBRID)


def luminance_changes(lamp: tuple[float, float, float]) -> Array:
    """lum(c_m) / lum(c_b) of paths joined to x_(c+1), where W follows the target without the suffix.  [MCMC Alg. 6]"""
    of = TwoRays(coloured(lamp), STEP)
    X, here = reused(of, 12, seed=1)
    m = moves(of, X, here, seed=2)
    joined = np.flatnonzero((m.x.c < m.x.k) & (m.x.far_S > 0).all(axis=0))
    x, y = take(m.x, joined), take(m.x_new, joined)
    partial, partial_new = (ratio(each.F, each.far_S).mean(axis=0) for each in (x, y))
    return np.asarray(y.F.mean(axis=0) / x.F.mean(axis=0) * partial / partial_new)


@pytest.mark.claims("MCMC-P03")
def test_a_coloured_suffix_makes_partial_targets_change_the_luminance_in_flatland() -> None:
    grey, colour = luminance_changes((8.0, 8.0, 8.0)), luminance_changes((8.0, 4.0, 1.0))
    assert len(grey) > 20
    assert np.ptp(grey) < 1e-10
    assert np.ptp(colour) > 1e-3


@pytest.mark.claims("MCMC-P03", part="with the whole target no colour changes it")
def test_the_mean_of_the_channels_stays_whatever_the_colours_if_it_is_the_target() -> None:
    of = TwoRays(coloured((8.0, 4.0, 1.0)), STEP)
    X, here = reused(of, 3, seed=1)
    noise = Blue(shade(X, here).mean(axis=0), [here.index], [1.0], 1.0)
    x_new, T = of.propose(here.index, X.x, Live(np.random.default_rng(2)))
    p_hat, p_hat_new = of.target(here.index, X.x), of.target(here.index, x_new)
    e, e_new = noise.energies(Move(here, X, x_new, p_hat, p_hat_new, T))
    assert np.abs(e_new - e)[(p_hat_new > 0) & (X.W > 0)].max() < 1e-6


# ---------------------------------------------------------------- the evaluation's preset


@pytest.mark.claims("MCMC-A11")
def test_the_evaluation_is_that_of_the_thesis_with_more_images() -> None:
    assert (mutated.FRAMES, mutated.LOOP.cap, mutated.RADIUS) == (50, 50, 8)
    assert (mutated.BLUE_WEIGHT, mutated.BLUE_NEIGHBOURS, mutated.BLUE_RADIUS) == (1, 8, 4)
    assert {"k = 0", "k = 5", "k = 5, blue"} <= ARMS.keys()
    assert mutated.ENOUGH >= 64


def test_what_each_image_adds_to_the_covariance_has_it_as_its_mean() -> None:
    images = np.random.default_rng(5).normal(size=(70, 128)).cumsum(axis=1)
    assert covariances(images).mean() == pytest.approx(float(box_covariance(images, np.ones(128))), rel=1e-12)


@pytest.mark.parametrize("arm", ["k = 0", "k = 1", "k = 5, blue", "k = 5, after spatial reuse"])
def test_every_way_to_mutate_keeps_what_pixels_show_and_moves_some_paths(arm) -> None:
    of = TwoRays(VIEWS["FS2, inset"].tracer)
    X, here = mutated.chain(of, ARMS["k = 0"], 2, 1, Live(np.random.default_rng(6)))
    Y, chance = X, Live(np.random.default_rng(7))
    for mutation in (ARMS[arm].between, ARMS[arm].after):
        Y = mutation(Y, here, chance)
    assert shade(Y, here) == pytest.approx(shade(X, here), rel=1e-10)
    assert (Y.x.z != X.x.z).any() == (arm != "k = 0")
