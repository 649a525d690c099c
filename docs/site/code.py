"""Pages that show the files of the checkout, so that links to code and tests work without a network or a repository."""

from collections.abc import Iterator
from html import escape
from pathlib import Path

from pygments import highlight
from pygments.formatters import HtmlFormatter
from pygments.lexers import get_lexer_by_name

from docs.site import layout

LEXERS = {".py": "python", ".md": "markdown", ".toml": "toml", ".json": "json", ".css": "css", ".cff": "yaml"}


PAGE = """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{title} - restir-ref</title>
<link rel="stylesheet" href="{up}_static/pygments.css">
<link rel="stylesheet" href="{up}_static/site.css">
</head>
<body class="code">
<p><a href="{up}index.html">restir-ref</a> / <a href="{up}code/index.html">code</a> / {title}</p>
{body}
</body>
</html>
"""


def write(folder: Path) -> int:
    """Write the pages of code into a site; their number."""
    listed = [path for path in layout.files() if layout.listed(path)]
    for path in listed:
        _page(folder / f"code/{path}.html", path, shown(path))
    _page(folder / "code/index.html", "all files", "".join(index(listed)))
    return len(listed)


def _page(file: Path, title: str, body: str) -> None:
    file.parent.mkdir(parents=True, exist_ok=True)
    up = "../" * (1 + (title.count("/") if file.stem != "index" else 0))
    file.write_text(PAGE.format(title=escape(title), body=body, up=up), encoding="utf-8")


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
        yield from (
            f'<li><a href="{escape(layout.way("code/index.html", f"code/{n}.html"))}">{escape(n)}</a></li>'
            for n in names
        )
        yield "</ul>\n"
