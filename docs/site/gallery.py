"""A page per figure: its picture, what it shows, its claims with their verdicts, conditions, code and tests.

Verdicts are those of the kept runs of the paper preset, in figures/paper.json.  Pictures are taken from a folder of
results, out-paper/ before out/, or from docs/figures/; a page without one says what to run.
"""

import json
from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

from docs.site import layout, words
from docs.site.api import APART, citing, heading, resolver
from docs.site.api import entry as api_entry
from figures.claims import ledger, showings
from figures.claims.criteria import show
from figures.claims.figure import Conditions, Entry
from figures.claims.ledger import Row
from figures.claims.showings import Showing
from figures.engine import kept, registry
from figures.engine.kept import Kept
from figures.project import Project
from figures.report.markup import SYMBOLS, two_sentences
from figures.report.sources import about, numbers

HERE = Project()
RESULTS = ("out-paper", "out")
"""Folders of results below the checkout, the best one first."""

COMMITTED = layout.ROOT / "docs" / "figures"
GALLERY = (
    "Every figure that ``make figures`` draws, with what it claims and how that came out when the paper preset was "
    "run. How to run one: ``python -m figures run GRIS-F07``; what verdicts mean: "
    "`claims and the ledger <../contributing.html#claims-and-the-ledger>`__."
)
SETUP = ("loop", "camera", "light", "view")


@cache
def entries() -> Mapping[str, Entry]:
    """The figures there are."""
    return registry.load(HERE.modules)


@cache
def claims() -> Mapping[str, Row]:
    """The ledger."""
    return ledger.load(HERE.ledger)


@cache
def runs() -> Mapping[str, Kept]:
    """What paper runs found."""
    return kept.read(HERE.paper)


@cache
def shown_by() -> Mapping[str, Sequence[Showing]]:
    """Claim -> who shows it."""
    return showings.showings(HERE.tests, HERE.benchmarks, claims(), entries())


def picture(id_: str) -> tuple[Path, str] | None:
    """A figure's picture, and at which preset it was drawn; nothing if there is none."""
    for folder in RESULTS:
        found = layout.ROOT / folder / id_ / "figure.png"
        if found.exists():
            return found, _preset(found.parent)
    for kept_one in (COMMITTED / f"{id_}.png", layout.ROOT / "docs" / f"{id_.lower()}.png"):
        if kept_one.exists():
            return kept_one, "paper" if id_ in _of_paper_runs() else "quick"
    return None


def _preset(folder: Path) -> str:
    try:
        return str(json.loads((folder / "record.json").read_text(encoding="utf-8"))["preset"])
    except (OSError, ValueError, KeyError):
        return "unknown"


@cache
def _of_paper_runs() -> frozenset[str]:
    """The committed pictures that were drawn at the paper preset."""
    found = COMMITTED / "paper.txt"
    return frozenset(found.read_text(encoding="utf-8").split()) if found.exists() else frozenset()


def pages() -> Iterator[tuple[str, str]]:
    """The gallery and a page for every figure."""
    yield "figures/index.rst", "\n".join(gallery())
    for id_, entry in entries().items():
        yield f"figures/{id_}.rst", "\n".join(page(entry))


def pictures() -> Iterator[tuple[str, Path]]:
    """Where the site keeps each picture, and the file."""
    for id_ in entries():
        found = picture(id_)
        if found:
            yield f"figures/{id_}.png", found[0]


def _wings() -> dict[str, list[str]]:
    found: dict[str, list[str]] = {}
    for id_, entry in entries().items():
        found.setdefault(entry.module.rpartition(".")[0], []).append(id_)
    return found


def gallery() -> Iterator[str]:
    """All figures, paper by paper."""
    yield from heading("Figures")
    yield from [GALLERY, ""]
    for wing, ids in _wings().items():
        yield from heading(_title_of(wing), "-")
        yield from [".. list-table::", "   :widths: 22 48 30", "   :class: gallery", ""]
        for id_ in ids:
            yield from _listed(entries()[id_])
        yield ""


def _title_of(wing: str) -> str:
    import importlib  # noqa: PLC0415

    return (importlib.import_module(wing).__doc__ or wing).strip().rstrip(".")


def _listed(entry: Entry) -> Iterator[str]:
    id_ = entry.figure.id
    if picture(id_):
        yield f"   * - .. image:: {id_}.png"
        yield f"          :alt: Thumbnail of {id_}"
        yield "          :width: 160"
        yield f"          :target: {id_}.html"
    else:
        yield "   * - no picture yet"
    yield f"     - :doc:`{id_}`: {words.plain(entry.figure.title)}"
    yield f"     - {', '.join(_counts(id_)) or 'claims nothing'}"


def _counts(id_: str) -> list[str]:
    checks = runs()[id_].checks if id_ in runs() else ()
    found = [check["verdict"] for check in checks]
    return [f"{SYMBOLS[name]} {found.count(name)} {name}" for name in SYMBOLS if name in found]


# ---------------------------------------------------------------- one figure


def page(entry: Entry) -> Iterator[str]:
    """All of a figure."""
    figure, here = entry.figure, f"figures/{entry.figure.id}.html"
    yield from APART
    yield from heading(f"{figure.id}: {figure.title}")
    yield from [":doc:`All figures <index>`", ""]
    yield from _picture(entry)
    yield from words.rst(about(entry), here, resolver(entry.module))
    yield from [f"Source: {words.plain(figure.source)}; world: {figure.world}.", ""]
    yield from heading("Claims and verdicts", "-")
    yield from _claims(entry)
    yield from _conditions(figure.conditions)
    yield from heading("Code and tests", "-")
    yield from _code(entry, here)
    yield from [f"To run it: ``python -m figures run {figure.id}``, with ``--preset paper`` at the paper's size.", ""]


def _picture(entry: Entry) -> Iterator[str]:
    id_, found = entry.figure.id, picture(entry.figure.id)
    if not found:
        yield from [
            ".. note::",
            "",
            f"   There is no picture yet: ``make figures ARGS={id_}`` draws it, and the next ``make docs`` shows it.",
            "",
        ]
        return
    alt = words.plain(two_sentences(about(entry)).replace("\n", " "))
    yield from [f".. figure:: {id_}.png", f"   :alt: {alt}", "", f"   Drawn at the {found[1]} preset.", ""]


def _claims(entry: Entry) -> Iterator[str]:
    found = runs().get(entry.figure.id)
    checks = found.checks if found else ()
    if found:
        yield from [f"Kept from a run at the paper preset: {found.date}, commit {found.commit}, seed {found.seed}.", ""]
    for claim in entry.figure.claims:
        yield from _claim(claim, [check for check in checks if check["id"] == claim], f"figures/{entry.figure.id}.html")
    if not entry.figure.claims:
        yield from ["It claims nothing.", ""]


def _claim(id_: str, checks: Sequence[Mapping[str, Any]], here: str) -> Iterator[str]:
    row = claims()[id_]
    yield from heading(f"{id_}, {row.source}", "~")
    yield from [f"`Who shows it <../{words.claim_place(id_)}>`__", ""]
    yield from [words.plain(row.sentence), "", f"*Criterion:* {words.plain(row.criterion)}.", ""]
    if checks:
        yield from [".. list-table::", "   :header-rows: 1", "   :widths: 22 38 20 20", "   :class: claims", ""]
        yield from ["   * - verdict", "     - what", "     - measured", "     - criterion"]
    for check in checks:
        notes = [check["part"], *(f"{name}: {check[name]}" for name in ("caveat", "reason") if check[name])]
        measured = show(check["measured"]) if check["verdict"] != "not judged" else ""
        cells = (". ".join(filter(None, notes)), measured, check["criterion"])
        yield f"   * - {SYMBOLS[check['verdict']]} {check['verdict']}"
        yield from (f"     - {words.plain(' '.join(each.split())) or ' '}" for each in cells)
    yield from ["", *tests(id_, here)]


def tests(id_: str, here: str) -> Iterator[str]:
    """The tests that show a claim, each once, with the parts that they show and in which worlds if it is several."""
    found = [each for each in shown_by().get(id_, ()) if each.kind == "tests"]
    for test in dict.fromkeys(each.name for each in found):
        marks = [each for each in found if each.name == test]
        worlds = dict.fromkeys(each.world for each in marks)
        parts = dict.fromkeys(filter(None, (each.part for each in marks)))
        path, _, name = test.partition("::")
        to = layout.way(here, layout.code_place(path, words.line_of(path, name)))
        said = "; ".join([*parts, *([", ".join(worlds)] if len(worlds) > 1 else [])])
        yield f"- `{words.plain(test)} <{to}>`__" + (f" ({words.plain(said)})" if said else "")
    yield ""


def _conditions(conditions: Sequence[Conditions]) -> Iterator[str]:
    if not conditions:
        return
    yield from heading("Conditions, by the paper and here", "-")
    yield from [".. list-table::", "   :header-rows: 1", "   :class: conditions", ""]
    yield "   * - claims"
    yield from (f"     - {name}" for name in ("where", *SETUP, "why not the same"))
    for each in conditions:
        for place, setup, why in ((each.source, each.paper, ""), ("here", each.ours, each.why)):
            yield f"   * - {words.plain(', '.join(each.claims)) if place != 'here' else ' '}"
            cells = (place, *(getattr(setup, name) for name in SETUP), why)
            yield from (f"     - {words.plain(cell) or ' '}" for cell in cells)
    yield ""


def _code(entry: Entry, here: str) -> Iterator[str]:
    path = entry.module.replace(".", "/") + ".py"
    yield f"- Module: `{words.plain(path)} <{layout.way(here, layout.code_place(path))}>`__"
    rows = [claims()[id_] for id_ in entry.figure.claims]
    found = [each for row in rows for number in numbers(row.source) for each in citing().get((row.paper, number), ())]
    said = ", ".join(api_entry(each) for each in dict.fromkeys(found))
    yield from [f"- Says the equations: {said}", ""] if said else [""]
