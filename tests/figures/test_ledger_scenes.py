"""Laws of the ledger's scenes: what a row is about, its sentence and criterion name."""

import json

import pytest

from figures.claims.coverage import WORDS, missing
from figures.project import Project

ROWS = {row["id"]: row for row in json.loads(Project().ledger.read_text(encoding="utf-8"))["claims"]}


def row(criterion, *, scenes=(), worlds=("flatland2d",), sentence="Error falls."):
    """A row of the ledger, as far as its scenes matter."""
    return {"sentence": sentence, "criterion": criterion, "scenes": list(scenes), "worlds": list(worlds)}


@pytest.mark.parametrize("id_", ROWS)
def test_every_row_names_its_scenes_and_worlds(id_):
    assert missing(ROWS[id_]) == []


def test_every_row_says_which_scenes_and_worlds_it_has():
    for each in ROWS.values():
        assert len(set(each["scenes"])) == len(each["scenes"]), each["id"]
        assert each["worlds"], each["id"]
        assert set(each["worlds"]) <= set(WORDS), each["id"]


# ---------------------------------------------------------------- rows that must fail


@pytest.mark.parametrize("id_", [id_ for id_, each in ROWS.items() if each["scenes"]])
def test_a_row_that_drops_its_scenes_is_noticed(id_):
    dropped = {"sentence": "Error falls.", "criterion": "on the line, in flatland and in 3D: ratio below 0.8"}
    assert missing(ROWS[id_] | dropped) == ROWS[id_]["scenes"]


@pytest.mark.parametrize("id_", [id_ for id_, each in ROWS.items() if len(each["worlds"]) > 1])
def test_a_row_that_drops_its_worlds_is_noticed(id_):
    dropped = {"sentence": "Error falls.", "criterion": "ratio below 0.8"}
    assert missing(ROWS[id_] | dropped | {"scenes": []}) == [w for w in ROWS[id_]["worlds"] if WORDS[w]]


def test_a_row_that_names_fewer_scenes_than_it_has_is_noticed():
    assert missing(row("FS1 and FS2: ratio below 0.8", scenes=("FS1", "FS2", "FS3"))) == ["FS3"]


def test_a_row_that_drops_one_of_its_worlds_is_noticed():
    several = ("toy1d", "flatland2d", "tracer3d")
    assert missing(row("on the line and in flatland", worlds=several)) == ["tracer3d"]
    assert missing(row("in flatland and in 3D", worlds=several)) == ["toy1d"]
    assert missing(row("on the line and in 3D", worlds=several)) == ["flatland2d"]


# ---------------------------------------------------------------- how a name is found


@pytest.mark.parametrize("text", ["FS1 to FS10: below 0.8", "in FS1-FS10 below 0.8", "all scenes (FS1 to FS10)"])
def test_a_range_names_every_scene_in_it(text):
    ten = [f"FS{k}" for k in range(1, 11)]
    assert missing(row(text, scenes=ten)) == []
    assert missing(row(text, scenes=[*ten, "FS11", "FS15"])) == ["FS11", "FS15"]


def test_a_scene_left_out_of_a_range_is_noticed():
    assert missing(row("FS2 to FS10", scenes=("FS1", "FS2", "FS10"))) == ["FS1"]


@pytest.mark.parametrize(
    ("scene", "longer"),
    [
        ("FS1", "FS10 and FS15"),
        ("CB3", "CB3-glossy"),
        ("T1", "GRIS-T1"),
        ("T7", "T7b"),
        ("T2", "_T2"),
        ("FS1", "FS10-FS15"),
    ],
)
def test_a_longer_name_does_not_name_a_scene(scene, longer):
    assert missing(row(f"{longer}: below 0.8", scenes=(scene,))) == [scene]


@pytest.mark.parametrize("text", ["(CB3) below", "CB3, FS1", "in 3D (FS2, CB3)", "CB3/FS1", "CB3: below"])
def test_a_scene_may_stand_beside_any_mark(text):
    assert missing(row(text, scenes=("CB3",))) == []


def test_a_longer_word_does_not_name_a_world():
    assert missing(row("flatlander, GPU3D, the 3Ds", worlds=("flatland2d", "tracer3d"))) == ["flatland2d", "tracer3d"]


def test_a_scene_may_be_named_by_the_sentence():
    assert missing(row("ratio below 0.8", scenes=("FS8",), sentence="Through glass (FS8) it fails.")) == []


def test_a_world_may_begin_a_sentence():
    both = ("toy1d", "flatland2d")
    assert missing(row("On the line: below 0.8. Flatland: reported.", worlds=both)) == []


@pytest.mark.parametrize("worlds", [("flatland2d",), ("unit", "flatland2d"), ("unit",)])
def test_an_only_world_and_units_need_no_name(worlds):
    assert missing(row("ratio below 0.8", worlds=worlds)) == [w for w in worlds if len(worlds) > 1 and w != "unit"]
