"""Laws of failure: a figure that crashes is named with its traceback, and the others still run."""

import json

import numpy as np
import pytest

from tests.figures.demos import sound
from tests.figures.project import arrays, claim, figures, project


def fail(*_):
    raise ArithmeticError("a deliberate error")


BROKEN = {
    "chunks": sound.figure(chunks=fail),
    "chunks that are no plain data": sound.figure(chunks=lambda _: [{"x": {1, 2}}]),
    "compute of objects": sound.figure(compute=lambda *_, rng: {"x": np.array([rng])}),
    "compute of no dict": sound.figure(compute=lambda *_, rng: [1]),
    "combine": sound.figure(combine=fail),
    "draw": sound.figure(draw=fail),
    "check": sound.figure(check=fail),
    "check of undeclared claims": sound.figure(check=lambda _: []),
}


def stored(out, id_):
    return json.loads((out / id_ / "claims.json").read_text())


@pytest.mark.parametrize("jobs", [1, 2])
def test_the_others_still_run(tmp_path, capsys, jobs):
    here, out = project(tmp_path, "crashing", "sound"), tmp_path / "out"
    assert figures(here, "run", "--jobs", jobs, "--out", out) == 1
    assert "DEMO-F03 crashed" in capsys.readouterr().out
    assert stored(out, "DEMO-F01")["status"] == "done"
    assert "a deliberate error" in stored(out, "DEMO-F03")["traceback"]


def test_the_traceback_is_in_the_report_and_the_manifest(tmp_path):
    here, out = project(tmp_path, "crashing", "sound"), tmp_path / "out"
    figures(here, "run", "--out", out)
    assert "ArithmeticError: a deliberate error" in (out / "index.html").read_text()
    entry = json.loads((out / "manifest.json").read_text())["figures"]["DEMO-F03"]
    assert entry["status"] == "crashed"
    assert 'chunk 1, {"first":50}' in entry["traceback"]


@pytest.mark.parametrize("figure", BROKEN.values(), ids=BROKEN)
def test_every_function_of_a_figure_may_crash(tmp_path, monkeypatch, figure):
    monkeypatch.setattr(sound, "FIGURE", figure)
    here, out = project(tmp_path, "sound"), tmp_path / "out"
    assert figures(here, "run", "--out", out) == 1
    assert "Traceback" in stored(out, "DEMO-F01")["traceback"]


def test_a_figure_that_no_longer_crashes_is_taken_up_again(tmp_path, monkeypatch):
    here, out = project(tmp_path, "sound"), tmp_path / "out"
    with monkeypatch.context() as patch:
        patch.setattr(sound, "FIGURE", sound.figure(draw=fail))
        assert figures(here, "run", "--out", out) == 1
    assert figures(here, "run", "--out", out) == 0
    assert stored(out, "DEMO-F01")["status"] == "done"


def test_a_killed_worker_is_told_and_what_is_stored_stays(tmp_path, capsys):
    here, out = project(tmp_path, "sound", "killed"), tmp_path / "out"
    assert figures(here, "run", "--jobs", 2, "--out", out) == 1
    assert "a worker process was killed" in capsys.readouterr().err
    assert json.loads((out / "manifest.json").read_text())["figures"]["DEMO-F04"]["status"] == "incomplete"
    assert arrays(out)


def test_ctrl_c_between_chunks_loses_nothing(tmp_path, monkeypatch, capsys):
    def compute(preset, chunk, *, rng):
        if chunk["first"]:
            raise KeyboardInterrupt
        return sound.draws(preset, chunk, rng=rng)

    here, out = project(tmp_path, "sound"), tmp_path / "out"
    with monkeypatch.context() as patch:
        patch.setattr(sound, "FIGURE", sound.figure(compute=compute))
        assert figures(here, "run", "--out", out) == 130
    assert "interrupted" in capsys.readouterr().err
    assert list(arrays(out)) == ["DEMO-F01/chunks/000.npz"]
    assert figures(here, "run", "--out", out) == 0


@pytest.mark.parametrize(("expected", "status"), [("refuted", 0), ("reproduced", 1), ("not reproduced", 1), (None, 0)])
def test_the_exit_status_tells_whether_verdicts_are_as_expected(tmp_path, capsys, expected, status):
    here = project(tmp_path, "refuted", claims=[claim("DEMO-C02", quick=expected)])
    assert figures(here, "run", "--out", tmp_path / "out") == status
    assert ("DIFFERS" in capsys.readouterr().out) == bool(status)


def test_a_verdict_of_an_earlier_run_does_not_fail_this_one(tmp_path):
    here, out = project(tmp_path, "refuted", "sound"), tmp_path / "out"
    assert figures(here, "run", "--out", out) == 0
    worse = project(tmp_path, "refuted", "sound", claims=[claim(), claim("DEMO-C02", quick="reproduced")])
    assert figures(worse, "run", "DEMO-F01", "--out", out) == 0
    assert figures(worse, "run", "DEMO-F05", "--out", out) == 1
