"""Laws of a run on a Dask cluster: the bytes of a run without one, or an error that names worker and remedy."""

import json
import logging
import os
import signal
import subprocess
import sys
import threading
import time
from contextlib import contextmanager
from importlib.util import find_spec

import pytest

from figures.claims.errors import FigureError
from figures.engine import cluster, jobs, preflight
from figures.engine.registry import load
from figures.project import ROOT
from tests.figures.demos import strange
from tests.figures.demos.stuck import STUCK
from tests.figures.project import arrays, figures, project
from tests.figures.test_jobs import WORK

needs_dask = pytest.mark.skipif(find_spec("distributed") is None, reason="needs dask: pip install '.[dask]'")


@contextmanager
def local(workers):
    """A cluster of worker processes on this machine."""
    from distributed import LocalCluster  # noqa: PLC0415

    where = {"host": "127.0.0.1", "dashboard_address": "127.0.0.1:0"}
    with LocalCluster(n_workers=workers, threads_per_worker=1, **where) as running:
        yield running


@pytest.fixture(scope="module")
def two():
    """A cluster of two workers."""
    with local(2) as running:
        yield running


@pytest.fixture
def client(two):
    """Our own way to its workers."""
    from distributed import Client  # noqa: PLC0415

    with Client(two.scheduler_address, set_as_default=False) as client:
        yield client


@pytest.fixture(scope="module")
def serial(tmp_path_factory):
    """A project of figures, and the arrays that one process computes."""
    place = tmp_path_factory.mktemp("serial")
    here = project(place, "numerical")
    assert figures(here, "run", "--out", place / "out") == 0
    return here, arrays(place / "out")


@needs_dask
def test_serial_two_processes_and_dask_store_the_same_bytes(tmp_path, serial, two):
    here, expected = serial
    assert figures(here, "run", "--jobs", 2, "--out", tmp_path / "jobs") == 0
    assert figures(here, "run", "--dask", two.scheduler_address, "--out", tmp_path / "dask") == 0
    assert arrays(tmp_path / "jobs") == arrays(tmp_path / "dask") == expected
    manifest = json.loads((tmp_path / "dask" / "manifest.json").read_text())
    assert (manifest["jobs"], manifest["dask"]) == (2, two.scheduler_address)


@needs_dask
def test_a_crash_on_the_cluster_is_a_traceback_as_elsewhere(tmp_path, two):
    here = project(tmp_path, "crashing")
    assert figures(here, "run", "--dask", two.scheduler_address, "--out", tmp_path / "out") == 1
    entry = json.loads((tmp_path / "out" / "manifest.json").read_text())["figures"]["DEMO-F03"]
    assert "ArithmeticError: a deliberate error" in entry["traceback"]


# ---------------------------------------------------------------- before any work


def refused(capsys, *words):
    """What a refused run says; nothing is written."""
    here, out = project(words[-1], "sound"), words[-1] / "out"
    assert figures(here, "run", *words[:-1], "--out", out) == 2
    assert not out.exists()
    return capsys.readouterr().err


@needs_dask
@pytest.mark.parametrize("address", ["tcp://127.0.0.1:9", "nonsense", "tcp://no.such.host.invalid:8786", ""])
def test_an_address_where_nobody_answers_is_named_in_time(tmp_path, capsys, monkeypatch, address):
    monkeypatch.setattr(cluster, "TIMEOUT", 0.3)
    start = time.monotonic()
    said = refused(capsys, "--dask", address, tmp_path)
    assert f"--dask {address}: no Dask scheduler answers there" in said
    assert "dask scheduler" in said
    assert time.monotonic() - start < 5


@needs_dask
def test_a_cluster_without_workers_is_refused(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(cluster, "TIMEOUT", 0.3)
    with local(0) as empty:
        said = refused(capsys, "--dask", empty.scheduler_address, tmp_path)
    assert f"the cluster has no workers. Start some in this checkout: dask worker {empty.scheduler_address}" in said


@pytest.mark.parametrize("package", ["distributed", "threadpoolctl"])
def test_without_dask_the_remedy_is_named(tmp_path, capsys, monkeypatch, package):
    monkeypatch.setitem(sys.modules, package, None)
    assert "pip install '.[dask]'" in refused(capsys, "--dask", "tcp://127.0.0.1:9", tmp_path)


def test_processes_and_a_cluster_exclude_each_other(tmp_path, capsys):
    with pytest.raises(SystemExit, match="2"):
        figures(project(tmp_path, "sound"), "run", "--jobs", 2, "--dask", "tcp://127.0.0.1:9")
    assert "--dask" in capsys.readouterr().err


STRANGE = {
    "python": ("platform", "python_version", strange.other_version, "python is 0.9.9 there and 3."),
    "numpy": ("numpy", "__version__", "0.9.9", "numpy is 0.9.9 there"),
    "scipy": ("scipy", "__version__", "0.9.9", "scipy is 0.9.9 there"),
    "restir-ref": ("figures.engine.manifest", "version", strange.other_version, "restir-ref is 0.9.9 there"),
    "code": ("figures.engine.preflight", "_code", strange.other_code, "code of DEMO-F01 is 1 there and"),
    "threads": ("threadpoolctl", "threadpool_info", strange.four_threads, "BLAS threads is 4 there and 1 here"),
    "a package": ("figures.engine.preflight", "identity", strange.no_package, "No module named 'figures'"),
}


@contextmanager
def altered(client, what, **where):
    """Workers with something else in the place of a module's member."""
    module, name, value, _ = what
    client.run(strange.alter, module, name, value, **where)
    try:
        yield
    finally:
        client.run(strange.restore, module, name, **where)


@needs_dask
@pytest.mark.parametrize("what", STRANGE.values(), ids=STRANGE)
def test_a_worker_that_differs_is_refused_by_name_with_the_remedy(tmp_path, capsys, client, what):
    odd, _ = client.nthreads()
    with altered(client, what, workers=[odd]):
        said = refused(capsys, "--dask", client.scheduler.address, tmp_path)
    assert said.count("worker tcp") == 1
    assert f"worker {odd}" in said
    assert what[-1] in said
    assert "Remedy there: " in said


@needs_dask
def test_another_kind_of_processor_is_told(tmp_path, capsys, client):
    with altered(client, ("figures.engine.preflight", "arithmetic", strange.other_version, "")):
        words = ("run", "--dask", client.scheduler.address, "--out", tmp_path / "out")
        assert figures(project(tmp_path, "sound"), *words) == 0
    assert "another kind of processor" in capsys.readouterr().err


@needs_dask
def test_blas_keeps_to_one_thread_on_a_worker_that_had_more(client):
    client.run(strange.more_threads)
    if set(client.run(strange.blas_threads).values()) == {1}:
        pytest.skip("BLAS cannot have more threads here")
    with cluster.crew(client.scheduler.address, [], print):
        assert set(client.run(strange.blas_threads).values()) == {1}


@needs_dask
def test_a_stranger_that_joins_late_computes_nothing(client):
    with cluster.crew(client.scheduler.address, load(["tests.figures.demos.sound"]).values(), print) as crew:
        with altered(client, STRANGE["numpy"]), pytest.raises(jobs.Lost, match=r"numpy is 0\.9\.9 there"):
            list(done(crew))
        assert len(list(done(crew))) == 5


def done(crew):
    with crew.pool() as pool:
        yield from jobs.completed(pool, WORK, 2)


def test_many_strangers_are_counted():
    with pytest.raises(FigureError, match="a; b; c; and 2 more"):
        preflight.refuse(list("abcde"))
    preflight.refuse([])


def test_arithmetic_is_the_same_twice_and_not_that_of_others(monkeypatch):
    mine = preflight.arithmetic()
    assert preflight.arithmetic() == mine
    monkeypatch.setattr(preflight.np, "exp", lambda x: x**2)
    assert preflight.arithmetic() != mine


# ---------------------------------------------------------------- workers that are lost


@contextmanager
def once_stored(chunks, out, act):
    """Do something, in a thread, as soon as so many chunks stand there."""
    over = threading.Event()

    def wait():
        while len(list(out.rglob("chunks/*.npz"))) < chunks and not over.is_set():
            time.sleep(0.01)
        act()

    thread = threading.Thread(target=wait)
    thread.start()
    yield
    over.set()
    thread.join()


@needs_dask
def test_one_worker_lost_is_told_and_changes_no_byte(tmp_path, capsys, serial, client, monkeypatch):
    monkeypatch.setattr(cluster, "GLANCE", 0.02)
    here, expected = serial
    victim, pid = next(iter(client.run(os.getpid).items()))
    with once_stored(3, tmp_path, lambda: os.kill(pid, signal.SIGKILL)):
        assert figures(here, "run", "--dask", client.scheduler.address, "--out", tmp_path) == 0
    assert f"worker {victim} of the cluster is lost: others take over its chunks" in capsys.readouterr().err
    assert arrays(tmp_path) == expected


@needs_dask
def test_a_chunk_that_kills_every_worker_is_told_and_what_is_stored_stays(tmp_path, capsys, two):
    here, out = project(tmp_path, "sound", "killed"), tmp_path / "out"
    two.scheduler.allowed_failures = 1
    assert figures(here, "run", "--dask", two.scheduler_address, "--out", out) == 1
    said = capsys.readouterr().err
    assert "a chunk killed 2 workers of the cluster" in said
    assert "the same command goes on from there" in said
    assert arrays(out)  # how many, depends on which worker was killed first


@contextmanager
def stuck_worker(address):
    """One worker without a nanny, on which only five chunks ever end."""
    command = [sys.executable, "-m", "dask", "worker", address, "--no-nanny", "--no-dashboard", "--nthreads", "1"]
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    with subprocess.Popen(command, cwd=ROOT, env=os.environ | {STUCK: "1"}, **quiet) as worker:
        try:
            yield worker
        finally:
            worker.kill()


ENDS = {
    "the cluster has no workers left": (lambda _, worker: worker.kill(), 0.3, 1),
    "the scheduler of the cluster is gone": (lambda running, _: running.close(), 60, 1),
    "interrupted": (lambda *_: os.kill(os.getpid(), signal.SIGINT), 60, 130),
}


@needs_dask
@pytest.mark.parametrize("words", ENDS)
def test_a_run_that_ends_early_says_why_and_the_same_folder_goes_on(tmp_path, capfd, monkeypatch, words):
    act, patience, status = ENDS[words]
    monkeypatch.setattr(cluster, "GLANCE", 0.02)
    monkeypatch.setattr(cluster, "PATIENCE", patience)
    monkeypatch.setattr(cluster, "TIMEOUT", 60)  # a new worker takes its time
    here, out = project(tmp_path, "stuck"), tmp_path / "out"
    with (
        local(0) as running,
        stuck_worker(running.scheduler_address) as worker,
        once_stored(5, out, lambda: act(running, worker)),
    ):
        assert figures(here, "run", "--dask", running.scheduler_address, "--out", out) == status
    said = capfd.readouterr().err
    assert f"{words}. What was computed is stored: the same command goes on from there" in said
    assert "Traceback" not in said
    stored = arrays(out)
    assert len(stored) == 5
    assert figures(here, "run", "--out", out) == figures(here, "run", "--out", tmp_path / "whole") == 0
    assert stored.items() < arrays(out).items()
    assert arrays(out) == arrays(tmp_path / "whole")


@needs_dask
def test_the_loggers_of_distributed_are_quiet_for_the_run_only(two):
    logger = logging.getLogger("distributed.client")
    before = logger.level
    with cluster.crew(two.scheduler_address, [], print):
        assert not logger.isEnabledFor(logging.CRITICAL)
    assert logger.level == before
