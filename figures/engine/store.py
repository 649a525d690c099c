"""Arrays on disk: `.npz` files that are atomic, never pickled, and depend on their contents alone.

Each file carries as its member `__key__` the canonical JSON of everything its arrays depend on, and a digest
of the arrays: a zip's own checksums do not cover its table of contents.
"""

import hashlib
import json
import zipfile
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any, Literal
from zipfile import BadZipFile

import numpy as np
from numpy.lib import format as npy

from figures.claims.figure import Arrays
from figures.engine import disk

KEY = "__key__"
EPOCH = (1980, 1, 1, 0, 0, 0)  # the date of every zip member: bytes must not depend on the time

# What reading a broken zip or array can raise; zlib and struct errors come with a bad header.
UNREADABLE = (OSError, ValueError, EOFError, KeyError, RuntimeError, MemoryError, BadZipFile, zlib.error)

State = Literal["absent", "ours", "stale", "damaged", "foreign"]


@dataclass(frozen=True)
class Stored:
    """What stands at a path: its state, its arrays if they are ours, and what is wrong if they are not."""

    state: State
    arrays: Arrays
    trouble: str = ""


def canonical(data: Any) -> str:
    """Plain data as JSON with one spelling; raises TypeError or ValueError for anything else."""
    return json.dumps(data, sort_keys=True, allow_nan=False, ensure_ascii=False, separators=(",", ":"))


def plain(arrays: Mapping[str, Any]) -> Arrays:
    """The named arrays as NumPy arrays in order of name; refuses what cannot be stored without pickle."""
    if not isinstance(arrays, Mapping):
        raise TypeError(f"expected a dict of arrays, got {type(arrays).__name__}")
    found = {name: np.asarray(arrays[name]) for name in sorted(arrays)}
    for name, array in found.items():
        if not name or name == KEY or "/" in name:
            raise ValueError(f"{name!r} cannot be the name of a stored array")
        if array.dtype.hasobject:
            raise TypeError(f"array {name!r} holds Python objects ({array.dtype}); store numbers or strings")
    return found


def save(path: Path, arrays: Arrays, key: str) -> None:
    """Write arrays and key to `path` in one step: it holds the whole file or what it held before."""

    def write(file: IO[bytes]) -> None:
        with zipfile.ZipFile(file, "w", zipfile.ZIP_STORED) as archive:
            found = plain(arrays)
            for name, array in {KEY: np.array([key, digest(found)]), **found}.items():
                _write_member(archive, name, array)

    disk.replace(path, write)


def _write_member(archive: zipfile.ZipFile, name: str, array: np.ndarray[Any, Any]) -> None:
    member = zipfile.ZipInfo(f"{name}.npy", EPOCH)
    member.external_attr = 0o644 << 16
    member.create_system = 3
    with archive.open(member, "w", force_zip64=True) as file:
        npy.write_array(file, array, allow_pickle=False)


def load(path: Path, key: str) -> Stored:
    """The arrays at `path` if they carry `key`; damaged if unreadable, foreign if readable but not ours."""
    if not path.is_symlink() and not path.exists():
        return Stored("absent", {})
    if not path.is_file():
        return Stored("foreign", {}, "it is not a file")
    try:
        arrays = read(path)
    except UNREADABLE as error:
        return Stored("damaged", {}, str(error) or type(error).__name__)
    return _judged(arrays, key)


def _judged(arrays: Arrays, key: str) -> Stored:
    found = arrays.pop(KEY, np.array([]))
    if found.dtype.kind != "U" or found.shape != (2,):
        return Stored("foreign", {}, "it carries no key, so it was not written by this program")
    if found[0] != key and differing(str(found[0]), key) == ["code"]:
        return Stored("stale", {}, "other code computed it")
    if found[0] != key:
        return Stored("foreign", {}, difference(str(found[0]), key))
    if found[1] != digest(arrays):
        return Stored("damaged", {}, "its arrays do not match their digest")
    return Stored("ours", arrays)


def digest(arrays: Arrays) -> str:
    """SHA-256 over names, types, shapes and values."""
    total = hashlib.sha256()
    for name, array in sorted(arrays.items()):
        total.update(repr((name, npy.dtype_to_descr(array.dtype), array.shape)).encode())
        total.update(array.tobytes())
    return total.hexdigest()


def state(path: Path, key: str) -> tuple[State, str]:
    """What stands at `path`, and what is wrong with it; the whole file is read to know."""
    found = load(path, key)
    return found.state, found.trouble


def unreadable(path: Path) -> str:
    """Why the file cannot be read, or nothing."""
    try:
        read(path)
    except UNREADABLE as error:
        return str(error) or type(error).__name__
    return ""


def read(path: Path) -> Arrays:
    """All arrays of a file, with its key; pickles are refused, not loaded."""
    with zipfile.ZipFile(path) as archive:
        return {name.removesuffix(".npy"): _read_member(archive, name) for name in archive.namelist()}


def _read_member(archive: zipfile.ZipFile, name: str) -> Any:
    with archive.open(name) as file:
        array = npy.read_array(file, allow_pickle=False)
        if file.read(1):
            raise ValueError(f"{name} goes on after its array")
        return array


def difference(found: str, wanted: str) -> str:
    """In what two keys differ, field by field, in words."""
    fields = differing(found, wanted)
    if not fields:
        return "its key is not one of this program's"
    old, new = json.loads(found), json.loads(wanted)
    return "; ".join(f"{f} is {_short(old.get(f))} there and {_short(new.get(f))} now" for f in fields)


def differing(found: str, wanted: str) -> list[str]:
    """The fields in which two keys differ; none if either is no key of ours."""
    try:
        old, new = json.loads(found), json.loads(wanted)
        return sorted(name for name in {*old, *new} if old.get(name) != new.get(name))
    except (ValueError, AttributeError, TypeError):
        return []


def _short(value: Any) -> str:
    text = json.dumps(value, ensure_ascii=False)
    return text if len(text) <= 60 else text[:57] + "..."
