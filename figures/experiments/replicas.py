"""How many replicas it takes to compare variances that a few rare paths carry, and what an interval says of a limit.

Hazard: where a few rare paths carry a variance, a 95% bootstrap interval of a ratio of two holds the truth nine times
in ten, at 64 replicas and at 256 (`tests/figures/test_coverage.py`): an end that is near a limit decides little.
"""

from dataclasses import dataclass, replace

import numpy as np

from figures.claims import criteria
from figures.claims.figure import Claim
from restir_ref.batch import Array

ENOUGH = 64
"""Replicas that can tell."""

Interval = tuple[float, float, str]
"""The ends of a 95% interval, and the estimate with them in words."""


def few(errors: Array) -> str:
    """Why errors of too few replicas (R,) are not judged; empty if they are enough."""
    R = len(errors)
    return "" if R >= ENOUGH else f"{R} replicas cannot tell: a few rare paths carry most of a variance."


# ---------------------------------------------------------------- an interval against a window


@dataclass(frozen=True)
class Window:
    """low < ratio < high is asked, with the rule in words."""

    low: float
    high: float
    rule: str


def under(limit: float) -> Window:
    """Ratio < limit."""
    return Window(-np.inf, limit, f"ratio < {limit:g} at 95%")


def over(limit: float) -> Window:
    """Ratio > limit."""
    return Window(limit, np.inf, f"ratio > {limit:g} at 95%")


def inside(low: float, high: float) -> Window:
    """Low < ratio < high: an interval that is wider than that can fail, and never pass."""
    return Window(low, high, f"ratio in [{low:g}, {high:g}] at 95%")


def placed(id_: str, interval: Interval, window: Window, part: str) -> Claim:
    """Passes if all of the interval lies in the window, fails if none of it does; else undecided, so not judged.

    NaN fails.
    """
    low, high, text = interval
    passes = bool(window.low < low and high < window.high)
    overlaps = low < window.high and high > window.low
    if overlaps and not passes:
        return Claim(id_, None, part, reason=f"Undecided: measured {text}, asked {window.rule}; {MORE}")
    return Claim(id_, criteria.Outcome(text, window.rule, passes), part)


MORE = "more replicas would tell."


def compared(id_: str, pair: tuple[Array, Array], window: Window, part: str) -> Claim:
    """The ratio of mean errors of two arms (R,) each against a window, if replicas are enough to tell."""
    if few(pair[0]):
        return Claim(id_, None, part, reason=few(pair[0]))
    return placed(id_, criteria.ratio_interval(*pair), window, part)


def smaller(id_: str, pair: tuple[Array, Array], limit: float, part: str, caveat: str = "") -> Claim:
    """The first variance below `limit` times the other, with the opposite beside it, or undecided."""
    claim = compared(id_, pair, under(limit), part)
    if claim.outcome is None:
        return claim
    return replace(claim, counter=criteria.ratio_above(*pair, 1), caveat=caveat)


def told(id_: str, pair: tuple[Array, Array], part: str) -> Claim:
    """The first variance over the other, reported, if replicas are enough to tell."""
    if few(pair[0]):
        return Claim(id_, None, part, reason=few(pair[0]))
    return Claim(id_, criteria.reported(criteria.ratio_interval(*pair)[2]), part)
