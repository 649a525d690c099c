"""Parts without a verdict are without one either way, and nothing else is touched."""

import pytest

from figures.claims import criteria
from figures.claims.figure import Claim, verdict_of
from figures.experiments.withheld import withheld_where

DISPUTED = (("DDGIR-F05", "leak", "the walls have no thickness."),)


@pytest.mark.parametrize("measured", [0.1, 0.9])
def test_a_disputed_part_is_not_judged_whether_it_passes_or_fails(measured):
    (claim,) = withheld_where([Claim("DDGIR-F05", criteria.below(measured, 0.2), "FS4, leak energy")], DISPUTED)
    assert verdict_of(claim) == "not judged"
    assert f"Measured {measured}" in claim.reason
    assert "the walls have no thickness." in claim.reason


@pytest.mark.parametrize(
    "claim",
    [
        Claim("DDGIR-F05", criteria.below(0.9, 0.2), "FS4, bias"),
        Claim("DDGIR-F03", criteria.below(0.9, 0.2), "FS4, leak energy"),
        Claim("DDGIR-F05", criteria.reported("0.9"), "FS4, leak energy, reported"),
    ],
    ids=["another part", "another claim", "no criterion"],
)
def test_all_others_stay_as_they_are(claim):
    assert withheld_where([claim], DISPUTED) == [claim]
