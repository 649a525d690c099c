"""Laws of the audit: whatever does not fit is named, and it ends with 1."""

import json

import pytest

from figures.claims import coverage, ledger
from figures.engine import audit
from figures.project import Project
from tests.figures.project import claim, figures, project

ROW = {"sentence": "On FS1 to FS3 and CB3-glossy", "criterion": "it falls, in flatland and 3D"}
NAMED = {
    "all": ({"scenes": ["FS1", "FS2", "FS3", "CB3-glossy"], "worlds": ["flatland2d", "tracer3d"]}, []),
    "a scene too many": ({"scenes": ["FS4"], "worlds": []}, ["FS4"]),
    "the longer name only": ({"scenes": ["CB3"], "worlds": []}, ["CB3"]),
    "a number that begins alike": ({"scenes": ["FS10", "FS3"], "worlds": []}, ["FS10"]),
    "a world of several": ({"scenes": [], "worlds": ["toy1d", "tracer3d"]}, ["toy1d"]),
    "an only world": ({"scenes": [], "worlds": ["toy1d"]}, []),
}


@pytest.mark.parametrize(("row", "lacking"), NAMED.values(), ids=NAMED)
def test_a_criterion_names_the_scenes_and_worlds_of_its_row(row, lacking):
    assert coverage.missing(ROW | row) == lacking


def test_a_criterion_that_names_fewer_scenes_is_a_problem(tmp_path, capsys):
    here = project(tmp_path, claims=[claim() | {"scenes": ["FS1"]}])
    assert figures(here, "audit", "--out", tmp_path / "none") == 1
    assert "DEMO-C01: sentence and criterion do not name FS1" in capsys.readouterr().out


def test_a_void_comparison_is_a_problem(tmp_path, capsys):
    here = project(tmp_path, "void")
    assert figures(here, "run", "--out", tmp_path / "out") == 1
    capsys.readouterr()
    assert figures(here, "audit", "--out", tmp_path / "out") == 1
    assert "DEMO-F08 crashed: figures.claims.criteria.Void" in capsys.readouterr().out


def test_an_unexpected_verdict_is_a_problem(tmp_path, capsys):
    here = project(tmp_path, "sound", claims=[claim(quick="refuted")])
    assert figures(here, "run", "--out", tmp_path / "out") == 1
    capsys.readouterr()
    assert figures(here, "audit", "--out", tmp_path / "out") == 1
    assert "DEMO-C01: reproduced at preset quick, expected refuted" in capsys.readouterr().out


def test_a_project_in_which_all_fits_passes(tmp_path, capsys):
    here = project(tmp_path, "sound", claims=[claim(paper="reproduced")])
    assert figures(here, "run", "--preset", "paper", "--out", tmp_path / "paper") == 0
    assert figures(here, "keep", "--out", tmp_path / "paper") == 0
    assert figures(here, "run", "--out", tmp_path / "out") == 0
    capsys.readouterr()
    assert figures(here, "audit", "--out", tmp_path / "out") == 0
    assert capsys.readouterr().out == "nothing to mend\n"


# ---------------------------------------------------------------- who shows a claim


def listed(here, out, capsys):
    capsys.readouterr()
    assert figures(here, "ledger", "--json", "--out", out) == 0
    return {row["id"]: row for row in json.loads(capsys.readouterr().out)}


@pytest.fixture
def shown(tmp_path, capsys):
    """Rows of a ledger that tests, evidence and a benchmark show in part."""
    worlds = {"worlds": ["toy1d", "flatland2d", "tracer3d"]}
    here = project(tmp_path, claims=[claim("A-1") | worlds, claim("A-2") | {"worlds": ["flatland2d"]}, claim("A-3")])
    (tmp_path / "tests" / "oracle").mkdir()
    (tmp_path / "tests" / "oracle" / "test_x.py").write_text(
        "import pytest\n@pytest.mark.claims('A-1', part='finite cells')\ndef test_f(): pass\n"
    )
    rows = [{"claims": "A-1, A-2", "holds": True}, {"claims": "A-3", "holds": False}, {"claims": "", "holds": True}]
    (tmp_path / "benchmarks").mkdir()
    (tmp_path / "benchmarks" / "evidence.json").write_text(json.dumps({"means": {"rows": rows}}))
    (tmp_path / "benchmarks" / "bench_x.py").write_text("Row('speed', 3, least=2, claims='A-2')\n")
    return listed(here, tmp_path / "none", capsys)


def test_a_row_is_shown_world_by_world(shown):
    assert shown["A-1"]["worlds"] == {"toy1d": "part", "flatland2d": "whole"}
    assert shown["A-1"]["missing"] == ["tracer3d"]
    (part,) = shown["A-1"]["parts"]
    assert part == {"by": "tests/oracle/test_x.py::test_f", "world": "toy1d", "part": "finite cells"}


def test_evidence_and_benchmarks_show_rows(shown):
    assert (shown["A-1"]["evidence"], shown["A-1"]["benchmark"]) == (["means"], [])
    assert (shown["A-2"]["evidence"], shown["A-2"]["benchmark"]) == (["means"], ["benchmarks/bench_x.py"])


def test_evidence_that_does_not_hold_shows_nothing(shown):
    assert shown["A-3"]["evidence"] == []
    assert shown["A-3"]["missing"] == ["toy1d"]


# ---------------------------------------------------------------- our own


def test_our_own_criteria_name_the_scenes_and_worlds_of_their_rows():
    assert list(audit.criteria(ledger.load(Project().ledger))) == []
