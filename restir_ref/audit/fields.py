"""The format of a dump: which fields there are, of which shape, and what is said where they are wrong.

`docs/audit.md` explains it to those who write dumps.  A dump is a NumPy archive (.npz, no pickles), a
JSON object with lists of numbers, or any mapping of names to arrays.  M inputs, N columns, batch last.
"""

import difflib
import reprlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np

from restir_ref.audit.names import meanings
from restir_ref.batch import Array

FORMAT, VERSION = "restir-ref dump", 1

LARGEST = 1e75
"""Products of four numbers that are not larger are still finite."""


class BadDump(ValueError):
    """A dump that cannot be read; the message, on one line, names the field, its value and the remedy."""

    def __init__(self, message: str) -> None:
        super().__init__(" ".join(message.split()))


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
        "k": Field("", "neighbours asked for, where weights count them and not those accepted"),
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
WORDS = ("format", "version", "mis", "precision")
LONGEST_WORD = 40
"""Words are read, and quoted, up to here."""

IGNORED = "note"
"""Fields whose name begins like this are for people."""


NEEDED = ("p_hat", "W")
"""Without these there is no pass; everything else has a default, or goes unchecked."""


def check_names(fields: Mapping[str, Any]) -> None:
    """Raise BadDump for another format or version, for unknown fields and for missing ones."""
    _check_header(fields)
    known = (*WORDS, *ARRAYS)
    for name in fields:
        if name not in known and not str(name).startswith(IGNORED):
            raise BadDump(
                f"unknown field {reprlib.repr(name)}: {_suggestion(str(name)[:LONGEST_WORD])}; "
                f"fields named {IGNORED}... are ignored."
            )
    missing = [f"{name!r} ({ARRAYS[name].meaning})" for name in NEEDED if name not in fields]
    if missing:
        raise BadDump(f"the dump has no {', no '.join(missing)}: write what the pass used.")


def _check_header(fields: Mapping[str, Any]) -> None:
    if (name := word(fields, "format")) != FORMAT:
        raise BadDump(f"'format' is {name!r}, not {FORMAT!r}: this is no dump of a pass, or it lacks its name.")
    if (version := word(fields, "version")) != str(VERSION):
        raise BadDump(f"'version' is {version}, but this audit reads version {VERSION}: see docs/audit.md.")


def word(fields: Mapping[str, Any], name: str) -> str:
    """A word as text, also where it is a number, missing, or in an array () as in archives; shortened."""
    value = fields.get(name)
    if getattr(value, "shape", None) == ():
        value = value.item()  # type: ignore[union-attr]
    return value[:LONGEST_WORD] if isinstance(value, str) else reprlib.repr(value)


def _suggestion(name: str) -> str:
    """What somebody may have meant."""
    known = [f"it may be {meaning}" for meaning in meanings(name)]
    same = [other for other in ARRAYS if other.lower() == name.lower()]
    near = [f"did you mean {other!r}?" for other in same or difflib.get_close_matches(name, ARRAYS, n=1)]
    return "; ".join(known or near) or f"fields are {', '.join(ARRAYS)}"


def shaped(name: str, given: Any, sizes: Mapping[str, int]) -> None:
    """Raise BadDump unless a field has real numbers, and axes of these sizes: columns last, or first in every field."""
    wanted = tuple(sizes[axis] for axis in ARRAYS[name].axes)
    if given.shape != wanted:
        raise BadDump(
            f"{name!r} has shape {given.shape}, but its axes ({', '.join(ARRAYS[name].axes)}) are {wanted}: "
            f"{ARRAYS[name].meaning}; M inputs, N columns, columns last."
        )


@dataclass(frozen=True)
class Defect:
    """A number that none of a pass should be: the field, its first place [input(s), column], and in how many columns.

    What it spoils is not compared.
    """

    term: str
    where: Sequence[int]
    value: float
    columns: int

    def __str__(self) -> str:
        inputs = "".join(f"[{i}]" for i in self.where[:-1])
        size = "1 column" if self.columns == 1 else f"{self.columns} columns"
        kind = "negative" if self.value < 0 else "beyond all bounds" if np.isfinite(self.value) else "not finite"
        return f"{self.term}{inputs} in column {self.where[-1]} is {self.value:.7g}: {kind} ({size}), {_came(self)}"


def _came(defect: Defect) -> str:
    """Where such a number comes from."""
    if np.isnan(defect.value):
        return "as 0/0 is: a density, a target or a sum of 0 that was divided by; it came in with the inputs"
    if np.isinf(defect.value):
        return "as 1/0 is, or a half float above 65504; it came in with the inputs"
    return "and came in with the inputs"


def improper(values: Array) -> Array:
    """Which numbers are negative, not finite, or too large to be multiplied."""
    return ~((values >= 0) & (values <= LARGEST))


def array(name: str, values: Any) -> Array:
    """Real numbers of any type; raises BadDump for words, ragged lists, complex numbers and objects."""
    try:
        found = np.asarray(values)
    except ValueError as error:
        raise BadDump(f"{name!r} is no rectangular array ({error}): give all rows the same length.") from error
    if found.dtype.kind not in "biuf":
        raise BadDump(f"{name!r} holds {found.dtype} instead of real numbers: {ARRAYS[name].meaning}.")
    return found


def refuse(name: str, values: Array, bad: Array, must: str) -> None:
    """Raise BadDump where anything is bad, naming the first such value and its place."""
    if bad.any():
        where = [int(k) for k in np.argwhere(bad)[0]]
        raise BadDump(
            f"{name!r} is {values[tuple(where)]} at {where} ({int(bad.sum())} of {values.size} values are bad), but "
            f"must be {must}: {ARRAYS[name].meaning}."
        )


def integers(name: str, values: Array, limit: int) -> Array:
    """Whole numbers below a limit; raises BadDump naming the first that is not."""
    bad = ~((values == np.floor(values)) & (values < limit) & (values >= 0))
    refuse(name, values, bad, f"a whole number below {limit}")
    return values.astype(int)
