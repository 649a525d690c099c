"""Results of older code are computed again, and only those."""

import numpy as np
import pytest

from figures import code, store

KEY = '{"code": "a", "seed": 1}'


@pytest.fixture
def stored(tmp_path):
    path = tmp_path / "000.npz"
    store.save(path, {"x": np.arange(3.0)}, KEY)
    return path


def test_a_file_that_differs_in_nothing_but_the_code_is_stale(stored):
    assert store.state(stored, '{"code": "b", "seed": 1}')[0] == "stale"


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
        found.append(code.digest("figures.gris_f02", "some_world"))
    assert found[0] == found[1] != found[2]


def test_the_digest_follows_the_figure_modules_that_a_figure_imports():
    files = [path.name for path in code._figure_files("figures.gris_f07")]
    assert files == ["gris_f07.py"]


def test_the_digest_sees_the_numbers_beside_a_module(tmp_path, monkeypatch):
    package = tmp_path / "other_world"
    package.mkdir()
    monkeypatch.syspath_prepend(tmp_path)
    (package / "__init__.py").write_text("")
    found = []
    for number in (1.0, 1.0, 2.0):
        np.savez(package / "__init__.npz", number=number)
        found.append(code.digest("figures.gris_f02", "other_world"))
    assert found[0] == found[1] != found[2]
