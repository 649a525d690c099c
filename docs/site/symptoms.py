"""The page of symptoms, with a picture of each: the mistake planted in flatland, and the right image beside it."""

import re
from collections.abc import Iterator

from docs.site import layout, words

HERE, FOLDER = "symptoms.html", "symptoms"
PLANTED = re.compile(r"^\| (?P<symptom>[^|]+) \| \*\*(?P<name>[^|*]+)\*\* \|", re.MULTILINE)
SAID = (
    "The pictures: fluence of a room in flatland, 240 images averaged, rendered by the loop of the zoo with the "
    "mistake in it and without; lines are walls. A difference is shown where it is more than three standard errors. "
    "They are of one room and a pass or two, so the sizes are not those of the tables, and what this room does not "
    "show may still be seen in another. The mistake about the previous frame has its right box move to the right. "
    "What is only noisier is shown by one image of each, and the ratio of their noise. Where a mistake is made of a "
    "table of cells, or of what a renderer has no place for, the picture is exact, of its own small scene: the bias of "
    "every cell, or the standard deviation of every pixel. They are drawn by `python -m docs.site.planted`."
)


def page() -> str:
    """docs/symptoms.md, with its pictures folded below each of its tables of mistakes."""
    text = (layout.ROOT / "docs" / "symptoms.md").read_text(encoding="utf-8")
    head, *parts = re.split(r"^(?=## )", text, flags=re.MULTILINE)
    whole = [head, SAID, "\n\n", *(piece for part in parts for piece in (part, *pictures(part)))]
    return words.markdown("".join(whole), "docs/symptoms.md", HERE)


def pictures(part: str) -> Iterator[str]:
    """The pictures of the mistakes in a section, in its order."""
    found = [(name, symptom) for symptom, name in PLANTED.findall(part) if (layout.ROOT / "docs" / file(name)).exists()]
    if found:
        yield "\n### Pictures\n\n"
    for name, symptom in found:
        yield f"**{name}**: {symptom}\n\n![{name}: {symptom}]({file(name)})\n\n"


def file(name: str) -> str:
    """The picture of a mistake, below docs/."""
    return f"{FOLDER}/{slug(name)}.png"


def slug(name: str) -> str:
    """The name of a mistake's picture, without an ending."""
    return re.sub(r"[^a-z0-9]+", "-", name.lower()).strip("-")
