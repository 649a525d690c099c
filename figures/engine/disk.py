"""Files that change in one step: a reader, or a run after kill -9, sees the old file or the new one, whole."""

import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import IO

from figures.claims.errors import FigureError

TEMPORARY = ".part"
ASIDE = ".corrupt"


def replace(path: Path, write: Callable[[IO[bytes]], object]) -> None:
    """Let `write` fill a temporary file beside `path`, then put it there in one step."""
    try:
        handle, name = tempfile.mkstemp(prefix=f".{path.name}.", suffix=TEMPORARY, dir=path.parent)
        with os.fdopen(handle, "wb") as file:
            write(file)
            file.flush()
            os.fsync(file.fileno())
        Path(name).chmod(0o644)
        Path(name).replace(path)
    except OSError as error:
        raise FigureError(unwritable(path, error)) from error


def unwritable(path: Path, error: OSError) -> str:
    """The message for a path that cannot be written."""
    reason = error.strerror or str(error)
    return f"cannot write {path}: {reason}. Choose another folder with --out; what is stored stays as it is"


def write_text(path: Path, text: str) -> None:
    """Write text to `path` in one step."""
    write_bytes(path, text.encode())


def write_bytes(path: Path, content: bytes) -> None:
    """Write bytes to `path` in one step."""
    replace(path, lambda file: file.write(content))


def sweep(folder: Path) -> None:
    """Remove what killed runs left half written in `folder`."""
    for path in folder.glob(f".*{TEMPORARY}"):
        path.unlink(missing_ok=True)


def set_aside(path: Path) -> Path:
    """Rename a damaged file, so that nothing is lost and its place is free."""
    aside = path.with_name(path.name + ASIDE)
    try:
        path.replace(aside)
    except OSError as error:
        raise FigureError(unwritable(path, error)) from error
    return aside
