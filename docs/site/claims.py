"""Every claim of the ledger, a page per paper: what it says, its verdict at the paper preset, and who shows it."""

from collections.abc import Iterator
from functools import cache

from docs.site import gallery, layout, words
from docs.site.api import APART, heading
from figures.claims import showings
from figures.claims.figure import Verdict
from figures.claims.ledger import Row
from figures.engine import kept, registry
from figures.report.glossary import PAPERS
from figures.report.markup import SYMBOLS

TOLD = (
    "A claim is one sentence of a paper made into a number and a criterion that could fail. Verdicts are those of kept "
    "runs at the paper preset; claims that no figure is about are shown by tests alone."
)


def pages() -> Iterator[tuple[str, str]]:
    """The index, and a page per paper."""
    yield "claims/index.rst", "\n".join(index())
    for paper in PAPERS:
        yield f"claims/{paper}.rst", "\n".join(page(paper))


def index() -> Iterator[str]:
    """The papers, with how many claims each has."""
    yield from heading("Claims")
    yield from [
        TOLD,
        "",
        ".. list-table::",
        "   :header-rows: 1",
        "",
        "   * - paper",
        "     - claims",
        "     - verdicts at the paper preset",
    ]
    for paper, title in PAPERS.items():
        ids = _ids(paper)
        verdicts = [_verdicts().get(id_) for id_ in ids]
        counts = [f"{SYMBOLS[name]} {verdicts.count(name)} {name}" for name in SYMBOLS if name in verdicts]
        yield f"   * - :doc:`{paper}`: {words.plain(title)}"
        yield f"     - {len(ids)}"
        yield f"     - {', '.join([*counts, f'{verdicts.count(None)} without a figure'])}"
    yield ""


def page(paper: str) -> Iterator[str]:
    """A paper's claims in the ledger's order."""
    yield from APART
    yield from heading(f"Claims of {paper}")
    yield from [f":doc:`All claims <index>` · {words.plain(PAPERS[paper])}", ""]
    for id_ in _ids(paper):
        yield from _claim(gallery.claims()[id_], f"claims/{paper}.html")


def _ids(paper: str) -> list[str]:
    return [id_ for id_ in gallery.claims() if id_.partition("-")[0] == paper]


@cache
def _verdicts() -> dict[str, Verdict]:
    return dict(kept.verdicts(gallery.runs(), registry.declared(gallery.entries())))


def _claim(row: Row, here: str) -> Iterator[str]:
    yield from [".. raw:: html", "", f'   <span id="{row.id}"></span>', ""]
    yield from heading(f"{row.id}, {row.source}", "-")
    yield from [words.plain(row.sentence), "", f"*Criterion:* {words.plain(row.criterion)}.", ""]
    verdict = _verdicts().get(row.id)
    yield from [f"*Verdict:* {SYMBOLS[verdict]} {verdict}.", ""] if verdict else []
    found = gallery.shown_by().get(row.id, ())
    figures = [f":doc:`{name} </figures/{name}>`" for name in showings.names(found, "figures")]
    jobs = [_job(name, here) for name in showings.names(found, "evidence")]
    for title, names in (("Figures", figures), ("Evidence", jobs)):
        yield from [f"*{title}:* {', '.join(names)}.", ""] if names else []
    yield from gallery.tests(row.id, here)


def _job(name: str, here: str) -> str:
    return f"`{words.plain(name)} <{layout.way(here, 'evidence.html')}#{name.replace(' ', '-')}>`__"
