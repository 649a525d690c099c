"""Laws of a run's results: the same bytes for any number of workers, after any interruption, at any time."""

import os
import signal
import subprocess
import time
from pathlib import Path

import numpy as np
import pytest

from tests.figures.demos import sound
from tests.figures.project import arrays, figures, project, stuck

PATIENCE = 60  # seconds until a process that hangs is a failure


def until(condition):
    """Wait for a condition of another process."""
    end = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.01)


def interrupted(here, stop, *words):
    """The status and words of a run that is stopped once five chunks stand there; `--out` comes last."""
    with stuck(here, *words) as run:
        until(lambda: len(list(words[-1].rglob("chunks/*.npz"))) == 5)
        stop(run)
        _, said = run.communicate(timeout=PATIENCE)
    return run.returncode, said


def ctrl_c(run):
    """What a terminal does: the signal goes to the run and to its workers."""
    os.killpg(run.pid, signal.SIGINT)


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A project with a figure that may be stuck, and the arrays of its uninterrupted run."""
    place = tmp_path_factory.mktemp("whole")
    here = project(place, "stuck", "sound")
    assert figures(here, "run", "--jobs", 2, "--out", place / "whole") == 0
    return here, arrays(place / "whole")


def test_one_worker_stores_what_two_store(tmp_path, whole):
    here, expected = whole
    assert figures(here, "run", "DEMO-F01", "--out", tmp_path) == 0
    assert arrays(tmp_path) == {name: data for name, data in expected.items() if "F01" in name}


def test_another_seed_stores_something_else(tmp_path, whole):
    here, expected = whole
    assert figures(here, "run", "DEMO-F01", "--seed", 1, "--out", tmp_path) == 0
    assert all(data != expected[name] for name, data in arrays(tmp_path).items())


@pytest.mark.parametrize("jobs", [1, 2])
def test_after_kill_9_the_same_command_goes_on_and_ends_in_the_same_bytes(tmp_path, whole, jobs):
    here, expected = whole
    words = ("run", "--jobs", jobs, "--out", tmp_path)
    status, _ = interrupted(here, subprocess.Popen.kill, *words)
    assert status == -signal.SIGKILL
    before = {path: path.stat().st_mtime_ns for path in tmp_path.rglob("chunks/*.npz")}
    assert len(before) == 5
    assert figures(here, *words) == 0
    assert arrays(tmp_path) == expected
    assert all(path.stat().st_mtime_ns == stamp for path, stamp in before.items())
    assert not list(tmp_path.rglob("*.part"))


def test_ctrl_c_is_answered_clearly_and_loses_nothing(tmp_path, whole):
    here, expected = whole
    words = ("run", "--jobs", 2, "--out", tmp_path)
    status, said = interrupted(here, ctrl_c, *words)
    assert status == 130
    assert "the same command goes on from there" in said
    assert "Traceback" not in said
    assert "Ended early" in (tmp_path / "index.html").read_text()
    assert figures(here, *words) == 0
    assert arrays(tmp_path) == expected


@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="needs /proc to see child processes")
def test_no_worker_outlives_a_killed_run(tmp_path, whole):
    with stuck(whole[0], "run", "--jobs", 2, "--out", tmp_path) as run:
        until(lambda: list(tmp_path.rglob("chunks/*.npz")))
        children = Path(f"/proc/{run.pid}/task/{run.pid}/children").read_text().split()
        assert len(children) >= 2
        run.kill()
        until(lambda: not any(alive(child) for child in children))


def alive(pid):
    """Whether a process runs; what only waits to be reaped does not."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


# ---------------------------------------------------------------- what stands there already


@pytest.fixture
def sane(done):
    """A finished run: its project, its folder, its arrays."""
    here, out = done
    return here, out, arrays(out)


def spoil(path):
    path.write_bytes(path.read_bytes()[:300])


def pickle_into(path):
    np.savez(path, x=np.array([os.getcwd], dtype=object), allow_pickle=True)


@pytest.mark.parametrize("damage", [spoil, pickle_into, lambda path: path.write_bytes(b"")])
def test_a_damaged_chunk_is_set_aside_and_computed_again(sane, capsys, damage):
    here, out, expected = sane
    chunk = out / "DEMO-F01" / "chunks" / "001.npz"
    damage(chunk)
    assert figures(here, "run", "--out", out) == 0
    assert "001.npz is damaged" in capsys.readouterr().err
    assert chunk.with_name("001.npz.corrupt").exists()
    assert arrays(out) == expected


@pytest.mark.parametrize(
    ("words", "differs"),
    [
        (("--seed", 5), "seed is 20220711 there and 5 now"),
        (("--preset", "paper"), 'preset is "quick" there and "paper" now'),
    ],
)
def test_chunks_of_another_run_are_refused_and_kept(sane, capsys, words, differs):
    here, out, expected = sane
    (out / "DEMO-F01" / "arrays.npz").unlink()
    assert figures(here, "run", "--out", out, *words) == 2
    said = capsys.readouterr().err
    assert str(out / "DEMO-F01" / "chunks" / "000.npz") in said
    assert differs in said
    assert "--out" in said
    assert arrays(out).items() < expected.items()


def test_chunks_of_another_version_are_refused(sane, capsys, monkeypatch):
    here, out, _ = sane
    monkeypatch.setattr(sound, "FIGURE", sound.figure(version=2))
    assert figures(here, "run", "--out", out) == 2
    assert "version is 1 there and 2 now" in capsys.readouterr().err


@pytest.mark.parametrize("name", ["chunks/001.npz", "chunks/notes.txt", "chunks/007.npz", "arrays.npz"])
def test_somebody_elses_file_is_refused_and_kept(sane, capsys, name):
    here, out, _ = sane
    path = out / "DEMO-F01" / name
    with path.open("wb") as file:
        np.savez(file, x=np.ones(3))
    before = path.read_bytes()
    assert figures(here, "run", "--out", out) == 2
    assert f"{path} is not a part of this run" in capsys.readouterr().err
    assert path.read_bytes() == before


def test_missing_results_are_made_anew_from_the_chunks(sane):
    here, out, expected = sane
    pictures = {path.name: path.read_bytes() for path in out.glob("DEMO-F01/figure.*")}
    for path in (out / "DEMO-F01").glob("*.*"):
        path.unlink()
    assert figures(here, "run", "--out", out) == 0
    assert arrays(out) == expected
    assert {path.name: path.read_bytes() for path in out.glob("DEMO-F01/figure.*")} == pictures


def test_leftovers_of_a_killed_run_are_swept(sane):
    here, out, expected = sane
    for folder in (out, out / "DEMO-F01", out / "DEMO-F01" / "chunks"):
        (folder / ".x.abc.part").write_bytes(b"half")
    assert figures(here, "run", "--out", out) == 0
    assert not list(out.rglob("*.part"))
    assert arrays(out) == expected


def test_a_full_disk_is_told_and_the_run_goes_on_later(tmp_path, capsys, monkeypatch):
    here, out = project(tmp_path, "sound"), tmp_path / "out"
    assert figures(here, "run", "--out", tmp_path / "whole") == 0
    with monkeypatch.context() as patch:
        patch.setattr(os, "fsync", Full(room=5))
        assert figures(here, "run", "--out", out) == 2
    assert "No space left on device" in capsys.readouterr().err
    stored = arrays(out)
    assert stored
    assert figures(here, "run", "--out", out) == 0
    assert stored.items() < arrays(out).items()
    assert arrays(out) == arrays(tmp_path / "whole")


class Full:
    """A disk with room for some files."""

    def __init__(self, room):
        self.room = room

    def __call__(self, _):
        self.room -= 1
        if self.room < 0:
            raise OSError(28, "No space left on device")
