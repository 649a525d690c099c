"""The format of dumps as a JSON schema, for those who check what they write before anybody reads it."""

from typing import Any

from restir_ref.audit.engines import KNOWN
from restir_ref.audit.fields import ARRAYS, FORMAT, IGNORED, NEEDED, VERSION
from restir_ref.audit.precision import KINDS
from restir_ref.audit.recorded import GIVEN


def schema() -> dict[str, Any]:
    """The schema (draft 2020-12) of a dump with columns last; shapes are checked by the audit itself."""
    words = {
        "format": {"const": FORMAT},
        "version": {"const": VERSION},
        "mis": {"enum": [*KNOWN, GIVEN]},
        "precision": {
            "anyOf": [
                {"type": "string"},
                {"type": "object", "additionalProperties": {"anyOf": [{"enum": [*KINDS]}, {"type": "number"}]}},
            ]
        },
    }
    fields = {name: {"description": field.meaning, **nested(len(field.axes))} for name, field in ARRAYS.items()}
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": f"{FORMAT}, version {VERSION}",
        "type": "object",
        "required": ["format", "version", "mis", *NEEDED],
        "properties": {**words, **fields},
        "patternProperties": {f"^{IGNORED}": {}},
        "additionalProperties": False,
    }


def nested(depth: int) -> dict[str, Any]:
    """Numbers in lists of lists."""
    return {"type": "array", "minItems": 1, "items": nested(depth - 1)} if depth else {"type": "number"}
