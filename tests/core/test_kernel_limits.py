"""Laws at the borders: nothing counts, nothing can be realised, saturation, shared numbers, bad numbers."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from restir_ref.integrals import Pixels
from restir_ref.mis import WEIGHTS, constant, defensive, one_over_z, pairwise
from restir_ref.oracle.scenes import offset
from restir_ref.resampling import Candidate, Input, gris, select, select_any
from restir_ref.restir import initial, resample
from restir_ref.streaming import select_streaming
from tests.core.inputs import drawn, weights
from tests.core.stubs import Wrapped, live, same_bits
from toy1d import overlapping_supports

pytestmark = pytest.mark.kernel

HERE = Pixels(overlapping_supports(), np.arange(7 * 40))
N = len(HERE.index)
NEAR, FAR = (offset(HERE.of, HERE.index, by) for by in (1, 2))
X = initial(HERE, live())
every_weight = pytest.mark.parametrize("mis", WEIGHTS.values(), ids=WEIGHTS)
every_formula = pytest.mark.parametrize(
    "m", [m for w in WEIGHTS.values() for m in (w.m, w.c) if m is not None], ids=lambda m: m.__name__
)

# ---------------------------------------------------------------- nothing counts


@every_formula
def test_where_no_input_counts_for_anything_all_weights_are_zero(m):
    case = drawn(4, 1, seed=0, columns=9)
    case.c[:, ::2] = 0
    assert (weights(m, case)[:, ::2] == 0).all()


def test_plain_shares_of_nothing_are_undefined():
    case = drawn(4, 1, seed=0, columns=9)
    with pytest.raises(RuntimeWarning, match="invalid value"):
        weights(lambda i, q, c: c[i] / c.C, case._replace(c=0 * case.c))


def merged(mis, *confidences):
    """A pass over the own samples, the neighbours' and others' of these confidences."""
    others = [Input(replace(X, c=c * np.ones(N)), FAR) for c in confidences]
    return gris([Input(X, HERE), Input(X, NEAR), *others], HERE, mis, live(2))


@every_weight
def test_an_input_of_confidence_zero_is_as_good_as_absent(mis):
    assert same_bits(merged(mis, 0), merged(mis))
    assert not same_bits(merged(mis, 1e-3), merged(mis))


# ---------------------------------------------------------------- the target is zero


@pytest.mark.parametrize("m", [constant, pairwise, defensive])
def test_canonical_inputs_alone_share_by_confidence_even_where_the_target_is_zero(m):
    case = drawn(3, 3, seed=0, columns=9)
    nowhere = case._replace(q=0 * case.q)
    shares = case.c / case.c.sum(axis=0)
    assert weights(m, nowhere) == pytest.approx(shares)
    assert (weights(one_over_z, nowhere) == 0).all()


@pytest.mark.parametrize("m", [pairwise, defensive])
def test_others_that_do_not_count_take_nothing_even_where_the_target_is_zero(m):
    case = drawn(3, 1, seed=0, columns=9)
    case.c[case.others] = 0
    alone = weights(m, case._replace(q=0 * case.q))
    assert (alone.sum(axis=0) == alone[case.canonical[0]]).all()
    assert (alone[case.canonical[0]] == 1).all()


# ---------------------------------------------------------------- confidences


@pytest.mark.parametrize(
    ("a", "b", "sum_"), [(99, 98, 2.0**99 + 2.0**98), (99, 99, 2.0**100), (100, 0, 2.0**100), (900, 900, 2.0**100)]
)
def test_confidences_add_up_exactly_until_they_saturate_at_2_to_the_100(a, b, sum_):
    inputs = [Input(replace(X, c=np.full(N, 2.0**k)), at) for k, at in ((a, HERE), (b, NEAR))]
    assert (gris(inputs, HERE, WEIGHTS["talbot"], live()).c == sum_).all()


def test_a_new_sample_counts_one_and_as_an_integer_leaves_rational_confidences_exact():
    assert (X.c == 1).all()
    assert isinstance(Fraction(1, 3) + X.c[0], Fraction)
    assert not isinstance(Fraction(1, 3) + np.ones(1)[0], Fraction)


def by_any_weights(candidates, chance, c):
    """`select_any` by the usual weights."""
    offered = list(candidates)
    cW, w = [each.mW for each in offered], [each.p_hat * each.mW for each in offered]
    return select_any([each.x for each in offered], cW, w, chance, c)


SELECTORS = {"select": select, "select_any": by_any_weights, "select_streaming": select_streaming}
every_selector = pytest.mark.parametrize("selector", SELECTORS.values(), ids=SELECTORS)


def offered(*mW):
    """Candidates with p_hat = 1 and these m W."""
    return [Candidate(X.x, np.ones(N), each * np.ones(N)) for each in mW]


@every_selector
def test_a_confidence_that_all_columns_share_becomes_one_number_per_column(selector):
    for c in (np.array(3), np.array([3]), np.full(N, 3)):
        chosen = selector(offered(1.0, 4.0), live(), c)
        assert chosen.c.shape == chosen.W.shape == (N,)
        assert (chosen.c == 3).all()


# ---------------------------------------------------------------- bad numbers


@every_selector
@pytest.mark.parametrize("bad", [-0.5, np.nan, np.inf])
@pytest.mark.parametrize("place", [0, 1, 2])
def test_bad_weights_are_refused_wherever_they_stand(selector, bad, place):
    mW = [1.0, 1.0, 1.0]
    selector(offered(*mW), live(), X.c)
    mW[place] = bad
    with pytest.raises(ValueError, match=r"^a resampling weight w_i = p_hat m_i W_i must .* Check the m W"):
        selector(offered(*mW), live(), X.c)


LARGE = np.full(N, 1.5e308)
TOO_LARGE = {
    "sum of weights": (np.ones(N), LARGE, "the sum of the resampling weights w_i"),
    "W": (np.full(N, 1e-9), LARGE, "the weight W_Y = sum_j w_j / p_hat"),
}


@pytest.mark.parametrize("selector", [select, select_streaming])
@pytest.mark.parametrize(("p_hat", "mW", "what"), TOO_LARGE.values(), ids=TOO_LARGE)
def test_what_overflows_is_refused_by_name(selector, p_hat, mW, what):
    selector([Candidate(X.x, p_hat, mW / 4)] * 2, live(), X.c)
    with (
        np.errstate(over="ignore"),
        pytest.raises(ValueError, match=rf"^{what}.* but is inf in column 0 .* Scale p_hat"),
    ):
        selector([Candidate(X.x, p_hat, mW)] * 2, live(), X.c)


def test_weights_of_any_kind_may_not_overflow_together():
    with np.errstate(over="ignore"), pytest.raises(ValueError, match=r"^the sum of the resampling weights w_i must"):
        select_any([X.x] * 2, [X.W] * 2, [LARGE] * 2, live(), X.c)


class Dark(Wrapped):
    """Integrals whose target is zero everywhere."""

    def target(self, index, x):
        return np.zeros(len(index))


@pytest.mark.parametrize("bad", [-0.5, np.nan, np.inf])
def test_a_bad_weight_of_a_candidate_is_refused_even_where_the_target_is_zero(bad):
    dark = Pixels(Dark(HERE.of), HERE.index)
    assert (resample([(X.x, X.W)], dark, live()).W == 0).all()
    with pytest.raises(ValueError, match=r"^the m W of a candidate must .* Yield m_i / p\(x\)\."):
        resample([(X.x, bad * X.W)], dark, live())


def test_a_weight_of_the_wrong_length_is_refused_by_name():
    with pytest.raises(ValueError, match=r"^the m W of a candidate has shape \(3,\)"):
        resample([(X.x, np.ones(3))], HERE, live())


@pytest.mark.parametrize(("field", "name"), [("W", "weight W"), ("c", "confidence c")])
def test_a_complaint_about_an_input_says_which_number_of_which_input_before_it_says_why(field, name):
    broken = replace(X, **{field: -np.ones(N)})
    with pytest.raises(ValueError, match=rf"^the {name} of input 1 must be .* W comes from 1/p or from a pass"):
        gris([Input(X, HERE), Input(broken, NEAR)], HERE, WEIGHTS["talbot"], live())
