"""Laws of the live chance: frequencies in proportion to the weights, and never an option of weight zero."""

from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.stats import chisquare

from restir_ref.chance import Live
from restir_ref.resampling import Candidate
from restir_ref.streaming import select_streaming
from tests.core.stubs import Constantly

NEXT_TO_ONE = np.nextafter(1.0, 0.0)
SIZES = st.sampled_from([0.0, 0.0, 5e-324, 1e-300, 1e-16, 1 / 3, 1.0, 1 + 2**-52, 3.0, 1e16, 1e300])
US = st.sampled_from([0.0, 5e-324, 0.5, NEXT_TO_ONE]) | st.floats(0, 1, exclude_max=True)

# ---------------------------------------------------------------- zero is never chosen


@dataclass(frozen=True)
class Naive:
    """A mistake: inversion without regard to rounding, and to u = 0 with `<`."""

    rng: Constantly

    def choose(self, weights):
        upto = np.cumsum(weights, axis=0)
        return (upto <= self.rng.random(weights.shape[-1]) * upto[-1]).sum(axis=0)


@dataclass(frozen=True)
class Strict(Naive):
    """A mistake: `<` for `<=` chooses a leading option of weight 0 at u = 0."""

    def choose(self, weights):
        upto = np.cumsum(weights, axis=0)
        return (upto < self.rng.random(weights.shape[-1]) * upto[-1]).sum(axis=0)


def chose_nothing(chance, weights) -> bool:
    """Whether the choice fell on no option, or on one of weight zero while others were offered."""
    s = chance.choose(weights)
    column = np.arange(weights.shape[-1])
    beyond = (s < 0) | (s >= len(weights))
    weight = weights[np.minimum(s, len(weights) - 1), column]
    return bool((beyond | ((weight == 0) & (weights > 0).any(axis=0))).any())


@given(weights=arrays(float, st.tuples(st.integers(1, 6), st.integers(1, 4)), elements=SIZES), u=US)
def test_an_option_of_zero_weight_is_never_chosen(weights, u):
    assert not chose_nothing(Live(Constantly(u)), weights)


@pytest.mark.parametrize("weights", [[[0.0], [1.0]], [[1.0], [0.0]], [[0.0], [1.0], [0.0]]])
@pytest.mark.parametrize("u", [0.0, NEXT_TO_ONE])
def test_the_first_and_the_last_option_are_skipped_where_their_weight_is_zero(weights, u):
    assert Live(Constantly(u)).choose(np.array(weights)) == np.argmax(weights)


# The smallest number times u next to one rounds up to itself: inversion steps past the last option.
TOO_FAR = np.array([[5e-324], [0.0]])


@pytest.mark.parametrize(("kind", "u", "weights"), [(Naive, NEXT_TO_ONE, TOO_FAR), (Strict, 0.0, TOO_FAR[::-1])])
def test_a_choice_of_nothing_is_noticed(kind, u, weights):
    assert chose_nothing(kind(Constantly(u)), weights)
    assert not chose_nothing(Live(Constantly(u)), weights)


@given(u=US, K=st.integers(1, 5))
def test_the_first_option_stands_for_nothing_where_all_weights_are_zero(u, K):
    assert (Live(Constantly(u)).choose(np.zeros((K, 3))) == 0).all()


# ---------------------------------------------------------------- frequencies

WEIGHTS = np.array([0.0, 1.0, 3.0, 0.25, 7.0, 0.0, 2.0, 5.0, 1e-3, 1.0])
DRAWS = 200_000


@dataclass(frozen=True)
class AgainstOldSum:
    """A mistake: a streaming reservoir that compares w with the sum before w was added."""

    rng: np.random.Generator

    def choose(self, weights):
        s, w_sum = np.zeros(weights.shape[-1], dtype=int), np.zeros(weights.shape[-1])
        for k, w in enumerate(weights):
            s = np.where(self.rng.random(len(s)) * w_sum < w, k, s)
            w_sum += w
        return s


def p_value(chance, weights) -> float:
    """Of a chi-square test of choices against weights / sum."""
    return p_of(chance.choose(np.broadcast_to(weights[:, None], (len(weights), DRAWS))), weights)


def p_of(s, weights) -> float:
    """Of a chi-square test of the frequencies of s against weights / sum; 0 if an option of weight 0 occurs."""
    seen = np.bincount(s, minlength=len(weights))
    possible = weights > 0
    if seen[~possible].any():
        return 0.0
    return float(chisquare(seen[possible], len(s) * weights[possible] / weights.sum()).pvalue)


ORDERS = {"given": slice(None), "reversed": slice(None, None, -1), "sorted": np.argsort(WEIGHTS)}
every_order = pytest.mark.parametrize("order", ORDERS.values(), ids=ORDERS)


@every_order
def test_frequencies_are_in_proportion_to_the_weights_in_any_order(order):
    assert p_value(Live(np.random.default_rng(1)), WEIGHTS[order]) > 1e-4


@every_order
def test_a_choice_against_the_old_sum_is_noticed(order):
    assert p_value(AgainstOldSum(np.random.default_rng(1)), WEIGHTS[order]) < 1e-4


RUNS = 1_000_000


def reservoirs(weights, chance):
    """What a million streaming reservoirs hold after these weights."""
    offered = (Candidate(np.full(RUNS, k), np.ones(RUNS), np.full(RUNS, w)) for k, w in enumerate(weights))
    return select_streaming(offered, chance, np.ones(RUNS)).x


@pytest.mark.claims("GRIS-A01")
@every_order
def test_a_million_reservoirs_hold_their_candidates_in_proportion_to_the_weights(order):
    assert p_of(reservoirs(WEIGHTS[order], Live(np.random.default_rng(6))), WEIGHTS[order]) > 1e-4


@pytest.mark.claims("GRIS-A01")
@every_order
def test_a_reservoir_always_takes_the_first_candidate_that_counts(order):
    first = int(np.flatnonzero(WEIGHTS[order])[0])
    assert (reservoirs(WEIGHTS[order][: first + 1], Live(np.random.default_rng(7))) == first).all()


@pytest.mark.claims("GRIS-A01")
@every_order
def test_a_million_choices_against_the_old_sum_are_noticed(order):
    weights = np.broadcast_to(WEIGHTS[order][:, None], (len(WEIGHTS), RUNS))
    assert p_of(AgainstOldSum(np.random.default_rng(6)).choose(weights), WEIGHTS[order]) < 1e-4


def test_columns_choose_by_their_own_weights():
    s = Live(np.random.default_rng(2)).choose(np.eye(4).repeat(100, axis=1))
    assert (s == np.arange(4).repeat(100)).all()


# ---------------------------------------------------------------- reproducible


def drawn(seed):
    chance = Live(np.random.default_rng(seed))
    return [*chance.choose(np.ones((9, 50))), *chance.uniform((2, 3)).ravel()]


def test_the_same_seed_draws_the_same_and_another_seed_does_not():
    assert drawn(3) == drawn(3)
    assert drawn(3) != drawn(4)


def test_choices_take_one_number_per_column_whatever_the_number_of_options():
    after = [Live(np.random.default_rng(5)) for _ in range(2)]
    for chance, K in zip(after, (2, 9), strict=True):
        chance.choose(np.ones((K, 50)))
    assert (after[0].uniform((4,)) == after[1].uniform((4,))).all()


def test_uniform_numbers_have_the_shape_asked_for_and_lie_below_one():
    u = Live(np.random.default_rng(6)).uniform((3, 1000))
    assert u.shape == (3, 1000)
    assert ((u >= 0) & (u < 1)).all()
