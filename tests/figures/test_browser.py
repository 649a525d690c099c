"""Laws of the page as a browser lays it out, where one is installed: nothing sticks out, pictures come early."""

import pytest

from tests.checkout import ROOT
from tests.figures.browser import AXE, browser, looks, pages
from tests.figures.test_report import page

WIDTHS = (1400, 480)
SCREEN = 800  # CSS pixels
pytestmark = pytest.mark.skipif(not browser(), reason="no Chromium here: install one, or name it in CHROMIUM")

FAULTS = {
    "comes late": ("<div style='height:5000px'></div>", "first"),
    "sticks out": ("<p style='width:3000px'>wide</p>", "excess"),
    "asks the network": ("<img alt='x' src='http://127.0.0.1:9/x.png'>", "requests"),
    "says nothing": ("<img src='x.png'>", "alts"),
    "says too much": (f"<img src='x.png' alt='{'x' * 301}'>", "alts"),
}


def faults(found):
    """What is wrong with a page, by the name of what was measured."""
    wrong = {
        "excess": any(each["excess"] > 0 for each in found.values()),
        "requests": any(not name.startswith("file:") for each in found.values() for name in each["requests"]),
        "first": any(each["first"] is None or each["first"] > 2 * SCREEN for each in found.values()),
        "alts": any(not 0 < length <= 300 for each in found.values() for length in each["alts"]),
        "axe": any(each["axe"] for each in found.values()),
    }
    return {name for name, fault in wrong.items() if fault}


def test_the_page_fits_its_window_needs_no_network_and_shows_a_picture_early(done):
    _, out = done
    assert faults(looks(out / "index.html", WIDTHS, SCREEN)) == set()


def test_a_page_that_sticks_out_or_asks_the_network_or_hides_its_pictures_is_noticed(done):
    _, out = done
    planted = "".join(text for text, _ in FAULTS.values())
    (out / "index.html").write_text(page(out).replace("<main>", f"<main>{planted}"))
    assert faults(looks(out / "index.html", WIDTHS, SCREEN)) >= {name for _, name in FAULTS.values()}


@pytest.mark.skipif(not AXE, reason="no axe-core here: name its axe.min.js in AXE_CORE")
def test_the_page_has_no_fault_that_axe_finds(done):
    _, out = done
    found = looks(out / "index.html", WIDTHS, SCREEN, AXE)
    assert all(each["axe"] == [] for each in found.values())


@pytest.mark.skipif(not AXE, reason="no axe-core here: name its axe.min.js in AXE_CORE")
def test_grey_on_grey_is_noticed_by_axe(done):
    _, out = done
    (out / "index.html").write_text(page(out).replace("<main>", "<main><p style='color:#999;background:#aaa'>grey</p>"))
    assert "axe" in faults(looks(out / "index.html", WIDTHS[:1], SCREEN, AXE))


WHOLE = ROOT / "out" / "index.html"
"""The report of all figures, where `make figures` has made one."""


@pytest.mark.skipif(not WHOLE.exists(), reason="no report of all figures here: make figures")
def test_the_report_of_all_figures_fits_its_window_and_prints_on_less_than_40_pages(tmp_path):
    (tmp_path / "out").symlink_to(WHOLE.parent)
    assert faults(looks(tmp_path / "out" / "index.html", WIDTHS, SCREEN, AXE, place=tmp_path)) == set()
    assert 2 < pages(WHOLE, tmp_path) < 40


def test_pages_are_counted(tmp_path):
    (tmp_path / "index.html").write_text("<p style='break-after:page'>1</p>" * 6 + "<p>7</p>")
    assert pages(tmp_path / "index.html", tmp_path) == 7
