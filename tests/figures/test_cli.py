"""Laws of the command: bad input names the value and the remedy, and ends with 2."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from figures.cli import main
from figures.engine import outdir
from figures.project import ROOT, Project
from tests.figures.demos import sound
from tests.figures.project import claim, figures, project


@pytest.fixture
def here(tmp_path):
    return project(tmp_path, "sound", "refuted")


def refused(capsys, here, *words):
    """What a refused command says."""
    assert figures(here, *words) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.startswith("figures: error: ")
    return said.err


def test_list_names_every_figure(here, capsys):
    assert figures(here, "list") == 0
    assert "DEMO-F01" in capsys.readouterr().out
    assert figures(here, "list", "--json") == 0
    first, second = json.loads(capsys.readouterr().out)
    assert first["id"], second["id"] == ("DEMO-F01", "DEMO-F05")
    assert first.keys() == {"id", "title", "world", "source", "claims", "presets", "module"}


@pytest.mark.parametrize(
    ("id_", "hint"),
    [("DEMO-F1", "did you mean DEMO-F01"), ("demo-f05", "did you mean DEMO-F05"), ("xyz", "known are DEMO-F01")],
)
def test_an_unknown_figure_is_named_with_its_neighbours(here, tmp_path, capsys, id_, hint):
    said = refused(capsys, here, "run", "DEMO-F01", id_, "--out", tmp_path / "out")
    assert repr(id_) in said
    assert hint in said
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    "words",
    [("--preset", "huge"), ("--jobs", "-1"), ("--jobs", "two"), ("--seed", "-3"), ("--seed", "1.5"), ("--nope",)],
)
def test_a_bad_option_is_named(here, capsys, words):
    with pytest.raises(SystemExit, match="2"):
        figures(here, "run", *words)
    assert words[-1] in capsys.readouterr().err


@pytest.mark.parametrize("jobs", ["0", "auto"])
def test_all_cores_may_be_asked_for(tmp_path, jobs):
    here = project(tmp_path, "sound")
    assert figures(here, "run", "--jobs", jobs, "--out", tmp_path / "out") == 0


@pytest.mark.parametrize(("mode", "words"), [("bar", "3/3"), ("log", "chunk 3 of 3"), ("auto", "chunk 3 of 3")])
def test_progress_is_a_bar_or_lines(tmp_path, capsys, mode, words):
    here = project(tmp_path, "sound")
    assert figures(here, "run", "--progress", mode, "--out", tmp_path / "out") == 0
    assert words in capsys.readouterr().err


@pytest.mark.parametrize("command", ["list", "run", "report", "ledger"])
def test_every_command_explains_itself(command, capsys):
    with pytest.raises(SystemExit, match="0"):
        main([command, "--help"])
    assert command in capsys.readouterr().out


def test_the_module_is_the_command():
    done = subprocess.run(
        [sys.executable, "-m", "figures", "list", "--json"], cwd=ROOT, capture_output=True, text=True, check=True
    )
    assert isinstance(json.loads(done.stdout), list)


# ---------------------------------------------------------------- the folder of results


def test_a_file_is_no_folder(here, tmp_path, capsys):
    (tmp_path / "out").write_text("mine")
    assert f"--out {tmp_path / 'out'} is not a folder" in refused(capsys, here, "run", "--out", tmp_path / "out")
    assert (tmp_path / "out").read_text() == "mine"


def test_a_folder_below_a_file_cannot_be_written(here, tmp_path, capsys):
    (tmp_path / "file").write_text("mine")
    said = refused(capsys, here, "run", "--out", tmp_path / "file" / "out")
    assert "cannot write" in said
    assert "--out" in said


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may write everywhere")
def test_a_read_only_folder_cannot_be_written(here, tmp_path, capsys):
    (tmp_path / "out").mkdir(mode=0o500)
    assert "cannot write" in refused(capsys, here, "run", "--out", tmp_path / "out")


@pytest.mark.skipif(not Path("/proc/self").is_dir(), reason="needs a file system that nobody may write")
def test_a_folder_nobody_may_write_is_refused(here, capsys):
    assert "cannot write /proc/self/out" in refused(capsys, here, "run", "--out", "/proc/self/out")


def test_a_foreign_tree_is_refused_and_left_alone(here, tmp_path, capsys):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "thesis.tex").write_text("mine")
    said = refused(capsys, here, "run", "--out", tmp_path / "out")
    assert "thesis.tex" in said
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["thesis.tex"]


def test_another_programs_manifest_is_refused(here, tmp_path, capsys):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "manifest.json").write_text('{"name": "an extension of a browser"}')
    assert "belongs to another program" in refused(capsys, here, "run", "--out", tmp_path / "out")


def test_a_damaged_manifest_is_set_aside(done, capsys):
    here, out = done
    (out / "manifest.json").write_text("{")
    assert figures(here, "run", "DEMO-F01", "--out", out) == 0
    assert "manifest.json is damaged" in capsys.readouterr().err


def test_our_own_folder_may_hold_notes(done):
    here, out = done
    (out / "notes.txt").write_text("mine")
    assert figures(here, "run", "DEMO-F01", "--out", out) == 0


def test_two_runs_do_not_write_to_one_folder(here, tmp_path, capsys):
    pytest.importorskip("fcntl")
    with outdir.opened(tmp_path / "out", (), print):
        assert "another run is writing" in refused(capsys, here, "run", "--out", tmp_path / "out")


def test_earlier_figures_stay_in_manifest_and_verdicts(here, tmp_path):
    for id_ in ("DEMO-F01", "DEMO-F05"):
        assert figures(here, "run", id_, "--out", tmp_path / "out") == 0
    manifest = json.loads((tmp_path / "out" / "manifest.json").read_text())
    assert list(manifest["figures"]) == ["DEMO-F01", "DEMO-F05"]
    assert {"python", "numpy", "scipy", "matplotlib"} <= manifest["versions"].keys()
    assert {"preset", "seed", "jobs", "started", "finished", "git", "platform"} <= manifest.keys()
    verdicts = json.loads((tmp_path / "out" / "verdicts.json").read_text())["verdicts"]
    assert [(row["id"], row["verdict"]) for row in verdicts] == [("DEMO-C01", "reproduced"), ("DEMO-C02", "refuted")]


# ---------------------------------------------------------------- the registry


def test_a_module_that_cannot_be_imported_is_named(tmp_path, capsys):
    assert "tests.figures.demos.missing" in refused(capsys, project(tmp_path, "missing"), "list")


def test_an_id_in_two_modules_is_refused(tmp_path, capsys):
    assert "is in both" in refused(capsys, project(tmp_path, "sound", "sound"), "list")


def test_an_empty_registry_has_nothing_to_run(tmp_path, capsys):
    assert "no figures yet" in refused(capsys, project(tmp_path), "run", "--out", tmp_path / "out")


FAULTS = {
    "must look like GRIS-F02": {"id": "../F01"},
    "presets are": {"presets": {"quick": {}}},
    "repeat an id": {"claims": ("DEMO-C01", "DEMO-C01")},
    "is not plain JSON data": {"presets": sound.SIZES | {"quick": {"n": {1}}}},
}


@pytest.mark.parametrize("words", FAULTS)
def test_a_figure_declared_badly_is_refused(tmp_path, capsys, monkeypatch, words):
    monkeypatch.setattr(sound, "FIGURE", sound.figure(**FAULTS[words]))
    assert words in refused(capsys, project(tmp_path, "sound"), "list")


def test_a_claim_the_ledger_lacks_is_named_with_its_figure(tmp_path, capsys):
    here = project(tmp_path, "sound", claims=[claim("DEMO-C09")])
    said = refused(capsys, here, "run", "--out", tmp_path / "out")
    assert "demos.sound: DEMO-F01 declares claim 'DEMO-C01'" in said
    assert "demos.sound: DEMO-F01 declares claim 'DEMO-C01'" in refused(capsys, here, "ledger")


def test_listing_and_workers_do_without_matplotlib():
    code = "import sys, figures.cli, tests.figures.demos.sound; print('matplotlib' in sys.modules)"
    assert subprocess.check_output([sys.executable, "-c", code], cwd=ROOT, text=True).strip() == "False"


def test_a_missing_ledger_is_named(tmp_path, capsys):
    here = Project((), tmp_path / "none.json", tmp_path)
    assert "there is no ledger of claims at" in refused(capsys, here, "ledger")
