"""Laws of chunks as jobs: a stream of its own for each, and results that do not depend on the executor."""

import itertools
import os
import subprocess
import sys

import pytest
from hypothesis import given
from hypothesis import strategies as st

from figures import jobs
from figures.jobs import Job
from figures.registry import ROOT

SOUND = "tests.figures.demos.sound"
WORK = [Job(SOUND, "DEMO-F01", {"chunks": 5, "n": 4}, k, {"first": k}, 1) for k in range(5)]


def first(seed, figure, number):
    return tuple(jobs.stream(seed, figure, number).integers(2**62, size=2))


@pytest.mark.claims("COM-A07")
@given(st.integers(0, 2**128), st.text(), st.integers(0, 2**31))
def test_a_stream_is_a_function_of_seed_figure_and_number(seed, figure, number):
    assert first(seed, figure, number) == first(seed, figure, number)


@pytest.mark.claims("COM-A07")
def test_other_seeds_figures_and_numbers_have_other_streams():
    names = list(itertools.product((0, 1), ("DEMO-F01", "DEMO-F02"), range(50)))
    assert len({first(*name) for name in names}) == len(names)


def ran(workers, work=WORK):
    with jobs.pool(workers) as pool:
        return {result.job.number: result for result in jobs.completed(pool, work, 2 * workers)}


@pytest.mark.claims("COM-A07")
def test_two_workers_find_what_one_finds():
    one, two = ran(1), ran(2)
    assert sorted(one) == sorted(two) == [0, 1, 2, 3, 4]
    assert all(one[k].arrays["x"].tobytes() == two[k].arrays["x"].tobytes() for k in one)


def test_work_is_taken_up_lazily():
    queue = iter(WORK)
    with jobs.pool(1) as pool:
        results = jobs.completed(pool, queue, 1)
        next(results)
        assert next(queue).number == 1
        assert [result.job.number for result in results] == [2, 3, 4]


def test_an_exception_comes_back_as_its_traceback():
    (result,) = ran(1, [Job("tests.figures.demos.crashing", "DEMO-F03", {"n": 4}, 1, {"first": 1}, 1)]).values()
    assert "ArithmeticError: a deliberate error" in result.traceback
    assert not result.arrays


def test_a_module_that_cannot_be_imported_is_a_traceback_too():
    (result,) = ran(1, [Job("tests.figures.demos.missing", "DEMO-F03", {}, 1, {}, 1)]).values()
    assert "ModuleNotFoundError" in result.traceback


def test_the_serial_executor_keeps_exceptions_and_lets_ctrl_c_through():
    def stop():
        raise KeyboardInterrupt

    assert isinstance(jobs.SerialExecutor().submit(int, "x").exception(), ValueError)
    with pytest.raises(KeyboardInterrupt):
        jobs.SerialExecutor().submit(stop)


def test_numpy_loads_with_one_thread_whatever_the_environment_says():
    code = "import os, figures; print(os.environ['OMP_NUM_THREADS'], os.environ['OPENBLAS_NUM_THREADS'])"
    env = os.environ | {"OMP_NUM_THREADS": "8", "OPENBLAS_NUM_THREADS": "8"}
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, env=env, capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["1", "1"]


def test_the_twin_without_the_engine_keeps_eight():
    code = "import os; print(os.environ['OMP_NUM_THREADS'])"
    env = os.environ | {"OMP_NUM_THREADS": "8"}
    assert subprocess.check_output([sys.executable, "-c", code], env=env, text=True).strip() == "8"
