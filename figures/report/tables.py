"""What the commands print: rows as plain data for JSON, and the same rows as aligned tables."""

import textwrap
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from figures.claims.criteria import show
from figures.claims.figure import VERDICTS, Entry, Verdict, words
from figures.claims.ledger import Row
from figures.claims.showings import KINDS, Showing, as_data
from figures.claims.verdicts import Judged
from figures.engine.gather import gather

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


def claim_row(row: Row, found: Sequence[Showing], verdict: Verdict | None, paper: Verdict | None) -> dict[str, Any]:
    """One claim as `ledger --json` prints it; `paper` is the kept verdict of the paper preset."""
    return {
        "id": row.id,
        "class": row.kind,
        **as_data(row, found),
        "scenes": list(row.scenes),
        "verdict": verdict,
        "paper": paper,
        "sentence": row.sentence,
        "criterion": row.criterion,
    }


def claims(rows: Sequence[Mapping[str, Any]]) -> str:
    """The ledger as a table, and how much of it is covered, by world."""
    heads = ("claim", "class", "tests", "figures", "more", "worlds", "verdict", "sentence")
    cells = [[row["id"], row["class"], *_coverage(row), row["sentence"]] for row in rows]
    shown = {kind: sum(bool(row[kind]) for row in rows) for kind in KINDS}
    counts = f"{shown['tests']} with tests, {shown['figures']} with figures, {shown['evidence']} with evidence"
    foot = [f"{len(rows)} claims: {counts}, {shown['benchmark']} with a benchmark", *_worlds(rows)]
    return aligned(heads, cells) + "\n" + "\n".join(foot)


def _coverage(row: Mapping[str, Any]) -> list[str]:
    more = [*row["evidence"], *row["benchmark"]]
    shown = [world + " (part)" * (how == "part") for world, how in row["worlds"].items()]
    worlds = shown + [f"no {world}" for world in row["missing"]]
    return [
        str(len(row["tests"])),
        ", ".join(row["figures"]),
        ", ".join(more),
        ", ".join(worlds),
        row["verdict"] or "-",
    ]


def _worlds(rows: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    """Per world: rows that name it, shown whole, in part, and not at all."""
    for world in dict.fromkeys(world for row in rows for world in [*row["worlds"], *row["missing"]]):
        how = Counter(row["worlds"].get(world, "missing") for row in rows if world in [*row["worlds"], *row["missing"]])
        yield f"{world}: {how['whole']} shown, {how['part']} in part, {how['missing']} missing"


def summary(judged: Sequence[Judged], crashed: Sequence[str], misfits: Sequence[str] = ()) -> str:
    """The verdicts after a run, the figures that crashed, what does not fit, and how many claims came out how."""
    heads = ("claim", "figure", "measured", "criterion", "verdict", "what was measured")
    table = aligned(heads, [row for claim in judged for row in _rows(claim)])
    troubles = [*(f"{id_} crashed: its traceback is in the report" for id_ in crashed), *misfits]
    return "\n".join([table, *troubles, counts(judged)])


def counts(judged: Sequence[Judged]) -> str:
    """How many claims have which verdict, and how many of them are not the expected one."""
    found = Counter[str](claim.verdict or "not measured" for claim in judged)
    by_verdict = [f"{found[name]} {name}" for name in (*VERDICTS, "not measured") if found[name]]
    differing = sum(claim.agrees is False for claim in judged)
    return f"{len(judged)} claims: {', '.join(by_verdict)}; {differing} not as expected"


def _rows(claim: Judged) -> Iterator[list[str]]:
    """The claim with its verdict and, where it is not the expected one, that; then its checks."""
    found = words(claim.verdict, claim.where, claim.preset) if claim.verdict else "not measured"
    verdict = found + (f" DIFFERS from {claim.expected}" if claim.agrees is False else "")
    yield [claim.id, ", ".join(claim.figures), "", "", verdict, ""]
    for figure, check in claim.checks:
        yield ["", figure, show(check.measured), check.criterion, check.verdict, check.part]


def crashes(out: Path) -> list[str]:
    """The figures whose stored record is a crash."""
    return [f.id for f in gather(out) if f.record is not None and f.record.status == "crashed"]
