"""What a figure found, as `claims.json` keeps it: plain data from which the whole report can be rebuilt."""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from dataclasses import fields as dataclass_fields
from pathlib import Path
from typing import Any

from figures.claims.figure import VERDICTS, Claim, Conditions, Figure, conditions_of, verdict_of
from figures.claims.ledger import Row
from figures.claims.verdicts import Check, Record
from figures.engine import disk
from figures.engine.plan import Plan

FORMAT = 2
NAME = "claims.json"


def record(plan: Plan, claims: Sequence[Claim], ledger: Mapping[str, Row], traceback: str = "") -> Record:
    """The record of a planned figure; a traceback makes it a crashed one."""
    figure, checks = plan.figure, tuple(_check(claim, plan.figure, ledger) for claim in claims)
    names = (figure.id, figure.title, figure.source, figure.world)
    run = (plan.preset, plan.seed, figure.version, list(figure.claims))
    conditions = [json.loads(json.dumps(asdict(each))) for each in figure.conditions]
    return Record(*names, *run, conditions, "crashed" if traceback else "done", traceback, checks)


def _check(claim: Claim, figure: Figure, ledger: Mapping[str, Row]) -> Check:
    outcome, sentence = claim.outcome, claim.sentence or ledger[claim.id].sentence
    measured = outcome.measured if outcome else ""
    value = measured if isinstance(measured, str) else _number(measured)
    verdict = verdict_of(claim, conditions_of(figure, claim.id))
    criterion = outcome.criterion if outcome else ""
    return Check(claim.id, claim.part, sentence, value, criterion, verdict, claim.caveat, claim.reason)


def _number(value: float) -> float | str:
    """A JSON number where JSON has one; "nan" and "inf" otherwise."""
    return float(value) if math.isfinite(value) else str(float(value))


def write(record: Record, folder: Path) -> None:
    """Keep the record in the figure's folder."""
    disk.write_text(folder / NAME, json.dumps({"format": FORMAT, **asdict(record)}, indent=1) + "\n")


def read(folder: Path) -> Record:
    """The record kept in a folder; raises OSError or ValueError if it is missing or damaged."""
    data = json.loads((folder / NAME).read_text(encoding="utf-8"))
    try:
        if data.pop("format") != FORMAT:
            raise ValueError(f"{NAME} has another format")
        checks = tuple(Check(**check) for check in data.pop("checks"))
        found = Record(**data, checks=checks)
    except (AttributeError, KeyError, TypeError) as error:
        raise ValueError(f"{NAME} is not a record of this program ({error})") from error
    if not _sound(found) or found.id != folder.name:
        raise ValueError(f"{NAME} is not a record of figure {folder.name}")
    return found


def _sound(found: Record) -> bool:
    """Whether fields that others rely on hold what they should."""
    texts: list[Any] = [found.id, found.title, found.source, found.world, found.preset, found.traceback]
    for c in found.checks:
        texts += [c.id, c.part, c.sentence, c.criterion, c.caveat, c.reason]
    verdicts = all(check.verdict in VERDICTS for check in found.checks)
    numbers = all(isinstance(check.measured, (int, float, str)) for check in found.checks)
    lists = isinstance(found.claims, list) and found.status in ("done", "crashed")
    lists = lists and isinstance(found.conditions, list) and all(map(_is_condition, found.conditions))
    return verdicts and numbers and lists and all(isinstance(text, str) for text in texts)


def _is_condition(data: Any) -> bool:
    fields = {field.name for field in dataclass_fields(Conditions)}
    return isinstance(data, dict) and set(data) == fields
