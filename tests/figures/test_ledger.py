"""Laws of the ledger: sound rows, marks of tests found wherever they stand, unknown ids named with their place."""

import json
import textwrap

import pytest

from figures.claims import ledger, scan
from figures.claims.errors import FigureError
from figures.claims.figure import PRESETS
from figures.claims.showings import world_of
from figures.engine import registry
from figures.project import Project
from tests.figures.project import claim, figures, project

KNOWN = ("A-1", "A-2", "A-3")


def marked(tmp_path, text):
    """Claim -> tests, for one test file with this text."""
    folder = tmp_path / "tests" / "deep"
    folder.mkdir(parents=True)
    (folder / "test_x.py").write_text("import pytest\n" + textwrap.dedent(text))
    found = scan.marks_by_claim(tmp_path / "tests", KNOWN)
    return {id_: [mark.test for mark in marks] for id_, marks in found.items() if marks}


X = "tests/deep/test_x.py"
MARKED = {
    "a function": (
        """
        @pytest.mark.claims("A-1", "A-2")
        def test_f(): pass
        """,
        {"A-1": [f"{X}::test_f"], "A-2": [f"{X}::test_f"]},
    ),
    "an async function under another mark": (
        """
        @pytest.mark.slow
        @pytest.mark.claims("A-1")
        async def test_f(): pass
        """,
        {"A-1": [f"{X}::test_f"]},
    ),
    "a class": (
        """
        @pytest.mark.claims("A-1")
        class TestC:
            def test_f(self): pass
            @pytest.mark.claims("A-2")
            def test_g(self): pass
            def helper(self): pass
        """,
        {"A-1": [f"{X}::TestC::test_f", f"{X}::TestC::test_g"], "A-2": [f"{X}::TestC::test_g"]},
    ),
    "a module": (
        """
        pytestmark = pytest.mark.claims("A-1")
        def test_f(): pass
        def helper(): pass
        """,
        {"A-1": [f"{X}::test_f"]},
    ),
    "a module, in a list": (
        """
        pytestmark: list = [pytest.mark.slow, pytest.mark.claims("A-1"), pytest.mark.claims("A-2")]
        class TestC:
            pytestmark = pytest.mark.claims("A-3")
            def test_f(self): pass
        """,
        {id_: [f"{X}::TestC::test_f"] for id_ in KNOWN},
    ),
    "a parameter": (
        """
        @pytest.mark.parametrize("x", [1, pytest.param(2, marks=[pytest.mark.claims("A-1")])])
        def test_f(x): pass
        """,
        {"A-1": [f"{X}::test_f"]},
    ),
    "a table of parameters and a name for the mark": (
        """
        claims = pytest.mark.claims
        TABLE = [pytest.param(2, marks=claims("A-1"))]
        @pytest.mark.parametrize("x", TABLE)
        def test_f(x): pass
        @claims("A-2")
        def test_g(): pass
        """,
        {"A-1": [f"{X}::test_f"], "A-2": [f"{X}::test_g"]},
    ),
    "an imported mark": (
        """
        from pytest import mark
        @mark.claims("A-1")
        def test_f(): pass
        """,
        {"A-1": [f"{X}::test_f"]},
    ),
    "nothing": ("def test_f(): pass\ndef claims(x): pass\ny = claims('A-9')\n", {}),
}


@pytest.mark.parametrize(("text", "expected"), MARKED.values(), ids=MARKED)
def test_marks_are_found_wherever_they_stand(tmp_path, text, expected):
    assert marked(tmp_path, text) == expected


BAD = {
    "test_x.py:2: tests/deep/test_x.py::test_f is marked with unknown claim 'A-9'": (
        "@pytest.mark.claims('A-9')\ndef test_f(): pass\n"
    ),
    "test_x.py:2: the claims of tests/deep/test_x.py::test_f must be plain string literals": (
        "@pytest.mark.claims(*IDS)\ndef test_f(): pass\n"
    ),
    "cannot read the marks of tests/deep/test_x.py": "def test_f(:\n",
}


@pytest.mark.parametrize("words", BAD)
def test_a_bad_mark_is_named_with_its_place(tmp_path, words):
    with pytest.raises(FigureError) as error:
        marked(tmp_path, BAD[words])
    assert words in str(error.value)


def of_text(tmp_path, place, text):
    """The marks of one test file."""
    path = tmp_path / "tests" / place
    path.parent.mkdir(parents=True)
    path.write_text("import pytest\n" + textwrap.dedent(text))
    return list(scan.marks(tmp_path / "tests"))


@pytest.mark.parametrize(
    ("place", "said", "world", "part"),
    [
        ("oracle/test_x.py", "", "toy1d", ""),
        ("flatland/test_x.py", "", "flatland2d", ""),
        ("test_x.py", "", "unit", ""),
        ("oracle/test_x.py", ", part='finite cells'", "toy1d", "finite cells"),
        ("transport/test_x.py", ", world='tracer3d'", "tracer3d", ""),
    ],
)
def test_a_mark_has_a_world_and_may_show_a_part(tmp_path, place, said, world, part):
    (mark,) = of_text(tmp_path, place, f"@pytest.mark.claims('A-1'{said})\ndef test_f(): pass\n")
    assert (mark.world, mark.part) == (world, part)


def test_a_mark_with_another_keyword_is_named(tmp_path):
    with pytest.raises(FigureError, match="with part= and world= at most"):
        of_text(tmp_path, "test_x.py", "@pytest.mark.claims('A-1', parts='x')\ndef test_f(): pass\n")


# ---------------------------------------------------------------- the file


def test_a_ledger_is_read_in_order(tmp_path):
    here = project(tmp_path, claims=[claim("A-2"), claim("A-1", quick=None)])
    rows = ledger.load(here.ledger)
    assert list(rows) == ["A-2", "A-1"]
    assert rows["A-2"].expected == {"quick": "reproduced", "paper": None}


DAMAGES = {
    "cannot be read": "{",
    "is not": "[]",
    "needs the texts": '{"format": 1, "claims": [{}]}',
    "expected needs": json.dumps({"format": 1, "claims": [claim() | {"expected": {"quick": None}}]}),
    "'fine' is none of": json.dumps({"format": 1, "claims": [claim(quick="fine")]}),
    "'DEMO-C01' stands there twice": json.dumps({"format": 1, "claims": [claim(), claim()]}),
}


@pytest.mark.parametrize("words", DAMAGES)
def test_a_damaged_ledger_is_named(tmp_path, words):
    path = tmp_path / "ledger.json"
    path.write_text(DAMAGES[words])
    with pytest.raises(FigureError) as error:
        ledger.load(path)
    assert words in str(error.value)
    assert str(path) in str(error.value)


# ---------------------------------------------------------------- the command


def test_the_ledger_joins_claims_tests_figures_and_verdicts(tmp_path, capsys):
    here = project(tmp_path, "sound")
    (tmp_path / "tests" / "test_x.py").write_text(
        "import pytest\n@pytest.mark.claims('DEMO-C01')\ndef test_f(): pass\n"
    )
    assert figures(here, "run", "--out", tmp_path / "out") == 0
    capsys.readouterr()
    assert figures(here, "ledger", "--json", "--out", tmp_path / "out") == 0
    first, second = json.loads(capsys.readouterr().out)
    assert first == {
        "id": "DEMO-C01",
        "class": "A",
        "tests": ["tests/test_x.py::test_f"],
        "figures": ["DEMO-F01"],
        "evidence": [],
        "benchmark": [],
        "worlds": {"toy1d": "whole"},
        "missing": [],
        "parts": [],
        "scenes": [],
        "verdict": "reproduced",
        "paper": None,
        "sentence": "Sentence <DEMO-C01>.",
        "criterion": "0.5",
    }
    assert (second["tests"], second["figures"], second["verdict"]) == ([], [], None)


def test_without_results_there_is_no_verdict(tmp_path, capsys):
    assert figures(project(tmp_path), "ledger", "--json", "--out", tmp_path / "none") == 0
    assert {row["verdict"] for row in json.loads(capsys.readouterr().out)} == {None}


def test_the_ledger_is_a_table_too(tmp_path, capsys):
    assert figures(project(tmp_path), "ledger") == 0
    said = capsys.readouterr().out
    assert "2 claims: 0 with tests, 0 with figures, 0 with evidence, 0 with a benchmark" in said
    assert "toy1d: 0 shown, 0 in part, 2 missing" in said


def test_a_declared_claim_without_an_expected_verdict_is_listed(tmp_path):
    here = project(tmp_path, "sound")
    entries, rows = registry.load(here.modules).values(), ledger.load(here.ledger)
    assert list(ledger.unmeasured(rows, entries, "quick")) == []
    (problem,) = ledger.unmeasured(rows, entries, "paper")
    assert "DEMO-F01 declares DEMO-C01" in problem


# ---------------------------------------------------------------- our own


def test_evidence_shows_the_world_that_the_name_of_its_job_says():
    assert [world_of(job) for job in ("means", "space gradients", "witness")] == ["flatland2d", "tracer3d", "tracer3d"]


def test_our_own_figures_declare_claims_of_our_ledger_with_expected_verdicts():
    entries, rows = registry.load(Project().modules).values(), ledger.load(Project().ledger)
    assert list(ledger.unknown(rows, entries)) == []
    assert list(ledger.unmeasured(rows, entries, PRESETS[0])) == []


def test_our_own_tests_mark_claims_of_our_ledger():
    here = Project()
    assert scan.marks_by_claim(here.tests, ledger.load(here.ledger))
