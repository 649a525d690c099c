"""Results of older code are computed again, and only those."""

import numpy as np
import pytest

from figures.engine import code, plan, store, syntax
from tests.checkout import plant

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
    for text in ("a = 1\n", '"""Words."""\na = 1  # one\n', "a = 2\n"):
        (package / "__init__.py").write_text(text)
        code._syntax.cache_clear()
        code._package.cache_clear()
        found.append(code.digest("figures.gris.gris_f02", "some_world"))
    assert found[0] == found[1] != found[2]


MODULE = """
from figures.experiments import offline
from figures.experiments.views import view

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


# ---------------------------------------------------------------- where code stands

BEFORE = {
    "lobes.py": "def f(x):\n    return x",
    "paths.py": "from ours import lobes\nfrom ours.lobes import f\nfrom numpy import pi\ny, z = f(pi), lobes.f(1)",
}
INTO_A_WING = {
    "wing/__init__.py": '"""A wing."""',
    "wing/lobes.py": '"""Words."""\n' + BEFORE["lobes.py"],
    "paths.py": BEFORE["paths.py"].replace("from ours", "from ours.wing"),
}
IN_ANOTHER_ORDER = BEFORE | {
    "paths.py": "from numpy import pi\n" + BEFORE["paths.py"].replace("from numpy import pi\n", "")
}
CHANGED = {
    "a statement": ("wing/lobes.py", "return x", "return -x"),
    "a name of ours": ("paths.py", "import f", "import g as f"),
    "a module of ours": ("paths.py", "wing.lobes import", "wing.shapes import"),
    "a package of others": ("paths.py", "numpy", "scipy.constants"),
}


def said(root, texts):
    """The digest of a package with these modules."""
    for name, text in {"__init__.py": "", **texts}.items():
        plant(root, f"ours/{name}", text)
    return syntax.total(part for path in root.rglob("*.py") for part in syntax.statements(path, root))


@pytest.mark.parametrize("after", [INTO_A_WING, IN_ANOTHER_ORDER], ids=["a wing", "another order"])
def test_code_that_only_moves_keeps_its_digest(tmp_path, after):
    assert said(tmp_path / "before", BEFORE) == said(tmp_path / "after", after)


@pytest.mark.parametrize(("path", "old", "new"), CHANGED.values(), ids=CHANGED)
def test_code_that_changes_on_its_way_is_noticed(tmp_path, path, old, new):
    after = INTO_A_WING | {path: INTO_A_WING[path].replace(old, new)}
    assert after != INTO_A_WING
    assert said(tmp_path / "before", BEFORE) != said(tmp_path / "after", after)


def test_a_figure_that_moves_to_another_wing_keeps_its_results(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(tmp_path)
    for wing in ("one_wing", "other_wing"):
        plant(plant(tmp_path, f"{wing}/__init__.py", ""), f"{wing}/some_figure.py", MODULE)
    names = ("one_wing.some_figure", "other_wing.some_figure")
    assert len({(code.digest(name, "toy1d"), code.own(name)) for name in names}) == 1
