"""Laws of kept paper runs: filed figure by figure, stale when their own code changes, and nothing drops a part."""

import json

import pytest

from figures.claims import ledger
from figures.claims.errors import FigureError
from figures.engine import code, kept, registry
from figures.project import Project
from tests.figures.demos.dropping import DROPPING
from tests.figures.project import claim, figures, project

PAPER = ("run", "--preset", "paper", "--out")


@pytest.fixture
def here(tmp_path):
    """A project whose only figure has been run at the paper preset and kept."""
    made = project(tmp_path, "dropping", claims=[claim(quick="not judged", paper="reproduced")])
    assert figures(made, *PAPER, tmp_path / "paper") == 0
    assert figures(made, "keep", "--out", tmp_path / "paper") == 0
    return made


def entries(here):
    return registry.load(here.modules)


def test_a_kept_run_holds_its_checks_with_commit_and_digests(here):
    (found,) = kept.read(here.paper).values()
    assert [(check["part"], check["verdict"]) for check in found.checks] == [
        ("mean", "reproduced"),
        ("spread", "reproduced"),
    ]
    assert found.commit
    assert found.chunks == code.digest("tests.figures.demos.dropping", "toy1d")


def test_a_quick_run_is_not_kept(here, tmp_path, capsys):
    assert figures(here, "run", "--out", tmp_path / "out") == 0
    before = here.paper.read_bytes()
    capsys.readouterr()
    assert figures(here, "keep", "--out", tmp_path / "out") == 0
    assert "DEMO-F09: done at preset quick" in capsys.readouterr().out
    assert here.paper.read_bytes() == before


def test_an_unfinished_figure_is_passed_over(tmp_path, capsys):
    here = project(tmp_path, "sound", "dropping")
    assert figures(here, *PAPER, tmp_path / "paper", "DEMO-F09") == 0
    capsys.readouterr()
    assert figures(here, "keep", "--out", tmp_path / "paper") == 0
    assert "DEMO-F01: not here" in capsys.readouterr().out
    assert list(kept.read(here.paper)) == ["DEMO-F09"]


def test_a_quick_run_that_drops_a_part_is_noticed(here, tmp_path, monkeypatch, capsys):
    assert figures(here, "run", "--out", tmp_path / "out") == 0
    assert figures(here, "audit", "--out", tmp_path / "out") == 0
    monkeypatch.setenv(DROPPING, "1")
    capsys.readouterr()
    assert figures(here, "run", "--out", tmp_path / "out") == 1
    assert "DEMO-F09 at preset quick drops a part of DEMO-C01, 'spread'" in capsys.readouterr().out
    assert figures(here, "audit", "--out", tmp_path / "out") == 1


def test_a_run_is_compared_with_what_the_ledger_expects_of_the_paper_preset(here, tmp_path, capsys):
    project(tmp_path, "dropping", claims=[claim(quick="not judged", paper="refuted")])
    capsys.readouterr()
    assert figures(here, "run", "--out", tmp_path / "out") == 1
    assert "expects 'refuted' at the paper preset, the kept run found 'reproduced'" in capsys.readouterr().out
    assert "expects &#x27;refuted&#x27;" in (tmp_path / "out" / "index.html").read_text()


def test_a_part_that_is_not_judged_makes_the_claim_not_judged(here, tmp_path):
    assert figures(here, "run", "--out", tmp_path / "out") == 0
    (row,) = json.loads((tmp_path / "out" / "verdicts.json").read_text())["verdicts"]
    assert row["verdict"] == "not judged"
    assert "not judged in quick" in (tmp_path / "out" / "index.html").read_text()


@pytest.mark.parametrize(("name", "stale", "older"), [("own", True, False), ("digest", False, True)])
def test_a_kept_run_is_stale_when_its_own_code_changes_and_older_when_theory_does(
    here, monkeypatch, name, stale, older
):
    runs = kept.read(here.paper)
    assert not list(kept.stale(runs, entries(here)))
    assert not kept.older(runs, entries(here))
    monkeypatch.setattr(code, name, lambda *_: "0123456789abcdef")
    assert bool(list(kept.stale(runs, entries(here)))) == stale
    assert bool(kept.older(runs, entries(here))) == older


def test_a_figure_without_a_kept_run_is_named(tmp_path):
    assert kept.missing({}, entries(project(tmp_path, "sound"))) == ["DEMO-F01"]


@pytest.mark.parametrize("text", ["{", '{"format": 2}', '{"format": 1, "figures": {"A-1": {}}}'])
def test_a_damaged_file_of_kept_runs_is_named(tmp_path, text):
    (tmp_path / "paper.json").write_text(text)
    with pytest.raises(FigureError, match=r"paper\.json is damaged"):
        kept.read(tmp_path / "paper.json")


# ---------------------------------------------------------------- our own


def test_our_own_ledger_expects_what_our_own_kept_runs_found():
    mine = Project()

    assert list(kept.unexpected(kept.read(mine.paper), registry.load(mine.modules), ledger.load(mine.ledger))) == []


def test_our_own_ledger_expects_nothing_of_the_paper_preset_that_no_kept_run_found():
    mine = Project()

    found = kept.verdicts(kept.read(mine.paper), registry.declared(registry.load(mine.modules)))
    expected = {id_: row.expected["paper"] for id_, row in ledger.load(mine.ledger).items()}
    assert {id_: verdict for id_, verdict in expected.items() if verdict is not None and id_ not in found} == {}
