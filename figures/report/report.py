"""The report of a folder of results, rebuilt from what is stored there and nothing else."""

from collections.abc import Mapping
from pathlib import Path

from figures.claims import verdicts
from figures.claims.errors import FigureError
from figures.claims.figure import Entry
from figures.claims.ledger import Row
from figures.claims.verdicts import Judged
from figures.engine import audit, disk, kept, manifest, registry, summary
from figures.engine.gather import gather
from figures.engine.outdir import REPORT
from figures.report import page


def write(out: Path, ledger: Mapping[str, Row], entries: Mapping[str, Entry], paper: Path) -> list[Judged]:
    """Write `verdicts.json` and `index.html`, with the kept verdicts of the paper preset; return the verdicts."""
    shown = gather(out)
    if not shown:
        raise FigureError(f"{out} holds no results. `run` computes them; --out names another folder")
    records = [figure.record for figure in shown if figure.record is not None]
    declared, kept_runs = registry.declared(entries), kept.read(paper)
    judged = verdicts.judge(records, ledger, declared)
    summary.write(judged, out)
    beside = page.Beside(ledger, kept.verdicts(kept_runs, declared), audit.misfits(out, ledger, entries, paper))
    disk.write_text(out / REPORT, page.page(shown, judged, beside, manifest.read(out)))
    return judged
