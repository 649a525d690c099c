"""Laws of chunks as jobs: a stream of its own for each, and results that do not depend on the executor."""

import itertools
import json
import os
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from figures.engine import jobs
from figures.engine.jobs import Job
from figures.project import ROOT

SOUND = "tests.figures.demos.sound"
WORK = [Job(SOUND, "DEMO-F01", {"chunks": 5, "n": 4}, k, {"first": k}, 1, k) for k in range(5)]


KEYS = list(itertools.product((0, 1), ("DEMO-F01", "DEMO-F02"), range(3)))
"""(root seed, figure, chunk)."""


def drawn(stream, keys):
    """Two numbers of the stream of every key; the streams are made in this order, and drawn from in turns."""
    streams = {key: stream(*key) for key in keys}
    one, two = ({key: int(rng.integers(2**62)) for key, rng in streams.items()} for _ in range(2))
    return {key: (one[key], two[key]) for key in keys}


def in_turn():
    """A mistake: streams that are handed out one after the other, in the order of execution."""
    turn = itertools.count()
    return lambda seed, figure, number: np.random.default_rng([seed, next(turn)])


ORDERS = {"backwards": KEYS[::-1], "some": KEYS[2::3], "one alone": KEYS[-1:]}
in_every_order = pytest.mark.parametrize("keys", ORDERS.values(), ids=ORDERS)


@pytest.mark.claims("COM-A07")
@in_every_order
def test_a_stream_is_the_same_whatever_was_drawn_before_it_and_beside_it(keys):
    assert drawn(jobs.stream, keys).items() <= drawn(jobs.stream, KEYS).items()


@pytest.mark.claims("COM-A07")
@in_every_order
def test_streams_in_the_order_of_execution_are_noticed(keys):
    assert not drawn(in_turn(), keys).items() <= drawn(in_turn(), KEYS).items()


seeds, figures, numbers = st.integers(0, 2**128), st.text(), st.integers(0, 2**31)


@pytest.mark.claims("COM-A07")
@given(st.lists(st.tuples(seeds, figures, numbers), unique=True, min_size=2, max_size=5), st.data())
def test_keys_that_differ_have_streams_that_differ_in_any_order(keys, data):
    found = drawn(jobs.stream, keys)
    assert len(set(found.values())) == len(keys)
    assert drawn(jobs.stream, data.draw(st.permutations(keys))) == found


@pytest.mark.claims("COM-A07")
def test_other_seeds_figures_and_numbers_have_other_streams():
    names = list(itertools.product((0, 1), ("DEMO-F01", "DEMO-F02"), range(50)))
    assert len(set(drawn(jobs.stream, names).values())) == len(names)


BY_HASH = "lambda seed, figure, number: np.random.default_rng([seed, hash(figure) % 2**32, number])"
"""A mistake: Python's hashes of text are others in every process."""


def in_another_process(stream: str, hash_seed: str):
    """The first numbers of every key's stream, made by an expression in a new interpreter."""
    code = f"import json, numpy as np; from figures.engine import jobs; made = {stream}; keys = {KEYS}"
    code += "; print(json.dumps([made(*key).integers(2**62, size=2).tolist() for key in keys]))"
    env = os.environ | {"PYTHONHASHSEED": hash_seed}
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, env=env, capture_output=True, text=True, check=True)
    return {key: tuple(found) for key, found in zip(KEYS, json.loads(done.stdout), strict=True)}


@pytest.mark.claims("COM-A07")
def test_another_process_has_the_same_streams():
    assert in_another_process("jobs.stream", "1") == drawn(jobs.stream, KEYS)


@pytest.mark.claims("COM-A07")
def test_streams_that_are_others_in_another_process_are_noticed():
    one, two = (in_another_process(BY_HASH, seed) for seed in "12")
    assert all(one[key] != two[key] for key in KEYS)


def ran(workers, work=WORK):
    with jobs.pool(workers) as pool:
        return {result.job.number: result for result in jobs.completed(pool, work, 2 * workers)}


def same_bytes(one, two):
    return all(one[k].arrays["x"].tobytes() == two[k].arrays["x"].tobytes() for k in one)


@pytest.mark.claims("COM-A07")
def test_two_workers_find_what_one_finds():
    one, two = ran(1), ran(2)
    assert sorted(one) == sorted(two) == [0, 1, 2, 3, 4]
    assert same_bytes(one, two)


@pytest.mark.claims("COM-A07")
def test_chunks_in_another_order_find_the_same_and_with_streams_in_turn_they_would_not(monkeypatch):
    assert same_bytes(ran(1), ran(1, WORK[::-1]))
    found = []
    for work in (WORK, WORK[::-1]):
        monkeypatch.setattr(jobs, "stream", in_turn())
        found.append(ran(1, work))
    assert not same_bytes(*found)


def test_work_is_taken_up_lazily():
    queue = iter(WORK)
    with jobs.pool(1) as pool:
        results = jobs.completed(pool, queue, 1)
        next(results)
        assert next(queue).number == 1
        assert [result.job.number for result in results] == [2, 3, 4]


def test_an_exception_comes_back_as_its_traceback():
    (result,) = ran(1, [Job("tests.figures.demos.crashing", "DEMO-F03", {"n": 4}, 1, {"first": 1}, 1, 1)]).values()
    assert "ArithmeticError: a deliberate error" in result.traceback
    assert not result.arrays


def test_a_module_that_cannot_be_imported_is_a_traceback_too():
    (result,) = ran(1, [Job("tests.figures.demos.missing", "DEMO-F03", {}, 1, {}, 1, 1)]).values()
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
