"""The index of symptoms agrees with the zoo: its words with the signs of exact biases, its page with the numbers."""

import re
from dataclasses import replace

import pytest

from restir_ref.oracle.zoo.page import SECTIONS, Entry, pieces
from restir_ref.transport.proofs.zoo import TRANSPORT_BUGS
from restir_ref.transport.proofs.zoo.page import section
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


def test_the_index_of_symptoms_is_up_to_date() -> None:
    """If not: python -m restir_ref.transport.proofs.zoo > docs/symptoms.md."""
    text = (ROOT / "docs" / "symptoms.md").read_text(encoding="utf-8")
    assert text == "".join([*pieces([looked_up(name) for name in ALL]), *section([*TRANSPORT_BUGS.values()])])
    assert [text.count(f"## {title}\n") for title in SECTIONS] == [1] * len(SECTIONS)


def test_an_outdated_index_is_noticed() -> None:
    text = (ROOT / "docs" / "symptoms.md").read_text(encoding="utf-8")
    said = looked_up("null confidence 0")
    forged = replace(said, bias=said.bias * 1.01)
    assert not text.startswith("".join(pieces([forged if n == said.bug.name else looked_up(n) for n in ALL])))
