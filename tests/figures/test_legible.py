"""Laws of pictures: large, labelled, free of collisions, told apart in grey; each with a picture that breaks it."""

import ast
import json
import re

import numpy as np
import pytest

from figures.report import legible, press, style
from tests.checkout import ROOT, modules, plant
from tests.figures.demos.sound import figure
from tests.test_house import PAPERS, floor

X = np.arange(6.0)


def good():
    """A picture that breaks no law."""
    picture, axes = style.panels(1, 2, width=3.2, height=2.4)
    for name in ("talbot", "pairwise"):
        axes[0, 0].plot(X, X + len(name), **style.look(name))
    axes[0, 0].axhline(3, **style.look("truth"))
    style.below(axes[0, 0])
    axes[0, 0].set(xlabel="samples $n$", ylabel="variance (1)", title="Lines")
    style.strips(axes[0, 1], [X, X], ["reference", "hybrid"], 5, 6)
    axes[0, 1].set(xlabel="pixel")
    return picture


def changed(change):
    """The troubles of the good picture after a change of its left panel."""
    with style.context():
        picture = good()
        change(picture.axes[0])
        return legible.troubles(press.settled(picture))


def small_ticks(axis):
    axis.tick_params(labelsize=4)


def run_over(axis):
    axis.text(0, 3, "far out " * 20, in_layout=False)


def no_words(axis):
    axis.set(xlabel="")


def over_lines(axis):
    axis.legend(loc="center")


def over_words(axis):
    axis.text(0.5, 0.5, "a remark", transform=axis.transAxes, ha="center")
    axis.legend(loc="center")


def many_ticks(axis):
    axis.set_xticks(X / 20, [f"{1000 + x:g}" for x in X])


def in_colour_only(axis):
    axis.plot(X, X, **{**style.nth(3), "marker": "o", "ls": "-"}, label="another")
    style.below(axis)


def bars_in_colour_only(axis):
    for k, colour in enumerate((style.VERMILLION, style.GREEN)):
        axis.bar(X + 7 + k / 2, X, 0.4, color=colour, label=f"bar {k}")
    style.below(axis)


def unnamed_guide(axis):
    axis.axvline(2, color=style.GREY, ls=":", marker="")


def no_scale(axis):
    axis.imshow(np.ones((3, 3)))


def two_colours(axis):
    axis.plot(X, X, color=style.GREEN, ls="--", marker="X", label="talbot")
    style.below(axis)


def not_its_colour(axis):
    axis.plot(X, X, color=style.GREEN, ls=":", marker="X", label="hybrid, frame 1")
    style.below(axis)


BREAKS = {
    small_ticks: "px high",
    run_over: "cut off",
    no_words: "no label",
    over_lines: "covers what",
    over_words: "covers the text 'a remark'",
    many_ticks: "collide",
    in_colour_only: "differ in colour only",
    bars_in_colour_only: "differ in colour only",
    unnamed_guide: "not explained",
    no_scale: "has no scale",
    two_colours: "'talbot' is",
    not_its_colour: "everywhere",
}


def test_a_good_picture_has_no_troubles():
    assert changed(lambda axis: None) == []


@pytest.mark.parametrize("change", BREAKS, ids=lambda change: change.__name__)
def test_a_picture_that_cannot_be_read_is_noticed(change):
    assert any(BREAKS[change] in trouble for trouble in changed(change))


# ---------------------------------------------------------------- one look for each method


def test_looks_that_are_compared_differ_without_colour():
    groups = (
        ("hybrid", "reconnection", "no distance test", "path tracing", "path reuse", "ReSTIR GI", "ReSTIR DI"),
        ("talbot", "pairwise", "defensive", "1/Z", "constant"),
        tuple(name for name in style.LOOKS if "M_c" in name or name == "no cap"),
    )
    for group in groups:
        looks = [style.LOOKS[name] for name in group]
        assert len({look.marker for look in looks}) == len(group)
        assert len({(look.marker, str(look.line)) for look in looks}) == len(group)


@pytest.mark.parametrize(
    ("label", "name"),
    [
        ("path tracing, equal rays", "path tracing"),
        ("pairwise, defensive", "pairwise, defensive"),
        ("1/Z with visibility", "1/Z"),
        ("righteous", ""),
    ],
)
def test_a_label_belongs_to_the_longest_name_it_begins_with(label, name):
    assert style.named(label) == name


def test_a_name_without_a_look_is_told():
    with pytest.raises(KeyError, match="'hybird' has no look: add it to LOOKS"):
        style.look("hybird")


HEX = re.compile(r"#[0-9a-fA-F]{6}")


def own_colours(root):
    """Colours that a figure's module writes down itself."""
    ours = [module for module in modules(root, ("figures",)) if floor(module.name) in PAPERS]
    nodes = ((module.name, node) for module in ours for node in ast.walk(module.tree) if isinstance(node, ast.Constant))
    return [f"{name} has {node.value}" for name, node in nodes if HEX.fullmatch(str(node.value))]


def test_figures_take_their_colours_from_the_style():
    assert own_colours(ROOT) == []


def test_a_colour_of_a_figures_own_is_noticed(tmp_path):
    assert own_colours(plant(tmp_path, "figures/gris/gris_f99.py", 'LOOK = {"color": "#0072B2"}'))


# ---------------------------------------------------------------- pictures of a folder


def stored(out, id_, colour, troubles=()):
    (out / id_).mkdir()
    seen = {"looks": {"method": [colour, "o", "-", ""]}, "troubles": list(troubles)}
    (out / id_ / legible.NAME).write_text(json.dumps(seen))


def test_a_label_of_two_colours_in_two_pictures_is_noticed(tmp_path):
    stored(tmp_path, "DEMO-F01", "#000000")
    stored(tmp_path, "DEMO-F02", "#000000")
    assert list(legible.problems(tmp_path)) == []
    stored(tmp_path, "DEMO-F03", "#0072b2", ["something is small"])
    assert len(list(legible.problems(tmp_path))) == 2


def test_a_picture_is_stored_with_what_cannot_be_read_in_it():
    files = press.drawn(figure(draw=lambda _: good()), {})
    assert json.loads(files[legible.NAME])["troubles"] == []
    assert json.loads(files[legible.NAME])["looks"]["talbot"][0] == style.LOOKS["talbot"].colour.lower()


def test_pictures_of_a_finished_run_can_be_read():
    """Judged where there is one, as in `make check`; `make audit` says the same."""
    assert list(legible.problems(ROOT / "out")) == []
