"""The report as one HTML page without scripts or network, beside the pictures that it shows."""

import json
from collections.abc import Iterator, Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any

from figures.claims.verdicts import Judged
from figures.engine.gather import Shown
from figures.report import front, glossary, register, running, sections
from figures.report.beside import Beside

STYLE = Path(__file__).with_name("page.css")
PARTS = {
    "verdicts": "verdicts",
    "otherwise": "came out otherwise",
    "gallery": "all pictures",
    "words": "words",
    "all-claims": "all claims",
    "computed": "how it was computed",
}


def page(shown: Sequence[Shown], judged: Sequence[Judged], beside: Beside, manifest: Mapping[str, Any]) -> str:
    """The whole page: what came out, all pictures, figure by figure, the words, and all claims."""
    finished = [each for each in shown if each.record or each.id not in running.ahead(manifest).missing]
    body = [
        "<h1>restir-ref: figures and claims</h1>",
        *running.told(manifest),
        *front.front(finished, judged, beside),
        *_contents(),
        *sections.gallery(finished, beside),
        *sections.sections(finished, beside),
        *glossary.glossary(),
        *register.register(judged, beside),
        *_provenance(manifest),
    ]
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        "<title>restir-ref: figures and claims</title>\n"
        f"<style>\n{STYLE.read_text(encoding='utf-8')}</style>\n</head>\n<body>\n<main>\n"
        + "\n".join(body)
        + "\n</main>\n</body>\n</html>\n"
    )


def _contents() -> Iterator[str]:
    links = (f'<a href="#{place}">{name}</a>' for place, name in PARTS.items())
    yield f'<nav aria-label="Parts of this page">{" · ".join(links)}</nav>'


def _provenance(manifest: Mapping[str, Any]) -> Iterator[str]:
    run = {name: value for name, value in manifest.items() if name != "figures"}
    yield '<section>\n<h2 id="computed">How it was computed</h2>'
    yield f'<pre tabindex="0">{escape(json.dumps(run, indent=1))}</pre>\n</section>'
