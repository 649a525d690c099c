"""What the page shows beside results: the ledger, who shows its claims, the code, and kept runs."""

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path

from figures.claims.figure import Entry, Verdict
from figures.claims.ledger import Row
from figures.claims.showings import Showing
from figures.engine.kept import Kept
from figures.engine.manifest import ROOT
from figures.report.markup import link, paper
from figures.report.sources import Place, cited, numbers


@dataclass(frozen=True)
class Beside:
    """The ledger, the figures there are, who shows a claim, and the kept runs of the paper preset with their verdicts.

    `misfits` is what does not fit, in words; `up` leads from the page to the checkout.
    """

    ledger: Mapping[str, Row]
    entries: Mapping[str, Entry]
    shown_by: Mapping[str, Sequence[Showing]]
    kept: Mapping[str, Kept]
    paper: Mapping[str, Verdict]
    misfits: Sequence[str]
    up: str


def way_up(out: Path) -> str:
    """From a folder of results to the checkout, as a link says it."""
    return Path(os.path.relpath(ROOT, out.resolve())).as_posix()


def module_link(figure: str, beside: Beside) -> str:
    """The module that computes and judges a figure; empty where there is none any more."""
    entry = beside.entries.get(figure)
    return file_link(entry.module.replace(".", "/") + ".py", "", beside) if entry else ""


def file_link(path: str, text: str, beside: Beside) -> str:
    """A file of the checkout under its path, or another text."""
    return link(f"{beside.up}/{path}", text or path)


def code_links(claim: str, beside: Beside) -> list[str]:
    """The functions and classes whose docstrings cite the equation or section that a claim stands in."""
    row, known = beside.ledger.get(claim), cited(ROOT)
    wanted = numbers(row.source) if row else ()
    places = [place for name in wanted for place in known.get((paper(claim), name), ())]
    return [_place_link(place, beside) for place in dict.fromkeys(places)]


def _place_link(place: Place, beside: Beside) -> str:
    line = f"{place.path}:{place.line}"
    return f'<a href="{escape(beside.up)}/{escape(place.path)}">{escape(place.name)}</a> <small>{escape(line)}</small>'


def test_links(claim: str, beside: Beside) -> list[str]:
    """The tests that show a claim, each with the part that it shows."""
    return [
        file_link(each.name.partition("::")[0], each.name, beside) + (f" ({escape(each.part)})" if each.part else "")
        for each in beside.shown_by.get(claim, ())
        if each.kind == "tests"
    ]


def chain(claim: str, beside: Beside) -> str:
    """Claim -> code -> test, folded: a claim's equations in code, and what tests show it."""
    code, tests = code_links(claim, beside), test_links(claim, beside)
    if not code and not tests:
        return ""
    lists = [
        f"<p>{name}</p><ul>{''.join(f'<li>{each}</li>' for each in links)}</ul>"
        for name, links in (("Code that cites it", code), ("Tests that show it", tests))
        if links
    ]
    counts = f"code: {len(code)}, tests: {len(tests)}"
    return f'<details class="chain"><summary>{counts}</summary>{"".join(lists)}</details>'
