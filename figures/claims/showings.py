"""Who shows a claim, in which worlds, and how much of it: tests, figures, the evidence, and benchmarks."""

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from figures.claims import scan
from figures.claims.errors import FigureError
from figures.claims.figure import Entry
from figures.claims.ledger import Row

Kind = Literal["tests", "figures", "evidence", "benchmark"]
KINDS: tuple[Kind, ...] = ("tests", "figures", "evidence", "benchmark")
EVIDENCE = "evidence.json"
JOBS_WORLD = "flatland2d"
"""The world of benchmarks with a row of the ledger, and of the evidence's jobs but those of SPACE."""

SPACE, SPACE_WORLD = ("space", "witness"), "tracer3d"
"""How the names of the evidence's jobs in space begin, and their world."""


@dataclass(frozen=True)
class Showing:
    """One thing that shows a claim: its kind, its name, its world, and which part of the claim; empty for all of it."""

    kind: Kind
    name: str
    world: str
    part: str = ""


def showings(
    tests: Path, benchmarks: Path, rows: Mapping[str, Row], entries: Mapping[str, Entry]
) -> dict[str, list[Showing]]:
    """Claim id -> all that shows it, in both folders and among the figures.

    Raises FigureError for a mark with an unknown claim.
    """
    found: dict[str, list[Showing]] = {id_: [] for id_ in rows}
    for id_, marks in scan.marks_by_claim(tests, rows).items():
        found[id_] += [Showing("tests", mark.test, mark.world, mark.part) for mark in marks]
    for entry in entries.values():
        for id_ in entry.figure.claims:
            found[id_].append(Showing("figures", entry.figure.id, entry.figure.world))
    for id_, jobs in evidence_by_claim(benchmarks / EVIDENCE).items():
        found.setdefault(id_, []).extend(Showing("evidence", job, world_of(job)) for job in jobs)
    for id_, scripts in scan.benchmarks_by_claim(benchmarks).items():
        found.setdefault(id_, []).extend(Showing("benchmark", script, JOBS_WORLD) for script in scripts)
    return found


def world_of(job: str) -> str:
    """The world of a job of the evidence, which its name says."""
    return SPACE_WORLD if job.startswith(SPACE) else JOBS_WORLD


def evidence_by_claim(path: Path) -> dict[str, list[str]]:
    """Claim id -> the jobs all of whose rows about it hold; nothing where there is no evidence."""
    if not path.exists():
        return {}
    try:
        jobs = json.loads(path.read_text(encoding="utf-8"))
        rows = [
            (id_, job, row["holds"])
            for job, about in jobs.items()
            for row in about["rows"]
            for id_ in row["claims"].split(", ")
        ]
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise FigureError(f"{path} is damaged ({error}): restore it from git, or `make evidence`") from error
    failed = {(id_, job) for id_, job, holds in rows if not holds}
    found: dict[str, list[str]] = {}
    for id_, job, _ in rows:
        if id_ and (id_, job) not in failed and job not in found.setdefault(id_, []):
            found[id_].append(job)
    return found


def names(found: Iterable[Showing], kind: Kind) -> list[str]:
    """The names of one kind, each once."""
    return list(dict.fromkeys(each.name for each in found if each.kind == kind))


def by_world(row: Row, found: Sequence[Showing]) -> dict[str, str]:
    """World of the row -> "whole", "part" or "missing"; a row that names no world but units is shown by anything."""
    return {world: _how_much([each for each in found if world in ("unit", each.world)]) for world in row.worlds}


def _how_much(found: Sequence[Showing]) -> str:
    if not found:
        return "missing"
    return "part" if all(each.part for each in found) else "whole"


def as_data(row: Row, found: Sequence[Showing]) -> dict[str, Any]:
    """What `ledger --json` says of who shows a row."""
    worlds = by_world(row, found)
    return {
        **{kind: names(found, kind) for kind in KINDS},
        "worlds": {world: how for world, how in worlds.items() if how != "missing"},
        "missing": [world for world, how in worlds.items() if how == "missing"],
        "parts": [{"by": each.name, "world": each.world, "part": each.part} for each in found if each.part],
    }
