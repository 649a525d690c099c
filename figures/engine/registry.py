"""The figures there are: the modules that stand in a wing, imported when asked for."""

import difflib
import importlib
import pkgutil
import re
import traceback
from collections.abc import Iterable, Iterator, Mapping, Sequence
from importlib.util import find_spec

from figures.claims.errors import FigureError
from figures.claims.figure import PRESETS, Entry, Figure
from figures.engine.store import canonical

ID = re.compile(r"[A-Z][A-Z0-9]*-[A-Za-z0-9-]+")
OF_A_PAPER = re.compile(r"f\d")
"""How the name of a module goes on, after its first underscore, that shows a numbered figure of a paper."""


def standing(wings: Iterable[str]) -> tuple[str, ...]:
    """The modules in the packages, wing by wing: numbered figures of the paper first, each kind by name and number."""
    return tuple(f"{wing}.{name}" for wing in wings for name in sorted(_modules(wing), key=_place))


def _modules(wing: str) -> Iterator[str]:
    spec = find_spec(wing)
    folders = (spec.submodule_search_locations if spec else None) or []
    yield from (module.name for module in pkgutil.iter_modules(folders))


def _place(name: str) -> tuple[bool, list[tuple[int, str]]]:
    """The order of gris_f02 and gris_f10 is that of 2 and 10, and gris_c06 comes after both."""
    rest = name.partition("_")[2] or name
    pieces = re.findall(r"(\d*)(\D*)", rest)
    return not OF_A_PAPER.match(rest), [(int(number or 0), word) for number, word in pieces]


def load(modules: Iterable[str]) -> dict[str, Entry]:
    """Import the modules: figure id -> entry, in the order given."""
    entries: dict[str, Entry] = {}
    for entry in map(_import, modules):
        id_ = entry.figure.id
        if id_ in entries:
            raise FigureError(f"figure id {id_!r} is in both {entries[id_].module} and {entry.module}")
        entries[id_] = entry
    return entries


def _import(name: str) -> Entry:
    try:
        figure = vars(importlib.import_module(name)).get("FIGURE")
    except Exception as error:
        raise FigureError(f"cannot import figure module {name}:\n{traceback.format_exc()}") from error
    if not isinstance(figure, Figure):
        raise FigureError(
            f"{name} stands among the figures and holds no FIGURE = Figure(...): give it one, "
            "or move what figures share to figures/experiments/"
        )
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
        raise FigureError("there are no figures yet: none stands in a wing, such as figures/gris/")
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
