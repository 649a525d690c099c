"""Parts without a verdict: a reader with the paper at hand holds the experiment unfit to judge them, either way.

What is withheld is so whether it passes or fails: a part that could only pass would be no check.
"""

from collections.abc import Iterable, Sequence
from dataclasses import replace

from figures.claims.figure import Claim


def withheld(claim: Claim, why: str) -> Claim:
    """The claim, not judged; what was measured against which criterion, and why that is no judgement."""
    if claim.outcome is None or claim.outcome.passed is None:
        return claim
    said = f"Measured {claim.outcome.measured}, asked {claim.outcome.criterion}; no verdict, for {why}"
    return replace(claim, outcome=None, counter=None, caveat="", reason=f"{said}  {claim.reason}".rstrip())


def withheld_where(claims: Iterable[Claim], disputed: Sequence[tuple[str, str, str]]) -> list[Claim]:
    """All claims, those withheld whose id and part are among (id, words of the part, why)."""

    def why(claim: Claim) -> str:
        return next((why for id_, words, why in disputed if claim.id == id_ and words in claim.part), "")

    return [withheld(claim, why(claim)) if why(claim) else claim for claim in claims]
