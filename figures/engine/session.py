"""A run under way, and the manifest that tells how far it is."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from figures.claims.figure import Entry
from figures.claims.ledger import Row
from figures.claims.verdicts import Judged, Record
from figures.engine import manifest, plan
from figures.engine.finish import Draw
from figures.engine.jobs import Crew
from figures.engine.plan import Plan


@dataclass(frozen=True)
class Press:
    """Who makes of results what people look at: a figure's pictures, and the report of a folder with its verdicts."""

    draw: Draw
    report: Callable[[Path], list[Judged]]


@dataclass(frozen=True)
class Request:
    """What was asked: figures, preset, root seed, who computes, who draws and reports, and the folder of results."""

    entries: tuple[Entry, ...]
    preset: str
    seed: int
    crew: Crew
    press: Press
    out: Path


@dataclass(frozen=True)
class Session:
    """A run under way; per figure: plan, chunks missing and reused, seconds spent, record once finished.

    The dicts and sets inside are the run's memory: they change as chunks come in.
    """

    request: Request
    ledger: Mapping[str, Row]
    plans: Mapping[str, Plan]
    missing: Mapping[str, set[int]]
    reused: Mapping[str, int]
    seconds: dict[str, float]
    records: dict[str, Record] = field(default_factory=dict)
    started: str = field(default_factory=manifest.now)
    environment: Mapping[str, Any] = field(default_factory=manifest.environment)


def begin(request: Request, ledger: Mapping[str, Row], warn: Callable[[str], object]) -> Session:
    """Plan the figures and look what is already stored; the first file that is not ours ends it here."""
    plans = {e.figure.id: plan.plan(e, request.preset, request.seed, request.out) for e in request.entries}
    missing = {id_: plan.prepare(p, warn) for id_, p in plans.items()}
    reused = {id_: len(p.parts) - len(missing[id_]) for id_, p in plans.items()}
    return Session(request, ledger, plans, missing, reused, dict.fromkeys(plans, 0.0))


def note(session: Session, status: str) -> None:
    """Write the manifest."""
    request = session.request
    run = {
        "status": status,
        "preset": request.preset,
        "seed": request.seed,
        "jobs": request.crew.size,
        **request.crew.about,
        "started": session.started,
        "noted": manifest.now(),
        "finished": None if status == "running" else manifest.now(),
        **session.environment,
    }
    manifest.write(request.out, run, {id_: _entry(session, id_) for id_ in session.plans})


def _entry(session: Session, id_: str) -> dict[str, object]:
    mine, found = session.plans[id_], session.records.get(id_)
    count, lacking = len(mine.parts), len(session.missing[id_])
    computed = count - lacking - session.reused[id_]
    return {
        "status": found.status if found else "incomplete",
        "preset": mine.preset,
        "seed": mine.seed,
        "version": mine.figure.version,
        "chunks": {"declared": count, "reused": session.reused[id_], "computed": computed},
        "seconds": round(session.seconds[id_], 3),
        "traceback": found.traceback if found else "",
    }
