"""Formulas that other laws use as bounds or as mistakes only, at numbers worked out by hand."""

from collections.abc import Sequence
from itertools import product

import numpy as np
import pytest

from restir_ref.batch import Array
from restir_ref.decorrelation import Move, metropolis
from restir_ref.oracle import bounds
from restir_ref.oracle.moments import Operator
from restir_ref.oracle.mutations import FOLDS, steps, without_T
from restir_ref.oracle.selected import probability

# ---------------------------------------------------------------- bounds

C, R, B = 3.0, 3, np.array([1.0, 0.25])


def test_the_bound_of_dependent_inputs_adds_that_of_independent_ones_and_two_of_the_covariances() -> None:
    """C = 3, M = 2, |R| = 3, so gamma = 3/2, and a mean b of 5/8."""
    assert bounds.equal_popoviciu(C, 2, R) == 0.5
    assert bounds.covariance_bound(C, 1.5, B) == 0.625
    assert bounds.dependent_bound(C, R, B) == 0.5 + 2 * 0.625


@pytest.mark.parametrize(("gamma", "b"), [(2 / 3, B), (1.5, B.sum()), (3, B)])
def test_a_ratio_upside_down_and_a_sum_for_a_mean_are_noticed(gamma, b) -> None:
    assert bounds.covariance_bound(C, gamma, np.asarray(b)) != 0.625


# ---------------------------------------------------------------- the density of what is selected

P = np.array([[0.3, 0.7], [0.6, 0.4]])


U = np.array([0.5, 4.0])


def by_cases(w: Array, P: Array, n: Array) -> Array:
    """P(Y=y) of n[i] samples from input i that weigh w[i] / n[i] each, over all tuples of cells; w, P (2, K)."""
    found, who = np.zeros(P.shape[1]), np.repeat([0, 1], n)
    for x in product(range(P.shape[1]), repeat=len(who)):
        chosen = w[who, x] / n[who]
        for k, cell in enumerate(x):
            found[cell] += P[who, x].prod() * (chosen[k] / chosen.sum() if chosen.sum() else 0)
    return found


def quadrature_error(W: Array, P: Array = P, copies: Sequence[int] = (1, 1)) -> float:
    """Largest error of the integral, where every sample stays in its cell and the pass weighs inputs by U."""
    u, K, n = np.repeat(U, P.shape[1]), P.shape[1], np.array(copies)
    L = np.concatenate([np.eye(K), np.eye(K)], axis=1)
    found = probability(Operator(L, u, L), P, W, n)
    return float(abs(found - by_cases(W * U[:, None], P, n)).max())


@pytest.mark.parametrize("n", [[1, 1], [3, 1], [2, 3]])
@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
@pytest.mark.parametrize("spread", [1.0, 1e3, 1e9])
def test_the_density_is_that_of_all_cases_however_far_weights_are_apart(spread, scale, n) -> None:
    assert quadrature_error(scale * np.array([[1.0, spread], [2.0, spread]]), copies=n) < 1e-12


@pytest.mark.parametrize("w", [[[0.0, 3.0], [2.0, 0.0]], [[0.0, 0.0], [2.0, 1.0]], [[0.0, 0.0], [0.0, 0.0]]])
def test_cells_without_weight_are_never_selected(w) -> None:
    assert quadrature_error(np.array(w)) < 1e-12


def test_a_cell_that_is_never_drawn_changes_nothing_however_small_its_weight() -> None:
    w, some = np.array([[1.0, 1e-9], [2.0, 3.0]]), np.array([[1.0, 0.0], [0.6, 0.4]])
    assert quadrature_error(w, some) < 1e-12


def test_an_integral_that_ends_with_the_largest_weight_is_noticed(monkeypatch) -> None:
    """A mistake: the range of t is that of the largest weight, where small ones have hardly decayed."""
    w = np.array([[1.0, 1e9], [2.0, 1e9]])
    monkeypatch.setattr(
        "restir_ref.oracle.selected._abscissae", lambda norm, smallest: np.exp(np.arange(-60, -17, 0.2))
    )
    assert quadrature_error(w) > 0.1


# ---------------------------------------------------------------- steps and acceptances

ONE, TWO = np.exp(-1 / 8), np.exp(-4 / 8)
"""Weights of steps by 1 and 2 cells, sigma = 2."""

STEPPED = {
    "wrapped": np.full((3, 3), ONE + TWO) + np.eye(3) * (1 - ONE - TWO),
    "bounded": [[1 + ONE + TWO, ONE, TWO], [ONE, 1 + 2 * TWO, ONE], [TWO, ONE, 1 + ONE + TWO]],
    "clamped": [[1 + ONE + TWO, ONE, TWO], [ONE + TWO, 1, ONE + TWO], [TWO, ONE, 1 + ONE + TWO]],
}


def test_every_fold_has_its_table() -> None:
    assert set(FOLDS) == set(STEPPED)


@pytest.mark.parametrize("fold", FOLDS)
def test_steps_are_gaussian_in_cells_and_end_where_the_fold_says(fold) -> None:
    assert steps(3, 2, FOLDS[fold]) == pytest.approx(np.array(STEPPED[fold]), rel=1e-12)


@pytest.mark.parametrize("fold", FOLDS)
def test_steps_of_another_width_are_noticed(fold) -> None:
    assert abs(steps(3, 2.02, FOLDS[fold]) - STEPPED[fold]).max() > 1e-3


def move(T_ratio: list[float]) -> Move:
    n = len(T_ratio)
    return Move(None, None, None, np.full(n, 4.0), np.full(n, 2.0), np.array(T_ratio))  # type: ignore[arg-type]


def test_the_acceptance_without_T_knows_only_whether_a_move_is_valid() -> None:
    assert without_T(move([0, 0.5, 1, 3])).tolist() == [0, 0.5, 0.5, 0.5]
    assert metropolis(move([0, 0.5, 1, 3])).tolist() == [0, 0.25, 0.5, 1]
