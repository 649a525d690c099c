"""What the commands print: rows as plain data for JSON, and the same rows as aligned tables."""

import textwrap
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from figures.criteria import show
from figures.figure import Verdict
from figures.gather import gather
from figures.ledger import Row
from figures.registry import Entry
from figures.verdicts import Judged

WIDEST = 44


def aligned(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Rows of cells under their heads; long cells are cut."""
    cut = [[textwrap.shorten(cell, WIDEST, placeholder="...") for cell in row] for row in rows]
    cells = [list(heads), *cut]
    widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
    lines = ["  ".join(cell.ljust(width) for cell, width in zip(line, widths, strict=True)) for line in cells]
    return "\n".join(line.rstrip() for line in lines)


def figure_row(entry: Entry) -> dict[str, Any]:
    """One figure as `list --json` prints it."""
    figure = entry.figure
    return {
        "id": figure.id,
        "title": figure.title,
        "world": figure.world,
        "source": figure.source,
        "claims": list(figure.claims),
        "presets": {name: dict(data) for name, data in figure.presets.items()},
        "module": entry.module,
    }


def figures(rows: Sequence[Mapping[str, Any]]) -> str:
    """The figures as a table."""
    cells = [[row["id"], row["world"], row["source"], ", ".join(row["claims"]), row["title"]] for row in rows]
    return aligned(("figure", "world", "source", "claims", "title"), cells) if rows else "no figures yet"


def claim_row(row: Row, tests: Sequence[str], figures: Sequence[str], verdict: Verdict | None) -> dict[str, Any]:
    """One claim as `ledger --json` prints it."""
    return {
        "id": row.id,
        "class": row.kind,
        "tests": list(tests),
        "figures": list(figures),
        "verdict": verdict,
        "sentence": row.sentence,
        "criterion": row.criterion,
    }


def claims(rows: Sequence[Mapping[str, Any]]) -> str:
    """The ledger as a table, and how much of it is covered."""
    cells = [[row["id"], row["class"], *_coverage(row), row["sentence"]] for row in rows]
    tested, drawn = (sum(bool(row[name]) for row in rows) for name in ("tests", "figures"))
    foot = f"{len(rows)} claims: {tested} with tests, {drawn} with figures"
    return aligned(("claim", "class", "tests", "figures", "verdict", "sentence"), cells) + "\n" + foot


def _coverage(row: Mapping[str, Any]) -> list[str]:
    return [str(len(row["tests"])), ", ".join(row["figures"]), row["verdict"] or "-"]


def summary(judged: Sequence[Judged], crashed: Sequence[str]) -> str:
    """The verdicts after a run, and the figures that crashed."""
    heads = ("claim", "figure", "measured", "criterion", "verdict", "expected")
    table = aligned(heads, [row for claim in judged for row in _rows(claim)])
    return "\n".join([table, *(f"{id_} crashed: its traceback is in the report" for id_ in crashed)])


def _rows(claim: Judged) -> Iterator[list[str]]:
    expected = (claim.expected or "-") + (" DIFFERS" if claim.agrees is False else "")
    if not claim.checks:
        yield [claim.id, ", ".join(claim.figures), "-", "-", "not measured", expected]
    for figure, check in claim.checks:
        measured = f"{check.part} {show(check.measured)}".strip()
        yield [claim.id, figure, measured, check.criterion, check.verdict, expected]


def crashes(out: Path) -> list[str]:
    """The figures whose stored record is a crash."""
    return [f.id for f in gather(out) if f.record is not None and f.record.status == "crashed"]
