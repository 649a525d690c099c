"""The folder of results: whose it is, and that only one run writes to it at a time."""

from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

from figures.claims.errors import FigureError
from figures.engine import disk, manifest, summary

REPORT = "index.html"
OWN = {manifest.NAME, summary.NAME, REPORT}
LOCK = ".lock"


@contextmanager
def opened(out: Path, figures: Collection[str], warn: Callable[[str], object]) -> Iterator[None]:
    """Make `out` ours for one run: refuse foreign trees and folders in use; sweep up after killed runs."""
    try:
        _refuse_foreign(out, figures, warn)
        out.mkdir(parents=True, exist_ok=True)
        disk.sweep(out)
        lock = (out / LOCK).open("w")
    except OSError as error:
        raise FigureError(disk.unwritable(out, error)) from error
    with lock:
        _hold(lock, out)
        yield


def _refuse_foreign(out: Path, figures: Collection[str], warn: Callable[[str], object]) -> None:
    if not out.is_dir():
        if out.exists() or out.is_symlink():
            raise FigureError(f"--out {out} is not a folder. Choose another one, or remove that file")
        return
    if not _is_ours(out, warn):
        strangers = sorted(path.name for path in out.iterdir() if not _may_be_ours(path, figures))
        if strangers:
            raise FigureError(
                f"--out {out} holds what this program did not write ({', '.join(strangers[:3])}"
                f"{', ...' if strangers[3:] else ''}). Choose an empty or a new folder"
            )


def _is_ours(out: Path, warn: Callable[[str], object]) -> bool:
    """Whether the manifest says so; a damaged manifest is set aside and proves nothing."""
    path = out / manifest.NAME
    try:
        if path.exists() and not manifest.is_ours(path):
            raise FigureError(f"{path} belongs to another program. Choose another folder with --out")
        return path.exists()
    except ValueError as error:
        warn(f"{path} is damaged ({error}): set aside as {disk.set_aside(path).name}")
    except OSError as error:
        raise FigureError(f"cannot read {path}: {error.strerror or error}") from error
    return False


def _may_be_ours(path: Path, figures: Collection[str]) -> bool:
    known = path.name in figures or path.name in OWN
    return known or path.name.startswith(".") or path.suffix == disk.ASIDE


def _hold(lock: IO[str], out: Path) -> None:
    try:
        import fcntl  # noqa: PLC0415  not every system has it

        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError as error:
        raise FigureError(f"another run is writing to {out}. Wait for it, or choose another --out") from error
    except (ImportError, OSError):  # no locks here: two runs at once are then the user's business
        return
