"""The ledger of claims: every sentence that is checked, the verdict expected of it, and who checks it."""

import json
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from figures.claims.errors import FigureError
from figures.claims.figure import PRESETS, VERDICTS, Entry, Verdict

FORMAT = 1
TEXTS = ("id", "paper", "class", "source", "sentence", "criterion")
LISTS = ("worlds", "scenes")


@dataclass(frozen=True)
class Row:
    """One claim: where it stands, what it says, how it is judged, in which worlds and scenes, and what is expected.

    `expected` holds a verdict per preset.
    """

    id: str
    paper: str
    kind: str
    source: str
    sentence: str
    criterion: str
    worlds: tuple[str, ...]
    scenes: tuple[str, ...]
    expected: Mapping[str, Verdict | None]


def load(path: Path) -> dict[str, Row]:
    """Claim id -> row, in the order of the file."""
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError as error:
        raise FigureError(f"there is no ledger of claims at {path}") from error
    except (OSError, ValueError) as error:
        raise FigureError(f"the ledger of claims {path} cannot be read: {error}") from error
    if not isinstance(data, dict) or data.get("format") != FORMAT or not isinstance(data.get("claims"), list):
        raise FigureError(f'the ledger of claims {path} is not {{"format": {FORMAT}, "claims": [...]}}')
    rows: dict[str, Row] = {}
    for number, claim in enumerate(data["claims"]):
        row = _row(claim, f"{path}, claim {number}")
        if row.id in rows:
            raise FigureError(f"{path}: claim {row.id!r} stands there twice")
        rows[row.id] = row
    return rows


def _row(claim: Any, where: str) -> Row:
    if not isinstance(claim, dict) or not all(isinstance(claim.get(name), str) for name in TEXTS):
        raise FigureError(f"{where}: needs the texts {', '.join(TEXTS)}")
    if not all(_is_texts(claim.get(name, [])) for name in LISTS):
        raise FigureError(f"{where} ({claim['id']}): needs lists of texts, {' and '.join(LISTS)}")
    expected = claim.get("expected")
    if not isinstance(expected, dict) or set(expected) != set(PRESETS):
        raise FigureError(f"{where} ({claim['id']}): expected needs {' and '.join(PRESETS)}")
    for verdict in expected.values():
        if verdict is not None and verdict not in VERDICTS:
            raise FigureError(f"{where} ({claim['id']}): {verdict!r} is none of {', '.join(VERDICTS)}")
    id_, paper, kind, source, sentence, criterion = (claim[name] for name in TEXTS)
    worlds, scenes = (tuple(claim.get(name, ())) for name in LISTS)
    return Row(id_, paper, kind, source, sentence, criterion, worlds, scenes, expected)


def _is_texts(value: Any) -> bool:
    return isinstance(value, list) and all(isinstance(each, str) for each in value)


def unknown(rows: Mapping[str, Row], entries: Iterable[Entry]) -> Iterator[str]:
    """Declared claims which the ledger lacks, in words."""
    for entry in entries:
        for claim in entry.figure.claims:
            if claim not in rows:
                yield f"{entry.module}: {entry.figure.id} declares claim {claim!r}, which the ledger lacks"


def unmeasured(rows: Mapping[str, Row], entries: Iterable[Entry], preset: str) -> Iterator[str]:
    """Declared claims of which the ledger expects nothing yet for this preset, in words."""
    for entry in entries:
        for claim in entry.figure.claims:
            if claim in rows and rows[claim].expected[preset] is None:
                yield f"{entry.figure.id} declares {claim}, whose expected verdict is null for {preset!r}"
