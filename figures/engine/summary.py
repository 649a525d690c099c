"""The verdicts of a folder of results, as `verdicts.json` keeps them."""

import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from figures.claims.errors import FigureError
from figures.claims.figure import Verdict, worst
from figures.claims.verdicts import Judged
from figures.engine import disk

FORMAT = 1
NAME = "verdicts.json"


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
