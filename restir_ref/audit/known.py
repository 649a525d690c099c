"""What the zoo looks like to the audit: tables of biases on the scenes that ship, and what every bug needs.

Both take minutes to compute and are kept in `data/zoo.json`, which `restir_ref.audit.make_known` makes.
"""

import hashlib
import json
from collections.abc import Iterable, Mapping
from functools import cache
from importlib import resources
from typing import Any

import numpy as np

from restir_ref.audit.advice import RULES
from restir_ref.audit.facts import Facts
from restir_ref.audit.likeness import Signature, signatures
from restir_ref.oracle.cells import Cells
from restir_ref.oracle.scenes import Scene

FILE = "zoo.json"


@cache
def kept() -> Mapping[str, Any]:
    """The file: `tables` of biases by digest of a scene, `patterns` of needs to names of bugs."""
    text = resources.files("restir_ref.audit").joinpath("known", FILE).read_text(encoding="utf-8")
    found: Mapping[str, Any] = json.loads(text)
    return found


def digest(scene: Scene) -> str:
    """What tells scenes apart: their tables, and the number of pixels."""
    tables: Cells = scene.now.cells
    parts = [np.asarray(each, dtype=float).tobytes() for each in (tables.v, tables.f, tables.p_hat, tables.pdf)]
    shifts = tables.shifts.astype(np.int64).tobytes()
    return hashlib.sha256(b"".join([*parts, shifts, str(scene.now.n).encode()])).hexdigest()[:16]


def known_signatures(scene: Scene, tolerance: float) -> Iterable[Signature]:
    """The zoo's tables on a scene: those kept, or computed where none are."""
    tables = kept()["tables"].get(digest(scene))
    if tables is None:
        return signatures(scene, tolerance)
    return [Signature(bug, loop, np.array(bias)) for bug, loop, bias in tables]


def pattern(facts: Facts) -> str:
    """What a bias needs, as one line: what it is gone without, who enters, and which rules speak."""
    enters = [name for name, read in (("neighbours", facts.neighbours), ("history", facts.history)) if read]
    rules = [rule.name for rule in RULES if rule.holds(facts)]
    return "; ".join(", ".join(each) for each in (facts.gone, enters, rules))


def needing_the_same(facts: Facts) -> tuple[str, ...]:
    """Bugs of the zoo with the same pattern in some loop on some scene."""
    return tuple(kept()["patterns"].get(pattern(facts), ()))
