"""The table of all claims of the ledger, folded, with a filter by paper, world and verdict that needs no script."""

from collections.abc import Iterator, Sequence
from html import escape

from figures.claims.criteria import show
from figures.claims.figure import VERDICTS, Verdict
from figures.claims.ledger import Row
from figures.claims.verdicts import Check, Judged
from figures.report.beside import Beside, chain
from figures.report.glossary import linked
from figures.report.markup import badge, kind, link, listed, paper, place_of, row_of, word

COLUMNS = ("Claim", "Sentence", "Measured", "Criterion", "Verdict", "Expected")
EXPLAINED = {"Criterion": "criterion", "Verdict": "reproduced", "Expected": "expected"}


def register(judged: Sequence[Judged], beside: Beside) -> Iterator[str]:
    """The section: filter and table, folded."""
    found: dict[str, list[Judged]] = {}
    for row in judged:
        found.setdefault(row.id, []).append(row)
    ids = list(dict.fromkeys([*beside.ledger, *found]))
    yield '<section>\n<h2 id="all-claims">All claims</h2>'
    yield f"<details><summary>The table of all {len(ids)} claims, with a filter</summary>"
    yield from _filter(ids, beside)
    yield '<div class="wide" tabindex="0" role="region" aria-label="All claims"><table class="register">'
    yield "<caption>Every claim, with what was measured and the rule it was judged by</caption>"
    yield f"<thead><tr>{''.join(_head(name) for name in COLUMNS)}</tr></thead>"
    for id_ in ids:
        first, *others = found.get(id_, [None])
        yield from _body(id_, first, beside, f' id="{row_of(id_)}"')
        yield from (line for row in others for line in _body(id_, row, beside, ""))
    yield "</table></div></details>\n</section>"


def _head(name: str) -> str:
    shown = link(f"#{word(EXPLAINED[name])}", name) if name in EXPLAINED else name
    return f'<th scope="col">{shown}</th>'


# ---------------------------------------------------------------- the filter


def _choices(ids: Sequence[str], beside: Beside) -> dict[str, dict[str, str]]:
    """Name of a choice -> class in the table -> what it is called; "" hides nothing."""
    worlds = [world for row in beside.ledger.values() for world in row.worlds]
    return {
        "paper": {"": "all", **{f"p-{name}": name for name in dict.fromkeys(map(paper, ids))}},
        "world": {"": "all", **{f"w-{name}": name for name in dict.fromkeys(worlds)}},
        "verdict": {"": "all", **{f"v-{kind(name)}": name for name in VERDICTS}, "v-none": "no figure"},
    }


def _filter(ids: Sequence[str], beside: Beside) -> Iterator[str]:
    """Selections, and the rules that hide what is not chosen."""
    yield '<form class="filter">'
    for name, options in _choices(ids, beside).items():
        shown = "".join(f'<option value="{escape(value)}">{escape(text)}</option>' for value, text in options.items())
        yield f'<label>{name} <select id="by-{name}">{shown}</select></label>'
    yield "</form>\n<style>"
    for name, options in _choices(ids, beside).items():
        for value in filter(None, options):
            chosen = f'main:has(#by-{name} option[value="{value}"]:checked)'
            yield f"{chosen} tbody.row:not(.{value}) {{ display: none }}"
    yield "</style>"


# ---------------------------------------------------------------- rows


def _body(id_: str, judged: Judged | None, beside: Beside, place: str) -> Iterator[str]:
    """A claim's rows, one per check; the claim itself and what is expected of it span them."""
    row, checks = beside.ledger.get(id_), judged.checks if judged else ()
    verdict = judged.verdict if judged else None
    shown = {beside.entries[figure].figure.world for figure, _ in checks if figure in beside.entries}
    worlds = sorted(shown) or (row.worlds if row else ())  # those of its figures; without any, those it is meant for
    classes = [f"p-{paper(id_)}", f"v-{kind(verdict)}", *(f"w-{world}" for world in worlds)]
    yield f'<tbody class="row {escape(" ".join(classes))}"{place}>'
    span = f' rowspan="{max(1, len(checks))}"'
    cells = [_check(check, judged) for _, check in checks if judged] or [_nothing(row)]
    last = f"<td{span}>{_expectation(judged, beside.paper.get(id_))}</td>"
    yield f"<tr>{_claim(id_, judged, span, beside)}{cells[0]}{last}</tr>"
    yield from (f"<tr>{cell}</tr>" for cell in cells[1:])
    yield "</tbody>"


def _claim(id_: str, judged: Judged | None, span: str, beside: Beside) -> str:
    row, figures = beside.ledger.get(id_), judged.figures if judged else ()
    links = listed([link(f"#{place_of(id_, figure)}", figure) for figure in figures])
    mark = badge(judged.verdict, judged.where, judged.preset) if judged else badge(None)
    source = escape(row.source) if row else ""
    sentence = linked(row.sentence) if row else ""
    head = f'<th scope="row"{span}>{escape(id_)}<br><small>{source}</small><br>{mark}<br><small>{links}</small></th>'
    return f"{head}<td{span}>{sentence}{chain(id_, beside)}</td>"


def _check(check: Check, judged: Judged) -> str:
    part = f"<b>{escape(check.part)}</b> " if check.part else ""
    measured, rule = escape(show(check.measured) or check.reason), linked(check.criterion)
    mark = badge(check.verdict, judged.where, judged.preset)
    return f"<td>{part}{measured}</td><td>{rule}</td><td>{mark}</td>"


def _nothing(row: Row | None) -> str:
    """A claim that no figure here has judged, with the ledger's rule."""
    return f"<td></td><td>{linked(row.criterion) if row else ''}</td><td>{badge(None)}</td>"


def _expectation(judged: Judged | None, paper: Verdict | None) -> str:
    notes = [f"kept paper run: {paper}"] if paper else []
    if judged is None:
        return "<br>".join(f"<small>{escape(note)}</small>" for note in notes)
    expected = escape(judged.expected) if judged.expected else "nothing yet"
    unfinished = [] if judged.complete else ["not all of its figures are here"]
    small = [f"<small>{escape(note)}</small>" for note in (judged.preset, *notes, *unfinished)]
    differs = ['<strong class="differs">differs</strong>'] if judged.agrees is False else []
    return "<br>".join([expected, *small, *differs])
