"""The report as one HTML page that needs nothing but itself: pictures, style and text are all inside."""

import base64
import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import Any

from figures.claims.criteria import show
from figures.claims.figure import Verdict, words
from figures.claims.ledger import Row
from figures.claims.verdicts import Check, Judged, Record
from figures.engine.gather import Shown

SYMBOLS: dict[Verdict, str] = {
    "reported": "i",
    "reproduced": "✓",
    "reproduced with caveat": "≈",
    "not judged": "…",
    "not reproduced": "○",
    "refuted": "✗",
}
STYLE = Path(__file__).with_name("page.css")
COLUMNS = ("Claim", "Sentence", "Measured", "Criterion", "Verdict", "Expected")
SETUP = {"loop": "Loop", "camera": "Camera", "light": "Light", "view": "View"}


@dataclass(frozen=True)
class Beside:
    """What a page shows beside results: the ledger, the kept verdicts of the paper preset, and what does not fit."""

    ledger: Mapping[str, Row]
    paper: Mapping[str, Verdict]
    misfits: Sequence[str] = ()


def page(shown: Sequence[Shown], judged: Sequence[Judged], beside: Beside, manifest: Mapping[str, Any]) -> str:
    """The whole page: how the run went, the table of claims, then each figure beside its claims, by paper."""
    body = [
        "<h1>Figures and claims</h1>",
        *_summary(shown, judged, beside.misfits),
        *_table(judged, beside),
        *(part for figure in sorted(shown, key=lambda f: (paper(f.id), f.id)) for part in _figure(figure)),
        *_provenance(manifest),
    ]
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        "<title>restir-ref: figures and claims</title>\n"
        f"<style>\n{STYLE.read_text(encoding='utf-8')}</style>\n</head>\n<body>\n<main>\n"
        + "\n".join(body)
        + "\n</main>\n</body>\n</html>\n"
    )


def paper(id_: str) -> str:
    """The paper an id belongs to: what stands before its first hyphen."""
    return id_.partition("-")[0]


def badge(verdict: Verdict | None, where: str = "", preset: str = "") -> str:
    """A verdict by symbol and word, colour only repeats it; what is refuted or not judged says where."""
    if verdict is None:
        return '<span class="badge none">– not measured</span>'
    return f'<span class="badge {verdict.replace(" ", "-")}">{SYMBOLS[verdict]} {words(verdict, where, preset)}</span>'


def _summary(shown: Sequence[Shown], judged: Sequence[Judged], misfits: Sequence[str]) -> Iterator[str]:
    crashed = sum(f.record is not None and f.record.status == "crashed" for f in shown)
    unsound = sum(bool(f.troubles) for f in shown)
    differing = [row.id for row in judged if row.agrees is False]
    troubled = f"{crashed} crashed, {unsound} damaged or incomplete"
    yield f"<p>{len(judged)} claims, {len(shown)} figures, {troubled}.</p>"
    if differing:
        yield f'<p class="differs">Not as expected: {escape(", ".join(differing))}.</p>'
    yield from (f'<p class="differs">{escape(misfit)}</p>' for misfit in misfits)


def _table(judged: Sequence[Judged], beside: Beside) -> Iterator[str]:
    yield '<div class="wide"><table>'
    yield "<caption>Every claim, with what was measured and the rule it was judged by</caption>"
    heads = "".join(f'<th scope="col">{name}</th>' for name in COLUMNS)
    yield f"<thead><tr>{heads}</tr></thead>"
    for name in dict.fromkeys(sorted(paper(row.id) for row in judged)):
        yield f'<tbody><tr><th colspan="{len(COLUMNS)}" scope="rowgroup">{escape(name)}</th></tr>'
        for row in (row for row in judged if paper(row.id) == name):
            yield from _claim_rows(row, beside)
        yield "</tbody>"
    yield "</table></div>"


def _claim_rows(row: Judged, beside: Beside) -> Iterator[str]:
    """A claim's rows, one per check; the claim itself and what is expected of it span them."""
    entry = beside.ledger.get(row.id)
    span = f' rowspan="{max(1, len(row.checks))}"'
    links = " ".join(f'<a href="#{escape(id_)}">{escape(id_)}</a>' for id_ in row.figures)
    verdict = badge(row.verdict, row.where, row.preset)
    first = (
        f'<th scope="row"{span}>{escape(row.id)}<br>{verdict}<br><small>{links}</small></th>'
        f"<td{span}>{escape(entry.sentence if entry else '')}</td>"
    )
    cells = [_check_cells(check, row) for _, check in row.checks] or [f"<td></td><td></td><td>{badge(None)}</td>"]
    last = f"<td{span}>{_expectation(row, beside.paper.get(row.id))}</td>"
    yield f"<tr>{first}{cells[0]}{last}</tr>"
    yield from (f"<tr>{cell}</tr>" for cell in cells[1:])


def _check_cells(check: Check, row: Judged) -> str:
    part = f"<b>{escape(check.part)}</b> " if check.part else ""
    measured, rule = escape(show(check.measured) or check.reason), escape(check.criterion)
    return f"<td>{part}{measured}</td><td>{rule}</td><td>{badge(check.verdict, row.where, row.preset)}</td>"


def _expectation(row: Judged, paper: Verdict | None) -> str:
    expected = escape(row.expected) if row.expected else "nothing yet"
    notes = [f"<small>{escape(row.preset)}</small>"]
    if paper:
        notes.append(f"<small>kept paper run: {escape(paper)}</small>")
    if row.agrees is False:
        notes.append('<strong class="differs">differs</strong>')
    if not row.complete:
        notes.append("<small>not all of its figures are here</small>")
    return "<br>".join([expected, *notes])


def _figure(shown: Shown) -> Iterator[str]:
    record = shown.record
    title = f"{shown.id}: {record.title}" if record else shown.id
    yield f'<section id="{escape(shown.id)}">\n<h2>{escape(title)}</h2>'
    if record:
        about = f"{record.source}, {record.world}, preset {record.preset}, seed {record.seed}"
        yield f'<p class="about">{escape(about)}</p>'
    yield from (f'<p class="trouble">{escape(trouble)}</p>' for trouble in shown.troubles)
    if record and record.status == "crashed":
        yield f'<p class="trouble">This figure crashed.</p>\n<pre>{escape(record.traceback)}</pre>'
    elif record:
        yield from _pictured(shown, record)
    yield "</section>"


def _pictured(shown: Shown, record: Record) -> Iterator[str]:
    yield '<div class="pair"><figure>'
    if shown.picture:
        data = base64.b64encode(shown.picture).decode()
        yield f'<img alt="{escape(_alt(record))}" src="data:image/png;base64,{data}">'
    files = [f'<a href="{escape(shown.id)}/{name}">{name}</a>' for name in ("figure.pdf", "arrays.npz")]
    yield f"<figcaption>{' · '.join(files)}</figcaption></figure>\n<ul>"
    yield from (_item(check, record) for check in record.checks)
    yield "</ul></div>"
    if record.conditions:
        yield from _conditions(record)


def _conditions(record: Record) -> Iterator[str]:
    """Under which conditions the paper shows its claims, and under which they are judged here."""
    yield '<div class="wide"><table><caption>Conditions, by the paper and here</caption>'
    heads = "".join(f'<th scope="col">{name}</th>' for name in ("Claims", "Where", *SETUP.values(), "Why not the same"))
    yield f"<thead><tr>{heads}</tr></thead><tbody>"
    for each in record.conditions:
        ours, why = [str(each["ours"][name]) for name in SETUP], str(each["why"])
        first = f'<th scope="row" rowspan="2">{escape(", ".join(each["claims"]))}</th><td>{escape(each["source"])}</td>'
        theirs = "".join(f"<td>{escape(str(each['paper'][name]))}</td>" for name in SETUP)
        yield f'<tr>{first}{theirs}<td rowspan="2">{escape(why)}</td></tr>'
        yield f"<tr><td>here</td>{''.join(f'<td>{escape(cell)}</td>' for cell in ours)}</tr>"
    yield "</tbody></table></div>"


def _alt(record: Record) -> str:
    return " ".join([f"{record.title}.", *(f"{c.id} {c.part} {c.verdict}." for c in record.checks)])


def _item(check: Check, record: Record) -> str:
    rule = f"; criterion {check.criterion}" if check.verdict != "reported" else ""
    measured = f"Measured {show(check.measured)}{rule}." if check.verdict != "not judged" else ""
    lines = [
        f"{badge(check.verdict, record.world, record.preset)} <b>{escape(f'{check.id} {check.part}'.strip())}</b>",
        escape(check.sentence),
        *([escape(measured)] if measured else []),
        *(f"{name}: {escape(text)}" for name, text in _remarks(check) if text),
    ]
    return f"<li>{'<br>'.join(lines)}</li>"


def _remarks(check: Check) -> Iterable[tuple[str, str]]:
    return (("Caveat", check.caveat), ("Reason", check.reason))


def _provenance(manifest: Mapping[str, Any]) -> Iterator[str]:
    run = {name: value for name, value in manifest.items() if name != "figures"}
    yield "<section>\n<h2>How it was computed</h2>"
    yield f"<pre>{escape(json.dumps(run, indent=1))}</pre>\n</section>"
