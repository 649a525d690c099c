"""Laws of verdicts: from a check to a claim, and from the figures of a folder to what the ledger expects."""

import itertools
import json
from dataclasses import replace

import pytest

from figures.claims import verdicts
from figures.claims.criteria import above, below, reported, within
from figures.claims.errors import FigureError
from figures.claims.figure import VERDICTS, Claim, Conditions, Setup, undeclared, verdict_line, verdict_of, worst
from figures.claims.ledger import Row
from figures.claims.verdicts import Check, Record
from figures.engine import record, summary
from tests.figures.demos.sound import figure

HIT, MISS = within(0, 0, 1), within(3, 0, 1)
DECISIONS = {
    "reported": Claim("A-1", reported(3.0)),
    "reproduced": Claim("A-1", HIT),
    "reproduced with caveat": Claim("A-1", HIT, caveat="only in flatland"),
    "not judged": Claim("A-1", None, reason="too few frames"),
    "not reproduced": Claim("A-1", MISS, caveat="only in flatland"),
    "refuted": Claim("A-1", MISS, counter=above(3, 2)),
}


@pytest.mark.parametrize("verdict", DECISIONS)
def test_every_verdict_can_come_about(verdict):
    assert verdict_of(DECISIONS[verdict]) == verdict


def test_the_cases_above_are_all_verdicts():
    assert tuple(DECISIONS) == VERDICTS


def test_a_miss_without_certainty_of_the_opposite_is_no_refutation():
    assert verdict_of(Claim("A-1", MISS, counter=below(3, 2))) == "not reproduced"


def test_a_pass_is_no_refutation_whatever_the_counter_says():
    assert verdict_of(Claim("A-1", HIT, counter=HIT)) == "reproduced"


def test_what_is_not_judged_says_why():
    with pytest.raises(ValueError, match="A-1 'slope' is not judged: say why"):
        Claim("A-1", None, "slope")


FILM, INSET = Setup("real time", "moving", "all", "film"), Setup("real time", "moving", "all", "inset")
OFFLINE = Setup("offline", "still", "all", "film")


@pytest.mark.parametrize(
    ("ours", "verdict"), [(FILM, "refuted"), (INSET, "refuted"), (OFFLINE, "not reproduced")], ids=str
)
def test_nothing_is_refuted_under_other_conditions_than_the_papers(ours, verdict):
    under = Conditions(("A-1",), "Fig. 1", FILM, ours, "for speed")
    assert verdict_of(DECISIONS["refuted"], under) == verdict


@pytest.mark.parametrize(("a", "b"), list(itertools.combinations(VERDICTS, 2)))
def test_the_worst_check_decides(a, b):
    assert worst([a, b]) == worst([b, a]) == b


def test_the_line_under_a_picture_says_what_was_measured_and_the_rule():
    line = verdict_line(Claim("GRIS-F07", within(-1.0, -1, 0.1), part="slope"))
    assert line == "GRIS-F07 reproduced: slope -1 (criterion -1 ± 0.1)"


@pytest.mark.parametrize(
    ("checked", "problem"),
    [
        (("DEMO-C01",), ""),
        (("DEMO-C01", "DEMO-C09"), "checks 'DEMO-C09' without declaring it"),
        ((), "declares 'DEMO-C01' without checking it"),
    ],
)
def test_a_figure_checks_what_it_declares(checked, problem):
    assert undeclared(figure(), [Claim(id_, HIT) for id_ in checked]) == problem


def row(expected):
    return Row("A-1", "A", "A", "", "", "", (), (), {"quick": expected, "paper": None})


def found(id_, *verdicts, status="done"):
    checks = tuple(Check("A-1", "", "", 1.0, "", verdict, "", "") for verdict in verdicts)
    return Record(id_, "", "", "toy1d", "quick", 1, 1, ["A-1"], [], status, "", checks)


def judged(records, expected, declared=("F-1",)):
    (only,) = verdicts.judge(records, {"A-1": row(expected)}, {"A-1": set(declared)})
    return only.verdict, only.agrees


BOTH = ("F-1", "F-2")


@pytest.mark.parametrize(
    ("records", "expected", "declared", "answer"),
    [
        ([found("F-1", "reproduced")], "reproduced", ("F-1",), ("reproduced", True)),
        ([found("F-1", "reproduced")], "refuted", ("F-1",), ("reproduced", False)),
        ([found("F-1", "reproduced", "refuted")], "reproduced", ("F-1",), ("refuted", False)),
        ([found("F-1", "refuted")], None, ("F-1",), ("refuted", None)),
        ([found("F-1", status="crashed")], "reproduced", ("F-1",), (None, None)),
        ([found("F-1", "reproduced")], "refuted", BOTH, ("reproduced", True)),
        ([found("F-1", "refuted")], "reproduced", BOTH, ("refuted", False)),
        ([found("F-1", "reproduced"), found("F-2", "refuted")], "refuted", BOTH, ("refuted", True)),
        ([found("F-1", "reproduced"), found("F-2", "reproduced")], "refuted", BOTH, ("reproduced", False)),
    ],
)
def test_a_claim_is_compared_once_all_its_figures_have_spoken(records, expected, declared, answer):
    assert judged(records, expected, declared) == answer


def test_a_verdict_names_the_worlds_that_decided_it():
    records = [found("F-1", "reproduced"), replace(found("F-2", "refuted"), world="flatland2d")]
    (only,) = verdicts.judge(records, {"A-1": row(None)}, {"A-1": set(BOTH)})
    assert (only.verdict, only.where) == ("refuted", "flatland2d")


def test_kept_verdicts_are_read_back(tmp_path):
    rows = verdicts.judge([found("F-1", "reproduced", "refuted")], {"A-1": row(None)}, {"A-1": {"F-1"}})
    summary.write(rows, tmp_path)
    assert summary.read(tmp_path) == {"A-1": "refuted"}


def test_a_folder_without_verdicts_has_none(tmp_path):
    assert summary.read(tmp_path) == {}


@pytest.mark.parametrize("text", ["", "[]", '{"verdicts": [{"id": "A-1"}]}', '{"verdicts": [{"id":1,"verdict":"x"}]}'])
def test_damaged_verdicts_are_named(tmp_path, text):
    (tmp_path / summary.NAME).write_text(text)
    with pytest.raises(FigureError, match=r"verdicts\.json is damaged"):
        summary.read(tmp_path)


def test_a_kept_record_is_read_back(tmp_path):
    folder = tmp_path / "F-1"
    folder.mkdir()
    record.write(found("F-1", "reproduced", "refuted"), folder)
    assert record.read(folder) == found("F-1", "reproduced", "refuted")


DAMAGES = {
    "no JSON": lambda data: "{",
    "not a dict": lambda data: "[]",
    "another format": lambda data: json.dumps(data | {"format": 1}),
    "a field missing": lambda data: json.dumps({k: v for k, v in data.items() if k != "title"}),
    "a field too many": lambda data: json.dumps(data | {"more": 1}),
    "no verdict": lambda data: json.dumps(data | {"checks": [data["checks"][0] | {"verdict": "fine"}]}),
    "no number": lambda data: json.dumps(data | {"checks": [data["checks"][0] | {"measured": None}]}),
    "no text": lambda data: json.dumps(data | {"title": 3}),
    "another figure": lambda data: json.dumps(data | {"id": "F-2"}),
    "half a condition": lambda data: json.dumps(data | {"conditions": [{"claims": ["A-1"]}]}),
}


@pytest.mark.parametrize("damage", DAMAGES.values(), ids=DAMAGES)
def test_a_damaged_record_is_noticed(tmp_path, damage):
    folder = tmp_path / "F-1"
    folder.mkdir()
    record.write(found("F-1", "reproduced"), folder)
    path = folder / record.NAME
    path.write_text(damage(json.loads(path.read_text())))
    with pytest.raises(ValueError, match=r"JSON|Expecting|claims\.json"):
        record.read(folder)
