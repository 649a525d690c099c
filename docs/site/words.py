"""Docstrings and Markdown of the checkout as Sphinx wants them: names, files and keys in brackets become links.

Docstrings here are plain English with formulas, no markup: every character means itself, `names` stand in backticks,
an indented block keeps its lines, and `>>>` begins an example.
"""

import posixpath
import re
from collections.abc import Callable, Iterator
from functools import cache
from html import escape

from docs.site import layout
from figures.claims import ledger

Resolve = Callable[[str], str]
"""A name in backticks -> the full name of what it means, empty if it means nothing public."""

KEY = r"(?:[A-Z]{3,5}|[A-Z][a-z]+ (?:19|20)\d\d)"
TOKEN = re.compile(rf"``(?P<literal>.+?)``|`(?P<code>[^`]+)`|\[(?P<key>{KEY})(?P<rest>[^\]\[]*)\]")
SPECIAL = re.compile(r"([\\*_|`<>])")
LIKE_A_LIST = re.compile(r"(?:[-+•]|\(?(?:\d+|[A-Za-z]|[ivxIVX]+)[.)]) |\.\. |:\w+:|__ ")
BULLET = re.compile(r"- ")
BRACES = re.compile(r"\{([^{}]+)\}")


def plain(text: str) -> str:
    """The text in reStructuredText, where every character means itself."""
    return SPECIAL.sub(r"\\\1", text)


REFERENCES = "docs/references.md"
EXPLAINED = re.compile(rf"^- \*\*\[({KEY})\]\*\*", re.MULTILINE)


@cache
def keys() -> frozenset[str]:
    """The keys that docs/references.md explains."""
    return frozenset(EXPLAINED.findall((layout.ROOT / REFERENCES).read_text(encoding="utf-8")))


def mark(key: str) -> str:
    """The name of the place where a key is explained."""
    return "ref-" + key.lower().replace(" ", "-")


def anchor(key: str) -> str:
    """Where a key is explained."""
    return f"references.html#{mark(key)}"


# ---------------------------------------------------------------- docstrings


def rst(text: str, here: str, resolve: Resolve) -> list[str]:
    """A docstring as lines of reStructuredText, for the page at `here`."""
    lines: list[str] = []
    for block in _blocks(text.splitlines()):
        lines += [*_block(block, here, resolve), ""]
    return lines


def _blocks(lines: list[str]) -> Iterator[list[str]]:
    """Runs of lines that belong together: between blank lines, and where indentation or an example begins or ends."""
    block: list[str] = []
    for line in lines:
        if block and (not line.strip() or _another(block, line)):
            yield block
            block = []
        if line.strip():
            block.append(line)
    if block:
        yield block


def _another(block: list[str], line: str) -> bool:
    first = block[0]
    if first.startswith(">>> "):
        return False
    if line.startswith((">>> ", "# erratum")):
        return True
    if BULLET.match(first):
        return not line.startswith(" ") and not BULLET.match(line)
    return first.startswith(" ") != line.startswith(" ") or bool(BULLET.match(line))


def _block(block: list[str], here: str, resolve: Resolve) -> list[str]:
    if block[0].startswith(">>> "):
        return block
    if block[0].startswith(" "):
        return ["::", "", *(f"   {line}" for line in block)]
    if BULLET.match(block[0]):
        items = re.split(r"\n(?=- )", "\n".join(block))
        return [f"- {inline(_joined(item[2:]), here, resolve)}" for item in items]
    if block[0].startswith("# erratum: "):
        said = _joined(" ".join(line.removeprefix("# ") for line in block)).removeprefix("erratum: ")
        return [".. admonition:: Erratum", "", f"   {inline(said, here, resolve)}"]
    said = _joined(" ".join(block))
    return [("\\ " if LIKE_A_LIST.match(said) else "") + inline(said, here, resolve)]


def _joined(text: str) -> str:
    return " ".join(text.split())


def inline(text: str, here: str, resolve: Resolve) -> str:
    """One paragraph."""
    pieces, last = [], 0
    for found in TOKEN.finditer(text):
        pieces += [plain(text[last : found.start()]), _token(found, here, resolve)]
        last = found.end()
    return "".join([*pieces, plain(text[last:])])


def _token(found: re.Match[str], here: str, resolve: Resolve) -> str:
    if found["key"]:
        words = f"[{found['key']}{found['rest']}]"
        return _linked(words, layout.way(here, anchor(found["key"]))) if found["key"] in keys() else plain(words)
    code = found["literal"] or found["code"]
    name = resolve(code)
    if name:
        return f"\\ :py:obj:`{code} <{name}>`\\ "
    there = place_of_words(code)
    return _linked(code, layout.way(here, there)) if there else f"\\ ``{code}``\\ "


def _linked(words: str, there: str) -> str:
    whole = plain(words).replace(". ", ".\\  ")  # or autosummary ends its sentence here
    return f"\\ `{whole} <{there}>`__\\ "


# ---------------------------------------------------------------- files in words


@cache
def claims() -> frozenset[str]:
    """The ids of the ledger."""
    return frozenset(ledger.load(layout.ROOT / "figures" / "ledger.json"))


def claim_place(id_: str) -> str:
    """Where a claim of the ledger stands."""
    return f"claims/{id_.partition('-')[0]}.html#{id_}"


def place_of_words(code: str) -> str:
    """The page of a file, `restir_ref/mis.py`, of a test in one, `tests/x.py::test_y`, or of a claim; else empty.

    Raises ValueError for a test that is not in its file.
    """
    if code in claims():
        return claim_place(code)
    path, _, name = code.partition("::")
    looks = "/" in code or code.endswith((".md", ".py", ".toml", ".json", ".cff"))
    if name and path in layout.files():
        return layout.code_place(path, line_of(path, name))
    return layout.place(code) if looks and " " not in code and "*" not in code else ""


def line_of(path: str, name: str) -> int:
    """The line of a file in which a function begins.  Raises ValueError if there is none of that name."""
    lines, start = _lines(path), f"def {name.partition('[')[0]}("
    found = [k for k, line in enumerate(lines, start=1) if line.strip().startswith(start)]
    if not found:
        raise ValueError(f"{path} has no function {name}: mend the name, or what is said of it.")
    return found[0]


@cache
def _lines(path: str) -> tuple[str, ...]:
    return tuple((layout.ROOT / path).read_text(encoding="utf-8").splitlines())


def spread(code: str) -> list[str]:
    """The files that `a/{b,c}.py` stands for; braces may stand in braces' place only once each."""
    found = BRACES.search(code)
    if not found:
        return [code]
    return [name for part in found[1].split(",") for name in spread(code[: found.start()] + part + code[found.end() :])]


# ---------------------------------------------------------------- Markdown

FENCE = re.compile(r"^(```+|~~~+)[^\n]*\n.*?^\1`*[ \t]*$", re.MULTILINE | re.DOTALL)
MATH = re.compile(r"^```math\n(.*?)\n```$", re.MULTILINE | re.DOTALL)
PIECE = re.compile(
    r"\$`(?P<math>[^`]+)`\$"
    r"|(?P<image>!)?\[(?P<words>(?:[^\[\]]|\[[^\[\]]*\])*)\]\((?P<to>[^)\s]+)\)"
    r"|(?<!`)`(?P<code>[^`\n]+)`(?!`)"
    rf"|(?<!\\)\[(?P<key>{KEY})(?P<rest>[^\]\[]*)\](?!\()"
)


def markdown(text: str, path: str, here: str) -> str:
    """The Markdown of a file of the checkout with formulas, links and names of files as the site has them."""
    pieces, last = [], 0
    for fence in FENCE.finditer(text):
        pieces += [_prose(text[last : fence.start()], path, here), _fence(fence[0])]
        last = fence.end()
    return "".join([*pieces, _prose(text[last:], path, here)])


def _fence(block: str) -> str:
    return MATH.sub(r"```{math}\n\1\n```", block)


def _prose(text: str, path: str, here: str) -> str:
    return PIECE.sub(lambda found: _piece(found, path, here), text)


def _piece(found: re.Match[str], path: str, here: str) -> str:
    if found["math"]:
        return f"${found['math']}$"
    if found["to"]:
        return _link(found, path, here)
    if found["key"]:
        words = f"[{found['key']}{found['rest']}]"
        return html_link(escape(words), layout.way(here, anchor(found["key"]))) if found["key"] in keys() else found[0]
    there = [place_of_words(each) for each in spread(found["code"])]
    if not all(there):
        return found[0]
    names = zip(_short(found["code"]), there, strict=True)
    return ", ".join(html_link(f"<code>{escape(name)}</code>", layout.way(here, to)) for name, to in names)


def _short(code: str) -> list[str]:
    """The names of files as they are shown: the first one whole, the others without the folder they share."""
    names = spread(code)
    folder = posixpath.commonpath([posixpath.dirname(name) for name in names]) if len(names) > 1 else ""
    return [names[0], *(posixpath.relpath(name, folder or ".") for name in names[1:])]


def _link(found: re.Match[str], path: str, here: str) -> str:
    to, words = found["to"], found["words"]
    if to.startswith(("http:", "https:", "mailto:")):
        return found[0]
    name, _, there = to.partition("#")
    target = posixpath.normpath(posixpath.join(posixpath.dirname(path), name)) if name else path
    if found["image"]:
        return f"![{words}]({layout.way(here, target.removeprefix('docs/'))})"
    if target in layout.pages():
        page = layout.way(here, f"{layout.pages()[target]}.md") if name else ""
        return f"[{words}]({page}{'#' * bool(there)}{there})"
    place = layout.place(target)
    if not place:
        raise ValueError(f"{path} links {to}, which is no file of the checkout that the site shows: mend the link.")
    return html_link(_spans(words), layout.way(here, place))


def _spans(words: str) -> str:
    """Words with their code spans, as HTML."""
    return re.sub(r"`([^`]+)`", r"<code>\1</code>", escape(words))


def html_link(inner: str, to: str) -> str:
    """A link to a page that Sphinx does not check; `inner` is HTML."""
    return f'<a href="{escape(to)}">{inner}</a>'
