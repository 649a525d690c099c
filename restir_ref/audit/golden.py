"""Golden vectors: passes with their results, for people who test shaders without Python.

They ship with the package, one JSON file per MIS weight; `docs/audit.md` explains the fields, and
`restir_ref.audit.make_golden` makes them.
"""

import json
import re
from importlib import resources
from typing import Any

from restir_ref.audit.engines import KNOWN

GOLDEN = "restir-ref golden vectors"
"""The name of their format."""


def golden_vectors(mis: str) -> Any:
    """The golden vectors of a weight as they ship with the package; raises ValueError unless it is one of KNOWN.

    >>> from restir_ref.audit import golden_vectors
    >>> sorted(golden_vectors("pairwise")["cases"][0]["expected"])
    ['W_Y', 'W_Y_stream', 'c_Y', 'm', 's', 's_stream', 'w', 'w_sum']
    """
    if mis not in KNOWN:
        raise ValueError(f"there are no golden vectors for {mis!r} weights, only for {', '.join(map(repr, KNOWN))}.")
    text = resources.files("restir_ref.audit").joinpath("data", file_name(mis)).read_text(encoding="utf-8")
    return json.loads(text)


def file_name(mis: str) -> str:
    """The file of a weight's vectors."""
    return re.sub(r"\W+", "_", mis.replace("1/", "one_over_")) + ".json"
