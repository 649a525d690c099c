"""Laws of what the page says: sentences, equations in code, words explained once, colours, and how far a run is."""

import json
import re

import pytest

from figures.claims.figure import VERDICTS
from figures.engine.manifest import ROOT
from figures.engine.progress import Sparing
from figures.project import Project
from figures.report.front import NOTHING, TESTS
from figures.report.glossary import PAPERS, known_scenes, linked
from figures.report.markup import two_sentences, word
from figures.report.page import STYLE
from figures.report.running import ahead, duration, told
from figures.report.sources import about, cited, numbers
from tests.figures.project import claim, figures, project

LEDGER = json.loads((ROOT / "figures" / "ledger.json").read_text())["claims"]


# ---------------------------------------------------------------- sentences and sources


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (
            "GRIS Fig. 2: without a cap, it\nfreezes.\n\nTwo pixels.  And more.",
            "Without a cap, it freezes. Two pixels.",
        ),
        ("GRIS 6.4: what a chain forgets.  [GRIS 6.4]", "What a chain forgets."),
        ("MCMC 3.2.4, 4.2: mutations help. So [MCMC Eq. 3].", "Mutations help. So [MCMC Eq. 3]."),
        ("The scenes of flatland: each with paths.", "The scenes of flatland: each with paths."),
        ("GRIS Fig. 7 in flatland: n samples.", "n samples."),
    ],
)
def test_a_figure_is_told_in_the_first_two_sentences_of_its_module(text, said):
    assert two_sentences(text) == said


def test_every_figure_says_what_it_shows():
    from figures.engine.registry import load  # noqa: PLC0415

    assert all(len(two_sentences(about(entry))) > 40 for entry in load(Project().modules).values())


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("Eq. 1, 6", ["Eq. 1", "Eq. 6"]),
        ("Eq. 17, 36-38", ["Eq. 17", "Eq. 36", "Eq. 37", "Eq. 38"]),
        ("4.2, Eq. 35", ["Sec. 4.2", "Eq. 35"]),
        ("Def. 4.1, Eq. 22", ["Def. 4.1", "Eq. 22"]),
        ("Theorem A.2", ["Thm. A.2"]),
        ("Sec. 7.2, Sec. 7.4", ["Sec. 7.2", "Sec. 7.4"]),
    ],
)
def test_numbers_of_a_paper_are_read_as_they_are_cited(text, found):
    assert list(numbers(text)) == found


def test_the_code_of_an_equation_is_found():
    assert any(place.path == "restir_ref/mis.py" for place in cited(ROOT)["GRIS", "Eq. 38"])
    assert ("GRIS", "Eq. 999") not in cited(ROOT)


# ---------------------------------------------------------------- words


def unexplained(scenes):
    """Scenes without a line of their own."""
    return scenes - set(known_scenes())


def test_every_scene_of_the_ledger_is_explained():
    assert unexplained({scene for row in LEDGER for scene in row["scenes"]}) == set()
    assert unexplained({"FS99"}) == {"FS99"}


def test_every_paper_of_the_ledger_has_its_title_from_the_references():
    references = " ".join((ROOT / "docs" / "references.md").read_text(encoding="utf-8").split())
    assert {row["paper"] for row in LEDGER} == set(PAPERS)
    assert all(title.rpartition(",")[0] in references for key, title in PAPERS.items() if key != "COM")


def test_scenes_and_errors_lead_to_their_words():
    assert linked("relMSE on FS1 < 2") == ('<a href="#word-relMSE">relMSE</a> on <a href="#word-FS1">FS1</a> &lt; 2')
    assert linked("FS1x, T, my-MAPE") == "FS1x, T, my-MAPE"


def test_the_words_of_a_page_are_explained_once(done):
    text = (done[1] / "index.html").read_text()
    places = re.findall(r'id="([^"]+)"', text)
    assert len(places) == len(set(places))
    assert {word(each) for each in (*VERDICTS, TESTS, NOTHING)} <= set(places)


def test_what_came_out_otherwise_has_its_whole_reason_and_bars_their_preset(done):
    first, _ = (done[1] / "index.html").read_text().split('id="gallery"')
    assert "it is a uniform draw. Its mean is a half." in first
    assert "paper by paper, at the quick preset</h2>" in first


def test_the_filter_hides_by_paper_world_and_verdict(done):
    text = (done[1] / "index.html").read_text()
    for name, value in (("paper", "p-DEMO"), ("world", "w-toy1d"), ("verdict", "v-refuted"), ("verdict", "v-none")):
        assert f'main:has(#by-{name} option[value="{value}"]:checked) tbody.row:not(.{value})' in text
        assert f'<option value="{value}">' in text
    assert '<tbody class="row p-DEMO v-refuted w-toy1d" id="claim-DEMO-C02">' in text


def test_a_claim_is_found_by_the_world_that_shows_it_not_by_one_it_is_meant_for(tmp_path):
    claims = claim(), claim("DEMO-C02", quick="refuted") | {"worlds": ["toy1d", "tracer3d"]}
    figures(project(tmp_path, "refuted", claims=claims), "run", "--out", tmp_path / "out", "--jobs", "1")
    text = (tmp_path / "out" / "index.html").read_text()
    assert '<tbody class="row p-DEMO v-refuted w-toy1d" id="claim-DEMO-C02">' in text


# ---------------------------------------------------------------- colours


def themes(css):
    """The colours of the light and of the dark page, by name."""
    blocks = re.findall(r":root \{(.*?)\}", css, re.DOTALL)
    return [dict(re.findall(r"--(\w+): (#\w+)", block)) for block in blocks]


def contrast(one, other):
    """(L1 + .05) / (L2 + .05) of two colours #rrggbb, by their relative luminance."""
    lighter, darker = sorted((luminance(one), luminance(other)), reverse=True)
    return (lighter + 0.05) / (darker + 0.05)


def luminance(colour):
    parts = [int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)]
    red, green, blue = (part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts)
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue


def test_text_stands_out_from_the_page_by_day_and_by_night():
    both = themes(STYLE.read_text())
    assert len(both) == 2
    for theme in both:
        for ink in ("ink", "quiet", "bad"):
            assert min(contrast(theme[ink], theme[ground]) for ground in ("paper", "soft")) >= 4.5


def test_pale_text_is_noticed():
    assert contrast("#ffffff", "#000000") == pytest.approx(21)
    assert contrast("#999999", "#fdfdfb") < 4.5


# ---------------------------------------------------------------- a run under way


def manifest(status="running", computed=3, **figures):
    """A run that started 60 s before its manifest was written."""
    chunks = {"declared": 10, "reused": 1, "computed": computed}
    return {
        "status": status,
        "started": "2026-01-01T10:00:00+00:00",
        "noted": "2026-01-01T10:01:00+00:00",
        "figures": {name: {"status": how, "chunks": chunks} for name, how in figures.items()},
    }


def test_the_time_left_is_that_of_the_missing_chunks_at_the_pace_so_far():
    there = ahead(manifest(A="done", B="incomplete"))
    assert (there.missing, there.done, there.chunks) == (("B",), 8, 20)
    assert there.left == pytest.approx(60 * 12 / 6)


@pytest.mark.parametrize("data", [{}, manifest(computed=0, A="incomplete"), {"figures": {}, "status": "running"}])
def test_where_nothing_is_known_no_time_is_guessed(data):
    assert ahead(data).left is None


@pytest.mark.parametrize(("seconds", "words"), [(20, "a minute"), (600, "10 minutes"), (9000, "2 hours")])
def test_time_is_told_no_finer_than_the_guess(seconds, words):
    assert words in duration(seconds)


def test_a_page_tells_what_is_to_come_and_nothing_once_all_is_there():
    assert "Still to come: B." in "".join(told(manifest(A="done", B="incomplete")))
    assert "Ended early" in "".join(told(manifest("interrupted", A="incomplete")))
    assert not list(told(manifest("finished", A="done", B="crashed")))


def test_the_page_is_written_as_figures_finish(tmp_path, monkeypatch):
    pages = []
    here = project(tmp_path, "sound", "refuted")
    monkeypatch.setattr("figures.engine.progress.Sparing.__call__", lambda news: news.do())
    monkeypatch.setattr("figures.report.running.told", lambda data: pages.append(ahead(data).missing) or [])
    assert figures(here, "run", "--out", tmp_path / "out") == 0
    assert pages == [("DEMO-F01", "DEMO-F05"), ("DEMO-F05",), (), ()]


def test_news_take_a_small_part_of_the_time(monkeypatch):
    clock, told_at = [0.0], []

    def tell():
        told_at.append(clock[0])
        clock[0] += 1

    monkeypatch.setattr("figures.engine.progress.time.monotonic", lambda: clock[0])
    news = Sparing(tell)
    for second in range(1, 200):
        clock[0] = max(clock[0], second)
        news()
    assert told_at == [1, 52, 103, 154]
