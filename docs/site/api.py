"""The API reference: a page per module, an index in the order of the README's table, and where each equation is.

All of it is staged as reStructuredText; autodoc and autosummary fill in signatures and docstrings.
"""

import builtins
import importlib
import inspect
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache

from docs.site import layout, words
from docs.site.layout import Module, Named
from figures.report.markup import sentences
from figures.report.sources import CITED, numbers

INDEX, EQUATIONS = "api/index.html", "equations.html"
PAPERS = ("GRIS", "GPT", "DDGIR", "MCMC")
GROUPED = (
    "Grouped as the table of equations and files in the :doc:`README </readme>`; where a single equation is, says "
    ":doc:`/equations`. Batches are the last axis, see :doc:`/notation`."
)
TOLD = (
    "The README's table, each row with the functions that say its equations; below, every equation, theorem and "
    "section of a paper that a docstring cites. The keys are explained in :doc:`references`."
)
REST = "what the others are made of"


@dataclass(frozen=True)
class Row:
    """A row of the README's table: what, its files and folders, and its source, as Markdown."""

    what: str
    where: tuple[str, ...]
    source: str

    @property
    def modules(self) -> list[str]:
        """The modules with pages that the row names, or that stand in folders it names."""
        found = (dotted for path in self.where for dotted in _within(path))
        return list(dict.fromkeys(found))


def _within(path: str) -> Iterator[str]:
    dotted = path.strip("/").removesuffix(".py").replace("/", ".")
    if path.endswith(".py"):
        yield from [dotted] * (dotted in layout.modules())
    else:
        yield from (name for name in layout.modules() if f"{name}.".startswith(f"{dotted}."))


@cache
def rows() -> tuple[Row, ...]:
    """The README's table "Equation to file"."""
    text = (layout.ROOT / "README.md").read_text(encoding="utf-8")
    table = text.partition("## Equation to file")[2].partition("\n\n")[2].partition("\n\n")[0]
    cells = [[cell.strip() for cell in line.strip("|").split("|")] for line in table.splitlines()[2:]]
    return tuple(Row(what, tuple(_files(where)), source) for what, where, source in cells)


def _files(where: str) -> Iterator[str]:
    """The files of the checkout that a cell names, in backticks or as links."""
    named = re.findall(r"`([^`]+)`", where) + re.findall(r"\]\(([^)]+)\)", where)
    yield from (path for each in named if "/" in each for path in words.spread(each) if layout.place(path))


# ---------------------------------------------------------------- names


def resolver(module: str) -> words.Resolve:
    """What a name in backticks means in a module: what it defines or imports, or another module of ours."""

    def resolve(code: str) -> str:
        if not re.fullmatch(r"[A-Za-z]\w*(?:\.[A-Za-z]\w*)*", code):
            return ""
        return _object(module, code) or _method(module, code) or _module(module, code)

    return resolve


@cache
def public() -> frozenset[str]:
    """The full names of everything that has an entry."""
    return frozenset(each.name for module in layout.modules().values() for each in module.holds)


def _object(module: str, code: str) -> str:
    found: object = importlib.import_module(module)
    for part in code.split("."):
        found = inspect.getattr_static(found, part, None)
        found = getattr(found, "__func__", found)
    name = f"{getattr(found, '__module__', '')}.{getattr(found, '__qualname__', '')}"
    return name if name in public() and not hasattr(builtins, code) else ""


def _method(module: str, code: str) -> str:
    ends = [name for name in sorted(public()) if name.startswith(f"{module}.") and name.endswith(f".{code}")]
    return ends[0] if len(ends) == 1 else ""


def _module(module: str, code: str) -> str:
    package = module.rpartition(".")[0] or module
    names = (code, f"{module}.{code}", f"{package}.{code}", f"{module.partition('.')[0]}.{code}")
    return next((name for name in names if name in layout.modules() and "." in name), "")


def summary(text: str) -> str:
    """The first sentence of a docstring."""
    return (sentences(text.partition("\n\n")[0]) or [""])[0]


# ---------------------------------------------------------------- pages


def pages() -> Iterator[tuple[str, str]]:
    """Every page of the reference: its path below the site's root, and its text."""
    yield "api/index.rst", "\n".join(index())
    yield "equations.rst", "\n".join(equations())
    for module in layout.modules().values():
        yield f"api/{module.name}.rst", "\n".join(page(module))


FEW = 6
"""Modules in a group whose contents are listed as well."""

APART = (":orphan:", "")
"""Such a page stands in an index of its own, not in the list beside every page."""


def heading(text: str, line: str = "=") -> list[str]:
    """A heading of plain text."""
    return [words.plain(text), line * (len(words.plain(text)) + 2), ""]


def page(module: Module) -> Iterator[str]:
    """A module: where its text is, what is in it, and all of that."""
    here = layout.module_place(module.name)
    yield from APART
    code = layout.way(here, layout.code_place(module.path))
    yield from heading(module.name)
    yield from [f":doc:`API reference <index>` · code: `{words.plain(module.path)} <{code}>`__", ""]
    yield from words.rst(module.doc, here, resolver(module.name))
    if not module.holds:
        yield from _offered(module, here)
        return
    yield from [".. autosummary::", "   :nosignatures:", ""]
    yield from (f"   ~{each.name}" for each in module.holds if each.name.count(".") == module.name.count(".") + 1)
    yield from ["", *heading("In detail", "-"), f".. automodule:: {module.name}", "   :members:", ""]


def _offered(module: Module, here: str) -> Iterator[str]:
    """What a package hands on, and its modules."""
    found = vars(importlib.import_module(module.name))
    names = [f"`{name}`" for name in found.get("__all__", ()) if _object(module.name, name)]
    if names:
        said = words.inline(f"To be imported from here: {', '.join(names)}.", here, resolver(module.name))
        yield from [said, ""]
    inside = [each for each in layout.modules().values() if each.name.startswith(f"{module.name}.")]
    yield from modules_in(inside, here)


def modules_in(modules: Sequence[Module], here: str) -> Iterator[str]:
    """A table of modules with their first sentences."""
    if modules:
        yield from [".. list-table::", "   :widths: 35 65", "   :class: modules", ""]
    for each in modules:
        to = layout.way(here, layout.module_place(each.name))
        yield f"   * - `{words.plain(each.name)} <{to}>`__"
        yield f"     - {words.inline(summary(each.doc), here, resolver(each.name))}"
    yield ""


def index() -> Iterator[str]:
    """All modules, in the order of the README's table."""
    yield from heading("API reference")
    yield from [GROUPED, ""]
    seen: set[str] = set()
    for row in rows():
        named = [name for name in row.modules if name not in seen]
        seen |= set(named)
        if named:
            yield from heading(_without_markup(row.what), "-")
            yield from _source(row, INDEX)
            yield from _group(named)
    yield from heading(REST[:1].upper() + REST[1:], "-")
    yield from _group([name for name in layout.modules() if name not in seen])


def _without_markup(text: str) -> str:
    return re.sub(r"[`*]", "", re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", text))


def _source(row: Row, here: str) -> Iterator[str]:
    if row.source:
        yield from [words.inline(_without_markup(row.source), here, lambda _: ""), ""]


def _group(names: Sequence[str]) -> Iterator[str]:
    """Modules with their first sentences; of few of them also what they hold."""
    found = [layout.modules()[name] for name in names]
    yield from modules_in(found, INDEX)
    held = [each for module in found for each in module.holds if each.name.count(".") == module.name.count(".") + 1]
    if held and len(found) <= FEW:
        yield from [".. autosummary::", "   :nosignatures:", "", *(f"   ~{each.name}" for each in held), ""]


# ---------------------------------------------------------------- equations


@cache
def citing() -> Mapping[tuple[str, str], tuple[Named, ...]]:
    """(paper, "Eq. 36") -> the functions and classes whose docstrings cite it."""
    found: dict[tuple[str, str], list[Named]] = {}
    for module in layout.modules().values():
        for each in module.holds:
            for paper, inside in CITED.findall(each.doc):
                for number in dict.fromkeys(numbers(inside)):
                    found.setdefault((paper, number), []).append(each)
    return {key: tuple(places) for key, places in found.items()}


def owner(name: str) -> str:
    """The module that holds a full name; empty for what is not ours."""
    while name and name not in layout.modules():
        name = name.rpartition(".")[0]
    return name


def shown_by(row: Row) -> list[Named]:
    """What a row of the README points at: what in its modules cites its source, then what else few modules hold."""
    wanted = [(paper, number) for paper, inside in CITED.findall(row.source) for number in numbers(inside)]
    cited = {each.name: each for key in wanted for each in citing().get(key, ()) if owner(each.name) in row.modules}
    held = [(name, each) for name in row.modules for each in layout.modules()[name].holds]
    top = {each.name: each for name, each in held if each.name.count(".") == name.count(".") + 1}
    return list((cited if cited and len(row.modules) > FEW // 2 else cited | top).values())


MOST = 16


def equations() -> Iterator[str]:
    """The README's table with the functions of each row, then paper by paper who cites what."""
    yield from heading("Equation to function")
    yield from [
        TOLD,
        "",
        ".. list-table::",
        "   :header-rows: 1",
        "   :widths: 30 50 20",
        "   :class: equations",
        "",
        "   * - what",
        "     - functions",
        "     - source",
    ]
    for row in rows():
        yield f"   * - {words.inline(_without_markup(row.what), EQUATIONS, lambda _: '')}"
        yield f"     - {_functions(row)}"
        yield f"     - {words.inline(_without_markup(row.source), EQUATIONS, lambda _: '') or ' '}"
    yield ""
    for paper in PAPERS:
        yield from _of_paper(paper)


def _functions(row: Row) -> str:
    found = shown_by(row)
    more = [f"and {len(found) - MOST} more"] if len(found) > MOST else []
    pages_ = [_linked(path, layout.place(path)) for path in row.where] if not found or more else []
    return ", ".join([*(entry(each) for each in found[:MOST]), *more, *pages_])


def _linked(text: str, place: str) -> str:
    return f"`{words.plain(text)} <{layout.way(EQUATIONS, place)}>`__"


def entry(each: Named) -> str:
    """A link to the entry of a name."""
    return f":py:obj:`{each.name.removeprefix(f'{owner(each.name)}.')} <{each.name}>`"


def _of_paper(paper: str) -> Iterator[str]:
    found = sorted((key[1] for key in citing() if key[0] == paper), key=_order)
    if not found:
        return
    yield from heading(paper, "-")
    yield from [".. list-table::", "   :widths: 15 85", ""]
    for number in found:
        yield f"   * - {words.plain(number)}"
        yield f"     - {', '.join(entry(each) for each in citing()[paper, number])}"
    yield ""


def _order(number: str) -> tuple[str, list[int], str]:
    kind, _, rest = number.partition(" ")
    return kind, [int(each) for each in re.findall(r"\d+", rest)], rest
