"""Verdicts of claims over all figures of a folder, compared with what the ledger expects."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from figures.claims.figure import VERDICTS, Verdict, worst
from figures.claims.ledger import Row

Status = Literal["done", "crashed"]


@dataclass(frozen=True)
class Check:
    """One claim of a figure as it was judged; what is not judged was not measured."""

    id: str
    part: str
    sentence: str
    measured: float | str
    criterion: str
    verdict: Verdict
    caveat: str
    reason: str


@dataclass(frozen=True)
class Record:
    """One figure of one run: what it is, how it went, and what it found."""

    id: str
    title: str
    source: str
    world: str
    preset: str
    seed: int
    version: int
    claims: Sequence[str]
    conditions: Sequence[Mapping[str, Any]]
    status: Status
    traceback: str
    checks: Sequence[Check]


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
