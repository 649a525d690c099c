"""What must hold of the pages that were built: no request to anybody, no link into nowhere, a search that finds.

Requests are what a browser fetches by itself: scripts, styles, pictures, fonts, frames.  Links are for people; those to
other sites are allowed, but counted.
"""

import json
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from html.parser import HTMLParser
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlsplit

FETCHED = {
    "script": "src",
    "img": "src",
    "source": "src",
    "iframe": "src",
    "embed": "src",
    "video": "src",
    "audio": "src",
    "link": "href",
    "object": "data",
    "use": "href",
}
"""Elements that make a browser fetch something, and by which attribute."""

IN_STYLES = re.compile(r"(?:url\(\s*['\"]?|@import\s+['\"])((?:https?:)?//[^'\")\s]+)")
IN_SCRIPTS = re.compile(r"(?:fetch|import|importScripts|open|src\s*=)\s*\(?\s*['\"`]((?:https?:)?//[^'\"`\s]+)")


@dataclass(frozen=True)
class Read:
    """A page: what a browser fetches for it, where its links lead, and its anchors."""

    fetched: tuple[str, ...]
    links: tuple[str, ...]
    anchors: frozenset[str]


class _Reader(HTMLParser):
    def __init__(self) -> None:
        super().__init__()
        self.fetched: list[str] = []
        self.links: list[str] = []
        self.anchors: set[str] = set()
        self.within = ""

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        found = {name: value or "" for name, value in attrs}
        self.anchors |= {found[name] for name in ("id", "name") if found.get(name)}
        if tag == "a" and "href" in found:
            self.links.append(found["href"])
        if tag in FETCHED and found.get(FETCHED[tag]):
            self.fetched.append(found[FETCHED[tag]])
        self.fetched += [part.split()[0] for part in found.get("srcset", "").split(",") if part.strip()]
        self.fetched += IN_STYLES.findall(found.get("style", ""))
        self.within = tag if tag in ("style", "script") else ""

    def handle_endtag(self, tag: str) -> None:
        self.within = ""

    def handle_data(self, data: str) -> None:
        if self.within:
            self.fetched += (IN_STYLES if self.within == "style" else IN_SCRIPTS).findall(data)


def read(text: str) -> Read:
    """A page of HTML, read."""
    reader = _Reader()
    reader.feed(text)
    return Read(tuple(reader.fetched), tuple(reader.links), frozenset(reader.anchors))


def read_code(text: str) -> Read:
    """A page of code, which is long, and whose few links are the same on every one of them: its lines."""
    return Read((), (), frozenset(re.findall(r' id="(L-\d+)"', text)))


@cache
def site(folder: Path) -> Mapping[str, Read]:
    """All pages of a folder by their paths."""
    files = {file.relative_to(folder).as_posix(): file.read_text(encoding="utf-8") for file in folder.rglob("*.html")}
    return {name: (read_code if _is_code(name) else read)(files[name]) for name in sorted(files)}


def _is_code(name: str) -> bool:
    return name.startswith("code/") and name != "code/index.html"


def abroad(url: str) -> bool:
    """Whether a URL leads to another host."""
    return bool(urlsplit(url).netloc) or urlsplit(url).scheme in ("http", "https", "ftp", "ws", "wss")


def requests(folder: Path) -> list[str]:
    """What pages, styles and scripts would fetch from other hosts, each with the file that does."""
    found = [f"{name} fetches {url}" for name, page in site(folder).items() for url in page.fetched if abroad(url)]
    for file in sorted([*folder.rglob("*.css"), *folder.rglob("*.js")]):
        text = file.read_text(encoding="utf-8", errors="replace")
        pattern = IN_STYLES if file.suffix == ".css" else IN_SCRIPTS
        found += [f"{file.relative_to(folder).as_posix()} fetches {url}" for url in pattern.findall(text)]
    return found


def broken(folder: Path) -> list[str]:
    """Links and fetched files that lead nowhere, each with its page."""
    return [f"{name} -> {url}" for name, page in site(folder).items() for url in _lost(folder, name, page)]


def _lost(folder: Path, name: str, page: Read) -> Iterator[str]:
    for url in dict.fromkeys([*page.links, *page.fetched]):
        parts = urlsplit(url)
        if parts.scheme or parts.netloc:
            continue
        target = (folder / name).parent / unquote(parts.path) if parts.path else folder / name
        target = target.resolve()
        if not target.is_file():
            yield url
        elif parts.fragment and target.suffix == ".html":
            there = site(folder).get(target.relative_to(folder.resolve()).as_posix())
            if there is None or unquote(parts.fragment) not in there.anchors:
                yield url


@dataclass(frozen=True)
class Index:
    """What a site's search looks things up in: names of pages, stems of words, and names of functions with pages."""

    pages: tuple[str, ...]
    stems: Mapping[str, tuple[int, ...]]
    functions: Mapping[str, int]


def index(folder: Path) -> Index:
    """The index of a site."""
    text = (folder / "searchindex.js").read_text(encoding="utf-8")
    found: dict[str, Any] = json.loads(text.removeprefix("Search.setIndex(").removesuffix(")"))
    stems = {stem: (at,) if isinstance(at, int) else tuple(at) for stem, at in found["terms"].items()}
    held = {f"{prefix}.{each[4]}": each[0] for prefix, objects in found["objects"].items() for each in objects}
    return Index(tuple(found["docnames"]), stems, held)


def searched(folder: Path, word: str) -> list[str]:
    """The pages on which a search for one word finds it: functions of that name, names that hold it, then texts."""
    found = index(folder)
    last = [(name.rpartition(".")[2].lower(), at) for name, at in found.functions.items()]
    named = [at for name, at in sorted(last, key=lambda each: each[0] != word) if word in name]
    stem = max((stem for stem in found.stems if word.startswith(stem)), key=len, default="")
    return list(dict.fromkeys(found.pages[at] for at in (*named, *found.stems.get(stem, ()))))
