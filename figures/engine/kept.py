"""What the paper preset found, kept in the repository: hours of computing that nobody has to repeat to be told.

`keep` takes every figure that is done in a folder of results, so that a long run is kept figure by figure.  A figure's
kept verdicts are stale once its own code, its paper preset, or what judges it is another one; that theory or world have
changed since is only told, as their laws and the quick preset watch over them.
"""

import hashlib
import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from figures.claims.errors import FigureError
from figures.claims.figure import VERDICTS, Entry, Verdict, worst
from figures.claims.ledger import Row
from figures.claims.verdicts import Record
from figures.engine import code, disk, manifest, plan, record, registry, store

FORMAT = 1
PAPER = "paper"


@dataclass(frozen=True)
class Kept:
    """One figure's paper run: commit and date, digests of code and arrays, seed, and its checks as plain data.

    `chunks` is the digest of all code that computed, `own` that of the figure's modules with its preset.
    """

    commit: str
    date: str
    seed: int
    chunks: str
    own: str
    arrays: str
    checks: Sequence[Mapping[str, Any]]


def read(path: Path) -> dict[str, Kept]:
    """Figure id -> what is kept; nothing where there is no file.  Raises FigureError for a damaged one."""
    if not path.exists():
        return {}
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
        if data["format"] != FORMAT:
            raise ValueError("another format")
        found = {id_: Kept(**each) for id_, each in data["figures"].items()}
        if not all(check["verdict"] in VERDICTS for each in found.values() for check in each.checks):
            raise ValueError("a verdict is none")
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise FigureError(f"{path} is damaged ({error}): restore it from git, or `keep` a paper run again") from error
    return found


def keep(out: Path, entries: Mapping[str, Entry], path: Path) -> list[str]:
    """File every figure that `out` holds whole, at the paper preset and by today's code; say what became of each."""
    kept, said = read(path), []
    for id_, entry in entries.items():
        trouble = _trouble(out / id_, entry)
        if trouble:
            said.append(f"{id_}: {trouble}")
            continue
        kept[id_] = _kept(entry, record.read(out / id_), out / id_ / "arrays.npz")
        said.append(f"{id_}: kept")
    data = {"format": FORMAT, "figures": {id_: asdict(each) for id_, each in sorted(kept.items())}}
    disk.write_text(path, json.dumps(data, indent=1, ensure_ascii=False) + "\n")
    return said


def _trouble(folder: Path, entry: Entry) -> str:
    """Why a figure cannot be kept; empty if it can."""
    try:
        found = record.read(folder)
    except (OSError, ValueError) as error:
        return f"not here ({getattr(error, 'strerror', None) or error})"
    if found.preset != PAPER or found.status != "done":
        return f"{found.status} at preset {found.preset}"
    asked = plan.plan(entry, PAPER, found.seed, folder.parent)
    state, trouble = store.state(plan.arrays_path(asked), plan.key(asked))
    return "" if state == "ours" else f"{state}: {trouble}"


def _kept(entry: Entry, found: Record, arrays: Path) -> Kept:
    names = ("id", "part", "measured", "criterion", "verdict", "caveat", "reason")
    git = manifest.git(manifest.ROOT)
    commit = f"{git['commit'] or 'unknown'}"[:12] + " (changed)" * bool(git["dirty"])
    return Kept(
        commit,
        manifest.now()[:10],
        found.seed,
        code.digest(entry.module, entry.figure.world),
        own(entry),
        hashlib.sha256(arrays.read_bytes()).hexdigest()[:16],
        [{name: getattr(check, name) for name in names} for check in found.checks],
    )


def own(entry: Entry) -> str:
    """Digest of the figure's modules and its paper preset."""
    text = code.own(entry.module) + store.canonical(entry.figure.presets[PAPER])
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def verdicts(kept: Mapping[str, Kept], declared: Mapping[str, set[str]]) -> dict[str, Verdict]:
    """Claim id -> its verdict at the paper preset, of claims all of whose figures are kept."""
    found = {}
    for id_, figures in declared.items():
        checks = [check for each in figures & set(kept) for check in kept[each].checks if check["id"] == id_]
        if figures <= set(kept) and checks:
            found[id_] = worst([check["verdict"] for check in checks])
    return found


# ---------------------------------------------------------------- what does not fit


def stale(kept: Mapping[str, Kept], entries: Mapping[str, Entry]) -> Iterator[str]:
    """Figures whose paper run was computed or judged by other code of their own, in words."""
    for id_, entry in entries.items():
        if id_ in kept and kept[id_].own != own(entry):
            yield f"{id_}: its code or paper preset has changed since its paper run at {kept[id_].commit}"


def missing(kept: Mapping[str, Kept], entries: Mapping[str, Entry]) -> list[str]:
    """Figures that still have no kept paper run."""
    return [id_ for id_ in entries if id_ not in kept]


def older(kept: Mapping[str, Kept], entries: Mapping[str, Entry]) -> list[str]:
    """Figures whose paper run stands, but was computed by other theory or another state of their world."""
    known = {id_: entry for id_, entry in entries.items() if id_ in kept and kept[id_].own == own(entry)}
    return [id_ for id_, e in known.items() if kept[id_].chunks != code.digest(e.module, e.figure.world)]


def unexpected(kept: Mapping[str, Kept], entries: Mapping[str, Entry], ledger: Mapping[str, Row]) -> Iterator[str]:
    """Claims whose expected verdict at the paper preset is not the kept one, in words."""
    for id_, found in verdicts(kept, registry.declared(entries)).items():
        expected = ledger[id_].expected[PAPER] if id_ in ledger else None
        if expected != found:
            yield f"{id_}: the ledger expects {expected!r} at the paper preset, the kept run found {found!r}"


def dropped(kept: Mapping[str, Kept], records: Iterable[Record]) -> Iterator[str]:
    """Parts of claims that a run lacks beside the kept one, in words; figures without a kept run are passed over."""
    for found in records:
        if found.id in kept and found.status == "done":
            mine = {(check.id, check.part) for check in found.checks}
            for check in kept[found.id].checks:
                if (check["id"], check["part"]) not in mine:
                    yield (
                        f"{found.id} at preset {found.preset} drops a part of {check['id']}, {check['part']!r}: "
                        "what a preset cannot judge is a Claim without outcome, with its reason"
                    )
