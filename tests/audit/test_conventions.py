"""The same pass, written down as engines do: every convention is settled, and mistakes are named within each."""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import pytest

from restir_ref.audit import audit_dump
from restir_ref.audit.conventions import CONVENTIONS, Reading, in_words, read_as, readings
from restir_ref.audit.engines import asked_defensive, asked_pairwise
from restir_ref.audit.load import completed
from restir_ref.audit.plateaus import plateaus
from restir_ref.batch import ratio, total
from restir_ref.mis import Confidences
from tests.audit.planted import PLANTED, fields, streamed
from tests.audit.shader import Shader, dumped, scattered_passes

Dump = dict[str, Any]
WHOLE = ("format", "version", "mis", "canonical", "cap")

# ---------------------------------------------------------------- how engines write


def plain(dump: Dump) -> Dump:
    return dump


def undivided(dump: Dump) -> Dump:
    """Streamed weights: c p_hat W J, and the sum of the confidences divides W_Y."""
    c = np.where(dump["canonical"][:, None] == 1, dump["c"], np.minimum(dump["c"], dump.get("cap", np.inf)))
    return {**dump, **{name: dump[name] * c.sum(axis=0) for name in ("m", "w", "w_sum")}}


def mirrored(dump: Dump) -> Dump:
    return {**dump, **{name: np.minimum(1 - dump[name], 1 - 1e-16) for name in ("u", "u_stream") if name in dump}}


def transposed(dump: Dump) -> Dump:
    return {**dump, "p_hat_from": dump["p_hat_from"].swapaxes(0, 1)}


def pixel_first(dump: Dump) -> Dump:
    return {name: v if name in WHOLE else np.moveaxis(np.asarray(v), -1, 0) for name, v in dump.items()}


def in_float32(dump: Dump) -> Dump:
    wide = {name for name, v in dump.items() if name not in WHOLE and np.asarray(v).dtype == np.float64}
    return {name: v.astype(np.float32) if name in wide else v for name, v in dump.items()}


def several(dump: Dump) -> Dump:
    return pixel_first(transposed(undivided(dump)))


WRITTEN = {
    "plain": plain,
    "undivided": undivided,
    "mirrored": mirrored,
    "transposed": transposed,
    "pixel first": pixel_first,
    "float32": in_float32,
    "several": several,
}
every_way = pytest.mark.parametrize("way", WRITTEN.values(), ids=WRITTEN)


@every_way
@pytest.mark.parametrize("given", [fields, partial(fields, cap=2.0)], ids=["free", "capped"])
@pytest.mark.parametrize("mis", ["talbot", "counted defensive", "1/Z"])
def test_a_right_pass_is_right_in_every_convention(way, given, mis) -> None:
    assert audit_dump(way(dumped(given(n=24), mis))).right


@pytest.mark.parametrize("way", [undivided, several], ids=["undivided", "several"])
@pytest.mark.parametrize("name", [name for name in PLANTED if "divides W_Y" not in name])
def test_a_planted_mistake_is_named_in_streamed_weights(name, way) -> None:
    shader, mis, given, _ = PLANTED[name]
    report = audit_dump(way(dumped(given(n=24), mis, shader)))
    assert not report.right
    assert name in [each.mistake for each in report.explanations if each.complete], report


def test_a_pass_that_none_of_the_conventions_makes_right_is_wrong() -> None:
    dump = dumped(fields(n=24), "talbot")
    for name in ("w", "w_sum", "W_Y", "c_Y"):
        assert not audit_dump(undivided({**dump, name: dump[name] * 1.01})).right


# ---------------------------------------------------------------- what is taken for granted is said


def said(dump: Dump) -> str:
    report = audit_dump(dump)
    assert report.right, report
    return "; ".join(report.conventions)


def test_the_report_says_how_the_dump_was_read() -> None:
    dump = dumped(fields(n=24), "talbot")
    assert said(dump) == ""
    assert "not divided by C" in said(undivided(dump))
    assert "1 - u" in said(mirrored(dump))
    assert "row j" in said(transposed(dump))
    assert "read so: " in str(audit_dump(mirrored(dump)))


def test_a_confidence_may_be_capped_when_it_is_stored_as_the_paper_prints_it() -> None:
    dump = dumped(fields(cap=2.0, n=24), "talbot")
    assert "min(M_c, sum)" in said({**dump, "c_Y": np.minimum(dump["c_Y"], 2.0)})
    assert "before the cap" in said({**dump, "c_Y": dump["c"].sum(axis=0)})
    assert not audit_dump({**dump, "c_Y": np.minimum(dump["c_Y"], 3.0)}).right


def test_a_cap_may_be_a_multiple_of_the_canonical_confidence() -> None:
    free = fields(n=24)
    c = np.where(free["canonical"][:, None] == 1, free["c"], np.minimum(free["c"], 2 * free["c"][0]))
    dump = {**dumped({**free, "c": c}, "talbot"), "c": free["c"], "cap": 2.0}
    assert "multiple of the canonical" in said(dump)


@pytest.mark.parametrize("order", [(1, 2, 0), (2, 1, 0)])
def test_inputs_may_be_offered_in_another_order(order) -> None:
    """The engine streams its neighbours first, or backwards; the dump lists the pixel's own reservoir first."""
    offered = streamed(n=200)
    at, back = np.array(order), np.argsort(order)
    by_input = ("canonical", "p_hat", "W", "J", "c", "p_hat_own", "u_stream")
    theirs = {name: v[at] if name in by_input else v for name, v in offered.items()}
    theirs["p_hat_from"] = offered["p_hat_from"][at][:, at]
    results = dumped(theirs, "talbot")
    listed = {name: results[name][back] for name in (*by_input, "m", "w")}
    dump = {**results, **listed, "p_hat_from": offered["p_hat_from"], "s": at[results["s"]]}
    assert f"offered in the order {order[0]}, {order[1]}, {order[2]}" in said(dump)


@pytest.mark.parametrize("k", [1.0, 5.0, 9.0])
@pytest.mark.parametrize("asked", [asked_pairwise, asked_defensive])
def test_weights_that_count_the_neighbours_asked_for_sum_to_one(k, asked) -> None:
    q, c = np.array([[1.0], [3.0], [0.5]]), Confidences([np.full(1, 2.0), np.full(1, 7.0), np.full(1, 1.0)], [0])
    np.testing.assert_allclose(total([asked(k)(i, q.__getitem__, c) for i in range(3)]), 1)


def asked_for(k: float, divisor: float | None = None) -> type[Shader]:
    """Defensive pairwise weights of k neighbours, of which those in the dump were accepted."""

    class Asked(Shader):
        def m_counted_defensive(self, i, q, c):
            own, n = q[self.R[0]], len(self.others)
            by = n + 1 if divisor is None else divisor

            def D(j):
                return c[self.R[0]] * own + k * c[j] * q[j]

            if i in self.others:
                return float(k / by * ratio(np.array(c[i] * q[i]), np.array(D(i))))
            return float((1 + sum(ratio(np.array(c[i] * own), np.array(D(j))) for j in self.others)) / by)

    return Asked


def test_the_number_of_neighbours_asked_for_is_found_by_itself_or_given() -> None:
    dump = dumped(fields(n=24), "counted defensive", asked_for(5))
    assert "k = 5 neighbours were asked for" in said(dump)
    assert said({**dump, "k": 5.0}) == ""
    assert not audit_dump({**dump, "k": 4.0}).right


def test_dividing_by_the_neighbours_asked_for_is_a_mistake_and_named() -> None:
    wrong = audit_dump(dumped(fields(n=24), "counted defensive", asked_for(5, 6.0)))
    assert "divided by k + 1, k = 5 neighbours asked for" in str(wrong)


# ---------------------------------------------------------------- clamps


def continuous(n: int = 24) -> Dump:
    """A pass whose Jacobians are all different."""
    given = fields(n=n)
    rng = np.random.default_rng(8)
    J = np.exp(rng.normal(0, 0.5, given["J"].shape))
    J[0] = 1
    q, i = given["p_hat_from"].copy(), np.arange(3)
    q[i, i] = given["p_hat_own"] / J
    return {**given, "J": J, "p_hat_from": q}


def test_a_jacobian_clamped_in_w_is_named_with_both_ends() -> None:
    class Clamped(Shader):
        def jacobian(self, i):
            return min(max(self.a.J[i], 0.8), 1.3) if i else 1

    report = audit_dump(dumped(continuous(), "talbot", Clamped))
    (only,) = report.explanations
    assert only.mistake == "J clamped in w to at least 0.8 and at most 1.3"
    assert only.bug == "Jacobian clamped in w"


def test_a_jacobian_clamped_before_the_dump_is_suspicious_though_the_pass_is_consistent() -> None:
    given = continuous()
    J = np.where(given["canonical"][:, None] == 1, 1, np.clip(given["J"], 1 / 1.4, 1.4))
    q, i = given["p_hat_from"].copy(), np.arange(3)
    q[i, i] = given["p_hat_own"] / J
    report = audit_dump(dumped({**given, "J": J, "p_hat_from": q}, "talbot"))
    assert not report.right
    assert report.wrong == []
    assert str(report).startswith("SUSPICIOUS: J is 1.4 in")
    assert audit_dump(dumped(given, "talbot")).right


def test_values_of_a_grid_are_no_clamp() -> None:
    rng = np.random.default_rng(9)
    for values in (
        rng.choice([0.5, 1, 2, 4], (3, 40)),
        np.round(np.exp(rng.normal(size=(3, 40))), 1),
        np.ones((3, 40)),
    ):
        found = {"canonical": np.array([1.0, 0, 0]), "J": values, "W": values}
        assert list(plateaus(found)) == []


# ---------------------------------------------------------------- readings


def small() -> Dump:
    given = {name: np.asarray(v) for name, v in fields(n=4).items() if name not in ("format", "version")}
    return completed(given, np.arange(4))


def test_the_plain_reading_changes_nothing() -> None:
    found = completed(
        {n: np.asarray(v) for n, v in fields(n=4).items() if n not in ("format", "version")}, np.arange(4)
    )
    assert read_as(found, Reading()) is found
    assert in_words(Reading()) == []
    assert Reading() not in readings(found, "talbot", ["s"])


def test_a_convention_is_tried_only_where_it_touches_a_wrong_term() -> None:
    found = {**small(), "m": np.ones((3, 4)), "s": np.zeros(4)}
    tried = {each.names for each in readings(found, "talbot", ["m"])}
    assert tried == {("transposed",), ("undivided",), ("transposed", "undivided")}
    assert ("mirrored",) in [each.names for each in readings(found, "talbot", ["s"])]
    assert list(readings(found, "talbot", [])) == []


@pytest.mark.parametrize("name", CONVENTIONS)
def test_every_convention_says_what_it_is(name) -> None:
    assert len(CONVENTIONS[name].about) > 15


def test_nobody_right_is_accused_in_any_convention() -> None:
    """120 random passes, each written in a random way; all thousand are run by `benchmarks`."""
    assert accused(120) == []


def accused(count: int) -> list[str]:
    """Right passes that the audit calls wrong."""
    rng = np.random.default_rng(16)
    ways: list[Callable[[Dump], Dump]] = [*WRITTEN.values()]
    found = []
    for number in range(count):
        mis = str(rng.choice(["talbot", "pairwise", "defensive", "1/Z", "constant", "counted defensive"]))
        M = int(rng.integers(1, 5))
        seed = int(rng.integers(2**31))
        given = scattered_passes(M, 6, [True, *[False] * (M - 1)], np.random.default_rng(seed))
        numbers = {"u": rng.random(6)} if number % 2 else {"u_stream": rng.random((M, 6))}
        caps = {"cap": float(rng.choice([1.0, 2.0]))} if number % 3 == 0 else {}
        way = ways[int(rng.integers(len(ways)))]
        report = audit_dump(way(dumped({**given, **numbers, **caps}, mis)))
        found += [] if report.right else [f"{number}: {report}"]
    return found
