"""Laws of the report: a page beside its pictures, without network, rebuilt from what is stored, honest about damage."""

import re
from html.parser import HTMLParser

import matplotlib as mpl
import pytest

from figures.claims.figure import VERDICTS
from figures.report import press, style
from figures.report.markup import SYMBOLS, badge
from tests.figures.demos.sound import FIGURE
from tests.figures.project import figures, project

NETWORK = re.compile(r"""https?:|(?:src|href)=["']?//|@import|url\(|<script|<link""")
VOID = {"meta", "img", "br"}


def page(out):
    return (out / "index.html").read_text()


class Tags(HTMLParser):
    """Notes what is not closed, and every attribute."""

    def __init__(self, text):
        super().__init__()
        self.open, self.found = [], []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.found.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


def test_the_page_is_well_formed(done):
    assert Tags(page(done[1])).open == []


def test_the_page_needs_no_network(done):
    assert not NETWORK.search(page(done[1]))


@pytest.mark.parametrize("text", ['<img src="https://x/y.png">', "<script>f()</script>", '<a href="//x">'])
def test_a_page_that_needs_the_network_is_noticed(text):
    assert NETWORK.search(text)


def test_links_lead_to_what_is_there(done):
    _, out = done
    links = [attrs["href"] for tag, attrs in Tags(page(out)).found if tag == "a"]
    ids = {attrs["id"] for _, attrs in Tags(page(out)).found if "id" in attrs}
    files = ("figure.png", "figure.pdf", "arrays.npz")
    assert {link for link in links if link.startswith("DEMO")} == {
        f"{id_}/{name}" for id_ in ("DEMO-F01", "DEMO-F05") for name in files
    }
    assert any(link.endswith("tests/figures/demos/sound.py") for link in links)
    assert all(link[1:] in ids if link[0] == "#" else (out / link).exists() for link in links)


def test_every_picture_says_in_words_what_it_shows(done):
    pictures = [attrs for tag, attrs in Tags(page(done[1])).found if tag == "img"]
    assert [attrs["src"] for attrs in pictures] == [f"{id_}/figure.png" for id_ in ("DEMO-F01", "DEMO-F05")] * 2
    assert all(attrs["loading"] == "lazy" and 0 < len(attrs["alt"]) <= 300 for attrs in pictures)
    assert any("Uniform <draws>" in attrs["alt"] and "reproduced" in attrs["alt"] for attrs in pictures)


def test_the_page_tells_sentence_value_criterion_verdict_and_expectation(done):
    text = page(done[1])
    for words in ("Sentence &lt;DEMO-C01&gt;", "0.5 ± 0.2", "✓ reproduced", "✗ refuted", "it is a uniform draw"):
        assert words in text
    assert "Uniform <draws>" not in text.replace('alt="Uniform <draws>', "")
    assert text.index("What came out otherwise") < text.index("<img") < text.index("All claims")


def test_every_verdict_has_a_symbol_of_its_own_and_its_word():
    assert set(SYMBOLS) == set(VERDICTS)
    assert len(set(SYMBOLS.values())) == len(VERDICTS)
    assert all(SYMBOLS[verdict] in badge(verdict) and verdict in badge(verdict) for verdict in VERDICTS)
    assert "no figure" in badge(None)


def test_the_report_is_rebuilt_from_what_is_stored(done):
    here, out = done
    before = {name: (out / name).read_bytes() for name in ("index.html", "verdicts.json")}
    for name in before:
        (out / name).unlink()
    for chunk in out.rglob("chunks/*.npz"):
        chunk.unlink()
    assert figures(here, "report", "--out", out) == 0
    assert {name: (out / name).read_bytes() for name in before} == before


DAMAGES = {
    "claims.json": ("claims.json is not a record", b'{"format": 2}'),
    "figure.png": ("figure.png is not a whole picture", b"\x89PNG"),
    "arrays.npz": ("arrays.npz cannot be read", b"PK"),
}


@pytest.mark.parametrize("name", DAMAGES)
def test_a_damaged_figure_is_shown_as_such_and_the_others_are_reported(done, name):
    here, out = done
    words, content = DAMAGES[name]
    (out / "DEMO-F01" / name).write_bytes(content)
    assert figures(here, "report", "--out", out) == 0
    assert words in page(out)
    assert "✗ refuted" in page(out)


def test_a_missing_picture_is_told(done):
    here, out = done
    (out / "DEMO-F01" / "figure.png").unlink()
    assert figures(here, "report", "--out", out) == 0
    assert "figure.png cannot be read" in page(out)


@pytest.mark.parametrize("make", [lambda out: None, lambda out: out.mkdir(), lambda out: out.write_text("mine")])
def test_nothing_to_report_is_an_error(tmp_path, capsys, make):
    make(tmp_path / "out")
    assert figures(project(tmp_path, "sound"), "report", "--out", tmp_path / "out") == 2
    assert "`run` computes" in capsys.readouterr().err


# ---------------------------------------------------------------- pictures


def drawn(values):
    return press.drawn(FIGURE, {"x": values})


def test_a_picture_is_the_same_at_any_time(monkeypatch):
    first = drawn([1.0, 3.0, 2.0])
    monkeypatch.setattr("time.time", lambda: 2e9)
    assert drawn([1.0, 3.0, 2.0]) == first
    other = drawn([1.0, 2.0, 3.0])
    assert {name for name in first if first[name] != other[name]} == {"figure.png", "figure.pdf"}


def test_the_style_tells_lines_apart_without_colour():
    looks = [(step["linestyle"], step["marker"]) for step in style.CYCLE]
    assert len(set(looks)) == len(looks) == len(set(style.COLOURS))


def test_a_users_own_matplotlibrc_changes_nothing():
    plain = drawn([1.0, 2.0])
    with mpl.rc_context({"font.size": 30, "axes.facecolor": "red"}):
        assert drawn([1.0, 2.0]) == plain
