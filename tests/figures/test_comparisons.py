"""Laws of comparisons: arms share random numbers, a thing is not compared with itself, conditions are declared."""

import json

import numpy as np
import pytest

from figures.claims import criteria
from figures.claims.figure import Conditions, Setup
from figures.engine import registry
from figures.engine.plan import arms, plan, stream
from tests.figures.demos.sound import figure
from tests.figures.project import figures, project


def planned(here, tmp_path, preset="quick"):
    (entry,) = registry.load(here.modules).values()
    return plan(entry, preset, 1, tmp_path)


def test_chunks_that_differ_in_nothing_but_the_arm_share_a_stream(tmp_path):
    here = planned(project(tmp_path, "arms"), tmp_path)
    assert [stream(here, n) for n in range(3)] == [0, 0, 2]
    assert [arms(here, n) for n in range(3)] == [[0, 1], [0, 1], [2]]


def test_a_figure_without_arms_has_a_stream_for_every_chunk(tmp_path):
    here = planned(project(tmp_path, "sound"), tmp_path)
    assert [stream(here, n) for n in range(len(here.parts))] == list(range(len(here.parts)))


def test_arms_are_computed_on_common_random_numbers(tmp_path):
    assert figures(project(tmp_path, "arms"), "run", "--out", tmp_path / "out") == 0
    x = np.load(tmp_path / "out" / "DEMO-F07" / "arrays.npz")["x"].reshape(3, 8)
    np.testing.assert_array_equal(x[0] ** 2, x[1])
    assert not np.isin(x[2], x[0]).any()


def test_arms_that_are_bitwise_equal_are_an_error(tmp_path, capsys):
    assert figures(project(tmp_path, "void"), "run", "--out", tmp_path / "out") == 1
    assert "DEMO-F08 crashed" in capsys.readouterr().out
    record = json.loads((tmp_path / "out" / "DEMO-F08" / "claims.json").read_text())
    assert 'chunks {"method":"plain"} and {"method":"squared"} are bitwise equal' in record["traceback"]


ONE, OTHER = np.arange(8.0) + 1, np.arange(8.0) + 2
RATIOS = {
    "below": lambda a, b: criteria.ratio_below(a, b, 2),
    "above": lambda a, b: criteria.ratio_above(a, b, 0.5),
    "within": lambda a, b: criteria.ratio_within(a, b, 0.1, 2),
    "interval": criteria.ratio_interval,
}


@pytest.mark.parametrize("ratio", RATIOS.values(), ids=RATIOS)
def test_a_ratio_of_equal_arms_is_void(ratio):
    ratio(ONE, OTHER)
    with pytest.raises(criteria.Void, match="compare a thing with itself"):
        ratio(ONE, ONE.copy())


FILM = Setup("real time", "moving", "all", "film")
STILL = Setup("real time", "still", "all", "film")
FAULTS = {
    "declared": ((Conditions(("DEMO-C01",), "Fig. 1", FILM, FILM),), ""),
    "another view": ((Conditions(("DEMO-C01",), "Fig. 1", FILM, Setup("real time", "moving", "all", "inset")),), ""),
    "explained": ((Conditions(("DEMO-C01",), "Fig. 1", FILM, STILL, "cheaper"),), ""),
    "not explained": ((Conditions(("DEMO-C01",), "Fig. 1", FILM, STILL),), "say why"),
    "none": ((), "must cover each of ['DEMO-C01'] once"),
    "twice": ((Conditions(("DEMO-C01",), "Fig. 1", FILM, FILM),) * 2, "once"),
    "of another claim": ((Conditions(("DEMO-C01", "DEMO-C02"), "Fig. 1", FILM, FILM),), "once"),
}


@pytest.mark.parametrize(("conditions", "words"), FAULTS.values(), ids=FAULTS)
def test_a_figure_that_renders_says_under_which_conditions(conditions, words):
    said = "; ".join(registry.faults(figure(world="flatland2d", conditions=conditions)))
    assert words in said if words else not said


def test_a_figure_on_the_line_needs_no_conditions():
    assert not list(registry.faults(figure()))
