"""Laws of L1 reconstruction: a linear program says how small the norm can be; outliers in rows and in images."""

from collections.abc import Iterable
from functools import partial

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.optimize import linprog
from tqdm import tqdm

from restir_ref.batch import Array
from restir_ref.poisson import ALPHA, by_transform, differences, gradient_matrix, l2
from restir_ref.poisson_l1 import ROUNDS, TOLERANCE, conjugate_gradients, l1, l1_norm, normal_equations, weighted

SHAPES = {"row": (24,), "image": (8, 9)}
every_shape = pytest.mark.parametrize("shape", SHAPES.values(), ids=SHAPES)


def with_outliers(shape: tuple[int, ...], leading: tuple[int, ...] = (), seed: int = 3) -> tuple[Array, list[Array]]:
    """A noisy image of ones, and its gradients with little noise, of which a tenth is wrong by 2."""
    dice, I = np.random.default_rng(seed), np.ones((*leading, *shape))
    G = [0.05 * dice.standard_normal(g.shape) for g in differences(I, len(shape))]
    wrong = [2 * dice.choice([-1, 0, 1], size=g.shape, p=[0.05, 0.9, 0.05]) for g in G]
    return I + 0.3 * dice.standard_normal(I.shape), [g + w for g, w in zip(G, wrong, strict=True)]


def least(primal: Array, G: list[Array], alpha: float) -> float:
    """The minimum of the norm: min sum t with -t <= A I - b <= t."""
    A = sp.vstack([alpha * sp.eye_array(primal.size), gradient_matrix(primal.shape)])
    b = np.concatenate([alpha * primal.ravel(), *(g.ravel() for g in G)])
    m, n = A.shape
    t = sp.eye_array(m)
    found = linprog(
        np.repeat([0.0, 1.0], [n, m]),
        A_ub=sp.vstack([sp.hstack([A, -t]), sp.hstack([-A, -t])]).tocsc(),
        b_ub=np.concatenate([b, -b]),
        bounds=[(None, None)] * n + [(0, None)] * m,
    )
    return float(found.fun)


def excess(reconstruct, shape: tuple[int, ...], alpha: float = ALPHA) -> float:
    """By how much the norm is above its minimum, relative to it."""
    primal, G = with_outliers(shape)
    norm = l1_norm(reconstruct(primal, *G, alpha=alpha), primal, *G, alpha=alpha)
    return float(norm) / least(primal, G, alpha) - 1


@pytest.mark.claims("GPT-A11", part="L1 against a linear program")
@pytest.mark.parametrize("alpha", [ALPHA, 0.7])
@every_shape
def test_the_norm_is_the_least_that_a_linear_program_finds(shape, alpha):
    assert -1e-9 < excess(l1, shape, alpha) < 1e-3


@every_shape
def test_the_norm_of_the_l2_image_and_of_weights_that_froze_is_noticed(shape):
    assert excess(l2, shape) > 0.1
    assert excess(partial(l1, rounds=3), shape) > 1e-3


@every_shape
def test_the_first_round_weighs_by_the_residuals_of_l2_beside_their_mean(shape):
    primal, G = with_outliers(shape)
    A = np.vstack([0.5 * np.eye(primal.size), gradient_matrix(shape).toarray()])
    b = np.concatenate([0.5 * primal.ravel(), *(g.ravel() for g in G)])
    r = A @ np.linalg.solve(A.T @ A, A.T @ b) - b
    w = 1 / np.sqrt(r**2 + abs(r).mean() ** 2)
    exact = np.linalg.solve(A.T @ (w[:, None] * A), A.T @ (w * b))
    assert l1(primal, *G, alpha=0.5, rounds=1).ravel() == pytest.approx(exact, abs=1e-4)
    assert abs(l1(primal, *G, alpha=0.5, rounds=2).ravel() - exact).max() > 1e-2


def test_the_norm_of_a_stack_is_that_of_every_image():
    primal, G = with_outliers((8, 9), (2, 3))
    norms = l1_norm(primal, primal, *G)
    assert norms.shape == (2, 3)
    assert norms[1, 2] == pytest.approx(l1_norm(primal[1, 2], primal[1, 2], *(g[1, 2] for g in G)), rel=1e-12)


@every_shape
def test_a_reweighted_step_solves_its_normal_equations(shape):
    primal, G = with_outliers(shape)
    dice = np.random.default_rng(1)
    w = [dice.random(each.shape) + 0.01 for each in (primal, *G)]
    A = np.vstack([ALPHA * np.eye(primal.size), gradient_matrix(shape).toarray()])
    b, W = (np.concatenate([each.ravel() for each in parts]) for parts in ((ALPHA * primal, *G), w))
    exact = np.linalg.solve(A.T @ (W[:, None] * A), A.T @ (W * b))
    found = weighted(np.zeros(shape), primal, G, w).ravel()
    assert found == pytest.approx(exact, abs=1e-4)
    assert (
        abs(weighted(np.zeros(shape), primal, G, w[:1] + [0.5 * each for each in w[1:]]).ravel() - exact).max() > 0.01
    )
    assert normal_equations(primal, G, w)[2].ravel() == pytest.approx(np.diag(A.T @ (W[:, None] * A)), rel=1e-12)


def solved(precondition) -> tuple[Array, float, int]:
    """What conjugate gradients find, its residual squared over that of zero, and how many products they took."""
    primal, G = with_outliers((8, 9))
    product, b, _ = normal_equations(primal, G, [np.ones(each.shape) for each in (primal, *G)])
    asked: list[int] = []

    def counted(v: Array) -> Array:
        asked.append(1)
        return product(v)

    x = conjugate_gradients(counted, b, np.zeros(b.shape), precondition, (-2, -1))
    r = b - product(x)
    return x, float((r * precondition(r)).sum() / (b * precondition(b)).sum()), len(asked)


def test_the_inverse_as_a_preconditioner_needs_one_step():
    primal, G = with_outliers((8, 9))
    x, _, products = solved(by_transform((8, 9)))
    assert x == pytest.approx(l2(primal, *G), abs=1e-10)
    assert products == 2


def test_steps_end_where_the_residual_is_small_enough_and_not_long_after():
    _, residual, products = solved(lambda r: r / 4)
    assert 1e-4 * TOLERANCE**2 < residual <= TOLERANCE**2
    assert products > 10


def test_where_nothing_is_left_to_solve_no_step_is_taken():
    asked: list[int] = []
    x = conjugate_gradients(lambda v: asked.append(1) or v, np.zeros((2, 5)), np.zeros((2, 5)), lambda r: r, (-1,))
    assert not x.any()
    assert len(asked) == 1


@pytest.mark.parametrize("size", [1e-6, 1.0, 1e6])
def test_an_image_that_is_done_stays_as_it_is_while_others_of_its_stack_go_on(size):
    b = size * np.random.default_rng(1).standard_normal((2, 50))
    easy, hard = np.linspace(1, 2, 50), np.geomspace(1, 1e4, 50)

    def solve(a: Array, right: Array) -> Array:
        return conjugate_gradients(lambda v: a * v, right, np.zeros_like(right), lambda r: r, (-1,))

    stack, alone = solve(np.stack([easy, hard]), b), solve(easy[None], b[:1])
    assert stack[0] == pytest.approx(alone[0], rel=1e-9, abs=1e-12 * size)
    assert stack[1] == pytest.approx(b[1] / hard, abs=1e-3 * size)


# ---------------------------------------------------------------- medians


def test_exact_gradients_leave_the_median_of_the_primal():
    I, off = np.arange(7.0) ** 2, np.array([0.3, 5.0, -0.2, 0.1, 0.0, -0.7, 0.4])
    found = l1(I + off, np.diff(I), alpha=0.1) - I
    assert found == pytest.approx(np.median(off), abs=1e-3)
    assert abs(np.median(off) - off.mean()) > 0.5


def test_l2_of_the_same_is_near_the_mean():
    I, off = np.arange(7.0) ** 2, np.array([0.3, 5.0, -0.2, 0.1, 0.0, -0.7, 0.4])
    assert abs(l2(I + off, np.diff(I), alpha=0.1) - I - np.median(off)).min() > 0.3


def spoiled(shape: tuple[int, ...]) -> tuple[Array, list[Array]]:
    """A smooth image and its gradients, of which one in the middle is wrong by 1."""
    I = np.cos(np.arange(np.prod(shape))).reshape(shape)
    G = differences(I, len(shape))
    G[0][tuple(n // 2 for n in G[0].shape)] += 1
    return I, G


@pytest.mark.claims("GPT-P05", part="one outlier, exactly")
def test_one_wrong_difference_is_kept_out_of_an_image_by_its_loops():
    I, G = spoiled((5, 6))
    assert l1(I, *G) == pytest.approx(I, abs=1e-4)
    assert abs(l2(I, *G) - I).max() > 0.1


def test_a_short_row_follows_the_same_wrong_difference():
    I, G = spoiled((6,))
    assert np.diff(l1(I, *G)) == pytest.approx(G[0], abs=1e-4)
    assert abs(np.diff(I) - G[0]).max() > 0.9


# ---------------------------------------------------------------- what it does not depend on


@every_shape
def test_what_fits_comes_back(shape):
    I = np.random.default_rng(1).random((3, *shape))
    assert l1(I, *differences(I, len(shape))) == pytest.approx(I, abs=1e-12)
    black = np.zeros(shape)
    assert np.array_equal(l1(black, *differences(black, len(shape))), black)


@every_shape
def test_every_image_of_a_stack_is_reconstructed_by_itself(shape):
    primal, G = with_outliers(shape, (2,))
    primal[1] *= 100
    stack = l1(primal, *G)
    for k in range(2):
        assert stack[k] == pytest.approx(l1(primal[k], *(g[k] for g in G)), abs=1e-9)


@every_shape
def test_units_and_what_is_known_of_the_image_do_not_matter(shape):
    primal, G = with_outliers(shape)
    found, J = l1(primal, *G), 1000 * np.random.default_rng(1).random(shape)
    assert np.array_equal(l1(1024 * primal, *(1024 * g for g in G)), 1024 * found)
    moved = l1(primal + J, *(g + j for g, j in zip(G, differences(J, len(shape)), strict=True)))
    assert moved - J == pytest.approx(found, abs=1e-6)


def test_a_bar_is_handed_every_round_and_changes_nothing(capsys):
    primal, G = with_outliers((8, 9))
    seen: list[int] = []

    def counted(rounds: Iterable[int]) -> Iterable[int]:
        for k in rounds:
            seen.append(k)
            yield k

    assert np.array_equal(l1(primal, *G, progress=counted), l1(primal, *G, progress=tqdm))
    assert seen == [*range(ROUNDS)]
    assert f"{ROUNDS}/{ROUNDS}" in capsys.readouterr().err


@pytest.mark.parametrize("rounds", [0, -1, 2.5])
def test_no_round_is_refused(rounds):
    with pytest.raises(ValueError, match=f"number of rounds must be a whole number >= 1, but is {rounds}"):
        l1(np.ones(3), np.zeros(2), rounds=rounds)
