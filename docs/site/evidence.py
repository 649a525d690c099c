"""The page of the evidence: a summary of all jobs on top, each job's rows folded below."""

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from docs.site import layout, words

HERE = "evidence.html"
HEADS = ("job", "asks", "rows", "hold", "worst \\|z\\|", "worst SE", "date", "CPU minutes")


def jobs() -> Mapping[str, Mapping[str, Any]]:
    """What benchmarks/evidence.json has filed."""
    found: Mapping[str, Mapping[str, Any]] = json.loads(
        (layout.ROOT / "benchmarks" / "evidence.json").read_text(encoding="utf-8")
    )
    return found


def unbiased(rows: Sequence[Mapping[str, Any]]) -> list[Mapping[str, Any]]:
    """The rows that ask for a small z; controls, which must be far off, are none of them."""
    return [row for row in rows if re.match(r"\|z\| <=", row["limit"]) and row["error"]]


def worst_z(rows: Sequence[Mapping[str, Any]]) -> float:
    """The largest |value / error| of rows that ask for a small one; 0 if there are none."""
    return max((abs(row["value"] / row["error"]) for row in unbiased(rows)), default=0.0)


def worst_error(rows: Sequence[Mapping[str, Any]]) -> float:
    """The largest standard error of the same rows, relative as they are; 0 if there are none."""
    return max((row["error"] for row in unbiased(rows)), default=0.0)


def summary() -> Iterator[str]:
    """The table of jobs, as Markdown, and a line for all of them."""
    found = jobs()
    yield "| " + " | ".join(HEADS) + " |"
    yield "|" + "---|" * len(HEADS)
    for name, job in found.items():
        yield _line(f"[{name}](#{name.replace(' ', '-')})", job["asks"], job["rows"], job["date"], job["cpu_minutes"])
    rows = [row for job in found.values() for row in job["rows"]]
    yield _line(f"**all {len(found)}**", "", rows, "", sum(job["cpu_minutes"] for job in found.values()))


def _line(name: str, asks: str, rows: Sequence[Mapping[str, Any]], date: str, minutes: float) -> str:
    z, error = worst_z(rows), worst_error(rows)
    cells = (name, asks, str(len(rows)), str(sum(row["holds"] for row in rows)))
    numbers = (f"{z:.2f}" if z else "–", f"{error:.2%}" if error else "–", date, f"{minutes:.0f}")
    return "| " + " | ".join((*cells, *numbers)) + " |"


def page() -> str:
    """docs/evidence.md with the summary after its introduction, and every table of rows folded."""
    text = (layout.ROOT / "docs" / "evidence.md").read_text(encoding="utf-8")
    head, *parts = re.split(r"^(?=## )", text, flags=re.MULTILINE)
    said = (
        "z is the deviation in standard errors, over the rows that ask for a small one; controls, which have to be "
        "far off, do not count there. SE is the standard error relative to what the row is about."
    )
    whole = [head.rstrip(), "", "## All jobs", "", *summary(), "", said, "", *map(_folded, parts)]
    return words.markdown("\n".join(whole), "docs/evidence.md", HERE)


def _folded(part: str) -> str:
    before, bar, table = part.partition("\n| claims |")
    if not bar:
        return part
    count = table.count("\n|") - 1
    rows = f"<details>\n<summary>{count} rows</summary>\n\n| claims |{table.rstrip()}\n\n</details>\n"
    return f"{before.rstrip()}\n\n{rows}"
