"""What must fit before a change is handed in, beyond tests: the ledger, the kept paper runs, and stored results."""

from collections.abc import Iterator, Mapping
from dataclasses import asdict
from pathlib import Path

from figures.claims import coverage, verdicts
from figures.claims.figure import Entry
from figures.claims.ledger import Row
from figures.engine import gather, kept, registry


def problems(paper: Path, rows: Mapping[str, Row], entries: Mapping[str, Entry], out: Path) -> Iterator[str]:
    """Everything amiss, in words: each line names what to mend.  `paper` is the file of kept paper runs."""
    yield from criteria(rows)
    runs = kept.read(paper)
    yield from kept.stale(runs, entries)
    yield from kept.unexpected(runs, entries, rows)
    if out.is_dir():
        yield from results(rows, entries, runs, out)


def criteria(rows: Mapping[str, Row]) -> Iterator[str]:
    """Rows whose sentence and criterion name fewer scenes or worlds than the row has."""
    for id_, row in rows.items():
        lacking = coverage.missing(asdict(row))
        if lacking:
            yield f"{id_}: sentence and criterion do not name {', '.join(lacking)}"


def results(
    rows: Mapping[str, Row], entries: Mapping[str, Entry], runs: Mapping[str, kept.Kept], out: Path
) -> Iterator[str]:
    """Figures of a folder that crashed, a comparison of a thing with itself among them; verdicts and parts amiss."""
    shown = [each.record for each in gather.gather(out) if each.record is not None]
    for record in shown:
        if record.status == "crashed":
            yield f"{record.id} crashed: {record.traceback.strip().splitlines()[-1]}"
    for judged in verdicts.judge(shown, rows, registry.declared(entries)):
        if judged.agrees is False:
            yield f"{judged.id}: {judged.verdict} at preset {judged.preset}, expected {judged.expected}"
    yield from kept.dropped(runs, shown)


def remarks(paper: Path, entries: Mapping[str, Entry]) -> Iterator[str]:
    """What is told without being amiss."""
    runs = kept.read(paper)
    older, missing = kept.older(runs, entries), kept.missing(runs, entries)
    if missing:
        yield f"{len(missing)} figures have no kept paper run yet: {', '.join(missing)}; make figures-paper"
    if older:
        yield f"{len(older)} paper runs were computed by other theory or worlds than today's: {', '.join(older)}"


def misfits(out: Path, ledger: Mapping[str, Row], entries: Mapping[str, Entry], paper: Path) -> list[str]:
    """What of a folder of results, and of the ledger, does not fit the kept runs of the paper preset, in words."""
    kept_runs = kept.read(paper)
    records = [each.record for each in gather.gather(out) if each.record is not None]
    return [*kept.dropped(kept_runs, records), *kept.unexpected(kept_runs, entries, ledger)]
