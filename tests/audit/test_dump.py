"""A dump of a right pass is right; a planted mistake is named at its first term, with the bug it is."""

from functools import partial
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from restir_ref.audit import KNOWN, audit_dump
from restir_ref.audit.mistakes import MISTAKES
from restir_ref.mis import CANONICAL_COVERS
from restir_ref.oracle.zoo import BUGS, INEFFICIENT
from tests.audit.planted import PLANTED, M, OwnWithoutJ, fields, streamed
from tests.audit.shader import Shader, dumped, scattered_passes

every_weight = pytest.mark.parametrize("mis", KNOWN)
WAYS = {
    "inverted": fields,
    "streamed": streamed,
    "capped": partial(fields, cap=2.0),
    "two canonical": partial(fields, (True, False, True)),
    "all canonical": partial(fields, (True, True, True)),
    "canonical last": partial(fields, (False, False, True)),
    "one input": partial(fields, (True,)),
}


@every_weight
@pytest.mark.parametrize("way", WAYS.values(), ids=WAYS)
def test_the_dump_of_an_independent_implementation_is_right(mis, way) -> None:
    report = audit_dump(dumped(way(), mis), rtol=1e-12)
    assert report.right, report
    assert report.missing == []


@given(
    mis=st.sampled_from(list(KNOWN)),
    canonical=st.lists(st.booleans(), min_size=1, max_size=5),
    cap=st.sampled_from([0.5, 2.0, np.inf]),
    seed=st.integers(0, 2**32 - 1),
)
def test_any_pass_of_an_independent_implementation_is_right(mis, canonical, cap, seed) -> None:
    rng = np.random.default_rng(seed)
    needed = KNOWN[mis].unbiased_for == CANONICAL_COVERS
    whole = scattered_passes(len(canonical), 5, [*canonical[:-1], canonical[-1] or needed], rng)
    numbers = {"u": rng.random(5)} if seed % 2 else {"u_stream": rng.random((len(canonical), 5))}
    caps = {"cap": cap} if np.isfinite(cap) else {}
    report = audit_dump(dumped({**whole, **caps, **numbers}, mis), rtol=1e-12)
    assert report.right, report


def test_a_dump_without_canonical_inputs_is_right_where_the_weights_allow_it() -> None:
    for mis in ("talbot", "1/Z", "constant", "constant, talbot"):
        assert audit_dump(dumped(fields((False, False)), mis), rtol=1e-12).right


@every_weight
def test_a_dump_in_float32_is_right(mis) -> None:
    right = dumped(fields(), mis)
    assert audit_dump({name: rounded(values) for name, values in right.items()}).right


def rounded(values: Any) -> Any:
    return values.astype(np.float32) if getattr(values, "dtype", None) == np.float64 else values


def test_pieces_of_the_densities_may_stand_for_their_product() -> None:
    right = in_pieces(dumped(fields(), "talbot"))
    report = audit_dump(right, rtol=1e-12)
    assert report.right
    assert {"J_back", "p_hat_back", "p_hat_from"} <= set(report.compared)


def in_pieces(whole: dict[str, Any]) -> dict[str, Any]:
    """p_hat_from = p_hat_back J_back, with J_back = 1 / J_i on the diagonal and a power of two elsewhere."""
    q, J, own = whole["p_hat_from"], whole["J"], whole["p_hat_own"]
    J_back = np.where(q > 0, np.random.default_rng(7).choice([0.5, 1, 2], q.shape), 0)
    J_back[:, whole["canonical"] == 1] = 1
    i = np.arange(len(J))
    J_back[i, i] = np.where(J > 0, 1 / np.where(J > 0, J, 1), 0)
    p_hat_back = np.where(J_back > 0, q / np.where(J_back > 0, J_back, 1), 0)
    p_hat_back[i, i] = own
    return {**whole, "p_hat_back": p_hat_back, "J_back": J_back}


def test_a_single_wrong_number_is_found_where_it_is() -> None:
    wrong = dumped(fields(), "defensive")
    wrong["w"][1, 17] *= 1.01
    report = audit_dump(wrong)
    assert (report.first.term, tuple(report.first.where), report.first.columns) == ("w", (1, 17), 1)
    assert report.first.found == pytest.approx(1.01 * report.first.expected)
    assert "w[1] in column 17" in str(report)


@pytest.mark.parametrize("term", ["p_hat_own", "p_hat_from", "m", "w", "w_sum", "W_Y", "c_Y"])
def test_every_term_is_compared(term) -> None:
    wrong = dumped(fields(), "talbot")
    wrong[term] = wrong[term] * 1.001
    assert audit_dump(wrong).first.term == term


@pytest.mark.parametrize("term", ["J", "p_hat_back", "J_back"])
def test_every_piece_is_compared(term) -> None:
    wrong = in_pieces(dumped(fields(), "talbot"))
    wrong[term] = wrong[term] * 1.001
    assert audit_dump(wrong).first.term == term


def test_an_impossible_selection_is_noticed_without_the_random_number() -> None:
    wrong = dumped(fields(), "talbot")
    del wrong["u"], wrong["W_Y"]
    column = int(np.flatnonzero((wrong["w"][2] == 0) & (wrong["w_sum"] > 0))[0])
    wrong["s"][column] = 2
    assert audit_dump(wrong).first == audit_dump(wrong).wrong[0]
    assert (audit_dump(wrong).first.term, tuple(audit_dump(wrong).first.where)) == ("s", (column,))


def test_a_number_on_a_boundary_may_select_either_side() -> None:
    dump = dumped(fields(), "talbot")
    upto = dump["w"][0] / np.where(dump["w_sum"] > 0, dump["w_sum"], 1)
    column = int(np.flatnonzero((upto > 0.1) & (upto < 0.9) & (dump["w"][1] > 0))[0])
    dump["u"][column] = upto[column] * (1 + 1e-7)
    for s in (0, 1):
        dump["s"][column] = s
        dump["W_Y"][column] = dump["w_sum"][column] / dump["p_hat"][s, column]
        assert audit_dump(dump).right
    dump["u"][column] = upto[column] * 1.01
    dump["s"][column] = 0
    assert audit_dump(dump).first.term == "s"


def test_a_number_on_a_boundary_leaves_the_result_open_if_the_selection_is_not_dumped() -> None:
    dump = dumped(fields(), "talbot")
    del dump["s"]
    upto = dump["w"][0] / np.where(dump["w_sum"] > 0, dump["w_sum"], 1)
    column = int(np.flatnonzero((upto > 0.1) & (upto < 0.9) & (dump["w"][1] > 0))[0])
    dump["u"][column], dump["W_Y"][column] = upto[column] * (1 + 1e-7), 99
    assert audit_dump(dump).right
    dump["u"][column] = upto[column] * 1.01
    assert audit_dump(dump).first.term == "W_Y"


def test_densities_that_the_weights_do_not_need_may_be_incomplete() -> None:
    whole = dumped(fields(), "constant")
    for kept in ({"p_hat_own"}, {"p_hat_from"}, set()):
        some = {name: values for name, values in whole.items() if name not in {"p_hat_own", "p_hat_from"} - kept}
        assert audit_dump(some, rtol=1e-12).right
        assert audit_dump({**some, "W_Y": 2 * whole["W_Y"]}).first.term == "W_Y"


# ---------------------------------------------------------------- mistakes


@pytest.mark.parametrize("name", PLANTED)
def test_a_planted_mistake_is_named_at_its_first_term(name) -> None:
    shader, mis, way, term = PLANTED[name]
    report = audit_dump(dumped(way(), mis, shader), rtol=1e-9)
    assert report.first.term == term
    assert name in [each.mistake for each in report.explanations if each.complete], report


@pytest.mark.parametrize("name", ["J left out everywhere", "J inverted everywhere", "J squared everywhere"])
def test_a_wrong_jacobian_forth_and_back_is_named(name) -> None:
    change = {"left out": lambda J: 1.0 * (J > 0), "inverted": lambda J: np.where(J > 0, 1 / np.where(J > 0, J, 1), 0)}
    J_of = change.get(name.removeprefix("J ").removesuffix(" everywhere"), np.square)
    pieces = in_pieces(fields())
    theirs = {**pieces, "J": J_of(pieces["J"]), "p_hat_from": pieces["p_hat_back"] * J_of(pieces["J_back"])}
    results = dumped(theirs, "talbot")
    report = audit_dump({**results, **{key: pieces[key] for key in ("J", "p_hat_from")}}, rtol=1e-9)
    assert report.first.term == "m"
    assert name in [each.mistake for each in report.explanations if each.complete]


def test_every_mistake_is_planted_somewhere() -> None:
    everywhere = {f"J {what} everywhere" for what in ("left out", "inverted", "squared")}
    assert {mistake.name for mistake in MISTAKES} == PLANTED.keys() | everywhere


def test_every_mistake_that_names_a_bug_names_one_of_the_zoo() -> None:
    assert {mistake.bug for mistake in MISTAKES} - {""} <= BUGS.keys() | INEFFICIENT.keys()


@every_weight
def test_the_dump_of_other_weights_is_told_from_the_one_it_claims_to_be(mis) -> None:
    claimed = "talbot" if mis != "talbot" else "defensive"
    report = audit_dump({**dumped(fields(), mis), "mis": claimed}, rtol=1e-9)
    assert f"the weights are {mis!r}, not {claimed!r}" in [each.mistake for each in report.explanations]


def test_an_own_target_without_jacobian_in_the_dump_itself_is_explained() -> None:
    wrong = dumped(fields(), "talbot", OwnWithoutJ)
    i = np.arange(M)
    wrong["p_hat_from"][i, i] = wrong["p_hat_own"]
    report = audit_dump(wrong)
    assert report.first.term == "p_hat_from"
    assert [each.mistake for each in report.explanations] == ["own MIS term without its Jacobian"]


def test_an_unheard_of_mistake_is_located_though_not_explained() -> None:
    class Halved(Shader):
        def w(self, i, m):
            return super().w(i, m) * (0.7 if i == 1 else 1)

    report = audit_dump(dumped(fields(), "talbot", Halved))
    assert report.first.term == "w"
    assert not any(each.complete for each in report.explanations)


def test_given_weights_are_taken_as_they_are_but_the_rest_is_judged() -> None:
    dump = dumped(fields(), "pairwise")
    given = {name: values for name, values in dump.items() if name not in ("p_hat_own", "p_hat_from")}
    assert audit_dump({**given, "mis": "given"}, rtol=1e-12).right
    assert audit_dump({**given, "mis": "given", "W_Y": 2 * dump["W_Y"]}).first.term == "W_Y"
