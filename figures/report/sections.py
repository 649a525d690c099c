"""The pictures: a gallery of all, then a section per figure with its picture, its claims, and its conditions."""

import sys
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from html import escape

from figures.claims.criteria import show
from figures.claims.figure import VERDICTS
from figures.claims.verdicts import Check, Record
from figures.engine.gather import Shown
from figures.report.beside import Beside, chain, module_link
from figures.report.glossary import linked
from figures.report.markup import badge, link, place_of, row_of, short, two_sentences
from figures.report.sources import about
from figures.report.style import RC

SETUP = {"loop": "Loop", "camera": "Camera", "light": "Light", "view": "View"}
HEADS = ("Verdict", "What", "Measured", "Criterion")
CSS_PIXELS_PER_INCH = 96


def in_order(shown: Sequence[Shown], beside: Beside) -> dict[str, list[Shown]]:
    """Wing -> its figures, as they are listed; those that no module declares any more come last."""
    rank = {id_: number for number, id_ in enumerate(beside.entries)}
    wings: dict[str, list[Shown]] = {}
    for figure in sorted(shown, key=lambda f: (rank.get(f.id, len(rank)), f.id)):
        wings.setdefault(_wing(figure.id, beside), []).append(figure)
    return wings


def _wing(id_: str, beside: Beside) -> str:
    """What a wing says of itself."""
    entry = beside.entries.get(id_)
    package = sys.modules.get(entry.module.rpartition(".")[0]) if entry else None
    return (getattr(package, "__doc__", "") or "Figures").strip().rstrip(".")


def gallery(shown: Sequence[Shown], beside: Beside) -> Iterator[str]:
    """A thumbnail per figure, in the papers' order."""
    yield '<section id="gallery">\n<h2>All pictures</h2>'
    for wing, figures in in_order(shown, beside).items():
        yield f'<h3>{escape(wing)}</h3>\n<ul class="gallery">'
        yield from (_thumbnail(figure) for figure in figures if figure.record)
        yield "</ul>"
    yield "</section>"


def _thumbnail(shown: Shown) -> str:
    title = shown.record.title if shown.record else ""
    picture = f'<img loading="lazy" alt="Thumbnail of {escape(shown.id)}" src="{escape(shown.id)}/figure.png">'
    seen = picture if shown.picture else "<span>no picture</span>"
    return f'<li><a href="#{escape(shown.id)}">{seen}<b>{escape(shown.id)}</b> {escape(title)}</a></li>'


def sections(shown: Sequence[Shown], beside: Beside) -> Iterator[str]:
    """Every figure, wing by wing."""
    for wing, figures in in_order(shown, beside).items():
        yield f"<section>\n<h2>{escape(wing)}</h2>"
        yield from (line for figure in figures for line in _figure(figure, beside))
        yield "</section>"


def _figure(shown: Shown, beside: Beside) -> Iterator[str]:
    record = shown.record
    title = f"{shown.id}: {record.title}" if record else shown.id
    yield f'<article id="{escape(shown.id)}">\n<h3>{escape(title)}</h3>'
    if record:
        yield from _about(record, beside)
    yield from (f'<p class="trouble">{escape(trouble)}</p>' for trouble in shown.troubles)
    if record and record.status == "crashed":
        yield f'<p class="trouble">This figure crashed.</p>\n<pre tabindex="0">{escape(record.traceback)}</pre>'
    elif record:
        yield from _picture(shown, record, beside)
        yield from _claims(record, beside)
        yield from _conditions(record)
    yield "</article>"


def _about(record: Record, beside: Beside) -> Iterator[str]:
    said = _said(record, beside)
    if said:
        yield f"<p>{escape(said)}</p>"
    facts = f"{record.source}, {record.world}, preset {record.preset}, seed {record.seed}"
    yield f'<p class="about">{escape(facts)} · {module_link(record.id, beside)}</p>'


def _said(record: Record, beside: Beside) -> str:
    entry = beside.entries.get(record.id)
    return two_sentences(about(entry)) if entry else ""


# ---------------------------------------------------------------- the picture


def _picture(shown: Shown, record: Record, beside: Beside) -> Iterator[str]:
    yield "<figure>"
    files = [link(f"{shown.id}/{name}", name) for name in ("figure.pdf", "arrays.npz")]
    if shown.picture:
        source, alt = f"{escape(shown.id)}/figure.png", escape(_alt(record, beside))
        width, height = _size(shown.picture)
        size = f'width="{width}" height="{height}"'
        yield f'<a href="{source}"><img loading="lazy" alt="{alt}" src="{source}" {size}></a>'
        files.insert(0, link(f"{shown.id}/figure.png", "enlarge"))
    yield f"<figcaption>{' · '.join(files)}</figcaption></figure>"


def _size(picture: bytes) -> tuple[int, int]:
    """Width and height of a PNG as it is shown, from its header."""
    pixels = (int.from_bytes(picture[start : start + 4], "big") for start in (16, 20))
    width, height = (round(each * CSS_PIXELS_PER_INCH / RC["savefig.dpi"]) for each in pixels)
    return width, height


def _alt(record: Record, beside: Beside) -> str:
    """What the picture shows, and how its claims came out."""
    count = Counter(check.verdict for check in record.checks)
    verdicts = ", ".join(f"{count[name]} {name}" for name in VERDICTS if count[name])
    counted = f" Checks: {verdicts}." if verdicts else ""
    return short(f"{record.title}. {_said(record, beside)}", 300 - len(counted)) + counted


# ---------------------------------------------------------------- its claims


def _claims(record: Record, beside: Beside) -> Iterator[str]:
    if not record.checks:
        yield "<p>It claims nothing.</p>"
        return
    heads = "".join(f'<th scope="col">{name}</th>' for name in HEADS)
    yield f'<table class="claims"><caption>Claims of {escape(record.id)}</caption><thead><tr>{heads}</tr></thead>'
    for id_ in dict.fromkeys(check.id for check in record.checks):
        checks = [check for check in record.checks if check.id == id_]
        yield f'<tbody id="{escape(place_of(id_, record.id))}">{_claim(id_, checks[0], beside)}'
        yield from (_check(check, record, checks[0].sentence) for check in checks)
        yield "</tbody>"
    yield "</table>"


def _claim(id_: str, check: Check, beside: Beside) -> str:
    row = beside.ledger.get(id_)
    source = f" {escape(row.source)}" if row else ""
    head = f"{link(f'#{row_of(id_)}', id_)}{source}: <span>{escape(check.sentence)}</span>"
    return f'<tr><th colspan="{len(HEADS)}" scope="rowgroup">{head} {chain(id_, beside)}</th></tr>'


def _check(check: Check, record: Record, said: str) -> str:
    notes = [
        *([check.sentence] if check.sentence != said else []),
        *([f"Caveat: {check.caveat}"] if check.caveat else []),
        *([f"Reason: {check.reason}"] if check.reason else []),
    ]
    remarks = "".join(f"<br><small>{linked(note)}</small>" for note in notes)
    measured = show(check.measured) if check.verdict != "not judged" else ""
    cells = (f"{linked(check.part)}{remarks}", escape(measured), linked(check.criterion))
    mark = badge(check.verdict, record.world, record.preset)
    return f"<tr><td>{mark}</td>{''.join(f'<td>{cell}</td>' for cell in cells)}</tr>"


def _conditions(record: Record) -> Iterator[str]:
    """Under which conditions the paper shows its claims, and under which they are judged here."""
    if not record.conditions:
        return
    yield "<details><summary>Conditions, by the paper and here</summary>"
    yield f'<div class="wide" tabindex="0" role="region" aria-label="Conditions of {escape(record.id)}"><table>'
    heads = "".join(f'<th scope="col">{name}</th>' for name in ("Claims", "Where", *SETUP.values(), "Why not the same"))
    yield f"<thead><tr>{heads}</tr></thead><tbody>"
    for each in record.conditions:
        yield from _condition(each)
    yield "</tbody></table></div></details>"


def _condition(each: Mapping[str, Mapping[str, str]]) -> Iterator[str]:
    names, why = escape(", ".join(each["claims"])), escape(str(each["why"]))
    theirs, ours = (
        "".join(f"<td>{escape(str(each[whose][name]))}</td>" for name in SETUP) for whose in ("paper", "ours")
    )
    first = f'<th scope="row" rowspan="2">{names}</th><td>{escape(str(each["source"]))}</td>'
    yield f'<tr>{first}{theirs}<td rowspan="2">{why}</td></tr>'
    yield f"<tr><td>here</td>{ours}</tr>"
