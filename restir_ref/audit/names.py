"""What engines call the terms of a pass: from the symbols of the papers to fields of a dump and back.

The names are those of public documentation and headers; `docs/names.md` shows them as a table and says
where one name means two things.  Only names are listed here, no code.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

ENGINES = ("RTXDI", "ReSTIR PT, Falcor", "Bevy Solari", "kajiya")


@dataclass(frozen=True)
class Name:
    """A term: symbol of the papers, field of a dump, meaning, and its names in each of ENGINES."""

    symbol: str
    field: str
    meaning: str
    engines: Sequence[Sequence[str]]


NAMES = (
    Name(
        "p̂(y)",
        "p_hat",
        "target function of a sample where the pass selects",
        (
            ("targetPdf", "targetFunction", "RAB_GetLightSampleTargetPdfForSurface"),
            ("toScalar(F)", "computeWeight(F)", "targetPdf"),
            ("reservoir_target_function",),
            ("p_q",),
        ),
    ),
    Name(
        "W",
        "W",
        "unbiased contribution weight (UCW), what replaces 1/p",
        (
            ("weightSum", "RTXDI_GetDIReservoirInvPdf"),
            ("weight", "avgWeight"),
            ("unbiased_contribution_weight",),
            ("W",),
        ),
    ),
    Name(
        "1/p",
        "W",
        "the same for a new candidate: one over its density",
        (("invSourcePdf", "samplePdf"), ("sourcePdf", "p"), ("inverse_pdf", "inverse_solid_angle_pdf"), ()),
    ),
    Name(
        "c, M_r",
        "c",
        "confidence of a reservoir, once a number of samples",
        (("M",), ("M",), ("confidence_weight",), ("M",)),
    ),
    Name(
        "M_c",
        "cap",
        "cap on the confidence that history brings along",
        (("maxHistoryLength",), ("gTemporalHistoryLength",), (), ()),
    ),
    Name(
        "J",
        "J",
        "Jacobian of the shift that brings a sample here",
        (
            ("RTXDI_CalculateJacobian", "partialJacobian"),
            ("jacobian", "dstJacobian", "in_Jacobian", "cachedJacobian"),
            (),
            (),
        ),
    ),
    Name(
        "p̂_i(X_i)",
        "p_hat_own",
        "target of a sample where it came from",
        (("neighborWeightAtNeighbor",), ("computeWeight(neighborReservoir.F)", "candidateTargetPdf"), (), ()),
    ),
    Name(
        "p̂_←j(y)",
        "p_hat_from",
        "target of input j for y, carried back by the shift, times its Jacobian",
        (("ps", "canonicalWeightAtNeighbor"), ("prefix_approxPdf", "p_", "cur_p"), (), ()),
    ),
    Name(
        "m_i",
        "m",
        "resampling MIS weight",
        (
            ("w0", "canonicalWeight"),
            ("misWeight", "neighborWeight", "canonicalWeight"),
            ("canonical_mis_weight", "other_mis_weight"),
            (),
        ),
    ),
    Name(
        "w_i",
        "w",
        "resampling weight m_i p̂(y_i) W_i J_i",
        (("risWeight",), ("sampleWeight", "w"), ("canonical_resampling_weight", "other_resampling_weight"), ("w",)),
    ),
    Name(
        "Σ w",
        "w_sum",
        "sum of the resampling weights",
        (("weightSum",), ("weight", "weightSum"), ("weight_sum",), ("w_sum",)),
    ),
    Name(
        "u",
        "u_stream",
        "random numbers that select",
        (("random",), ("sampleNext1D",), ("rand_f",), ("dart",)),
    ),
    Name(
        "c_s/m_s",
        "mis",
        "correction of W_Y where contribution weights differ from m: 1/Z and its like",
        (("normalizationNumerator", "normalizationDenominator", "piSum"), ("misWeight", "sum_approxPdf"), (), ()),
    ),
)


def meanings(name: str) -> Iterator[str]:
    """Fields that somebody's name may stand for, and whose name it is; case does not matter."""
    for term in NAMES:
        for engine, theirs in zip(ENGINES, term.engines, strict=True):
            if name.lower() in (each.lower() for each in theirs):
                yield f"{term.field!r} ({term.meaning}) in {engine}"


def table() -> str:
    """The names as rows of Markdown."""
    head = ["symbol", "meaning", "field of a dump", *ENGINES]
    rows = [
        [term.symbol, term.meaning, f"`{term.field}`", *(", ".join(f"`{n}`" for n in e) or "–" for e in term.engines)]
        for term in NAMES
    ]
    return "\n".join("| " + " | ".join(row) + " |" for row in (head, ["---"] * len(head), *rows))
