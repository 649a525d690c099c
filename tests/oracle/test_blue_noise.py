"""Blue noise in the acceptance: a no-op in grey, and a bias for whoever reuses the sample.  [MCMC 4.2, Alg. 6]"""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from figures.mcmc.mcmc_1d import BLUE, MOST, six_cells
from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.decorrelation import Blue, Move, annealed, energy, metropolis, mutate
from restir_ref.integrals import Pixels
from restir_ref.oracle.cells import Frame
from restir_ref.oracle.laws import bias_of
from restir_ref.oracle.mutations import (
    always,
    blue,
    inverted,
    kernel,
    repeated,
)
from restir_ref.oracle.scenes import offset, reference_scene
from restir_ref.restir import initial, shade, spatial
from tests.core.stubs import live
from tests.oracle.strategies import scenes
from tests.oracle.walks import always_accepted, composed, largest_bias, stationarity_error
from toy1d import image_of_64, walking


@pytest.mark.claims("MCMC-E12")
def test_the_annealed_acceptance_is_one_if_the_energy_falls() -> None:
    e, e_new = np.array([1, 1, 1, 0]), np.array([0.5, 1, 1.02, 0.01])
    assert annealed(e, e_new, 0.02) == pytest.approx([1, 1, np.exp(-1), np.exp(-0.5)], rel=1e-12)


def test_the_energy_of_two_pixels_falls_with_their_distance_and_their_difference() -> None:
    assert energy(2.1, np.array([0, 4, -4])) == pytest.approx(np.exp([-1, -3, -3]), rel=1e-12)
    assert energy(0, np.zeros(1)) == 1


def moves_of(k: int, acceptance=metropolis) -> tuple[Array, Array, list[Move], Blue]:
    """Luminances of four images of 64 pixels before and after k mutations, and every proposal on the way."""
    line, chance = walking(image_of_64()), Live(np.random.default_rng(3))
    here = Pixels(line, np.arange(4 * line.n))
    X = spatial(initial(here, chance), here, [offset(line, here.index, 1)], chance)
    light = shade(X, here)[0]
    near = [offset(line, here.index, by).index for by in (-2, -1, 1, 2)]
    noise, proposals = Blue(light, near, [2, 1, 1, 2], 1.0), []

    def recorded(move: Move) -> Array:
        proposals.append(move)
        return acceptance(move)

    for _ in range(k):
        X = mutate(X, here, chance, recorded)
    return light, shade(X, here)[0], proposals, noise


@pytest.mark.claims("MCMC-A12")
def test_the_mutated_colour_is_the_old_one_times_the_ratios_of_contribution_and_target() -> None:
    """c_m = c_b F'/F s(F)/s(F'), and energies are means over the neighbours as they were at the start."""
    light, _, proposals, noise = moves_of(1)
    (move,) = proposals
    f, f_new = (move.here.of.contribution(move.here.index, x)[0] for x in (move.X.x, move.x_new))
    colour = light * f_new / f * move.p_hat / move.p_hat_new
    for found, own in zip(noise.energies(move), (light, colour), strict=True):
        by_hand = [energy(d, own - light[near]) for d, near in zip(noise.distances, noise.neighbours, strict=True)]
        assert found == pytest.approx(np.mean(by_hand, axis=0), rel=1e-9)


@pytest.mark.claims("MCMC-P02")
@pytest.mark.parametrize("k", [1, 5, 50])
def test_a_grey_pixel_keeps_its_luminance_and_no_proposal_changes_its_energy(k) -> None:
    light, after, proposals, noise = moves_of(k)
    assert after == pytest.approx(light, rel=1e-10)
    assert len(proposals) == k
    for move in proposals:
        e, e_new = noise.energies(move)
        assert abs(e_new - e).max() <= 1e-7


@pytest.mark.claims("MCMC-P02")
def test_unchanged_luminance_sees_an_inverted_weight_but_no_wrong_acceptance() -> None:
    light, after, _, _ = moves_of(5, always)
    assert after == pytest.approx(light, rel=1e-10)
    assert stationarity_error(six_cells("bounded"), always_accepted) > 0.1
    line = walking(image_of_64())
    here = Pixels(line, np.arange(line.n))
    X = initial(here, live())
    assert abs(shade(inverted(X, here, live(2)), here) / shade(X, here) - 1).max() > 0.1


@pytest.mark.claims("MCMC-E13")
@given(scene=scenes(n=1, K=3), k=st.integers(1, 3))
def test_without_weight_on_blue_noise_the_acceptance_is_that_of_metropolis(scene, k) -> None:
    assert largest_bias(scene, repeated(k, blue(0.0))) < 1e-13


@pytest.mark.claims("MCMC-E13")
@pytest.mark.parametrize("w", BLUE.values(), ids=BLUE)
def test_weight_on_blue_noise_biases_other_integrands_and_spares_the_target(w) -> None:
    frame = six_cells("bounded")
    moved = kernel(frame, 0, repeated(MOST, blue(w))).A.sum(axis=0)
    own, other = (moved @ f / f.sum() - 1 for f in frame.cells.f)
    assert abs(own) < 1e-10
    assert abs(other) > 0.05


def test_at_full_weight_on_blue_noise_the_target_has_no_say() -> None:
    frame = six_cells("bounded")
    flat = Frame(replace(frame.cells, p_hat=np.ones(frame.cells.p_hat.shape)), 2)
    assert np.array_equal(kernel(frame, 0, blue(1.0)).P, kernel(flat, 0).P)


@pytest.mark.claims("MCMC-P04")
@pytest.mark.parametrize(("w", "biased"), [(0.0, False), (1.0, True)])
def test_full_weight_on_blue_noise_biases_what_other_pixels_reuse(w, biased) -> None:
    """Two pixels, mutated and then merged with each other, enumerated; the total of the own target is exact before."""
    scene = reference_scene()
    here = np.arange(2)
    merged = bias_of(composed(scene, ["mutate", "spatial"], blue(w)), scene.v, scene.support)
    alone = bias_of(composed(scene, ["mutate"], blue(w)), scene.v, scene.support)
    f = (scene.now.cells.p_hat * scene.now.cells.v)[scene.now.ids(here)]
    assert (f * alone).sum(axis=1) / f.sum(axis=1) == pytest.approx(0, abs=1e-12)
    assert (abs((f * merged).sum(axis=1) / f.sum(axis=1)).max() > 0.01) == biased
