"""How exactly an engine stores its terms, where it says so: tolerances follow from it."""

import math
import re
from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import Any

from restir_ref.audit.fields import DENSITIES, INPUTS, BadDump

KINDS: Mapping[str, float] = MappingProxyType(
    {"double": 2.0**-53, "float": 2.0**-24, "half": 2.0**-11, "unorm16": 2.0**-16, "unorm8": 2.0**-8}
)
"""Half a unit in the last place, relative to the value; of normalised integers, to the largest."""

SEVERAL = 4
"""So many roundings of inputs meet in a term."""


def tolerances(said: Any, names: Iterable[str]) -> Mapping[str, float]:
    """Relative tolerances per term beside the usual one, 0 if nothing is said.

    `said` is a kind for all fields, `{"W": "half", "m": 0.004}`, or the same as text, "W=half, m=0.004".
    Raises BadDump for kinds that are none.
    """
    if said is None:
        return {}
    eps = dict.fromkeys(names, 0.0) | _declared(said, names)
    spread = SEVERAL * sum(eps.get(name, 0.0) for name in (*INPUTS, *DENSITIES))
    return {name: spread + 2 * each for name, each in eps.items()}


def _declared(said: Any, names: Iterable[str]) -> dict[str, float]:
    if isinstance(said, Mapping):
        return {str(name): _eps(kind) for name, kind in said.items()}
    text = str(said.item() if getattr(said, "shape", None) == () else said).strip()
    if "=" not in text and ":" not in text:
        return {name: _eps(text) for name in names}
    parts = [re.split(r"[=:]", each, maxsplit=1) for each in text.split(",")]
    if any(len(each) != 2 for each in parts):
        raise BadDump(f"'precision' is {text[:60]!r}: write one kind for all, or W=half, m=float.")
    return {name.strip(): _eps(kind.strip()) for name, kind in parts}


def _eps(kind: Any) -> float:
    try:
        value = KINDS[kind] if isinstance(kind, str) and kind in KINDS else float(kind)
    except (TypeError, ValueError) as error:
        raise BadDump(
            f"'precision' says {str(kind)[:40]!r}, but a kind is one of {', '.join(KINDS)} or a relative error."
        ) from error
    if not (0 <= value < 1) or math.isnan(value):
        raise BadDump(f"'precision' says {value}, but a relative error is at least 0 and below 1.")
    return value
