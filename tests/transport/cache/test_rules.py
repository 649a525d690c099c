"""Laws of the two update rules: what they converge to, exactly, for numbers and for operators.  [DDGIR Eq. 2-5]"""

from fractions import Fraction

import numpy as np
import pytest

from restir_ref.transport.cache.rules import AUGMENTED, ORIGINAL, RULES, gathered


def fixed_point(rule, T, L_e, times: int = 400):
    """L = T (what a probe takes), iterated from 0; T is a number or a matrix, L_e as well, or a vector."""
    apply = T.dot if isinstance(T, np.ndarray) else lambda x: T * x
    L = 0 * L_e
    for _ in range(times):
        L = apply(gathered(rule, L, L_e, apply(L_e)))
    return L


BOUNCES = {"original": lambda t: t**2 / (1 - t), "augmented": lambda t: t / (1 - t)}


@pytest.mark.claims("DDGIR-E04", part="a number", world="toy1d")
@pytest.mark.claims("DDGIR-E05", part="a number", world="toy1d")
@pytest.mark.parametrize("t", [0.1, 0.6, 0.75, 0.9])
@pytest.mark.parametrize("name", RULES)
def test_for_a_number_t_probes_converge_to_all_bounces_from_their_first_on(name, t):
    assert fixed_point(RULES[name], t, 1.0) == pytest.approx(BOUNCES[name](t), rel=1e-10)


@pytest.mark.parametrize("name", RULES)
def test_a_fixed_point_stays_exactly(name):
    t, L = Fraction(3, 5), BOUNCES[name](Fraction(3, 5))
    assert t * gathered(RULES[name], L, Fraction(1), t) == L


def operator(n: int = 12, seed: int = 1) -> np.ndarray:
    """A random operator that sends on at most 80 % of what it gets."""
    T = np.random.default_rng(seed).random((n, n))
    return 0.8 * T / T.sum(axis=0).max()


@pytest.mark.claims("DDGIR-E04", part="operators", world="flatland2d")
@pytest.mark.claims("DDGIR-E05", part="operators", world="flatland2d")
@pytest.mark.parametrize("name", RULES)
def test_for_an_operator_probes_converge_to_all_bounces_from_their_first_on(name):
    T, L_e, rule = operator(), np.random.default_rng(2).random(12), RULES[name]
    all_light = np.linalg.solve(np.eye(12) - T, L_e)
    expected = {"original": all_light - L_e - T @ L_e, "augmented": all_light - L_e}[name]
    np.testing.assert_allclose(fixed_point(rule, T, L_e), expected, rtol=1e-10)


@pytest.mark.claims("DDGIR-E03")
def test_original_probes_and_direct_light_make_what_augmented_ones_hold():
    """L_DDGI + T_fd L_e = T_f L, for Lambert surfaces."""
    T, L_e = operator(seed=3), np.random.default_rng(4).random(12)
    recovered = fixed_point(ORIGINAL, T, L_e) + T @ L_e
    np.testing.assert_allclose(recovered, T @ np.linalg.solve(np.eye(12) - T, L_e), rtol=1e-8)
    np.testing.assert_allclose(recovered, fixed_point(AUGMENTED, T, L_e), rtol=1e-8)


def test_original_probes_at_the_second_vertex_miss_the_light_that_reaches_it_directly():
    T, L_e = operator(seed=5), np.random.default_rng(6).random(12)
    L = np.linalg.solve(np.eye(12) - T, L_e)
    secondary = {name: L_e + T @ (L_e + fixed_point(rule, T, L_e)) for name, rule in RULES.items()}
    np.testing.assert_allclose(secondary["augmented"], L, rtol=1e-10)
    np.testing.assert_allclose(L - secondary["original"], T @ T @ L_e, rtol=1e-9)
    assert ((L - secondary["original"]) / L).min() > 0.01
