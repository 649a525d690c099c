"""Claims that need some of several scenes: "in at least three of four rows".  A scene may also leave it open."""

from collections.abc import Mapping, Sequence

from figures.claims import criteria
from figures.claims.figure import Claim
from figures.experiments.replicas import few
from restir_ref.batch import Array

Pair = tuple[Array, Array]
"""Errors of ours and of another method, replica by replica; (R,) each."""

MET, CONTRARY, UNDECIDED = "met", "contrary", "undecided"


def standing(pairs: Sequence[Pair], limit: float) -> str:
    """Of one scene: met if the 95% intervals of all ratios end below the limit, contrary if one begins at it or above.

    Anything else is undecided: more replicas would tell.
    """
    ends = [criteria.ratio_interval(*pair)[:2] for pair in pairs]
    if all(high < limit for _, high in ends):
        return MET
    return CONTRARY if any(low >= limit for low, _ in ends) else UNDECIDED


def in_enough(id_: str, scenes: Mapping[str, Sequence[Pair]], asked: tuple[float, int], part: str, why: str) -> Claim:
    """Met in at least so many scenes, asked = (limit, how many); failed once too many are contrary, else not judged."""
    limit, least = asked
    short = next((few(pair[0]) for pairs in scenes.values() for pair in pairs if few(pair[0])), "")
    if short:
        return Claim(id_, None, part, reason=short)
    found = {name: standing(pairs, limit) for name, pairs in scenes.items()}
    by = {each: [name for name in found if found[name] == each] for each in (MET, CONTRARY, UNDECIDED)}
    measured = "; ".join(f"{each}: {', '.join(names)}" for each, names in by.items() if names)
    rule = f"ratio < {limit:g} at 95% in at least {least} of {len(found)}"
    decided = len(by[MET]) >= least or len(found) - len(by[CONTRARY]) < least
    if decided:
        return Claim(id_, criteria.Outcome(measured, rule, len(by[MET]) >= least), part, reason=why)
    return Claim(id_, None, part, reason=f"Undecided ({measured}; asked {rule}).  {why}")
