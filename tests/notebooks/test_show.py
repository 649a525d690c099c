"""Pictures have words and stay when a notebook is exported; controls say that they work, and draw nothing twice."""

import base64
import functools
import re
import sys

import pytest

from notebooks import line_up, one_dimension, show


def png(picture):
    return picture[1:4] == b"PNG"


def plain(title="A picture", letter="a"):
    """Nothing but a title.

    More lines do not count.
    """
    picture, axes = show.style.panels(width=2.0, height=1.5)
    axes[0, 0].set_title(title + letter)
    return picture


class Screen:
    """A display of one output, which remembers what it shows."""

    def __init__(self, box=None):
        self.box, self.seen, self.said = box, [], []

    def update(self, shown):
        self.seen.append(shown)
        self.said.append(self.box.children[-1].value)


def explored(draw, **options):
    """Explored, its controls, their line of words, and the screen that they draw on."""
    pytest.importorskip("ipywidgets", reason="needs ipywidgets: pip install '.[notebooks]'")
    found, screen = show.explore(draw, **options), Screen()
    screen.box = show.controls(found, found.at(), screen)
    row, said = screen.box.children
    return found, row.children, said, screen


# ---------------------------------------------------------------- words


def test_a_picture_is_shown_as_png_in_the_house_style_with_its_words():
    shown, words = show.show(one_dimension.shift)._repr_png_()
    assert png(shown)
    assert words["alt"].startswith("The two integrands, and where the shift takes samples of the first. Pixel 1, J = 1")


def test_words_are_the_docstring_and_the_titles_without_marks_of_formulas():
    shown = show.show(functools.partial(plain, letter="b"), r"$\hat p(y)$, ")
    assert shown.alt == "Nothing but a title. p_hat(y), b"
    assert repr(shown) == f"Picture: {shown.alt}"
    assert len(show.described(plain, plain("long " * 100))) == show.LONGEST_ALT


def test_a_picture_of_a_nameless_function_still_has_its_titles():
    assert show.show(lambda: plain("By hand ")).alt == "A picture. By hand a"


def test_a_table_is_text_and_html():
    table = show.Table(["a", "b"], [("x < y", 1)])
    assert str(table) == "a      b\nx < y  1"
    assert "x &lt; y" in table._repr_html_()


# ---------------------------------------------------------------- export


class Publisher:
    """What a notebook's file would hold: outputs as (kinds of data, their words)."""

    def __init__(self):
        self.outputs = []

    def publish(self, data, metadata=None, **_):
        self.outputs.append((data, metadata or {}))


def published(value, monkeypatch):
    """The outputs of a cell that ends with the value."""
    shell = pytest.importorskip("IPython.core.interactiveshell", reason="needs IPython").InteractiveShell.instance()
    publisher = Publisher()
    monkeypatch.setattr(shell, "display_pub", publisher)
    value._ipython_display_()
    return publisher.outputs


@pytest.mark.parametrize("widgets", [True, False], ids=["with ipywidgets", "without"])
def test_a_picture_survives_export_as_an_output_of_its_own(monkeypatch, widgets):
    monkeypatch.setattr(show, "has_widgets", lambda: widgets)
    *controls, (data, words) = published(show.explore(plain, letter=["a", "b"]), monkeypatch)
    assert len(controls) == widgets
    found = data["image/png"]
    assert png(base64.b64decode(found) if isinstance(found, str) else found)
    assert words["image/png"]["alt"].endswith("A picturea")
    assert re.fullmatch(
        '<img alt="Nothing but a title. A picturea" src="data:image/png;base64,[^"]+">', data["text/html"]
    )


def test_a_picture_inside_a_widget_would_not_survive_export(monkeypatch):
    widgets = pytest.importorskip("ipywidgets", reason="needs ipywidgets: pip install '.[notebooks]'")
    inside = widgets.VBox([widgets.Image(value=show.show(plain).png, format="png")])
    inside._ipython_display_ = lambda: sys.modules["IPython.display"].display(inside)
    assert not [data for data, _ in published(inside, monkeypatch) if "image/png" in data]


def test_without_widgets_the_first_setting_is_shown(monkeypatch):
    monkeypatch.setitem(sys.modules, "ipywidgets", None)
    assert not show.has_widgets()
    assert str(show.explore(plain, letter=["x", "y"])) == str(show.show(plain, letter="x"))


# ---------------------------------------------------------------- controls


def test_a_control_redraws_the_picture():
    found, (letter,), _, screen = explored(plain, letter=["a", "b"])
    letter.value = "b"
    assert screen.seen == [found.at(letter="b")] != [found.at()]


def test_what_was_drawn_once_is_not_drawn_again():
    drawn = []

    def counted(letter):
        drawn.append(letter)
        return plain(letter=letter)

    _, (letter,), _, screen = explored(counted, letter=["a", "b"])
    for value in ("b", "a", "b"):
        letter.value = value
    assert drawn == ["a", "b"]
    assert [shown.alt[-1] for shown in screen.seen] == ["b", "a", "b"]


def test_controls_say_that_they_work_and_wait():
    seen = []

    def watched(letter):
        seen.extend((each.value, control[0].disabled) for each in said)
        return plain(letter=letter)

    said, control = [], []
    _, (letter,), words, _ = explored(watched, letter=["a", "b"])
    said.append(words)
    control.append(letter)
    letter.value = "b"
    assert seen == [(show.WORKING, True)]
    assert words.value.startswith("drawn in ")
    assert not letter.disabled
    letter.value = "a"
    assert (seen, words.value) == ([(show.WORKING, True)], "")


def test_controls_say_what_went_wrong_and_can_be_used_again():
    def fails(letter):
        return plain(letter=letter) if letter == "a" else {}[letter]

    _, (letter,), words, screen = explored(fails, letter=["a", "b"])
    with pytest.raises(KeyError):
        letter.value = "b"
    assert words.value == "failed: 'b'"
    assert not letter.disabled
    letter.value = "a"
    assert len(screen.seen) == 1


def test_numbers_slide_in_order_from_the_first_one_given():
    _, (slider,), _, _ = explored(lambda M: plain(letter=str(M)), M=[4, 1, 2])
    assert (slider.options, slider.value) == ((1, 2, 4), 4)


def test_an_option_of_one_value_has_no_control():
    suspects = line_up.line_up(1)
    found, controls, _, _ = explored(line_up.cells_of, suspects=[suspects], letter=["A", "B"], experiment=["as it is"])
    assert [control.description for control in controls] == list(found.choices) == ["letter"]
