"""Claims that need some of several scenes: "in at least three of four rows".  A scene may also leave it open."""

from collections.abc import Mapping, Sequence

from figures.claims import criteria
from figures.claims.figure import Claim
from figures.experiments.replicas import few
from restir_ref.batch import Array

Pair = tuple[Array, Array]
"""Errors of ours and of another method, replica by replica; (R,) each."""

MET, CONTRARY, UNDECIDED = "met", "contrary", "undecided"

Sorted = Mapping[str, Sequence[str]]
"""Scenes that are met, contrary and undecided."""


def standing(limits: Sequence[tuple[Pair, float]]) -> str:
    """Of one scene: met if all 95% intervals of its ratios end below their limits, contrary if one begins above.

    Anything else is undecided: more replicas would tell.
    """
    ends = [(criteria.ratio_interval(*pair)[:2], limit) for pair, limit in limits]
    if all(high < limit for (_, high), limit in ends):
        return MET
    return CONTRARY if any(low >= limit for (low, _), limit in ends) else UNDECIDED


def sorted_by(standings: Mapping[str, str]) -> Sorted:
    """The names of scenes by how they stand."""
    return {kind: [name for name, each in standings.items() if each == kind] for kind in (MET, CONTRARY, UNDECIDED)}


def words(scenes: Sorted) -> str:
    """Which scenes stand how."""
    return "; ".join(f"{kind}: {', '.join(names)}" for kind, names in scenes.items() if names)


def in_enough(id_: str, scenes: Mapping[str, Sequence[Pair]], asked: tuple[float, int], part: str, why: str) -> Claim:
    """Met in at least so many scenes, asked = (limit, how many); failed once too many are contrary, else not judged."""
    limit, least = asked
    short = next((few(pair[0]) for pairs in scenes.values() for pair in pairs if few(pair[0])), "")
    if short:
        return Claim(id_, None, part, reason=short)
    by = sorted_by({name: standing([(pair, limit) for pair in pairs]) for name, pairs in scenes.items()})
    rule = f"ratio < {limit:g} at 95% in at least {least} of {len(scenes)}"
    if len(by[MET]) >= least or len(scenes) - len(by[CONTRARY]) < least:
        return Claim(id_, criteria.Outcome(words(by), rule, len(by[MET]) >= least), part, reason=why)
    return Claim(id_, None, part, reason=f"Undecided ({words(by)}; asked {rule}).  {why}")
