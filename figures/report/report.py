"""The report of a folder of results, rebuilt from what is stored there and nothing else."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from figures.claims import verdicts
from figures.claims.errors import FigureError
from figures.claims.figure import Entry
from figures.claims.ledger import Row
from figures.claims.showings import Showing
from figures.claims.verdicts import Judged
from figures.engine import audit, disk, kept, manifest, registry, summary
from figures.engine.gather import gather
from figures.engine.outdir import REPORT
from figures.report import page
from figures.report.beside import Beside, way_up


@dataclass(frozen=True)
class Source:
    """What stands beside results: ledger, figures, who shows a claim, and the file of kept paper runs."""

    ledger: Mapping[str, Row]
    entries: Mapping[str, Entry]
    shown_by: Mapping[str, Sequence[Showing]]
    paper: Path


def write(out: Path, source: Source) -> list[Judged]:
    """Write `verdicts.json` and `index.html`, with the kept verdicts of the paper preset; return the verdicts."""
    shown = gather(out)
    if not shown:
        raise FigureError(f"{out} holds no results. `run` computes them; --out names another folder")
    records = [figure.record for figure in shown if figure.record is not None]
    declared, runs = registry.declared(source.entries), kept.read(source.paper)
    judged = verdicts.judge(records, source.ledger, declared)
    summary.write(judged, out)
    misfits = audit.misfits(out, source.ledger, source.entries, source.paper)
    found = kept.verdicts(runs, declared)
    beside = Beside(source.ledger, source.entries, source.shown_by, runs, found, misfits, way_up(out))
    disk.write_text(out / REPORT, page.page(shown, judged, beside, manifest.read(out)))
    return judged
