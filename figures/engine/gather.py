"""What is stored in a folder of results, figure by figure, sound or not."""

from dataclasses import dataclass
from pathlib import Path

from figures.claims.errors import FigureError
from figures.claims.verdicts import Record
from figures.engine import record, registry, store

PNG_START, PNG_END = b"\x89PNG\r\n\x1a\n", b"IEND\xaeB`\x82"


@dataclass(frozen=True)
class Shown:
    """One figure as the report shows it: its record and picture as far as they are sound, and what is not."""

    id: str
    record: Record | None
    picture: bytes
    troubles: tuple[str, ...]


def gather(out: Path) -> list[Shown]:
    """Every figure with something stored, by id."""
    if not out.is_dir():
        raise FigureError(f"there is no folder {out}. `run` computes results; --out names another folder")
    folders = sorted(path for path in out.iterdir() if registry.ID.fullmatch(path.name) and path.is_dir())
    return [show(path) for path in folders if (path / record.NAME).exists() or (path / "chunks").is_dir()]


def show(folder: Path) -> Shown:
    """What is stored of one figure."""
    if not (folder / record.NAME).exists():
        count = len(list((folder / "chunks").glob("*.npz")))
        trouble = f"incomplete: {count} chunks are stored; `run` goes on from there"
        return Shown(folder.name, None, b"", (trouble,))
    try:
        found = record.read(folder)
    except (OSError, ValueError) as error:
        return Shown(folder.name, None, b"", (f"damaged: {error}; `run` makes it anew from its chunks",))
    if found.status == "crashed":
        return Shown(folder.name, found, b"", ())
    picture, trouble = _picture(folder / "figure.png")
    return Shown(folder.name, found, picture, tuple(t for t in (trouble, _arrays(folder)) if t))


def _picture(path: Path) -> tuple[bytes, str]:
    try:
        content = path.read_bytes()
    except OSError as error:
        return b"", f"damaged: {path.name} cannot be read ({error.strerror}); `run` makes it anew"
    if content.startswith(PNG_START) and content.endswith(PNG_END):
        return content, ""
    return b"", f"damaged: {path.name} is not a whole picture; `run` makes it anew"


def _arrays(folder: Path) -> str:
    trouble = store.unreadable(folder / "arrays.npz")
    return f"damaged: arrays.npz cannot be read ({trouble}); `run` makes it anew" if trouble else ""
