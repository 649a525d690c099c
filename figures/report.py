"""The report of a folder of results, rebuilt from what is stored there and nothing else."""

from collections.abc import Mapping
from pathlib import Path

from figures import disk, manifest, page, registry, verdicts
from figures.errors import FigureError
from figures.gather import gather
from figures.ledger import Row
from figures.outdir import REPORT
from figures.registry import Entry
from figures.verdicts import Judged


def write(out: Path, ledger: Mapping[str, Row], entries: Mapping[str, Entry]) -> list[Judged]:
    """Write `verdicts.json` and `index.html`; return the verdicts."""
    shown = gather(out)
    if not shown:
        raise FigureError(f"{out} holds no results. `run` computes them; --out names another folder")
    records = [figure.record for figure in shown if figure.record is not None]
    judged = verdicts.judge(records, ledger, registry.declared(entries))
    verdicts.write(judged, out)
    disk.write_text(out / REPORT, page.page(shown, judged, ledger, manifest.read(out)))
    return judged
