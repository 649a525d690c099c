"""Dumps as files: archives of arrays (.npz) and JSON, which may hold anything.

Whatever is wrong with a file, it is refused with one sentence; nothing in it is ever run.
"""

import json
import warnings
import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from restir_ref.audit.fields import MOST_NUMBERS, BadDump

MOST_BYTES = 4 * 8 * MOST_NUMBERS
"""Unpacked size of the largest archive: densities whole and in pieces, and all the rest."""


def read(path: Path | str) -> dict[str, Any]:
    """The fields of a .npz or .json file; raises BadDump for files that are neither, corrupt, pickled or too large."""
    path = Path(path)
    if path.suffix.lower() not in READERS:
        raise BadDump(f"{path.name} is neither .npz nor .json: write it by numpy.savez(path, **fields) or as JSON.")
    reader, remedy = READERS[path.suffix.lower()]
    try:
        if not path.is_file():
            raise BadDump(f"there is no file {path}: pass a dump, a .npz archive or a .json file.")
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return reader(path)
    except BadDump:
        raise
    except Exception as error:  # hazard: for damaged bytes zipfile, its decoders and NumPy raise a dozen types
        said = str(error) or type(error).__name__
        raise BadDump(f"{path.name} is {remedy.format(said[:200])}") from error


def _arrays(path: Path) -> dict[str, Any]:
    """The arrays of an archive, if they are not too large; what its directory says of their sizes is a bound."""
    with zipfile.ZipFile(path) as members:
        size = sum(member.file_size for member in members.infolist())
    if size > MOST_BYTES:
        raise BadDump(
            f"{path.name} unpacks to {size} bytes, more than the limit of {MOST_BYTES}: dump fewer columns; each is "
            "audited by itself."
        )
    with path.open("rb") as file, np.load(file, allow_pickle=False) as archive:
        return {name: archive[name] for name in archive.files}


def _object(path: Path) -> dict[str, Any]:
    """The members of a JSON object."""
    fields = json.loads(path.read_text(encoding="utf-8"))
    if not isinstance(fields, dict):
        raise BadDump(f"{path.name} holds a JSON {type(fields).__name__}, not an object: name the fields.")
    return fields


NO_ARCHIVE = (
    "no readable .npz archive, damaged, or holds pickled objects, which are not read ({}): write plain arrays of "
    "numbers, and the words as strings, by numpy.savez(path, **fields)."
)
NO_JSON = "no JSON ({}): write one object with a list of numbers per field."
READERS = {".npz": (_arrays, NO_ARCHIVE), ".json": (_object, NO_JSON)}
"""By suffix: how to read such a file, and what to say if that fails."""
