"""What the commands print: rows as plain data for JSON, and the same rows as aligned tables."""

import textwrap
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from figures.criteria import show
from figures.figure import VERDICTS, Verdict
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
    """The verdicts after a run, the figures that crashed, and how many claims came out how."""
    heads = ("claim", "figure", "measured", "criterion", "verdict", "what was measured")
    table = aligned(heads, [row for claim in judged for row in _rows(claim)])
    return "\n".join([table, *(f"{id_} crashed: its traceback is in the report" for id_ in crashed), counts(judged)])


def counts(judged: Sequence[Judged]) -> str:
    """How many claims have which verdict, and how many of them are not the expected one."""
    found = Counter[str](claim.verdict or "not measured" for claim in judged)
    by_verdict = [f"{found[name]} {name}" for name in (*VERDICTS, "not measured") if found[name]]
    differing = sum(claim.agrees is False for claim in judged)
    return f"{len(judged)} claims: {', '.join(by_verdict)}; {differing} not as expected"


def _rows(claim: Judged) -> Iterator[list[str]]:
    """The claim with its verdict and, where it is not the expected one, that; then its checks."""
    verdict = (claim.verdict or "not measured") + (f" DIFFERS from {claim.expected}" if claim.agrees is False else "")
    yield [claim.id, ", ".join(claim.figures), "", "", verdict, ""]
    for figure, check in claim.checks:
        yield ["", figure, show(check.measured), check.criterion, check.verdict, check.part]


def crashes(out: Path) -> list[str]:
    """The figures whose stored record is a crash."""
    return [f.id for f in gather(out) if f.record is not None and f.record.status == "crashed"]
