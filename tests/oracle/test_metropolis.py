"""Mutations: stationarity, weights, boundaries of the domain, and mistakes of print.  [MCMC 3.2, 5.2]"""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import kstest

from figures.mcmc.mcmc_1d import MOST, RIGHT, WALKS, moved_weight, predicted, six_cells
from restir_ref.batch import Array
from restir_ref.decorrelation import STEPS, attempt, metropolis, mutate
from restir_ref.integrals import Pixels, Reservoirs
from restir_ref.oracle.cells import Frame
from restir_ref.oracle.enumeration import outcomes
from restir_ref.oracle.laws import bias_of
from restir_ref.oracle.moments import drawn
from restir_ref.oracle.mutations import (
    FOLDS,
    clamped,
    inverted,
    kernel,
    last_accepted,
    mutated,
    power,
    repeated,
    steps,
    unsymmetric,
)
from restir_ref.oracle.scenes import reference_scene
from restir_ref.restir import initial
from tests.core.stubs import live
from tests.oracle.strategies import scenes
from tests.oracle.walks import always_accepted, asymmetry, composed, largest_bias, stationarity_error
from toy1d import two_pixels, walking

one_pixel = given(scene=scenes(n=1, K=4))


# ---------------------------------------------------------------- kernels


@pytest.mark.claims("MCMC-E03", "MCMC-E04")
@one_pixel
def test_mutations_leave_the_target_invariant_in_detailed_balance(scene) -> None:
    """The proposals of these scenes are not symmetric, nor are the volumes equal."""
    assert stationarity_error(scene.now) < 1e-12
    assert asymmetry(scene.now) < 1e-14


@pytest.mark.claims("MCMC-E03")
def test_asymmetric_proposals_without_their_ratio_are_noticed() -> None:
    cells = six_cells("bounded").cells
    to_the_right = np.tile(np.arange(1, 7) / 21, (6, 1))
    frame = Frame(replace(cells, proposal=to_the_right), 2)
    assert stationarity_error(frame) < 1e-12
    assert stationarity_error(frame, unsymmetric) > 0.01
    assert asymmetry(frame, unsymmetric) > 0.01


@pytest.mark.claims("MCMC-E03")
def test_the_printed_ratio_without_a_minimum_is_no_probability_and_breaks_detailed_balance() -> None:
    frame = six_cells("bounded")
    p, T = frame.cells.p_hat[0], frame.cells.proposal
    ratio = p / p[:, None]
    assert ratio.max() > 1
    flow = p[:, None] * T * ratio
    assert abs(flow - flow.T).max() > 0.1 * flow.max()


def test_detailed_balance_is_not_needed_for_stationarity() -> None:
    """Two kernels in turn, one per half of the moves, are stationary and not reversible."""
    left, right = (kernel(six_cells(fold), 0).P for fold in ("bounded", "wrapped"))
    pi = six_cells("bounded").cells.p_hat[0]
    flow = pi[:, None] * (left @ right)
    assert pi @ left @ right == pytest.approx(pi, rel=1e-12)
    assert abs(flow - flow.T).max() > 1e-6 * flow.max()


# ---------------------------------------------------------------- weights


@pytest.mark.claims("MCMC-E06", "MCMC-A05", "MCMC-C02")
@given(scene=scenes(n=1, K=3), k=st.integers(1, 5))
def test_weights_stay_unbiased_after_any_number_of_mutations(scene, k) -> None:
    assert largest_bias(scene, repeated(k)) < 1e-13


@pytest.mark.claims("MCMC-C02")
@pytest.mark.parametrize("k", [1, 2, 5, 50])
@pytest.mark.parametrize("name", RIGHT)
def test_no_burn_in_is_needed(name, k) -> None:
    frame = six_cells(WALKS[name][0])
    assert power(kernel(frame, 0), k).A.sum(axis=0) == pytest.approx(1, rel=1e-10)


@pytest.mark.claims("MCMC-E06")
def test_the_inverted_update_of_the_weight_is_noticed() -> None:
    for k in (1, 2):
        assert largest_bias(reference_scene(), repeated(k, inverted)) > 0.5


@pytest.mark.claims("MCMC-E06", "MCMC-A05", "MCMC-A07", "MCMC-E13")
@pytest.mark.parametrize("k", [1, 2, MOST])
@pytest.mark.parametrize("name", WALKS)
def test_every_walk_right_or_wrong_does_what_its_matrices_say(name, k) -> None:
    found, by_matrices = moved_weight(name, k)[0], predicted(name, k)
    assert found == pytest.approx(by_matrices, rel=1e-10)
    assert (abs(by_matrices - 1).max() < 1e-10) == (name in RIGHT or (name, k) == ("last accepted", 1))


@pytest.mark.claims("MCMC-A05")
def test_looking_at_the_last_proposal_only_is_right_for_one_mutation_and_biased_for_more() -> None:
    once, twice = (largest_bias(reference_scene(), last_accepted(k)) for k in (1, 2))
    assert once < 1e-13
    assert twice > 0.01


def drawn_program(frame: Frame, k: int):
    def program(index, chance) -> Array:
        here = Pixels(frame, index)
        return repeated(k)(initial(here, chance), here, chance)

    return program


@given(scene=scenes(n=2, K=2))
def test_moments_pass_through_mutations(scene) -> None:
    """E[W_i W_j 1{X_i=x} 1{X_j=y}] of two pixels, enumerated."""
    frame = scene.now
    second = np.zeros((4, 4))
    for outcome in outcomes(drawn_program(frame, 2), 2):
        x, W = (values.reshape(-1, 2) for values in (outcome.result.x, outcome.result.W))
        Z = np.zeros((len(x), 4))
        np.add.at(Z, (np.arange(len(x))[:, None], x + np.array([0, 2])), W)
        second += np.einsum("l,li,lj->ij", outcome.probability, Z, Z)
    kernels = [power(kernel(frame, i), 2) for i in (0, 1)]
    first = drawn(frame)
    covered = replace(first, second=first.second * np.outer(*[(frame.cells.p_hat > 0).ravel()] * 2))
    assert mutated(covered, kernels).second == pytest.approx(second, rel=1e-12, abs=1e-14)


@st.composite
def compositions(draw: st.DrawFn) -> list[str]:
    """Up to three steps of a frame, in any order."""
    return draw(st.lists(st.sampled_from(["temporal", "spatial", "mutate"]), min_size=1, max_size=3))


@pytest.mark.claims("GRIS-E08", part="finite cells")
@pytest.mark.claims("MCMC-E06")
@given(scene=scenes(n=2, K=2, frames=2), names=compositions())
def test_any_composition_of_resampling_passes_and_mutations_gives_an_unbiased_weight(scene, names) -> None:
    assert abs(bias_of(composed(scene, names), scene.v, scene.support)).max() < 1e-13


@pytest.mark.parametrize("names", [["mutate"], ["mutate", "spatial"], ["temporal", "mutate", "spatial"]])
def test_a_wrong_mutation_anywhere_in_a_composition_is_noticed(names) -> None:
    scene = reference_scene()
    for wrong in (inverted, always_accepted):
        assert abs(bias_of(composed(scene, names, wrong), scene.v, scene.support)).max() > 0.01


# ---------------------------------------------------------------- steps of primary sample numbers


@pytest.mark.claims("MCMC-A07")
@pytest.mark.parametrize("fold", FOLDS)
def test_bounded_and_wrapped_steps_are_symmetric_and_clamped_ones_are_not(fold) -> None:
    table = steps(6, 1, FOLDS[fold])
    assert np.allclose(table, table.T, rtol=1e-14) == (fold in STEPS)
    assert (stationarity_error(six_cells(fold), unsymmetric) < 1e-12) == (fold in STEPS)


def chains(step, count: int = 20_000, k: int = 50) -> Array:
    """Ends of independent chains on 1 + .9 sin(2 pi x) that start from their target, by the inverse of its integral."""
    line, chance = walking(two_pixels(), 0.1, step), live(7)
    x = np.linspace(0, 1, 100_001)
    X = Reservoirs(np.interp(chance.uniform((count,)), integral_of_wave(x), x), np.ones(count), np.ones(count))
    return repeated(k)(X, Pixels(line, np.zeros(count, dtype=int)), chance).x


def integral_of_wave(x: Array) -> Array:
    return x + 0.9 * (1 - np.cos(2 * np.pi * x)) / (2 * np.pi)


def at_the_ends(x: Array) -> int:
    return int(((x <= 0) | (x >= np.nextafter(1, 0))).sum())


@pytest.mark.claims("MCMC-A07")
@pytest.mark.parametrize("name", STEPS)
def test_independent_chains_keep_the_distribution_of_the_target_without_atoms_at_the_ends(name) -> None:
    """Two tests at p > 1e-3 each; clamping, below, shifts D by far more than their power of 1.4 %."""
    x = chains(STEPS[name])
    assert kstest(x, integral_of_wave).pvalue > 1e-3
    assert at_the_ends(x) == 0
    assert 0 <= x.min() < x.max() < 1


@pytest.mark.claims("MCMC-A07")
def test_clamping_piles_up_samples_at_the_ends() -> None:
    x = chains(clamped)
    assert kstest(x, integral_of_wave).pvalue < 1e-6
    assert at_the_ends(x) > 100


@pytest.mark.claims("MCMC-A07")
def test_an_invalid_proposal_is_rejected_and_counts_as_a_step() -> None:
    line = walking(two_pixels(), 100.0, STEPS["bounded"])
    x = np.linspace(0.01, 0.99, 1000)
    X, here = Reservoirs(x, np.ones(1000), np.ones(1000)), Pixels(line, np.zeros(1000, dtype=int))
    moved, accepted = attempt(X, here, live(), metropolis)
    assert 0 < accepted.sum() < 20
    assert np.array_equal(moved.x != x, accepted)


def test_steps_move_points_of_any_dimension_by_their_standard_deviation() -> None:
    u = np.full((3, 50_000), 0.5)
    for step in STEPS.values():
        u_new, ratio = step(u, 0.05, live())
        assert u_new.std(axis=1) == pytest.approx(0.05, rel=0.02)
        assert ratio.shape == (50_000,)
        assert (ratio == 1).all()


def test_a_negative_ratio_of_transition_densities_is_refused() -> None:
    line = walking(two_pixels(), step=lambda u, sigma, chance: (u, np.full(u.shape, -1.0)))
    here = Pixels(line, np.arange(2))
    with pytest.raises(ValueError, match="the ratio T"):
        mutate(initial(here, live()), here, live())


def test_a_clamped_step_stays_in_the_unit_interval_and_meets_both_ends() -> None:
    u, T = clamped(np.full((1, 200), 0.5), 2.0, live())
    assert (u.min(), u.max()) == (0, np.nextafter(1, 0))
    assert (T == 1).all()
