"""The figures there are: an explicit tuple of modules, imported when asked for."""

import difflib
import importlib
import re
import traceback
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from figures.claims.errors import FigureError
from figures.claims.figure import PRESETS, Figure
from figures.engine.store import canonical

MODULES: tuple[str, ...] = (
    "figures.gris.gris_f02",
    "figures.gris.gris_f03",
    "figures.gris.gris_f04",
    "figures.gris.gris_f07",
    "figures.gris.gris_f07c",
    "figures.gris.gris_f08",
    "figures.gris.gris_f09",
    "figures.gris.gris_f10",
    "figures.gris.gris_e46",
    "figures.gris.gris_c06",
    "figures.gris.gris_c08",
    "figures.gris.gris_c19",
    "figures.gris.gris_c21",
    "figures.trust.zoo",
    "figures.gradient.gpt_f03",
    "figures.mcmc.mcmc_1d",
    "figures.mcmc.mcmc_c09",
    "figures.gris.gris_t1",
    "figures.gris.gris_a2",
    "figures.gris.gris_e33",
    "figures.gris.gris_e40",
    "figures.gris.gris_e41",
    "figures.gris.gris_c15",
    "figures.gris.gris_c10",
    "figures.gris.gris_c09",
    "figures.gris.gris_f17",
    "figures.gris.gris_f17coat",
    "figures.gris.gris_f13",
    "figures.gris.gris_f12",
    "figures.gris.gris_f11",
    "figures.gris.gris_f07flat",
    "figures.gris.gris_f05",
    "figures.trust.flat_scenes",
    "figures.gris.gris_f14",
    "figures.gris.gris_f15di",
    "figures.gris.gris_f01",
    "figures.gris.gris_f06",
    "figures.gris.gris_f09flat",
    "figures.gris.gris_f15",
    "figures.gris.gris_c12",
    "figures.gris.gris_c16",
    "figures.mcmc.mcmc_e05",
    "figures.gris.gris_x",
)
ROOT = Path(__file__).resolve().parents[2]
ID = re.compile(r"[A-Z][A-Z0-9]*-[A-Za-z0-9-]+")


@dataclass(frozen=True)
class Project:
    """Where the engine finds figures, claims, tests and what long runs found; the commands of tests use another one."""

    modules: tuple[str, ...] = MODULES
    ledger: Path = ROOT / "figures" / "ledger.json"
    tests: Path = ROOT / "tests"
    paper: Path = ROOT / "figures" / "paper.json"
    benchmarks: Path = ROOT / "benchmarks"


@dataclass(frozen=True)
class Entry:
    """A figure and the module that holds it."""

    module: str
    figure: Figure


def load(modules: Iterable[str]) -> dict[str, Entry]:
    """Import the modules: figure id -> entry, in the order of the registry."""
    entries: dict[str, Entry] = {}
    for entry in map(_import, modules):
        id_ = entry.figure.id
        if id_ in entries:
            raise FigureError(f"figure id {id_!r} is in both {entries[id_].module} and {entry.module}")
        entries[id_] = entry
    return entries


def _import(name: str) -> Entry:
    try:
        figure = importlib.import_module(name).FIGURE
    except Exception as error:
        raise FigureError(f"cannot import figure module {name}:\n{traceback.format_exc()}") from error
    problems = list(faults(figure))
    if problems:
        raise FigureError(f"{name}.FIGURE: " + "; ".join(problems))
    return Entry(name, figure)


def faults(figure: Figure) -> Iterator[str]:
    """What is wrong with a figure's declaration, in words."""
    if not ID.fullmatch(figure.id):
        yield f"id {figure.id!r} must look like GRIS-F02, as it names a folder"
    if set(figure.presets) != set(PRESETS):
        yield f"presets are {sorted(figure.presets)}, not {sorted(PRESETS)}"
    if len(set(figure.claims)) != len(figure.claims):
        yield f"claims {figure.claims} repeat an id"
    yield from _unexplained(figure)
    for name, data in figure.presets.items():
        try:
            canonical(data)
        except (TypeError, ValueError) as error:
            yield f"preset {name!r} is not plain JSON data ({error})"


def _unexplained(figure: Figure) -> Iterator[str]:
    """Claims of a figure that renders without conditions, and conditions that are not the paper's without a reason."""
    covered = [id_ for each in figure.conditions for id_ in each.claims]
    needed = set(figure.claims) if figure.world != "toy1d" else set(covered)
    if len(set(covered)) != len(covered) or set(covered) != needed:
        yield f"conditions cover {sorted(covered)}, but must cover each of {sorted(needed)} once"
    for each in figure.conditions:
        if not each.alike and not each.why:
            yield f"conditions of {', '.join(each.claims)} are {each.ours.kind}, the paper's {each.paper.kind}: say why"


def select(entries: Mapping[str, Entry], ids: Sequence[str]) -> list[Entry]:
    """The entries of the ids in the order asked, each once; all of them if no id is given."""
    if not entries:
        raise FigureError("there are no figures yet: figures/engine/registry.py lists none")
    for id_ in ids:
        if id_ not in entries:
            raise FigureError(f"unknown figure {id_!r}: {_hint(id_, list(entries))}")
    return [entries[id_] for id_ in dict.fromkeys(ids or entries)]


def _hint(id_: str, known: Sequence[str]) -> str:
    spelled = {name.lower(): name for name in known}
    close = difflib.get_close_matches(id_.lower(), spelled, n=3)
    if close:
        return f"did you mean {' or '.join(spelled[name] for name in close)}?"
    return f"known are {', '.join(known) or 'none yet'}"


def declared(entries: Mapping[str, Entry]) -> dict[str, set[str]]:
    """Claim id -> ids of the figures that declare it."""
    claims = {claim for entry in entries.values() for claim in entry.figure.claims}
    return {claim: {id_ for id_, e in entries.items() if claim in e.figure.claims} for claim in claims}
