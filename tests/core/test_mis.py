"""Laws of the MIS weights over the whole family; identities are decided in rational numbers, so exactly."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from restir_ref.mis import ALL_CANONICAL, ANY, WEIGHTS, constant
from tests.core.inputs import Inputs, drawn, exactly, fractions, inputs, mixed, weights

pytestmark = pytest.mark.kernel

every_weight = pytest.mark.parametrize("name", WEIGHTS)
every_formula = pytest.mark.parametrize(
    "m", [m for w in WEIGHTS.values() for m in (w.m, w.c) if m is not None], ids=lambda m: m.__name__
)


def talbot_36(i, q, R):
    return q[i] / sum(q)


def pairwise_37(i, q, R):
    if i in R:
        return sum(pairs(q, R)[j] for j in range(len(q)) if j not in R) / (len(q) - len(R))
    return q[i] / (len(R) * q[R[0]] + (len(q) - len(R)) * q[i])


def defensive_38(i, q, R):
    others = [j for j in range(len(q)) if j not in R]
    if i in R:
        return (1 + sum(pairs(q, R)[j] for j in others)) / len(q)
    return Fraction(len(others), len(q)) * pairwise_37(i, q, R)


def pairs(q, R):
    """p_hat / (|R| p_hat + (M - |R|) q_j) for every j."""
    return [q[R[0]] / (len(R) * q[R[0]] + (len(q) - len(R)) * q_j) for q_j in q]


PRINTED = {"talbot": talbot_36, "pairwise": pairwise_37, "defensive": defensive_38}
"""Eq. 36, 37 and 38 as printed: no confidences."""


def literal(printed):
    """The words of [GRIS 6.2]: p_hat and p_hat_from_i multiplied by the confidence inside Eq. 36-38."""

    def m(i, q, c):
        return printed(i, [c[j] * q(j) for j in range(len(c))], c.canonical)

    return m


# ---------------------------------------------------------------- partition


def faults(m, case: Inputs) -> list[str]:
    """What keeps m from partitioning one among the inputs that can realise y and count for something."""
    realises = (case.q > 0) & (case.c > 0)
    values = weights(m, case)
    wrong_sum = np.where(realises, values, 0).sum(axis=0) - realises.any(axis=0)
    return ["negative"] * bool(values.min() < 0) + ["sum"] * bool(abs(wrong_sum).max() > 1e-12)


@pytest.mark.claims("GRIS-E04", "GRIS-A03")
@pytest.mark.claims("GRIS-E36", "GRIS-E37", "GRIS-E38", part="partition of one")
@every_weight
@given(data=st.data())
def test_weights_are_non_negative_and_sum_to_one_over_the_inputs_that_can_realise_y(name, data):
    mis = WEIGHTS[name]
    assert faults(mis.c or mis.m, data.draw(inputs(mis.unbiased_for))) == []


def capped_below(i, q, c):
    """A mistake: confidences are capped at 1 in the denominator of Talbot's weights only."""
    return c[i] * q(i) / (1e-300 + sum(np.minimum(c[j], 1) * q(j) for j in range(len(c))))


def half_a_pair(i, q, c):
    """A mistake: every pair shares its weight half and half, whatever the canonical input's own count."""
    return q(i) / (q(c.canonical[0]) + q(i)) / len(c)


def rest_of_constant(i, q, c):
    """A mistake: the canonical input takes what constant weights leave of the densities."""
    return constant(i, q, c) if i not in c.canonical else 1 - sum(q(j) for j in c.others)


WRONG = {
    "1/M over unequal supports": (constant, "sum"),
    "cap only in the denominator": (capped_below, "sum"),
    "half a pair": (half_a_pair, "sum"),
    "what is left": (rest_of_constant, "negative"),
}


@pytest.mark.parametrize(("wrong", "fault"), WRONG.values(), ids=WRONG)
def test_weights_that_do_not_partition_are_noticed(wrong, fault):
    assert fault in faults(wrong, drawn(5, 1, seed=1, columns=200))


@every_formula
@given(case=inputs(columns=3), order=st.randoms(use_true_random=False))
def test_weights_do_not_depend_on_the_order_of_the_inputs(m, case, order):
    there = order.sample(range(case.M), case.M)
    moved = Inputs(case.q[there], case.c[there], [there.index(i) for i in case.canonical])
    assert (weights(m, exactly(moved)) == weights(m, exactly(case))[there]).all()


# ---------------------------------------------------------------- as printed


@pytest.mark.claims("GRIS-A03")
@pytest.mark.parametrize("name", PRINTED)
@given(case=mixed(), k=st.fractions(min_value="1/8", max_value=8))
def test_equal_confidences_give_the_printed_equation(name, case, k):
    equal = exactly(case)._replace(c=np.full(case.q.shape, k))
    printed = np.stack([PRINTED[name](i, equal.q, case.canonical) for i in range(case.M)])
    assert (weights(WEIGHTS[name].m, equal) == printed).all()


@pytest.mark.parametrize("name", PRINTED)
def test_unequal_confidences_do_not_give_the_printed_equation(name):
    case = exactly(drawn(4, 2, seed=0, columns=3))
    printed = np.stack([PRINTED[name](i, case.q, case.canonical) for i in range(case.M)])
    assert (weights(WEIGHTS[name].m, case) != printed).any()


# ---------------------------------------------------------------- confidence is replication


def replication_error(m, q, counts, canonical):
    """How far the weight of input i with confidence counts[i] is from that of counts[i] copies; exact."""
    source = np.repeat(np.arange(len(q)), counts)
    copies = Inputs(
        q[source], fractions(np.ones((len(source), q.shape[1]))), np.flatnonzero(np.isin(source, canonical))
    )
    summed = np.stack([weights(m, copies)[source == i].sum(axis=0) for i in range(len(q))])
    c = fractions(np.broadcast_to(np.array(counts)[:, None], q.shape))
    return abs(weights(m, Inputs(q, c, canonical)) - summed).max()


@pytest.mark.claims("GRIS-A03")
@every_formula
@given(case=inputs(columns=3), data=st.data())
def test_a_confidence_of_k_acts_as_k_identical_copies(m, case, data):
    counts = data.draw(st.lists(st.integers(1, 4), min_size=case.M, max_size=case.M))
    assert replication_error(m, exactly(case).q, counts, case.canonical) == 0


@pytest.mark.parametrize("printed", [pairwise_37, defensive_38])
def test_the_literal_reading_of_confidence_partitions_one_but_is_no_replication(printed):
    case = exactly(drawn(4, 1, seed=0, columns=5))
    assert (weights(literal(printed), case).sum(axis=0) == 1).all()
    assert replication_error(literal(printed), case.q, [3, 1, 2, 1], case.canonical) > 0.1


# ---------------------------------------------------------------- equal domains


def excess_over_share(m, case: Inputs):
    """m_i - c_i / C, (M, N)."""
    return weights(m, case) - case.c / case.c.sum(axis=0)


@pytest.mark.claims("GRIS-A03")
@pytest.mark.parametrize("name", [name for name in WEIGHTS if name != "defensive"])
@given(case=inputs(columns=3))
def test_equal_densities_give_every_input_its_share_of_the_confidence(name, case):
    alike = exactly(case._replace(q=np.broadcast_to(case.p_hat, case.q.shape)))
    mis = WEIGHTS[name]
    assert (excess_over_share(mis.c or mis.m, alike)[alike.c > 0] == 0).all()


@pytest.mark.parametrize("m", [WEIGHTS["defensive"].m, literal(pairwise_37)], ids=["defensive", "literal"])
def test_weights_that_give_equal_densities_unequal_shares_are_noticed(m):
    case = exactly(drawn(4, 1, seed=0, columns=3))
    alike = case._replace(q=np.broadcast_to(case.p_hat, case.q.shape))
    assert abs(excess_over_share(m, alike)).max() > 0.01


@pytest.mark.claims("GRIS-E37", part="all inputs canonical")
@every_formula
@given(case=inputs(ALL_CANONICAL, columns=20))
def test_where_all_inputs_are_canonical_weights_are_c_over_C(m, case):
    assert abs(excess_over_share(m, case)).max() < 1e-15
    assert (excess_over_share(m, exactly(case)) == 0).all()


def test_the_printed_pairwise_weights_have_no_answer_where_all_inputs_are_canonical():
    case = drawn(3, 3, seed=0, columns=2)
    with pytest.raises(ZeroDivisionError):
        pairwise_37(0, case.q, case.canonical)


# ---------------------------------------------------------------- defensive


def smallest_privilege(m, case: Inputs):
    """Smallest of m_i C / c_i - 1 over canonical and of 1 - m_i C / c_i over other inputs that count."""
    relative = np.divide(weights(m, case) * case.c.sum(axis=0), case.c, where=case.c > 0, out=case.c * 0 + 1)
    sign = np.where(np.isin(np.arange(case.M), case.canonical), 1, -1)[:, None]
    return (sign * (relative - 1)).min()


@pytest.mark.claims("GRIS-E38", part="inequality of canonical and other inputs")
@given(mixed(columns=1000))
def test_defensive_canonical_weights_exceed_c_over_C_and_others_stay_below(case):
    assert smallest_privilege(WEIGHTS["defensive"].m, case) > -1e-12


@given(mixed())
def test_defensive_weights_are_strictly_privileged_where_the_target_is_positive(case):
    counting = exactly(case)._replace(c=fractions(case.c + 1))
    assert smallest_privilege(WEIGHTS["defensive"].m, counting) > 0


@given(mixed())
def test_defensive_weights_are_c_over_C_where_only_the_target_is_zero(case):
    q = exactly(case).q + 1
    q[case.canonical] = Fraction(0)
    assert (excess_over_share(WEIGHTS["defensive"].m, Inputs(q, exactly(case).c, case.canonical)) == 0).all()


def test_uniform_pairwise_weights_do_not_privilege_canonical_inputs():
    assert smallest_privilege(WEIGHTS["pairwise"].m, drawn(5, 1, seed=0, columns=1000)) < -0.5


# ---------------------------------------------------------------- bounded weights


BOUNDED = ("talbot", "pairwise", "defensive")
"""The weights of Eq. 36-38; the others promise no bound."""


def relative_to_bound(m, case: Inputs):
    """Largest w_i C_R / (c_i C_i) for p_hat_i W_i = C_i, that is of m_i p_hat C_R / (c_i q_i).  [GRIS Thm A.4]"""
    counts = (case.q > 0) & (case.c > 0)
    C_R = case.c[case.canonical].sum(axis=0)
    return ((weights(m, case) * case.p_hat * C_R)[counts] / (case.c * case.q)[counts]).max()


@pytest.mark.claims("GRIS-TA4")
@pytest.mark.parametrize("name", BOUNDED)
@given(case=inputs())
def test_resampling_weights_stay_below_c_C_over_C_R(name, case):
    assert relative_to_bound(WEIGHTS[name].m, case) <= 1 + 1e-12
    unconfident = case._replace(c=np.ones(case.c.shape))
    assert relative_to_bound(WEIGHTS[name].m, unconfident) <= 1 + 1e-12


@pytest.mark.claims("GRIS-TA4")
@pytest.mark.parametrize("name", BOUNDED)
@given(case=mixed())
def test_the_bound_is_attained_where_only_canonical_inputs_can_realise_y(name, case):
    alone = exactly(case)
    alone.q[case.others] = Fraction(0)
    assert relative_to_bound(WEIGHTS[name].m, alone) == 1


@pytest.mark.parametrize("name", [name for name in WEIGHTS if name not in BOUNDED])
def test_weights_without_a_bound_exceed_it(name):
    assert relative_to_bound(WEIGHTS[name].m, drawn(5, 2, seed=0, columns=200)) > 10


# ---------------------------------------------------------------- nothing over nothing


@every_formula
@given(case=inputs(columns=3))
def test_where_no_input_can_realise_y_no_weight_is_undefined(m, case):
    nowhere = weights(m, case._replace(q=np.zeros(case.q.shape)))
    assert ((nowhere >= 0) & (nowhere <= 1)).all()


@pytest.mark.parametrize("m", [WEIGHTS["talbot"].m, WEIGHTS["pairwise"].m, WEIGHTS["1/Z"].c])
@given(case=mixed())
def test_nothing_over_nothing_is_zero(m, case):
    nowhere = Inputs(np.zeros(case.q.shape), case.c + 1, case.canonical)
    assert (weights(m, nowhere) == 0).all()


def test_weights_without_the_convention_are_undefined():
    with pytest.raises(ZeroDivisionError):
        talbot_36(0, [Fraction(0)] * 2, [0])


@every_formula
@given(case=mixed())
def test_others_of_no_confidence_leave_the_canonical_inputs_their_full_weight(m, case):
    c = case.c.copy()
    c[case.others] = 0
    alone = weights(m, exactly(case._replace(c=c)))
    assert (alone[case.others] == 0).all()
    assert (alone[case.canonical] == exactly(case).c[case.canonical] / sum(exactly(case).c[case.canonical])).all()


@given(case=inputs(ANY))
def test_one_over_Z_counts_the_inputs_that_can_realise_y(case):
    unconfident = case._replace(c=np.ones(case.c.shape))
    Z = (case.q > 0).sum(axis=0)
    assert weights(WEIGHTS["1/Z"].c, unconfident) == pytest.approx((case.q > 0) / np.maximum(Z, 1))
