"""Results of older code are computed again, and only those."""

import numpy as np
import pytest

from figures.engine import code, plan, store

KEY = '{"code": "a", "seed": 1}'


@pytest.fixture
def stored(tmp_path):
    path = tmp_path / "000.npz"
    store.save(path, {"x": np.arange(3.0)}, KEY)
    return path


def test_a_file_that_differs_in_nothing_but_the_code_is_stale(stored):
    assert store.state(stored, '{"code": "b", "seed": 1}')[0] == "stale"


@pytest.mark.parametrize("field", sorted(plan.OF_CODE))
def test_a_chunk_that_differs_in_what_the_code_decides_is_stale(stored, field):
    assert plan.state_at(stored, f'{{"code": "b", "{field}": 9, "seed": 1}}')[0] == "stale"


@pytest.mark.parametrize("key", ['{"code": "b", "stream": 9, "seed": 2}', "no JSON", "[]"])
def test_a_chunk_that_also_differs_otherwise_is_foreign(stored, key):
    assert plan.state_at(stored, key)[0] == "foreign"


def test_a_file_that_also_differs_in_the_seed_is_foreign(stored):
    assert store.state(stored, '{"code": "b", "seed": 2}')[0] == "foreign"


def test_the_digest_sees_statements_but_no_comments(tmp_path, monkeypatch):
    package = tmp_path / "some_world"
    package.mkdir()
    monkeypatch.syspath_prepend(tmp_path)
    found = []
    for text in ("a = 1\n", "a = 1  # one\n", "a = 2\n"):
        (package / "__init__.py").write_text(text)
        code._syntax.cache_clear()
        code._package.cache_clear()
        found.append(code.digest("figures.gris.gris_f02", "some_world"))
    assert found[0] == found[1] != found[2]


MODULE = """
from figures.experiments import offline
from figures.experiments.flatland import view

SCALE, UNUSED = 2.0, 3.0

def chunks(preset): return [{}]
def compute(preset, chunk, *, rng): return {"x": SCALE * offline.equal_samples(1)}
def combine(preset, parts): return parts[0]
def check(a): return judge(a)
def judge(a): return []
def draw(a): return view

FIGURE = Figure(chunks=chunks, compute=compute, combine=combine, check=check, draw=draw, id="A-1")
"""
CHANGES = {
    "a constant of compute": ("SCALE, UNUSED = 2.0", "SCALE, UNUSED = 2.5", {"digest", "own"}),
    "chunks": ("[{}]", "[{}, {}]", {"digest", "own"}),
    "what another module gives": ("equal_samples", "equal_time", {"digest", "own"}),
    "how it is joined": ("parts[0]", "parts[1]", {"own"}),
    "how it is judged": ("return []", "return [1]", {"own"}),
    "the picture": ("return view", "return None", set()),
    "the id": ('"A-1"', '"A-2"', set()),
}


@pytest.mark.parametrize(("old", "new", "seen"), CHANGES.values(), ids=CHANGES)
def test_a_digest_sees_what_runs_before_it_is_asked_and_nothing_else(tmp_path, monkeypatch, old, new, seen):
    monkeypatch.syspath_prepend(tmp_path)
    digests = {"digest": lambda: code.digest("some_figure", "toy1d"), "own": lambda: code.own("some_figure")}
    found = {name: [] for name in digests}
    for text in (MODULE, MODULE.replace(old, new)):
        (tmp_path / "some_figure.py").write_text(text)
        code._source.cache_clear()
        for name, digest in digests.items():
            found[name].append(digest())
    code._source.cache_clear()
    assert {name for name, (before, after) in found.items() if before != after} == seen


def test_a_figure_that_another_function_makes_counts_as_a_whole():
    demo = "tests.figures.demos.sound"
    assert list(code._called(demo, code.COMPUTING)) == [(demo, code.WHOLE)]


def test_the_digest_sees_the_numbers_beside_a_module(tmp_path, monkeypatch):
    package = tmp_path / "other_world"
    package.mkdir()
    monkeypatch.syspath_prepend(tmp_path)
    (package / "__init__.py").write_text("")
    found = []
    for number in (1.0, 1.0, 2.0):
        np.savez(package / "__init__.npz", number=number)
        found.append(code.digest("figures.gris.gris_f02", "other_world"))
    assert found[0] == found[1] != found[2]
