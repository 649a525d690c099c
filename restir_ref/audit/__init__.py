"""Audits for strangers: is this estimator unbiased, is this dump of a renderer's pass right?

`audit_estimator` enumerates somebody's estimator on a finite scene, `audit_dump` recomputes a pass
that an engine has written down, and `golden_vectors` are passes with their results, to test shaders
without Python.  `docs/audit.md` is for those who come from an engine, `docs/names.md` a dictionary.
"""

from restir_ref.audit.dump import DumpReport, audit_dump
from restir_ref.audit.engines import KNOWN
from restir_ref.audit.estimator import EstimatorReport, audit_estimator
from restir_ref.audit.fields import BadDump
from restir_ref.audit.golden import golden_vectors
from restir_ref.audit.rehearsal import CannotAudit

__all__ = [
    "KNOWN",
    "BadDump",
    "CannotAudit",
    "DumpReport",
    "EstimatorReport",
    "audit_dump",
    "audit_estimator",
    "golden_vectors",
]
