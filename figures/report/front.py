"""The first screen: what this is, verdicts per paper as bars, and what came out otherwise, with reasons."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from typing import Any

from figures.claims.criteria import show
from figures.claims.figure import Verdict, words
from figures.claims.verdicts import Judged
from figures.engine.gather import Shown
from figures.report.beside import Beside
from figures.report.glossary import PAPERS
from figures.report.markup import OTHERWISE, SYMBOLS, kind, link, listed, paper, place_of, sentences, word

WHAT = (
    "restir-ref computes the figures of four papers on ReSTIR (reservoir-based spatiotemporal importance resampling) "
    "anew, with code that is written to be read beside them. "
    "What the papers say is cut into claims, each with a number that is measured here, a criterion that could fail, "
    "and a verdict (<a href='#words'>the words explained</a>). "
    "Claims no figure is about are shown by tests, and the <a href='#all-claims'>table of all claims</a> tells which."
)
TESTS, NOTHING = "by tests alone", "not yet"
ORDER = ("reproduced", "reproduced with caveat", "not reproduced", "refuted", "reported", "not judged", TESTS, NOTHING)
"""From left to right in a bar."""
MARKS: dict[str, str] = {**{str(name): mark for name, mark in SYMBOLS.items()}, TESTS: "t", NOTHING: "–"}


@dataclass(frozen=True)
class Failure:
    """A claim that came out otherwise: its figure and verdict, the words for it, and the reason in one line."""

    claim: str
    figure: str
    verdict: Verdict
    said: str
    reason: str


def front(shown: Sequence[Shown], judged: Sequence[Judged], beside: Beside) -> Iterator[str]:
    """The whole of it."""
    yield f"<p>{WHAT}</p>"
    yield from _bars(judged, beside)
    yield from _otherwise(judged, beside)
    yield from _troubles(shown, judged, beside.misfits)


# ---------------------------------------------------------------- bars


def counts(judged: Sequence[Judged], beside: Beside) -> dict[str, Counter[str]]:
    """Paper -> how many of its claims have which verdict, are shown by tests alone, or not yet."""
    verdicts = {row.id: row.verdict for row in judged if row.verdict}
    found: dict[str, Counter[str]] = {}
    for id_ in dict.fromkeys([*beside.ledger, *(row.id for row in judged)]):
        tested = any(each.kind == "tests" for each in beside.shown_by.get(id_, ()))
        how = verdicts.get(id_) or (TESTS if tested else NOTHING)
        found.setdefault(paper(id_), Counter())[how] += 1
    order = [*PAPERS, *sorted(set(found) - set(PAPERS))]
    return {name: found[name] for name in order if name in found}


def _bars(judged: Sequence[Judged], beside: Beside) -> Iterator[str]:
    presets = " and ".join(sorted({row.preset for row in judged})) or "no"
    yield f'<h2 id="verdicts">Claims, paper by paper, at the {presets} preset</h2>\n<div class="bars">'
    for name, count in counts(judged, beside).items():
        parts = [(how, count[how]) for how in ORDER if count[how]]
        said = ", ".join(f"{number} {how}" for how, number in parts)
        title = PAPERS.get(name, "")
        yield f"<p><b>{escape(name)}</b> {escape(title)}, {count.total()} claims</p>"
        yield f'<div class="bar" role="img" aria-label="{escape(name)}: {said}">{_segments(parts)}</div>'
        pieces = (f'<span class="badge {_kind(how)}">{MARKS[how]} {number} {how}</span>' for how, number in parts)
        yield f'<p class="counts">{" ".join(pieces)}</p>'
    yield "</div>"


def _segments(parts: Sequence[tuple[str, int]]) -> str:
    return "".join(f'<span class="{_kind(how)}" style="flex-grow:{number}"></span>' for how, number in parts)


def _kind(how: str) -> str:
    return how.replace(" ", "-")


# ---------------------------------------------------------------- what came out otherwise


def failures(judged: Sequence[Judged], beside: Beside) -> list[Failure]:
    """Claims that came out otherwise here, then those that did so only in kept runs of the paper preset."""
    here = [_failure(row) for row in judged if row.verdict in OTHERWISE]
    seen = {each.claim for each in here}
    return [*here, *(each for each in _kept(beside) if each.claim not in seen)]


def _failure(row: Judged) -> Failure:
    figure, check = next((figure, check) for figure, check in row.checks if check.verdict == row.verdict)
    verdict: Verdict = check.verdict
    why = _why(vars(check))
    return Failure(row.id, figure, verdict, words(verdict, row.where, row.preset), why)


def _kept(beside: Beside) -> Iterator[Failure]:
    for figure, run in beside.kept.items():
        worst: dict[str, Mapping[str, Any]] = {}
        for check in (check for check in run.checks if check["verdict"] in OTHERWISE):
            worst.setdefault(check["id"], check)
        for id_, check in worst.items():
            if figure in beside.entries:
                yield Failure(id_, figure, check["verdict"], f"{check['verdict']} at the paper preset", _why(check))


def _why(check: Mapping[str, Any]) -> str:
    """What was measured, against which criterion, and the reason."""
    part = f"{check['part']}: " if check["part"] else ""
    reason = sentences(check["reason"])
    return " ".join([f"{part}{show(check['measured'])}, criterion {check['criterion']}.", *reason])


def _otherwise(judged: Sequence[Judged], beside: Beside) -> Iterator[str]:
    yield '<h2 id="otherwise">What came out otherwise</h2>'
    found = failures(judged, beside)
    if not found:
        yield "<p>Nothing so far: no claim that was judged is refuted or not reproduced.</p>"
    yield '<ul class="otherwise">' if found else ""
    for each in found:
        row = beside.ledger.get(each.claim)
        mark = f'<span class="badge {kind(each.verdict)}">{SYMBOLS[each.verdict]} {escape(each.said)}</span>'
        there = link(f"#{place_of(each.claim, each.figure)}", each.claim)
        yield f'<li>{mark} {there} <span class="clamp">{escape(row.sentence if row else "")}</span>'
        yield f'<span class="why">{escape(each.reason)}</span></li>'
    yield "</ul>" if found else ""
    careful = [row for row in judged if row.verdict == "reproduced with caveat" and row.figures]
    if careful:
        links = [link(f"#{place_of(row.id, row.checks[0][0])}", row.id) for row in careful]
        about = f'<a href="#{word("reproduced with caveat")}">with a caveat</a>'
        yield f"<p>Reproduced {about}: {listed(links)}.</p>"


def _troubles(shown: Sequence[Shown], judged: Sequence[Judged], misfits: Sequence[str]) -> Iterator[str]:
    crashed = [f.id for f in shown if f.record is not None and f.record.status == "crashed"]
    unsound = [f.id for f in shown if f.record is None or f.troubles]
    differing = [row.id for row in judged if row.agrees is False]
    lines = [
        *([f"Crashed: {', '.join(crashed)}."] if crashed else []),
        *([f"Damaged or incomplete: {', '.join(unsound)}."] if unsound else []),
        *([f"Not as expected: {', '.join(differing)}."] if differing else []),
        *misfits,
    ]
    yield from (f'<p class="differs">{escape(line)}</p>' for line in lines)
