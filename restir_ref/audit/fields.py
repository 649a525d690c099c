"""The format of a dump: which fields there are, of which shape, and what is said where they are wrong.

`docs/audit.md` explains it to those who write dumps.  A dump is a NumPy archive (.npz, no pickles), a
JSON object with lists of numbers, or any mapping of names to arrays.  M inputs, N columns, batch last.
"""

import difflib
import json
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from restir_ref.audit.names import meanings
from restir_ref.batch import Array

FORMAT, VERSION = "restir-ref dump", 1

LARGEST = 1e75
"""Products of four numbers that are not larger are still finite."""


class BadDump(ValueError):
    """A dump that cannot be read; the message names the field, its value and the remedy."""


@dataclass(frozen=True)
class Field:
    """The axes of a field, "M" and "N", and in words what it holds."""

    axes: str
    meaning: str


INPUTS: Mapping[str, Field] = MappingProxyType(
    {
        "canonical": Field("M", "which inputs have the domain of the pass, 0 or 1"),
        "p_hat": Field("MN", "p_hat(y_i), the target of the shifted sample where the pass selects"),
        "W": Field("MN", "contribution weights W_i of the inputs, 0 for null samples"),
        "J": Field("MN", "Jacobians |dT_i/dx|: 1 for the identity, 0 where the shift is undefined"),
        "c": Field("MN", "confidences of the inputs (M of a reservoir), before capping"),
    }
)
DENSITIES: Mapping[str, Field] = MappingProxyType(
    {
        "p_hat_own": Field("MN", "p_hat_i(X_i), the target of the sample where it came from"),
        "p_hat_from": Field("MMN", "[i][j]: p_hat_from_j(y_i)"),
        "p_hat_back": Field("MMN", "[i][j]: p_hat_j(T_j^-1 y_i)"),
        "J_back": Field("MMN", "[i][j]: |dT_j^-1/dy| at y_i, 0 where undefined"),
    }
)
OPTIONS: Mapping[str, Field] = MappingProxyType(
    {
        "cap": Field("", "cap on the confidences of inputs that are not canonical"),
        "u": Field("N", "the number in [0, 1) that inverts the running sum of w"),
        "u_stream": Field("MN", "one number in [0, 1) per input: taken if u w_sum < w, w_sum including w"),
    }
)
RESULTS: Mapping[str, Field] = MappingProxyType(
    {
        "m": Field("MN", "resampling MIS weights m_i"),
        "w": Field("MN", "resampling weights m_i p_hat(y_i) W_i J_i"),
        "w_sum": Field("N", "their sum"),
        "s": Field("N", "index of the selected input"),
        "W_Y": Field("N", "contribution weight of the result"),
        "c_Y": Field("N", "confidence of the result"),
    }
)
ARRAYS: Mapping[str, Field] = MappingProxyType({**INPUTS, **DENSITIES, **OPTIONS, **RESULTS})
WORDS = ("format", "version", "mis")
IGNORED = "note"
"""Fields whose name begins like this are for people."""


def read(path: Path | str) -> dict[str, Any]:
    """The fields of a .npz or .json file; raises BadDump for files that are neither, corrupt, or pickled."""
    path = Path(path)
    if not path.is_file():
        raise BadDump(f"there is no file {path}: pass a dump, a .npz archive or a .json file.")
    reader = {".npz": _read_npz, ".json": _read_json}.get(path.suffix.lower())
    if reader is None:
        raise BadDump(f"{path.name} is neither .npz nor .json: write it by numpy.savez(path, **fields) or as JSON.")
    return reader(path)


def _read_npz(path: Path) -> dict[str, Any]:
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as archive:
            return {name: archive[name] for name in archive.files}
    except (OSError, EOFError, KeyError, zipfile.BadZipFile, AttributeError, TypeError) as error:
        raise BadDump(
            f"{path.name} is no readable .npz archive ({error}): write it by numpy.savez(path, **fields)."
        ) from error
    except ValueError as error:
        raise BadDump(
            f"{path.name} is damaged or holds pickled objects, which are not read ({error}): "
            "write plain arrays of numbers, and the words as strings, by numpy.savez(path, **fields)."
        ) from error


def _read_json(path: Path) -> dict[str, Any]:
    try:
        fields = json.loads(path.read_text(encoding="utf-8"))
    except (ValueError, RecursionError) as error:
        raise BadDump(
            f"{path.name} is no JSON ({error}): write one object with a list of numbers per field."
        ) from error
    if not isinstance(fields, dict):
        raise BadDump(f"{path.name} holds a JSON {type(fields).__name__}, not an object: name the fields.")
    return fields


def check_names(fields: Mapping[str, Any], required: Mapping[str, Field]) -> None:
    """Raise BadDump for another format or version, for unknown fields and for missing ones."""
    _check_header(fields)
    known = (*WORDS, *ARRAYS)
    for name in fields:
        if name not in known and not name.startswith(IGNORED):
            raise BadDump(f"unknown field {name!r}: {_suggestion(name)}; fields named {IGNORED}... are ignored.")
    missing = [f"{name!r} ({field.meaning})" for name, field in required.items() if name not in fields]
    if missing:
        raise BadDump(f"the dump has no {', no '.join(missing)}: write what the pass used.")


def _check_header(fields: Mapping[str, Any]) -> None:
    found = {name: fields.get(name) for name in ("format", "version")}
    if str(found["format"]) != FORMAT:
        raise BadDump(
            f"'format' is {found['format']!r}, not {FORMAT!r}: this is no dump of a pass, or it lacks its name."
        )
    if str(found["version"]) != str(VERSION):
        raise BadDump(f"'version' is {found['version']!s}, but this audit reads version {VERSION}: see docs/audit.md.")


def _suggestion(name: str) -> str:
    """What somebody may have meant."""
    known = [f"it may be {meaning}" for meaning in meanings(name)]
    same = [other for other in ARRAYS if other.lower() == name.lower()]
    near = [f"did you mean {other!r}?" for other in same or difflib.get_close_matches(name, ARRAYS, n=1)]
    return "; ".join(known or near) or f"fields are {', '.join(ARRAYS)}"


def numbers(fields: Mapping[str, Any], name: str, sizes: Mapping[str, int]) -> Array:
    """A field as float64 array, if its axes have these sizes and its numbers are finite and not negative."""
    values = array(name, fields[name])
    wanted = tuple(sizes[axis] for axis in ARRAYS[name].axes)
    if values.shape != wanted:
        raise BadDump(
            f"{name!r} has shape {values.shape}, but its axes ({', '.join(ARRAYS[name].axes)}) are {wanted}: "
            f"{ARRAYS[name].meaning}; M inputs, N columns, columns last."
        )
    bad = ~((values >= 0) & (values <= LARGEST))
    if bad.any():
        where = tuple(int(k) for k in np.argwhere(bad)[0])
        raise BadDump(
            f"{name!r} is {values[where]} at {list(where)} ({int(bad.sum())} of {values.size} values are bad), but "
            f"must be finite, not negative and at most {LARGEST:.0e}: {ARRAYS[name].meaning}."
        )
    return values


def array(name: str, values: Any) -> Array:
    """Numbers as float64; raises BadDump for words, ragged lists, complex numbers and objects."""
    try:
        found = np.asarray(values)
    except ValueError as error:
        raise BadDump(f"{name!r} is no rectangular array ({error}): give all rows the same length.") from error
    if found.dtype.kind not in "biuf":
        raise BadDump(f"{name!r} holds {found.dtype} instead of real numbers: {ARRAYS[name].meaning}.")
    return found.astype(float)


def integers(name: str, values: Array, limit: int) -> Array:
    """Whole numbers below a limit; raises BadDump naming the first that is not."""
    bad = (values != np.floor(values)) | (values >= limit)
    if bad.any():
        where = [int(k) for k in np.argwhere(bad)[0]]
        raise BadDump(
            f"{name!r} is {values[tuple(where)]} at {where}, but must be a whole number below {limit}: "
            f"{ARRAYS[name].meaning}."
        )
    return values.astype(int)
