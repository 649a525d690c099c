"""Whether a row of the ledger, in its sentence and its criterion, names the scenes and worlds it is about."""

import re
from collections.abc import Mapping
from typing import Any

WORDS: Mapping[str, tuple[str, ...]] = {
    "toy1d": ("toy1d", "on the line"),
    "flatland2d": ("flatland2d", "flatland"),
    "tracer3d": ("tracer3d", "3D"),
    "unit": (),
}
"""How a world may be named; units need no name."""

RANGE = re.compile(r"(?<![\w-])FS(\d+)(?:\s*-\s*|\s+to\s+)FS(\d+)(?![\w-])")


def missing(row: Mapping[str, Any]) -> list[str]:
    """Scenes of the row, and worlds where it has more than one, that its texts do not name, in the row's order."""
    text = f"{row['sentence']} {row['criterion']}"
    among = in_ranges(text)
    scenes = [scene for scene in row["scenes"] if scene not in among and not names(text, scene)]
    several = row["worlds"] if len(row["worlds"]) > 1 else ()
    return [*scenes, *(world for world in several if not names_world(text, world))]


def names_world(text: str, world: str) -> bool:
    """Whether a text says one of the words for a world, capitals or not."""
    words = WORDS[world]
    return not words or any(names(text.lower(), word.lower()) for word in words)


def names(text: str, word: str) -> bool:
    """Whether a word stands in a text by itself: FS1 not within FS10, CB3 not within CB3-glossy."""
    return re.search(rf"(?<![\w-]){re.escape(word)}(?![\w-])", text) is not None


def in_ranges(text: str) -> set[str]:
    """Every scene of ranges such as "FS1 to FS10" and "FS1-FS10"."""
    ranges = RANGE.findall(text)
    return {f"FS{k}" for low, high in ranges for k in range(int(low), int(high) + 1)}
