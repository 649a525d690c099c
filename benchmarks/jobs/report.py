"""What jobs have found, filed: benchmarks/evidence.json for programs, docs/evidence.md for people.

Every job keeps the commit it was measured at; a later run of one job leaves the others alone.
"""

import json
import math
import subprocess
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from benchmarks.jobs.job import ROOT, SEED, Done, Job, Row, depends
from figures.engine import disk

JSON, TABLE = "benchmarks/evidence.json", "docs/evidence.md"
MEASURED_CODE = ("restir_ref", "flatland2d", "tracer3d", "benchmarks", "tests/transport", "tests/tracer3d")


@dataclass(frozen=True)
class Measured:
    """One job's results and where they come from; `code` is the digest of all that the chunks depend on."""

    asks: str
    commit: str
    changed: bool
    code: str
    seed: int
    share: float
    date: str
    chunks: int
    cpu_minutes: float
    rows: list[dict[str, Any]]


@dataclass(frozen=True)
class Checkout:
    """The commit that is checked out, and whether files of the code differ from it."""

    commit: str
    changed: bool


def checkout() -> Checkout:
    """That of now: to be asked before a run, for others may commit in the meantime."""
    return Checkout(git("rev-parse", "--short=12", "HEAD"), bool(git("status", "--porcelain", "--", *MEASURED_CODE)))


def measured(job: Job, of: Checkout, share: float, rows: Sequence[Row], done: Done) -> Measured:
    """Results of a run that began with a checkout."""
    return Measured(
        job.asks,
        of.commit,
        of.changed,
        depends(job),
        SEED,
        share,
        datetime.now(UTC).date().isoformat(),
        len(done),
        round(sum(float(arrays["cpu"]) for _, arrays in done) / 60, 1),
        [{**asdict(row), "error": None if math.isnan(row.error) else row.error} for row in rows],
    )


def git(*arguments: str) -> str:
    """What git says of this checkout; nothing where there is no git."""
    try:
        said = subprocess.run(["git", *arguments], cwd=ROOT, capture_output=True, text=True, check=True)
    except (OSError, subprocess.CalledProcessError):
        return ""
    return said.stdout.strip()


def file(name: str, found: Measured, root: Path) -> None:
    """Put one job's results into both files."""
    path = root / JSON
    everything = json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}
    everything[name] = asdict(found)
    for each in (path, root / TABLE):
        each.parent.mkdir(parents=True, exist_ok=True)
    disk.write_text(path, json.dumps(everything, indent=1, ensure_ascii=False, allow_nan=False) + "\n")
    disk.write_text(root / TABLE, page(everything))


def stale(jobs: Mapping[str, Job], root: Path) -> list[str]:
    """Jobs whose filed results are missing, partial, or were measured by other code or against other references."""
    path = root / JSON
    filed = json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}
    said = []
    for name, job in jobs.items():
        found = filed.get(name)
        if found is None:
            said.append(f"{name}: never measured")
        elif found["share"] != 1:
            said.append(f"{name}: measured at {found['share']:.3g} of its counts only")
        elif found["code"] != depends(job):
            said.append(f"{name}: code or references have changed since it was measured at {found['commit']}")
    return said + [f"{name}: is filed, but no job any more" for name in filed if name not in jobs]


def page(everything: Mapping[str, Any]) -> str:
    """All results in Markdown."""
    return HEAD + "".join(section(name, everything[name]) for name in sorted(everything))


HEAD = """# Evidence

Results of `make evidence`, written by `benchmarks/evidence.py`; `benchmarks/evidence.json` has them in full.
Every job names its seed, its counts and the commit it was measured at; *changed* says that files of the checkout
differed from that commit.  Chunks count only while the code they depend on, whose digest is given, stays the same.
± is one standard error.
"""


def section(name: str, found: Mapping[str, Any]) -> str:
    """One job."""
    changed = " (changed)" if found["changed"] else ""
    share = "" if found["share"] == 1 else f", at {found['share']:.3g} of the full counts"
    holds = sum(row["holds"] for row in found["rows"])
    made = f"commit {found['commit'] or 'unknown'}{changed}, code {found['code']}, seed {found['seed']}"
    spent = f"{found['date']}, {found['cpu_minutes']:.1f} CPU minutes{share}"
    lines = [
        f"\n## {name}\n",
        f"{found['asks']}.\n",
        f"{holds} of {len(found['rows'])} hold; {made}, {spent}.\n",
        "| claims | what | value | limit | count | verdict | note |",
        "|---|---|---|---|---|---|---|",
        *(table_row(row) for row in found["rows"]),
    ]
    return "\n".join(lines) + "\n"


def table_row(row: Mapping[str, Any]) -> str:
    """One statement as a line of a table."""
    cells = (row["claims"], row["what"], shown(row), row["limit"], f"{row['count']:,}".replace(",", " "), verdict(row))
    return "| " + " | ".join(str(cell).replace("|", "\\|") for cell in (*cells, row["note"])) + " |"


def shown(row: Mapping[str, Any]) -> str:
    """Value and standard error."""
    error = row["error"]
    return f"{row['value']:.3g}" + ("" if error is None or math.isnan(error) else f" ± {error:.2g}")


def verdict(row: Mapping[str, Any]) -> str:
    """In one word."""
    return "holds" if row["holds"] else "**FAILS**"


def print_rows(name: str, rows: Sequence[Row]) -> None:
    """The same on the terminal."""
    print(f"\n{name}")
    for row in rows:
        each = asdict(row)
        word = "holds" if row.holds else "FAILS"
        print(f"{word:6} {shown(each):>20}  {row.limit:24} {row.what}  [{row.claims}] {row.note}", flush=True)
