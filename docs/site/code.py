"""Pages that show the files of the checkout, so that links to code and tests work without a network or a repository."""

from collections.abc import Iterator
from html import escape
from typing import Any

from pygments import highlight
from pygments.formatters import HtmlFormatter
from pygments.lexers import get_lexer_by_name

from docs.site import layout

LEXERS = {".py": "python", ".md": "markdown", ".toml": "toml", ".json": "json", ".css": "css", ".cff": "yaml"}


def pages() -> Iterator[tuple[str, dict[str, Any], str]]:
    """Place without ending, what the template needs, and the template, as Sphinx collects pages."""
    listed = [path for path in layout.files() if layout.listed(path)]
    for path in listed:
        yield f"code/{path}", {"title": path, "body": shown(path), "index_of_code": _up(path)}, "code.html"
    yield "code/index", {"title": "The code", "body": "".join(index(listed)), "index_of_code": ""}, "code.html"


def _up(path: str) -> str:
    return layout.way(f"code/{path}.html", "code/index.html")


def shown(path: str) -> str:
    """A file as HTML, every line with an anchor `L-7`."""
    whole = layout.ROOT / path
    text = whole.read_text(encoding="utf-8")
    lexer = get_lexer_by_name(LEXERS.get(whole.suffix, "text"), stripnl=False)
    made: str = highlight(text, lexer, HtmlFormatter(linenos="inline", lineanchors="L", cssclass="highlight"))
    return made


def index(listed: list[str]) -> Iterator[str]:
    """The files, folder by folder."""
    folders: dict[str, list[str]] = {}
    for path in listed:
        folders.setdefault(path.rpartition("/")[0], []).append(path)
    for folder, names in sorted(folders.items()):
        yield f'<h2 id="{escape(folder)}">{escape(folder) or "The checkout"}</h2>\n<ul>'
        yield from (f'<li><a href="{escape(layout.way("code/index.html", f"code/{n}.html"))}">{escape(n)}</a></li>' for n in names)
        yield "</ul>\n"
