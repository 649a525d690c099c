"""From a figure's `draw` to the files of its picture, with what the picture shows and what in it cannot be read."""

import io
import json
from typing import TYPE_CHECKING, Any

from figures.claims.figure import Arrays, Figure
from figures.report import legible, style

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture

METADATA: dict[str, dict[str, Any]] = {"png": {"Software": None}, "pdf": {"CreationDate": None}}


def drawn(figure: Figure, arrays: Arrays) -> dict[str, bytes]:
    """A figure's picture as PNG and PDF, and `legible.NAME` about it, by the names of their files."""
    with style.context():
        picture = settled(figure.draw(arrays))
        seen = {"looks": legible.looks(picture), "troubles": legible.troubles(picture)}
        files = {f"figure.{kind}": render(picture, kind) for kind in METADATA}
    return {**files, legible.NAME: json.dumps(seen, indent=1, ensure_ascii=False).encode()}


def settled(picture: "Picture") -> "Picture":
    """The picture, its layout worked out once for all the files to come."""
    picture.draw_without_rendering()
    picture.set_layout_engine("none")
    return picture


def render(picture: "Picture", kind: str) -> bytes:
    """The picture as a file; the same picture gives the same bytes: whatever depends on the time is left out."""
    file = io.BytesIO()
    picture.savefig(file, format=kind, metadata=METADATA[kind])
    return file.getvalue()
