"""The bug zoo: what people who implement ReSTIR really get wrong, one small deliberate error each.

Every bug is the right loop with one part replaced, on a scene small enough to know its bias
exactly.  `BUGS` are biased: a check that misses one of them is not a check.  `INEFFICIENT` ones are
not, they only waste samples.  `CHECKS` is what one can hold against a loop, from a mean to
Definition 4.1; docs/symptoms.md says which check catches which bug.
"""

from restir_ref.oracle.zoo.bug import Bug, exact_bias, family, of
from restir_ref.oracle.zoo.candidates import CANDIDATE_BUGS, WASTEFUL_CANDIDATES
from restir_ref.oracle.zoo.checks import CHECKS, Case, Found, examine
from restir_ref.oracle.zoo.confidence import CONFIDENCE_BUGS, OneSeed, null_confidence_zero
from restir_ref.oracle.zoo.inefficient import INEFFICIENT_BUGS
from restir_ref.oracle.zoo.mutations import MUTATION_BUGS
from restir_ref.oracle.zoo.passes import PASS_BUGS
from restir_ref.oracle.zoo.selection import SELECTION_BUGS
from restir_ref.oracle.zoo.shifts import SHIFT_BUGS
from restir_ref.oracle.zoo.weights import WEIGHT_BUGS, talbot_capped_below

BUGS = family(
    [
        *SHIFT_BUGS,
        *WEIGHT_BUGS,
        *PASS_BUGS,
        *SELECTION_BUGS,
        *CONFIDENCE_BUGS,
        *MUTATION_BUGS,
        *CANDIDATE_BUGS,
    ]
)
INEFFICIENT = family([*INEFFICIENT_BUGS, *WASTEFUL_CANDIDATES])

__all__ = [
    "BUGS",
    "CHECKS",
    "INEFFICIENT",
    "Bug",
    "Case",
    "Found",
    "OneSeed",
    "exact_bias",
    "examine",
    "family",
    "null_confidence_zero",
    "of",
    "talbot_capped_below",
]
