"""A figure is found by standing in its wing, in an order that nobody writes down."""

import pytest

from figures.claims.errors import FigureError
from figures.engine.registry import load, standing
from figures.project import WINGS, Project
from tests.checkout import plant

FIGURE = "from tests.figures.demos.sound import figure\n\nFIGURE = figure(id='{}')\n"


@pytest.fixture
def wing(tmp_path, monkeypatch, request):
    """A new package of figures, which no other test can have imported: its name is the test's."""
    name = f"wing_of_{request.node.name}"
    monkeypatch.syspath_prepend(tmp_path)

    def stand(*modules):
        plant(tmp_path, f"{name}/__init__.py", "")
        for module in modules:
            plant(tmp_path, f"{name}/{module}.py", FIGURE.format(f"A-{module}".replace("_", "-")))
        return name

    return stand


def test_a_module_in_a_wing_is_a_figure(wing):
    here = wing("gpt_f01", "gpt_f02")
    assert list(load(standing([here]))) == ["A-gpt-f01", "A-gpt-f02"]


def test_figures_of_the_paper_come_first_by_number_and_the_others_by_name(wing):
    here = wing("a_f10", "a_x", "a_f2b", "a_c06", "a_f2", "a_f09", "a_c05")
    found = [name.rpartition(".")[2] for name in standing([here])]
    assert found == ["a_f2", "a_f2b", "a_f09", "a_f10", "a_c05", "a_c06", "a_x"]


def test_a_module_in_a_wing_without_a_figure_is_named_with_the_remedy(wing, tmp_path):
    here = wing("a_f01")
    plant(tmp_path, f"{here}/helpers.py", "FIGURES = ()\n")
    with pytest.raises(FigureError, match=rf"{here}\.helpers .*figures/experiments"):
        load(standing([here]))


def test_our_own_wings_have_one_figure_per_module():
    modules = Project().modules
    assert [entry.module for entry in load(modules).values()] == list(modules)
    assert {name.rpartition(".")[0] for name in modules} == set(WINGS)
