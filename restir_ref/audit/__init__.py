"""Audits for strangers: is this estimator unbiased, is this dump of a renderer's pass right?

`audit_estimator` enumerates somebody's estimator on a finite scene, `audit_dump` recomputes a pass
that an engine has written down, `audit_images` compares frames with a reference, `audit_ladder` a
renderer step by step, and `golden_vectors` are passes with their results, to test shaders without
Python.  `docs/audit.md` is for those who come from an engine, `docs/names.md` a dictionary.
"""

from restir_ref.audit.dump import DumpReport, audit_dump
from restir_ref.audit.engines import KNOWN
from restir_ref.audit.estimator import EstimatorReport, audit_estimator
from restir_ref.audit.fields import BadDump
from restir_ref.audit.golden import golden_vectors
from restir_ref.audit.images import BadImages, ImageReport, audit_images, audit_ladder
from restir_ref.audit.rehearsal import CannotAudit
from restir_ref.audit.shift_table import TableReport, audit_shift_table

__all__ = [
    "KNOWN",
    "BadDump",
    "BadImages",
    "CannotAudit",
    "DumpReport",
    "EstimatorReport",
    "ImageReport",
    "TableReport",
    "audit_dump",
    "audit_estimator",
    "audit_images",
    "audit_ladder",
    "audit_shift_table",
    "golden_vectors",
]
