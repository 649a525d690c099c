"""Pieces that every part of the page is made of: badges, links, and names of places on it."""

import re
import textwrap
from html import escape

from figures.claims.figure import Verdict, words

SYMBOLS: dict[Verdict, str] = {
    "reported": "i",
    "reproduced": "✓",
    "reproduced with caveat": "≈",
    "not judged": "…",
    "not reproduced": "○",
    "refuted": "✗",
}
OTHERWISE: tuple[Verdict, ...] = ("refuted", "not reproduced")
"""What came out otherwise than the paper says."""
LONGEST_ALT = 300


def badge(verdict: Verdict | None, where: str = "", preset: str = "") -> str:
    """A verdict by symbol and word, colour only repeats it; what is refuted or not judged says where."""
    if verdict is None:
        return '<span class="badge none">– no figure</span>'
    return f'<span class="badge {kind(verdict)}">{SYMBOLS[verdict]} {words(verdict, where, preset)}</span>'


def kind(verdict: Verdict | None) -> str:
    """The name of a verdict in the style sheet."""
    return verdict.replace(" ", "-") if verdict else "none"


def link(target: str, text: str) -> str:
    """A link whose text is plain."""
    return f'<a href="{escape(target)}">{escape(text)}</a>'


def paper(id_: str) -> str:
    """The paper an id belongs to: what stands before its first hyphen."""
    return id_.partition("-")[0]


def row_of(claim: str) -> str:
    """Where a claim stands in the table of all claims."""
    return f"claim-{claim}"


def place_of(claim: str, figure: str) -> str:
    """Where a claim stands below a figure."""
    return f"{figure}--{claim}"


def word(term: str) -> str:
    """Where a word, a measure of error or a scene is explained."""
    return f"word-{term.replace(' ', '-')}"


def short(text: str, longest: int = LONGEST_ALT) -> str:
    """The text on one line, cut where a word ends."""
    return textwrap.shorten(text, longest, placeholder=" ...")


def sentences(text: str) -> list[str]:
    """The sentences of a text whose lines are joined, without citations in brackets behind them."""
    joined = re.sub(r"\s*\[[A-Z][^\]]*\]\s*$", "", " ".join(text.split()))
    return [part for part in re.split(r"(?<=[.?!])\s+(?=[A-Z(])", joined) if part]


def two_sentences(text: str) -> str:
    """The first two sentences of a module's docstring, without the number of the figure they start with."""
    said = sentences(re.sub(r"^[A-Z]{3,} [^:.]*(?:\.[^:.]*)*?: ", "", text.strip()))[:2]
    whole = " ".join(said)
    return whole if re.match(r"\w\b", whole) else whole[:1].upper() + whole[1:]


def listed(html: list[str], empty: str = "") -> str:
    """Pieces with commas between."""
    return ", ".join(html) if html else empty
