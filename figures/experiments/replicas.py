"""How many replicas it takes to compare variances that a few rare paths carry."""

from figures.claims import criteria
from figures.claims.figure import Claim
from restir_ref.batch import Array

ENOUGH = 64
"""Replicas that can tell."""


def few(errors: Array) -> str:
    """Why errors of too few replicas (R,) are not judged; empty if they are enough."""
    R = len(errors)
    return "" if R >= ENOUGH else f"{R} replicas cannot tell: a few rare paths carry most of a variance."


def smaller(id_: str, pair: tuple[Array, Array], limit: float, part: str, caveat: str = "") -> Claim:
    """The first variance below `limit` times the other, with the opposite beside it, if replicas are enough to tell."""
    if few(pair[0]):
        return Claim(id_, None, part, reason=few(pair[0]))
    return Claim(id_, criteria.ratio_below(*pair, limit), part, criteria.ratio_above(*pair, 1), caveat)


def told(id_: str, pair: tuple[Array, Array], part: str) -> Claim:
    """The first variance over the other, reported, if replicas are enough to tell."""
    if few(pair[0]):
        return Claim(id_, None, part, reason=few(pair[0]))
    return Claim(id_, criteria.reported(criteria.ratio_interval(*pair)[2]), part)
