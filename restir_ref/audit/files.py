"""Dumps as files: archives of arrays (.npz), JSON and CSV, which may hold anything.

Whatever is wrong with a file, it is refused with one sentence; nothing in it is ever run.  Arrays of large archives
stay on disk, and are read column by column.
"""

import csv
import json
import re
import shutil
import warnings
import zipfile
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from math import prod
from pathlib import Path
from typing import Any

import numpy as np

from restir_ref.audit.fields import WORDS, BadDump
from restir_ref.batch import Array

MOST_BYTES = 2**33
"""Unpacked size of the largest archive: 8 GiB, on disk."""

IN_MEMORY = 2**27
"""Archives that unpack to more bytes are not read whole."""


SMALL = 2**16
"""Arrays of fewer bytes are read."""


@dataclass(frozen=True)
class Stored:
    """An array that lies in a file from `offset` on, in C order."""

    path: Path
    offset: int
    dtype: Any
    shape: tuple[int, ...]

    def columns(self, start: int, stop: int) -> Array:
        """Columns start .. stop of the last axis, (..., stop - start)."""
        *leading, N = self.shape
        rows = [self._read(row * N + start, stop - start) for row in range(prod(leading))]
        return np.stack(rows).reshape(*leading, stop - start)

    def rows(self, start: int, stop: int) -> Array:
        """Rows start .. stop of the first axis."""
        size = prod(self.shape[1:])
        return self._read(start * size, (stop - start) * size).reshape(stop - start, *self.shape[1:])

    def _read(self, start: int, count: int) -> Array:
        return np.fromfile(self.path, self.dtype, count, offset=self.offset + start * self.dtype.itemsize)


def read(path: Path | str, folder: Path) -> dict[str, Any]:
    """The fields of a .npz, .json or .csv file; arrays of large archives are unpacked into a folder.

    Raises BadDump for files that are none of them, corrupt, pickled or too large.
    """
    path = Path(path)
    if path.suffix.lower() not in READERS:
        raise BadDump(f"{path.name} is neither .npz nor .json nor .csv: write it by numpy.savez(path, **fields).")
    reader, remedy = READERS[path.suffix.lower()]
    try:
        if not path.is_file():
            raise BadDump(f"there is no file {path}: pass a dump, a .npz archive, a .json or a .csv file.")
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return reader(path, folder)
    except BadDump:
        raise
    except Exception as error:  # hazard: for damaged bytes zipfile, its decoders and NumPy raise a dozen types
        said = str(error) or type(error).__name__
        raise BadDump(f"{path.name} is {remedy.format(said[:200])}") from error


# ---------------------------------------------------------------- archives


def _arrays(path: Path, folder: Path) -> dict[str, Any]:
    """The arrays of an archive, if they are not too large; what its directory says of their sizes is a bound."""
    with zipfile.ZipFile(path) as members:
        size = sum(member.file_size for member in members.infolist())
    if size > MOST_BYTES:
        raise BadDump(
            f"{path.name} unpacks to {size} bytes, more than the limit of {MOST_BYTES}: dump fewer columns; each is "
            "audited by itself."
        )
    if size > IN_MEMORY:
        return _unpacked(path, folder)
    with path.open("rb") as file, np.load(file, allow_pickle=False) as archive:
        return {name: archive[name] for name in archive.files}


def _unpacked(path: Path, folder: Path) -> dict[str, Any]:
    """The arrays of an archive, unpacked into files."""
    found: dict[str, Any] = {}
    with zipfile.ZipFile(path) as members:
        for number, member in enumerate(members.infolist()):
            target = folder / f"{number}.npy"
            with members.open(member) as packed, target.open("wb") as file:
                shutil.copyfileobj(packed, file, 2**20)
            found[member.filename.removesuffix(".npy")] = _stored(target)
    return found


def _stored(path: Path) -> Any:
    """An array left in its file; small ones, and those in Fortran order, are read."""
    with path.open("rb") as file:
        version = np.lib.format.read_magic(file)
        header = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
        shape, fortran, dtype = header(file)
        size, start = prod(shape) * dtype.itemsize, file.tell()
    if fortran or size < SMALL or dtype.kind not in "biuf":
        return np.load(path, allow_pickle=False)
    if path.stat().st_size < start + size:
        raise ValueError("an array is shorter than its header says")
    return Stored(path, start, dtype, shape)


# ---------------------------------------------------------------- JSON


def _object(path: Path, folder: Path) -> dict[str, Any]:
    """The members of a JSON object, each named once; a byte order mark is no part of it."""
    fields = json.loads(path.read_text(encoding="utf-8-sig"), object_pairs_hook=_each_once)
    if not isinstance(fields, dict):
        raise BadDump(f"{path.name} holds a JSON {type(fields).__name__}, not an object: name the fields.")
    return fields


def _each_once(pairs: Iterable[tuple[str, Any]]) -> dict[str, Any]:
    """The pairs as a dictionary; raises BadDump for a name that comes twice, whose first values would be lost."""
    found: dict[str, Any] = {}
    for name, value in pairs:
        if name in found:
            raise BadDump(f"the field {name[:40]!r} comes twice: which one is meant? Write every field once.")
        found[name] = value
    return found


# ---------------------------------------------------------------- CSV

COLUMN = re.compile(r"(?P<name>\w+)(?P<index>(?:\[\d+\])*)$")


def _table(path: Path, folder: Path) -> dict[str, Any]:
    """A table: `# mis,talbot` first, then names like p_hat[0] or p_hat_from[0][1], then one line per pixel."""
    lines = list(csv.reader(path.read_text(encoding="utf-8-sig").splitlines()))
    head = [line for line in lines if line and line[0].lstrip().startswith("#")]
    fields: dict[str, Any] = {"format": "restir-ref dump", "version": 1}
    for line in head:
        name, _, value = ",".join(line).lstrip("# ").partition(",")
        fields[name.strip()] = value.strip() if name.strip() in WORDS else _numbers(value)
    body = [line for line in lines if line and line not in head]
    if not body:
        raise BadDump(f"{path.name} has no line of names: write p_hat[0],p_hat[1],W[0], ... first.")
    names, rows = body[0], body[1:]
    if any(len(row) != len(names) for row in rows) or not rows:
        raise BadDump(f"{path.name} has lines of other lengths than its {len(names)} names: write one number each.")
    columns = {name.strip(): [float(row[k]) for row in rows] for k, name in enumerate(names)}
    if len(columns) < len(names):
        raise BadDump(f"{path.name} names a column twice: write every column once.")
    return {**fields, **_gathered(columns)}


def _numbers(text: str) -> Any:
    """One number, or several with commas or spaces between."""
    found = [float(each) for each in re.split(r"[,\s]+", text.strip()) if each]
    return found[0] if len(found) == 1 else found


def _gathered(columns: Mapping[str, list[float]]) -> dict[str, Any]:
    """Columns p_hat[0], p_hat[1] as one array (M, N)."""
    parts: dict[str, dict[tuple[int, ...], list[float]]] = {}
    for label, values in columns.items():
        if (match := COLUMN.match(label)) is None:
            raise BadDump(f"the column {label[:40]!r} has no name like W_Y, p_hat[0] or p_hat_from[0][1].")
        place = tuple(int(each) for each in re.findall(r"\d+", match["index"]))
        parts.setdefault(match["name"], {})[place] = values
    return {name: _stacked(name, places) for name, places in parts.items()}


def _stacked(name: str, places: Mapping[tuple[int, ...], list[float]]) -> Array:
    """The array whose rows stand at these places; raises BadDump where some are missing."""
    sizes = [max(place) + 1 for place in zip(*places, strict=True)]
    if len(places) != prod(sizes) or prod(sizes) > len(places):
        raise BadDump(f"{name[:40]!r} has {len(places)} columns, but as many as {sizes} are named: write all of them.")
    rows = np.array([places[place] for place in np.ndindex(*sizes)])
    return rows.reshape(*sizes, rows.shape[-1])


NO_ARCHIVE = (
    "no readable .npz archive, damaged, or holds pickled objects, which are not read ({}): write plain arrays of "
    "numbers, and the words as strings, by numpy.savez(path, **fields)."
)
NO_JSON = "no JSON ({}): write one object with a list of numbers per field."
NO_TABLE = "no table ({}): write a line of names, then one line of numbers per pixel."
READERS: Mapping[str, tuple[Callable[[Path, Path], dict[str, Any]], str]] = {
    ".npz": (_arrays, NO_ARCHIVE),
    ".json": (_object, NO_JSON),
    ".csv": (_table, NO_TABLE),
}
"""By suffix: how to read such a file, and what to say if that fails."""
