"""Images compared by two metrics: the squared error, and the same relative to the reference pixel.  [COM-M03]

The gradient paper says "error" and names no metric.  The squared error is carried by what is bright or rare, the
relative one, e^2 / (R^2 + (.01 mean R)^2), counts dark pixels as much as bright ones, and they can say the opposite.
So a claim about images holds that holds by both, and fails that fails by both; where they differ nothing is judged,
whichever says what.  Of several scenes each is met, or contrary, that is so by both, and undecided otherwise.
Differences of pixels have the variance alone: a difference may be zero, and nothing is relative to that.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from figures.claims import criteria
from figures.claims.figure import Claim
from figures.experiments.replicas import few
from figures.experiments.scenewise import CONTRARY, MET, UNDECIDED, Pair, Sorted, sorted_by, standing, words
from restir_ref.batch import Array
from restir_ref.metrics import MAP, SMALL, band_powers

MSE, RELATIVE = "MSE", "relMSE"
METRICS = (MSE, RELATIVE)

ByMetric = Mapping[str, Array]
"""Errors of every replica by metric, (R,) each."""

Bands = Mapping[str, ByMetric]
"""The same in "total", and below and above alpha, "low" and "high"."""

Pairs = Mapping[str, Pair]
"""What is compared, by metric."""

Standings = Mapping[str, Mapping[str, str]]
"""How scenes stand, by metric."""


# ---------------------------------------------------------------- errors


def units(right: Array) -> dict[str, Array]:
    """What an error is measured in, pixel by pixel: 1, and sqrt(R^2 + (.01 mean R)^2); right is R (rows, columns)."""
    return {MSE: np.ones_like(right), RELATIVE: np.sqrt(right**2 + (SMALL * right.mean()) ** 2)}


def off(images: Array, right: Array, cost: float, biased: float) -> Array:
    """Images (R, rows, columns) about their mean at equal cost, and `biased` times how far that is from the truth.

    The mean square over replicas is cost s^2 + biased^2 (mean I - R)^2, s^2 the unbiased variance.
    """
    R, mean = len(images), images.mean(axis=0)
    return np.asarray((images - mean) * np.sqrt(R / (R - 1) * cost) + biased * (mean - right))


def bands(error: Array, right: Array, alpha: float) -> Bands:
    """Power of errors (R, rows, columns) by band and metric: mean e^2, and `band_powers` of the image of e, (R,)."""
    found = {metric: error / unit for metric, unit in units(right).items()}
    low, high = ({metric: band_powers(e, alpha, MAP)[k] for metric, e in found.items()} for k in (0, 1))
    return {"total": {metric: (e**2).mean(axis=MAP) for metric, e in found.items()}, "low": low, "high": high}


def best(images: Sequence[Bands]) -> Bands:
    """Of several images the one with the least error in total, by every metric for itself."""
    least = {metric: min(images, key=lambda each: float(each["total"][metric].mean())) for metric in METRICS}
    return {band: {metric: least[metric][band][metric] for metric in METRICS} for band in images[0]}


def pairs(ours: ByMetric, theirs: ByMetric) -> Pairs:
    """Both errors by metric."""
    return {metric: (ours[metric], theirs[metric]) for metric in ours}


# ---------------------------------------------------------------- one comparison


def told(id_: str, compared: Pairs, part: str) -> Claim:
    """The first error over the other by every metric, reported, if replicas are enough to tell."""
    if short := too_few(compared):
        return Claim(id_, None, part, reason=short)
    return Claim(id_, criteria.reported(ratios(compared)), part)


def smaller(id_: str, compared: Pairs, limit: float, part: str, caveat: str = "") -> Claim:
    """The first error below `limit` times the other by every metric; failed where it is above by every one."""
    if short := too_few(compared):
        return Claim(id_, None, part, reason=short)
    passed = unanimous([PASSED[standing([(pair, limit)])] for pair in compared.values()])
    more = criteria.all_of(*(criteria.ratio_above(*pair, 1) for pair in compared.values()))
    rule = f"ratio < {limit:g} at 95%, by {both(compared)}"
    found = verdict(id_, part, criteria.Outcome(ratios(compared), rule, passed))
    return found if found.outcome is None else replace(found, counter=more, caveat=caveat)


def too_few(compared: Pairs) -> str:
    """Why nothing is compared; empty if replicas are enough."""
    return next((few(pair[0]) for pair in compared.values() if few(pair[0])), "")


def ratios(compared: Pairs) -> str:
    """Ratios and their intervals; those of one nameless measure alone."""
    return "; ".join(f"{metric} {criteria.ratio_interval(*pair)[2]}".strip() for metric, pair in compared.items())


def both(metrics: Mapping[str, object]) -> str:
    """The metrics by which something must hold."""
    return " and by ".join(metrics)


PASSED: Mapping[str, bool | None] = {MET: True, CONTRARY: False, UNDECIDED: None}


# ---------------------------------------------------------------- several scenes


def unanimous(answers: Sequence[bool | None]) -> bool | None:
    """What all metrics say; None where they differ, or one of them cannot tell."""
    return answers[0] if len(set(answers)) == 1 else None


def answer(scenes: Sorted, least: int) -> bool | None:
    """True once enough scenes are met, False once too many are contrary for that, None in between."""
    if len(scenes[MET]) >= least:
        return True
    return False if len(scenes[MET]) + len(scenes[UNDECIDED]) < least else None


def agreed(by_metric: Sequence[Sorted]) -> Sorted:
    """Scenes that are met, and contrary, by every metric; the others are undecided."""
    first = by_metric[0]
    same = {kind: [x for x in first[kind] if all(x in each[kind] for each in by_metric)] for kind in (MET, CONTRARY)}
    others = [x for names in first.values() for x in names if not any(x in names for names in same.values())]
    return {**same, UNDECIDED: others}


def in_words(by: Standings) -> str:
    """Which scenes stand how, metric by metric; without a name where there is one nameless measure alone."""
    return ". ".join(f"{metric}: {words(sorted_by(each))}".removeprefix(": ") for metric, each in by.items())


def in_enough(
    id_: str, compared: Mapping[str, Mapping[str, Pair]], asked: tuple[float, int], part: str, why: str
) -> Claim:
    """Below the limit by every metric in at least so many scenes, asked = (limit, how many); else not judged.

    It fails where too many scenes are contrary by every metric.  What is compared goes by scene and metric.
    """
    limit, least = asked
    if short := next(filter(None, map(too_few, compared.values())), ""):
        return Claim(id_, None, part, reason=short)
    by = {metric: {scene: standing([(each[metric], limit)]) for scene, each in compared.items()} for metric in METRICS}
    rule = f"ratio < {limit:g} at 95% in at least {least} of {len(compared)}, by {both(by)}"
    passed = answer(agreed([sorted_by(each) for each in by.values()]), least)
    return verdict(id_, part, criteria.Outcome(in_words(by), rule, passed), why)


def often(id_: str, compared: Mapping[str, Pairs], part: str) -> Claim:
    """Below 1 in at least half of the cases that are decided, by every metric; failed where it is so by none."""
    if short := next(filter(None, map(too_few, compared.values())), ""):
        return Claim(id_, None, part, reason=short)
    by = {metric: {case: standing([(each[metric], 1.0)]) for case, each in compared.items()} for metric in METRICS}
    passed = unanimous([half(sorted_by(each)) for each in by.values()])
    rule = f"ratio < 1 at 95% in at least half of the cases in which it is not 1 at 95%, by {both(by)}"
    return verdict(id_, part, criteria.Outcome(in_words(by), rule, passed), OFTEN)


OFTEN = (
    "The paper says that L1 often has the lower error and names no condition, so that every scene and method of this "
    "figure is a case; often is in at least half of those that are decided, for L1 and against it alike."
)


def half(cases: Sorted) -> bool | None:
    """Whether at least half of those that are decided are met; None where none is decided."""
    met, contrary = len(cases[MET]), len(cases[CONTRARY])
    return met >= contrary if met + contrary else None


def verdict(id_: str, part: str, found: criteria.Outcome, why: str = "") -> Claim:
    """The claim of an outcome; where it says neither, replicas or metrics do not tell, and it is left open."""
    if found.passed is None:
        said = f"Undecided ({found.measured}; asked {found.criterion}).  {why}"
        return Claim(id_, None, part, reason=said.strip())
    return Claim(id_, found, part, reason=why)
