"""Verdicts of claims over all figures of a folder, compared with what the ledger expects."""

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from figures.claims.errors import FigureError
from figures.claims.figure import VERDICTS, Verdict, worst
from figures.claims.ledger import Row
from figures.engine import disk
from figures.engine.record import Check, Record

FORMAT = 1
NAME = "verdicts.json"


@dataclass(frozen=True)
class Judged:
    """A claim under one preset: its checks by figure, its verdict, and whether that is the expected one.

    `complete` tells whether every figure that declares the claim has been run. The verdict of an incomplete
    claim may still get worse, so it agrees unless it is already worse than expected. `agrees` is None where
    the ledger expects nothing yet or nothing was measured. `where` names the worlds of the checks that decided.
    """

    id: str
    preset: str
    verdict: Verdict | None
    expected: Verdict | None
    complete: bool
    agrees: bool | None
    figures: tuple[str, ...]
    checks: tuple[tuple[str, Check], ...]
    where: str


def judge(records: Sequence[Record], ledger: Mapping[str, Row], declared: Mapping[str, set[str]]) -> list[Judged]:
    """One row per claim and preset, in the order of the ledger; claims that it lacks come last."""
    found = dict.fromkeys((claim, record.preset) for record in records for claim in record.claims)
    rank = {id_: number for number, id_ in enumerate(ledger)}
    order = sorted(found, key=lambda pair: (rank.get(pair[0], len(rank)), pair))
    return [_judged(pair[0], pair[1], records, ledger.get(pair[0]), declared) for pair in order]


def _judged(
    id_: str, preset: str, records: Sequence[Record], row: Row | None, declared: Mapping[str, set[str]]
) -> Judged:
    mine = [record for record in records if record.preset == preset and id_ in record.claims]
    checks = tuple((record.id, check) for record in mine for check in record.checks if check.id == id_)
    verdict = worst([check.verdict for _, check in checks]) if checks else None
    done = {record.id for record in mine if record.status == "done"}
    complete = declared.get(id_, set()) <= done and all(record.status == "done" for record in mine)
    expected = row.expected.get(preset) if row else None
    agrees = _agrees(verdict, expected, exactly=complete)
    deciding = [record.world for record in mine if verdict in [c.verdict for c in record.checks if c.id == id_]]
    where = ", ".join(dict.fromkeys(deciding))
    return Judged(id_, preset, verdict, expected, complete, agrees, tuple(r.id for r in mine), checks, where)


def _agrees(verdict: Verdict | None, expected: Verdict | None, *, exactly: bool) -> bool | None:
    if verdict is None or expected is None:
        return None
    return verdict == expected if exactly else VERDICTS.index(verdict) <= VERDICTS.index(expected)


def write(judged: Iterable[Judged], out: Path) -> None:
    """Keep the verdicts in the folder."""
    data = {"format": FORMAT, "verdicts": [_plain(row) for row in judged]}
    disk.write_text(out / NAME, json.dumps(data, indent=1) + "\n")


def _plain(row: Judged) -> dict[str, Any]:
    checks = [{"figure": figure, **vars(check)} for figure, check in row.checks]
    return {**vars(row), "figures": list(row.figures), "checks": checks}


def read(out: Path) -> dict[str, Verdict]:
    """Claim id -> worst verdict kept in the folder; empty if there is none."""
    path = out / NAME
    if not path.exists():
        return {}
    try:
        rows = json.loads(path.read_text(encoding="utf-8"))["verdicts"]
        pairs = [(str(row["id"]), row["verdict"]) for row in rows if row["verdict"] is not None]
        return {id_: worst([verdict for other, verdict in pairs if other == id_]) for id_, _ in pairs}
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise FigureError(f"{path} is damaged ({error}): `report` writes it anew") from error
