"""Everything the site is made of, as files that Sphinx reads: pages in Markdown and reStructuredText, and pictures."""

import shutil
from collections.abc import Iterator
from pathlib import Path

from docs.site import api, claims, evidence, gallery, layout, symptoms, words

OWN = Path(__file__).resolve().parent
SPECIAL = {"docs/evidence.md": evidence.page, "docs/symptoms.md": symptoms.page}
"""Pages that are more than their file."""


def pages() -> Iterator[tuple[str, str]]:
    """Every page's path below the root of the sources, and its text."""
    for path, place in layout.pages().items():
        yield f"{place}.md", SPECIAL[path]() if path in SPECIAL else page(path, place)
    yield from api.pages()
    yield from gallery.pages()
    yield from claims.pages()


def page(path: str, place: str) -> str:
    """A file of Markdown as a page."""
    text = (layout.ROOT / path).read_text(encoding="utf-8")
    return words.markdown(anchored(text) if path == words.REFERENCES else text, path, f"{place}.html")


def anchored(text: str) -> str:
    """The references, each of which can be linked by its key."""
    return words.EXPLAINED.sub(lambda found: f'- <span id="{words.mark(found[1])}"></span>**\\[{found[1]}]**', text)


def pictures() -> Iterator[tuple[str, Path]]:
    """Every picture's path below the root of the sources, and the file."""
    for name in layout.files():
        if name.startswith("docs/") and name.endswith(".png"):
            yield name.removeprefix("docs/"), layout.ROOT / name
    yield from gallery.pictures()


def write(folder: Path) -> int:
    """Write all of it into a folder that is emptied before; the number of pages."""
    shutil.rmtree(folder, ignore_errors=True)
    count = 0
    for name, text in pages():
        _at(folder / name).write_text(text, encoding="utf-8")
        count += 1
    for name, file in pictures():
        shutil.copyfile(file, _at(folder / name))
    return count


def _at(path: Path) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    return path
