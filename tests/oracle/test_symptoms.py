"""The index of symptoms agrees with the zoo: its words with the signs of exact biases, its page with the numbers."""

import re
from collections.abc import Iterator
from dataclasses import replace

import pytest

from restir_ref.oracle.zoo.cures import CURES
from restir_ref.oracle.zoo.page import BEFORE, SECTIONS, Entry, pieces
from restir_ref.transport.proofs.zoo import TRANSPORT_BUGS
from restir_ref.transport.proofs.zoo.cached import CACHE_BUGS
from restir_ref.transport.proofs.zoo.cures import PATH_CURES
from restir_ref.transport.proofs.zoo.gradients import GRADIENT_BUGS
from restir_ref.transport.proofs.zoo.page import cached, differences, section
from tests.checkout import ROOT
from tests.oracle.pinned import ALL, looked_up

SIGNS = {"Dark": {"dark"}, "Bright": {"bright"}, "Bright here, dark there": {"bright", "dark"}}


def poor_words(said: Entry) -> list[str]:
    """What a bug's description lacks, or says against its own numbers."""
    bug = said.bug
    signs = set(re.findall("dark|bright", bug.symptom))
    wanted = SIGNS.get(said.section, set())
    found = [] if signs == wanted else [f"says {sorted(signs)} of {said.section}"]
    found += [] if wanted or "no bias" in bug.symptom else ["does not say that there is no bias"]
    found += [] if re.fullmatch(r"\[(GRIS|MCMC|Chao 1982)\b[^]]*\]", bug.breaks) else ["breaks no equation"]
    return found + [f"tells no {what}" for what in ("story", "symptom") if len(getattr(bug, what)) < 25]


@pytest.mark.parametrize("name", ALL)
def test_a_bug_says_how_it_gets_in_what_it_looks_like_and_what_it_breaks(name) -> None:
    assert poor_words(looked_up(name)) == []


@pytest.mark.parametrize(("part", "words"), [("symptom", "dark"), ("breaks", "[Eq. 3]"), ("story", "oops")])
def test_poor_words_are_noticed(part, words) -> None:
    said = looked_up("null confidence 0")
    assert poor_words(replace(said, bug=replace(said.bug, **{part: words})))


def others() -> Iterator[str]:
    """The parts of the page about paths, caches and differences."""
    yield from section([*TRANSPORT_BUGS.values()])
    yield from cached([*CACHE_BUGS.values()])
    yield from differences([*GRADIENT_BUGS.values()])


def test_the_index_of_symptoms_is_up_to_date() -> None:
    """If not: python -m restir_ref.transport.proofs.zoo > docs/symptoms.md."""
    text = (ROOT / "docs" / "symptoms.md").read_text(encoding="utf-8")
    assert text == "".join([*pieces([looked_up(name) for name in ALL]), *others()])
    assert [text.count(f"## {title}\n") for title in SECTIONS] == [1] * len(SECTIONS)


def cures_missing(text: str) -> list[str]:
    """The symptoms of a page without a cure in its column."""
    missing, column = [], -1
    for line in text.splitlines():
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        if not line.startswith("| ") or set(cells) == {"---"}:
            continue
        if cells[0] in ("what it looks like", "check"):
            column = cells.index("cure") if "cure" in cells else len(cells) if cells[0] == "check" else -1
        elif column < len(cells) and (column < 0 or len(cells[column]) < 15 or cells[column] == cells[column - 1]):
            missing.append(cells[0])
    return missing


def test_every_symptom_of_the_page_has_a_cure() -> None:
    text = (ROOT / "docs" / "symptoms.md").read_text(encoding="utf-8")
    assert cures_missing(text) == []
    assert text.count("| cure |") == len(SECTIONS) + 4


@pytest.mark.parametrize(
    ("before", "after", "missing"),
    [
        (f"| {CURES['W clamped']} |", "|  |", ["dark where samples are rare and strong: caustics, small lights"]),
        (f"| {BEFORE[0][3]} |", f"| {BEFORE[0][2]} |", [BEFORE[0][0]]),
        ("| how it gets in | cure |\n", "| how it gets in |\n", [b[0] for b in BEFORE]),
    ],
    ids=["empty", "copied", "no column"],
)
def test_a_symptom_without_a_cure_is_noticed(before, after, missing) -> None:
    text = (ROOT / "docs" / "symptoms.md").read_text(encoding="utf-8")
    assert before in text
    assert cures_missing(text.replace(before, after)) == missing


def test_every_mistake_has_a_cure_and_there_is_no_cure_without_a_mistake() -> None:
    assert set(CURES) == set(ALL)
    assert set(PATH_CURES) == set(TRANSPORT_BUGS)


def test_an_outdated_index_is_noticed() -> None:
    text = (ROOT / "docs" / "symptoms.md").read_text(encoding="utf-8")
    said = looked_up("null confidence 0")
    forged = replace(said, bias=said.bias * 1.01)
    assert not text.startswith("".join(pieces([forged if n == said.bug.name else looked_up(n) for n in ALL])))
