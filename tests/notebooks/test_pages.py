"""The notebooks stand in docs/notebooks as they are, run, with pictures that have words, in less than 3 MB."""

import io
import json
import re
import shutil

import numpy as np
import pytest
from PIL import Image

from notebooks import pages, shift_mappings
from notebooks.show import Table, show
from tests.checkout import ROOT

MOST_BYTES = 3_000_000
PICTURE = re.compile(r"!\[([^\]]*)\]\(([^)]*)\)")


def faults(notebooks, folder):
    """Pages that are not of these notebooks; pictures without words, missing, or shown nowhere; too many bytes."""
    shown = set()
    for path in notebooks:
        text = (folder / f"{path.stem}.md").read_text(encoding="utf-8")
        for old, new in zip(pages.sources(text), cells := pages.cells(path), strict=False):
            if old != new:
                yield f"{path.stem}: {new.id} has changed"
        if len(pages.sources(text)) != len(cells):
            yield f"{path.stem}: cells are missing, or too many"
        for alt, name in PICTURE.findall(text):
            shown.add(folder / name)
            if not 20 <= len(alt) <= 300:
                yield f"{name}: {len(alt)} letters of words"
    there = set(folder.rglob("*.png"))
    yield from (f"{path.name} is missing" for path in sorted(shown - there))
    yield from (f"{path.name} is not shown" for path in sorted(there - shown))
    size = sum(path.stat().st_size for path in folder.rglob("*.*"))
    if size > MOST_BYTES:
        yield f"{size} bytes"


def test_the_pages_are_current_and_whole():
    assert list(faults(pages.notebooks(), pages.PAGES)) == []


def test_the_list_of_pages_is_current():
    assert (pages.PAGES / "README.md").read_text(encoding="utf-8") == pages.index()


# ---------------------------------------------------------------- twins, on a small notebook

CELLS = [
    ("markdown", "# Small\n\nA notebook of one picture."),
    ("code", "from tests.notebooks.test_show import plain\nfrom notebooks.show import explore, show"),
    ("code", "print('said')\nshow(plain, 'A picture of nothing at all, ')"),
    ("code", "explore(plain, letter=['a', 'b', 'c'], title=['A picture of nothing at all, '])"),
]


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A notebook, its page and its pictures."""
    tmp_path = tmp_path_factory.mktemp("made")
    cells = [{"cell_type": kind, "id": f"cell-{k:02d}", "source": text} for k, (kind, text) in enumerate(CELLS)]
    path, folder = tmp_path / "small.ipynb", tmp_path / "pages"
    path.write_text(json.dumps({"cells": cells}), encoding="utf-8")
    (line,) = pages.write([path], folder)
    assert "4 pictures" in line
    return path, folder


@pytest.fixture
def small(made, tmp_path):
    """A copy to be spoiled."""
    path, folder = made
    shutil.copytree(folder, tmp_path / "pages")
    return path, tmp_path / "pages"


def test_a_page_holds_its_notebook_and_what_it_shows(small):
    path, folder = small
    text = (folder / "small.md").read_text(encoding="utf-8")
    assert list(faults([path], folder)) == []
    assert pages.sources(text) == [pages.Cell(f"cell-{k:02d}", kind, source) for k, (kind, source) in enumerate(CELLS)]
    assert "```text\nsaid\n```" in text
    assert "*Shown: letter = a. The notebook has controls for `letter`: a, b, c.*" in text
    assert text.count("<details>") == text.count("</details>") == 1


SPOIL = {
    "another word": lambda text: text.replace("one picture", "two pictures"),
    "another line of code": lambda text: text.replace("print('said')", "print('unsaid')", 1),
    "a cell too few": lambda text: text[: text.index("<!-- cell-03 code")],
    "a picture without words": lambda text: PICTURE.sub(r"![](\2)", text, count=1),
    "a picture that is not there": lambda text: text.replace("cell-02.png", "cell-20.png"),
}


@pytest.mark.parametrize("spoil", SPOIL.values(), ids=SPOIL)
def test_a_spoiled_page_is_noticed(small, spoil):
    path, folder = small
    page = folder / "small.md"
    page.write_text(spoil(page.read_text(encoding="utf-8")), encoding="utf-8")
    assert list(faults([path], folder))


def test_a_picture_too_many_and_a_page_too_large_are_noticed(small):
    path, folder = small
    shutil.copy(folder / "small" / "cell-02.png", folder / "small" / "old.png")
    assert list(faults([path], folder)) == ["old.png is not shown"]
    (folder / "small" / "old.png").write_bytes(b"0" * MOST_BYTES)
    assert len(list(faults([path], folder))) == 2


# ---------------------------------------------------------------- outputs


def test_a_cell_shows_what_it_prints_and_its_last_value():
    assert pages.run("print('a')\n1 + 1", {}, "cell") == ["a\n", 2]
    assert pages.run("x = 1", {}, "cell") == pages.run("", {}, "cell") == pages.run("None", {}, "cell") == []


def test_a_table_is_one_of_markdown():
    assert pages.in_markdown(Table(["a", ""], [("x|y", 1)]), "name", {}) == "| a |  |\n| --- | --- |\n| x\\|y | 1 |"


FORMULAS = "with $a\\,b$ and $c$,\n\n$$\nx \\tag{1}\n$$\n\n```python\nprice = '$1', '$2'\n```"


def test_formulas_stand_in_backticks_and_code_stays():
    web = pages.web(FORMULAS)
    assert web == FORMULAS.replace("$a\\,b$ and $c$", "$`a\\,b`$ and $`c`$").replace(
        "$$\nx \\tag{1}\n$$", "```math\nx \\tag{1}\n```"
    )
    assert pages.sources(f"<!-- cell-00 markdown -->\n{web}\n") == [pages.Cell("cell-00", "markdown", FORMULAS)]


def apart(a, b):
    """The largest difference of two pictures in a channel, of 255."""
    a, b = (np.asarray(each.convert("RGB"), dtype=int) for each in (a, b))
    return abs(a - b).max()


def test_compressed_pictures_look_the_same():
    png = show(shift_mappings.example, "hybrid", 17).png
    small = pages.compressed(png)
    before, after = (Image.open(io.BytesIO(each)) for each in (png, small))
    assert before.size == after.size
    assert after.convert("RGB").getpixel((0, 0)) == (255, 255, 255)
    assert apart(before, after) <= 8
    assert len(small) < len(png) / 2


def test_a_small_dot_that_loses_its_colour_is_noticed():
    before = Image.open(io.BytesIO(show(shift_mappings.example, "hybrid", 17).png)).convert("RGB")
    assert apart(before, before.quantize(128, dither=Image.Dither.NONE)) > 32


def test_the_readme_links_the_pages():
    assert "docs/notebooks/README.md" in (ROOT / "README.md").read_text(encoding="utf-8")
