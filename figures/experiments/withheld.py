"""Verdicts that are withheld: a criterion failed, and a reader with the paper at hand holds the experiment to blame.

A part that passes stays as it is, so that nothing becomes better by being withheld.
"""

from collections.abc import Iterable, Sequence
from dataclasses import replace

from figures.claims.figure import Claim, verdict_of


def withheld(claim: Claim, why: str) -> Claim:
    """The claim, not judged if it would be a negative verdict; what was measured, and why that is no judgement."""
    if claim.outcome is None or verdict_of(claim) not in ("not reproduced", "refuted"):
        return claim
    said = f"Measured {claim.outcome.measured}, asked {claim.outcome.criterion}; no verdict, for {why}"
    return replace(claim, outcome=None, counter=None, reason=f"{said}  {claim.reason}".rstrip())


def withheld_where(claims: Iterable[Claim], disputed: Sequence[tuple[str, str, str]]) -> list[Claim]:
    """All claims, those withheld whose id and part are among (id, words of the part, why)."""

    def why(claim: Claim) -> str:
        return next((why for id_, words, why in disputed if claim.id == id_ and words in claim.part), "")

    return [withheld(claim, why(claim)) if why(claim) else claim for claim in claims]
