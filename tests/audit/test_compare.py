"""What is compared, where, and how closely: each law says what passes, and its twin what just fails."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from restir_ref.audit import audit_dump
from restir_ref.audit.compare import Check, Wrong
from restir_ref.audit.dump import RTOL
from tests.audit.planted import M, fields
from tests.audit.shader import dumped
from tests.audit.test_dump import in_pieces

Dump = dict[str, Any]


def wrong_terms(dump: Dump) -> list[str]:
    return [each.term for each in audit_dump(dump).wrong]


def by_hand(W: Any, p_hat: Any, **more: Any) -> Dump:
    """Canonical inputs with constant weights in one column, w_i = p_hat_i W_i / M."""
    W, p_hat = np.array(W, dtype=float)[:, None], np.array(p_hat, dtype=float)[:, None]
    ones, named = np.ones(W.shape), {name: np.atleast_1d(values) for name, values in more.items()}
    head = {"format": "restir-ref dump", "version": 1, "mis": "constant", "canonical": ones[:, 0]}
    return {**head, "p_hat": p_hat, "W": W, "J": ones, "c": ones, **named}


# ---------------------------------------------------------------- how closely


@pytest.mark.parametrize(("term", "slack"), [("m", lambda _: 1e-2), ("w", lambda dump: 1e-2 * dump["w_sum"])])
def test_small_m_and_w_are_held_to_an_absolute_tolerance(term, slack: Callable[[Dump], Any]) -> None:
    dump = dumped(fields(), "talbot")
    allowed = np.where(dump[term] == 0, RTOL * slack(dump), 0)
    assert wrong_terms({**dump, term: dump[term] + 0.9 * allowed}) == []
    assert wrong_terms({**dump, term: dump[term] + 1.1 * allowed}) == [term]


@pytest.mark.parametrize("term", ["w_sum", "W_Y", "c_Y"])
def test_other_terms_are_held_to_a_relative_one(term) -> None:
    dump = dumped(fields(), "talbot")
    assert wrong_terms({**dump, term: dump[term] * (1 + 0.9 * RTOL)}) == []
    assert wrong_terms({**dump, term: dump[term] * (1 + 1.1 * RTOL)}) == [term]


TINY = float(np.finfo(np.float32).tiny)


def test_what_underflows_in_float32_may_be_dumped_as_zero() -> None:
    assert wrong_terms(by_hand([1], [0.99 * TINY], w_sum=0)) == []
    assert wrong_terms(by_hand([1], [1.01 * TINY], w_sum=0)) == ["w_sum"]
    assert wrong_terms(by_hand([1], [0.99 * TINY], w_sum=TINY / 2)) == ["w_sum"]


@pytest.mark.parametrize(("tolerances", "place"), [([1e-3, 1e-3, 1e-4], 2), ([0, 0, 0], 1)])
def test_the_worst_error_is_the_largest_in_units_of_what_is_tolerated(tolerances, place) -> None:
    found, nothing = np.array([[1e-2, 2e-2, 1e-2]]), np.zeros((1, 3))
    compared = np.ones((1, 3), dtype=bool)
    worst = Check("w", nothing, found, compared, np.array([tolerances], dtype=float)).worst()
    assert (worst.where, worst.found) == ((0, place), found[0, place])


@pytest.mark.parametrize(("columns", "said"), [(1, "(wrong in 1 column)"), (3, "(wrong in 3 columns)")])
def test_a_wrong_term_says_in_how_many_columns(columns, said) -> None:
    assert str(Wrong("w", (0, 2), 1.0, 2.0, columns)) == f"w[0] in column 2: expected 1, found 2 {said}"


# ---------------------------------------------------------------- where


@pytest.mark.parametrize("zero", ["J", "W", "p_hat"])
def test_m_is_compared_unless_w_is_zero_anyway(zero) -> None:
    dump = dumped(fields(), "talbot")
    others = [dump[name] > 0 for name in ("J", "W", "p_hat") if name != zero]
    dead = (dump[zero] == 0) & others[0] & others[1]
    assert dead.any()
    assert wrong_terms({**dump, "m": np.where(dead, 0.77, dump["m"])}) == []
    assert wrong_terms({**dump, "m": np.where((dump[zero] > 0) & others[0] & others[1], 0.77, 0)}) == ["m"]


def test_w_is_compared_where_it_is_zero() -> None:
    dump = dumped(fields(), "talbot")
    assert wrong_terms({**dump, "w": np.where(dump["W"] == 0, 0.77, dump["w"])}) == ["w"]


def chosen_otherwise() -> tuple[Dump, int, int]:
    """A dump in which one column has selected another possible input, and has a W_Y that fits; column and input."""
    dump = dumped(fields(), "talbot")
    possible = (dump["w"] > 0.1 * dump["w_sum"]) & (np.arange(M)[:, None] != dump["s"])
    s, column = (int(k) for k in np.argwhere(possible)[0])
    dump["s"][column], dump["W_Y"][column] = s, dump["w_sum"][column] / dump["p_hat"][s, column]
    return dump, column, s


def test_after_a_wrong_selection_its_result_is_left_open_but_not_its_confidence() -> None:
    dump, column, _ = chosen_otherwise()
    assert wrong_terms(dump) == ["s"]
    dump["c_Y"][column] += 1
    assert wrong_terms(dump) == ["s", "c_Y"]
    dump["W_Y"][(column + 1) % len(dump["s"])] += 1
    assert wrong_terms(dump) == ["s", "W_Y", "c_Y"]


def test_without_numbers_any_possible_input_may_be_selected_and_the_result_has_to_fit() -> None:
    dump, column, _ = chosen_otherwise()
    free = {name: values for name, values in dump.items() if name != "u"}
    assert wrong_terms(free) == []
    free["W_Y"] = np.where(np.arange(len(free["s"])) == column, 1.01, 1) * free["W_Y"]
    assert wrong_terms(free) == ["W_Y"]


# ---------------------------------------------------------------- which selections are allowed


@pytest.mark.parametrize(("s", "wrong"), [(0, []), (1, ["s"]), (2, [])])
def test_on_a_boundary_both_sides_are_allowed_but_no_input_of_weight_zero(s, wrong) -> None:
    """w = 1/3, 0, 1, and u just above 1/4; 1 - u would select the last one."""
    assert wrong_terms(by_hand([1, 0, 3], [1, 1, 1], u=0.25 + RTOL / 2, s=s)) == wrong
    assert wrong_terms(by_hand([1, 0, 3], [1, 1, 1], u=0.25 + 2 * RTOL, s=s)) == ([] if s == 2 else ["s"])


@pytest.mark.parametrize("s", [0, 1])
def test_where_all_weights_are_zero_any_input_is_allowed(s) -> None:
    assert wrong_terms(by_hand([0, 0], [1, 1], u=0.7, s=s, W_Y=0)) == []
    assert wrong_terms(by_hand([0, 0], [1, 1], u=0.7, s=s, W_Y=1)) == ["W_Y"]


def test_numbers_at_either_end_select_beyond_doubt_beside_inputs_of_weight_zero() -> None:
    """Moved beyond the ends by the tolerance, they would select what has no weight, and leave the result open."""
    for u, first, last in ((0.0, 0, 1), (1 - 2.0**-53, 1, 0)):
        W, p_hat = [first, 1, 1, last], [1, 2, 4, 8]
        due = 6 / 4 + (1 if first else 8) / 4
        selected = 2 if u == 0 else 4
        dump = by_hand(W, p_hat, u=u, W_Y=due / selected)
        assert wrong_terms(dump) == []
        assert wrong_terms({**dump, "W_Y": dump["W_Y"] * 1.01}) == ["W_Y"]


# ---------------------------------------------------------------- what follows from other numbers

OFF_DIAGONAL = ~np.eye(M, dtype=bool)
CANONICAL = np.arange(M) == 0
PLACES = {
    "the own input": (~OFF_DIAGONAL & ~CANONICAL, ["p_hat_back"]),
    "a canonical input": (OFF_DIAGONAL & CANONICAL, ["p_hat_back"]),
    "others": (OFF_DIAGONAL & ~CANONICAL, []),
}


@pytest.mark.parametrize("name", PLACES)
def test_targets_shifted_back_are_compared_where_the_shift_back_is_known(name) -> None:
    """Weights are constant, so nothing else depends on them; p_hat_from is made to fit."""
    place, wrong = PLACES[name]
    dump = in_pieces(dumped(fields(), "constant"))
    reached = place[..., None] & (dump["J"] > 0)[:, None]
    dump["p_hat_back"] = np.where(reached, dump["p_hat_back"] + 1, dump["p_hat_back"])
    if not wrong:
        dump["p_hat_from"] = np.where(reached, dump["p_hat_back"] * dump["J_back"], dump["p_hat_from"])
    assert wrong_terms(dump) == wrong


@pytest.mark.parametrize("name", PLACES)
def test_jacobians_of_the_shift_back_are_compared_where_it_is_known(name) -> None:
    place, wrong = PLACES[name]
    dump = in_pieces(dumped(fields(), "constant"))
    reached = place[..., None] & (dump["J"] > 0)[:, None]
    dump["J_back"] = np.where(reached, dump["J_back"] + 1, dump["J_back"])
    if not wrong:
        dump["p_hat_from"] = np.where(reached, dump["p_hat_back"] * dump["J_back"], dump["p_hat_from"])
    assert wrong_terms(dump) == (["J_back"] if wrong else [])


@pytest.mark.parametrize("term", ["p_hat_back", "J_back", "p_hat_from"])
def test_samples_that_were_not_reached_have_nothing_to_compare(term) -> None:
    dump = in_pieces(dumped(fields(), "talbot"))
    unreached = np.broadcast_to((dump["J"] == 0)[:, None], dump[term].shape)
    assert unreached.any()
    assert wrong_terms({**dump, term: np.where(unreached, 0.77, dump[term])}) == []
