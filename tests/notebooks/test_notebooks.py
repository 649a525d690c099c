"""Every notebook is clean, runs from top to bottom in this process, and ends with the facts that it tells."""

import json

import pytest

from notebooks import pages
from tests.checkout import ROOT

NOTEBOOKS = sorted((ROOT / "notebooks").glob("*.ipynb"))
LONGEST = 14
"""Lines of a code cell."""


def read(path):
    return json.loads(path.read_text(encoding="utf-8"))


def faults(path):
    """What is wrong with the file of a notebook, apart from its contents."""
    text, notebook = path.read_text(encoding="utf-8"), read(path)
    if json.dumps(notebook, indent=1, ensure_ascii=False, sort_keys=True) + "\n" != text:
        yield "not as Jupyter writes it"
    if (notebook["nbformat"], notebook["nbformat_minor"]) != (4, 5):
        yield "not format 4.5"
    if notebook["metadata"].keys() != {"kernelspec", "language_info"}:
        yield "odd metadata"
    ids = [cell["id"] for cell in notebook["cells"]]
    if len(set(ids)) < len(ids):
        yield "ids twice"
    for cell in notebook["cells"]:
        if cell.get("outputs") or cell.get("execution_count") is not None:
            yield f"{cell['id']} has outputs"
        if cell["cell_type"] == "code" and "".join(cell["source"]).count("\n") >= LONGEST:
            yield f"{cell['id']} is too long"


def run(path):
    """The names that a notebook leaves behind, and what it prints; every picture and table is drawn."""
    names, printed = {"__name__": "notebook"}, []
    for cell in pages.cells(path):
        if cell.kind == "code":
            shown = pages.run(cell.source, names, cell.id)
            assert all(map(repr, shown))
            printed += [each for each in shown if isinstance(each, str)]
    return names, "".join(printed)


every_notebook = pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)


def test_there_are_nine_notebooks_in_order():
    assert [path.name[:3] for path in NOTEBOOKS] == ["01_", "02_", "03_", "04_", "05_", "06_", "07_", "08_", "09_"]


@every_notebook
def test_a_notebook_is_stored_clean(path):
    assert list(faults(path)) == []


SPOILED = {
    "outputs": lambda cell: cell.update(outputs=[{"output_type": "stream"}]),
    "a count": lambda cell: cell.update(execution_count=3),
    "a long cell": lambda cell: cell.update(source=["x = 1\n"] * LONGEST),
    "an id twice": lambda cell: cell.update(id="cell-00"),
}


@pytest.mark.parametrize("spoil", SPOILED.values(), ids=SPOILED)
def test_a_spoiled_notebook_is_noticed(tmp_path, spoil):
    notebook = read(NOTEBOOKS[0])
    spoil(next(cell for cell in notebook["cells"] if cell["cell_type"] == "code"))
    path = tmp_path / "spoiled.ipynb"
    path.write_text(json.dumps(notebook, indent=1, ensure_ascii=False, sort_keys=True) + "\n")
    assert len(list(faults(path))) == 1


def test_from_ris_to_gris_tells_the_truth():
    names, _ = run(NOTEBOOKS[0])
    plain, truth = names["plain"], names["truth"]
    assert abs(plain.mean() - truth) < 4 * plain.std() / 100 < 0.05 * truth
    assert names["without"].mean() == pytest.approx(1, abs=0.01)
    assert abs(names["without"] - 1).min() > 0.2
    assert names["lost"].pop("constant") > 0.2
    assert max(map(abs, names["lost"].values())) < 1e-12
    assert names["ends"]["none"].std() > 10 * names["ends"]["1"].std() > 0


def test_is_my_estimator_unbiased_tells_the_truth():
    names, _ = run(NOTEBOOKS[1])
    assert "one seed for two passes" in str(names["hidden"])
    assert names["verdict"].startswith("Unbiased")
    assert names["found"].startswith("Biased")
    assert [name for name, words in names["family"].items() if not words.startswith("Unbiased")] == ["constant"]


def test_find_the_bug_runs_and_gives_nothing_away():
    names, printed = run(NOTEBOOKS[2])
    assert list(names["suspects"]) == list("ABCDEF")
    shown = printed + str(names["suspects"])
    assert not [name for name in names["lab"].names() if name in shown]


def test_shift_mappings_you_can_see_tells_the_truth():
    names, _ = run(NOTEBOOKS[3])
    assert {shift: pair.c for shift, pair in names["pairs"].items()} == {"replay": 0, "reconnection": 2, "hybrid": 4}
    kept = {shift: pair.J * pair.gain for shift, pair in names["pairs"].items()}
    assert kept["reconnection"] < 0.02
    assert min(kept["replay"], kept["hybrid"]) > 0.8
    assert max(error for error, _ in names["back"].values()) < 1e-9


def test_restir_pt_frame_by_frame_tells_the_truth():
    names, printed = run(NOTEBOOKS[4])
    initial, spatial, second = names["lit"].values()
    assert initial < 0.1
    assert 0.2 < spatial < second / 2
    assert (names["Y"].c == 4).all()
    assert (names["Z"].c == 20).all()
    assert "pixels with light" in printed
    assert 0.8 < names["film"].seen[1:].mean() < 1


def test_the_3d_tracer_in_ten_minutes_tells_the_truth():
    names, printed = run(NOTEBOOKS[5])
    initial, spatial = names["lit"].values()
    assert 2 * initial < spatial < (names["Z"].W > 0).mean()
    assert (names["Y"].c == 4).all()
    assert (names["Z"].c == 20).all()
    assert 0.8 < names["m"].seen.mean() < 1
    assert "did you mean 'roughness'?" in names["said"]
    found = {scene: names["lesson"].pays(scene, 3) for scene in ("cornell", "ajar", "checker", "crease")}
    assert [scene for scene, each in found.items() if each.split.break_even[0] < 16] == ["checker", "crease"]
    assert [scene for scene, each in found.items() if each.without[-1] < each.reused[-1]] == ["checker", "crease"]
    assert all(each.reused[0] < each.without[0] for each in found.values())
    assert "GRIS-F11b reproduced: " in printed
    assert "GRIS-F11b refuted: " in printed


def test_why_blotches_dissolve_tells_the_truth():
    names, printed = run(NOTEBOOKS[7])
    glossy, slit = (
        [[float(cell) for cell in row] for row in names["lesson"].sharing(scene).rows]
        for scene in names["lesson"].SCENES
    )
    for (_, none, *_), _, (_, five, *_) in (glossy, slit):
        assert five < 2 < none / 2
    assert names["kept"].luminance < 1e-12
    assert names["kept"].energy < 1e-7
    assert names["kept"].moved > 0.1
    assert "e' - e" in printed


def test_what_a_probe_knows_tells_the_truth():
    names, printed = run(NOTEBOOKS[8])
    lesson = names["lesson"]
    free, corner = (lesson.asked("sunlit", x).rows for x in (0.03, 0.005))
    shares = [[(float(share), sees) for _, _, _, _, share, _, sees in rows] for rows in (free, corner)]
    assert sum(share for share, sees in shares[0] if sees == "no") < 0.05
    assert sum(share for share, sees in shares[1] if sees == "no") > 0.2
    inside, beside = (lesson.irradiance("sunlit", x) for x in (0.03, 0.005))
    assert beside > 5 * inside
    leaks = {name: float(share.split()[0]) for name, share, _ in lesson.leaking("sunlit").rows}
    assert leaks["without visibility"] > 3 * leaks["as it is"] > 0
    assert "bounces" in printed
    assert abs(names["after"][1] / names["after"][0] - 1) > 0.2
    assert abs(names["after"][-1] / names["after"][-2] - 1) < 0.1
    errors = list(names["errors"].values())
    assert errors == sorted(errors, reverse=True)
    assert errors[-1] > 0.05
