"""A mistake is named for what it explains: positively, in enough columns, and without making right ones wrong."""

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pytest

from restir_ref.audit import KNOWN, audit_dump
from restir_ref.audit import dump as module
from restir_ref.audit.compare import Check
from restir_ref.audit.mistakes import Mistake, edited, ended
from restir_ref.audit.recorded import BELOW_ONE
from tests.audit.planted import DividedByC, GrownFromZero, OwnNotCounted, capped, fields, lonely, streamed
from tests.audit.shader import dumped

Dump = dict[str, Any]


def named(dump: Dump) -> list[str]:
    return [each.mistake for each in audit_dump(dump).explanations]


def shares(dump: Dump) -> dict[str, float]:
    return {each.mistake: each.share for each in audit_dump(dump).explanations}


def without(dump: Dump, *names: str) -> Dump:
    return {name: values for name, values in dump.items() if name not in names}


def alive(mis: str = "talbot") -> Dump:
    """A right dump whose results are not 0 in any of its 20 columns."""
    dump = dumped(fields(), mis)
    kept = np.flatnonzero(dump["W_Y"] > 0)[:20]
    whole = ("format", "version", "mis", "canonical")
    return {name: values if name in whole else values[..., kept] for name, values in dump.items()}


# ---------------------------------------------------------------- what is left open explains nothing

many = partial(fields, (True, *(False,) * 6))
WAYS = {"inverted": fields, "streamed": streamed, "capped": capped, "many inputs": many}


@pytest.mark.parametrize("mis", KNOWN)
@pytest.mark.parametrize("way", WAYS.values(), ids=WAYS)
def test_an_unrelated_factor_on_the_result_is_explained_by_nothing(mis, way) -> None:
    dump = dumped(way(), mis)
    assert named({**dump, "W_Y": 1.37 * dump["W_Y"]}) == []


def test_taking_what_is_left_open_for_explained_is_noticed(monkeypatch) -> None:
    """1 - u selects otherwise in most columns, whose W_Y cannot be compared then."""
    dump = dumped(many(), "talbot")
    mirror = edited(lambda p: replace(p, u=[np.minimum(1 - u, BELOW_ONE) for u in p.u]))
    monkeypatch.setattr(module, "suspects", lambda dump: [Mistake("mirrored", "", mirror)])
    assert named({**dump, "W_Y": 1.37 * dump["W_Y"]}) == []
    monkeypatch.setattr(Check, "right", property(lambda check: ~check.wrong))
    assert named({**dump, "W_Y": 1.37 * dump["W_Y"]}) == ["mirrored"]


# ---------------------------------------------------------------- small passes from real renderers


@pytest.mark.parametrize("mis", [mis for mis in KNOWN if "pairwise" in mis])
def test_a_canonical_weight_that_starts_at_zero_is_named_where_no_neighbour_was_accepted(mis) -> None:
    wrong = dumped(fields((True,), n=3), mis, GrownFromZero)
    assert (audit_dump(wrong).first.term, named(wrong)) == ("m", ["canonical weight 0 without neighbours"])


def test_initial_candidates_whose_average_was_forgotten_are_named() -> None:
    """RIS over M = 2 candidates: all inputs are canonical, W = 1/p, and W_Y lacks 1/M."""
    one = np.ones((2, 2))
    head = {"format": "restir-ref dump", "version": 1, "mis": "constant", "canonical": [1, 1]}
    drawn = {"p_hat": [[3.0, 1.0], [1.0, 4.0]], "W": [[0.5, 2.0], [1.0, 0.25]], "J": one, "c": one, "u": [0.2, 0.9]}
    wrong = {"w": [[1.5, 2.0], [1.0, 1.0]], "w_sum": [2.5, 3.0], "s": [0, 1], "W_Y": [2.5 / 3, 0.75]}
    assert named({**head, **drawn, **wrong}) == ["the sum is never divided by M (the sum of confidences)"]
    halved = {name: np.array(each) / 2 for name, each in wrong.items() if name != "s"}
    assert audit_dump({**head, **drawn, **halved}).right


@pytest.mark.parametrize("way", [fields, capped, lonely])
def test_own_samples_that_were_not_counted_are_named_from_the_result_alone(way) -> None:
    wrong = without(dumped(way(), "constant", OwnNotCounted), "m", "w", "w_sum")
    assert audit_dump(wrong).first.term == "W_Y"
    assert "own samples not counted in C" in named(wrong)


def test_a_limit_on_the_result_is_named_with_its_value() -> None:
    dump = alive()
    limit = np.sort(dump["W_Y"])[-4]
    (said,) = audit_dump({**dump, "W_Y": np.minimum(dump["W_Y"], limit)}).explanations
    assert (said.mistake, said.bug, said.complete) == (f"W_Y clamped at {limit:.7g}", "W clamped", True)


def test_no_limit_is_guessed_from_one_column_or_from_zeros() -> None:
    dump = alive()
    whole = ("format", "version", "mis", "canonical")
    alone = {name: values if name in whole else values[..., :1] for name, values in dump.items()}
    assert named({**alone, "W_Y": 0.9 * alone["W_Y"]}) == []
    assert named({**dump, "W_Y": 0 * dump["W_Y"]}) == []


# ---------------------------------------------------------------- shares

BY_M = "W_Y divided by M once more"


def test_a_mistake_has_to_leave_right_columns_right() -> None:
    dump = alive()
    assert BY_M in named({**dump, "W_Y": dump["W_Y"] / 3})
    assert named({**dump, "W_Y": np.where(np.arange(20) == 5, dump["W_Y"] / 3, dump["W_Y"])}) == []


@pytest.mark.parametrize(("columns", "share"), [(9, {}), (10, {BY_M: 0.5}), (14, {BY_M: 0.7}), (20, {BY_M: 1.0})])
def test_a_mistake_is_named_from_half_of_the_wrong_columns_on(columns, share) -> None:
    dump = alive()
    first = np.arange(20) < columns
    assert shares({**dump, "W_Y": dump["W_Y"] * np.where(first, 1 / 3, 0.77)}) == pytest.approx(share)


def suspecting(*columns: int, monkeypatch: Any) -> None:
    """Suspects that double W_Y in so many columns, and triple it in the others."""

    def doubled(k: int) -> Mistake:
        grown = np.where(np.arange(20) < k, 2, 3)
        return Mistake(str(k), "", ended(lambda p, terms: replace(terms, W_Y=terms.W_Y * grown)))

    monkeypatch.setattr(module, "suspects", lambda dump: [doubled(k) for k in columns])


def test_the_three_mistakes_that_explain_most_are_named_in_order(monkeypatch) -> None:
    dump = alive()
    suspecting(12, 18, 9, 10, 16, 14, monkeypatch=monkeypatch)
    assert named({**dump, "W_Y": 2 * dump["W_Y"]}) == ["18", "16", "14"]


def test_beside_a_mistake_that_explains_everything_others_are_not_named(monkeypatch) -> None:
    dump = alive()
    suspecting(12, 20, 18, monkeypatch=monkeypatch)
    assert named({**dump, "W_Y": 2 * dump["W_Y"]}) == ["20"]


def test_a_mistake_that_explains_the_first_term_only_says_so(monkeypatch) -> None:
    dump = alive()
    suspecting(20, monkeypatch=monkeypatch)
    report = audit_dump({**dump, "W_Y": 2 * dump["W_Y"], "c_Y": 3 * dump["c_Y"]})
    assert [each.term for each in report.wrong] == ["W_Y", "c_Y"]
    assert str(report.explanations[0]) == "20: explains this term in 100% of its columns, but not all others"


@pytest.mark.parametrize(("columns", "seen"), [(20, 4), (6, 8), (2, 6)])
def test_explanations_are_tried_on_some_wrong_columns_and_as_many_others(columns, seen, monkeypatch) -> None:
    sizes: list[int] = []
    monkeypatch.setattr(module, "SOME", 4)
    monkeypatch.setattr(module, "suspects", lambda dump: sizes.append(dump.recorded.p_hat.shape[1]) or [])
    dump = alive()
    audit_dump({**dump, "W_Y": dump["W_Y"] * np.where(np.arange(20) < columns, 2, 1)})
    assert set(sizes) == {seen}


@pytest.mark.parametrize("way", [fields, capped])
def test_a_division_by_confidences_is_one_by_those_after_capping(way) -> None:
    """Canonical confidences are above the cap in some columns, and not capped."""
    wrong = dumped(way(), "talbot", DividedByC)
    assert (wrong["c"][0] > 2).any()
    assert "W_Y divided by the sum of confidences once more" in named(wrong)
