"""Criteria that can fail: each takes numbers and returns an Outcome (measured value, rule, answer).

NaN passes nothing. Random error is judged with a power clause: too noisy to decide is a failure.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import ndtr, ndtri, stdtrit

from restir_ref.batch import ratio

BOOTSTRAP = 2000  # resamples behind a confidence interval
STREAM = 0x5EED  # fixed stream of the bootstrap: the same errors always give the same verdict


@dataclass(frozen=True)
class Outcome:
    """What a criterion found: a measured number or short text, the rule in words, and whether it passed.

    `passed` is None for what is reported without a rule.
    """

    measured: float | str
    criterion: str
    passed: bool | None


class Void(ValueError):
    """A comparison of a thing with itself: its two arms are the same to the last bit, so that nothing is compared."""


def reported(measured: float | str) -> Outcome:
    """A number or short text that belongs beside a claim and has no criterion of its own."""
    return Outcome(measured, "reported", None)


def within(value: ArrayLike, target: float, tol: float) -> Outcome:
    """|value - target| <= tol."""
    v = float(np.asarray(value))
    return Outcome(v, f"{target:g} ± {tol:g}", bool(abs(v - target) <= tol))


def between(value: ArrayLike, low: float, high: float) -> Outcome:
    """Low <= value <= high."""
    v = float(np.asarray(value))
    return Outcome(v, f"in [{low:g}, {high:g}]", bool(low <= v <= high))


def below(value: ArrayLike, limit: float) -> Outcome:
    """Value < limit."""
    v = float(np.asarray(value))
    return Outcome(v, f"< {limit:g}", bool(v < limit))


def above(value: ArrayLike, limit: float) -> Outcome:
    """Value > limit."""
    v = float(np.asarray(value))
    return Outcome(v, f"> {limit:g}", bool(v > limit))


def equal_to(value: ArrayLike, target: ArrayLike, tol: float = 1e-12) -> Outcome:
    """Largest |value - target| <= tol max(|target|), over all elements; tol = 0 means bitwise equal values.

    Reports the value of two scalars, otherwise the largest deviation relative to max |target|.
    """
    v, t = np.asarray(value, dtype=float), np.asarray(target, dtype=float)
    deviation = float(np.max(np.abs(v - t), initial=0.0))
    size = float(np.max(np.abs(t), initial=0.0))
    passed = bool(v.shape == t.shape and deviation <= tol * size)
    if v.ndim == t.ndim == 0:
        return Outcome(float(v), f"= {float(t):.10g} to a relative {tol:g}", passed)
    return Outcome(deviation / (size or 1.0), f"largest relative deviation ≤ {tol:g}", passed)


def slope(x: ArrayLike, y: ArrayLike) -> float:
    """Least-squares slope of log y over log x; x, y (n,); NaN where a logarithm is missing."""
    log_x, log_y = (_log10(v) for v in (x, y))
    centred = log_x - log_x.mean()
    spread = float(centred @ centred)
    return float(centred @ log_y) / spread if spread > 0 else float("nan")


def slope_within(
    x: ArrayLike, y: ArrayLike, target: float, tol: float, points: int = 6, decades: float = 2.0
) -> Outcome:
    """|slope of log y over log x - target| <= tol, from at least `points` abscissae spanning `decades`."""
    s, log_x = slope(x, y), _log10(x)
    enough = len(np.unique(log_x)) >= points and bool(np.ptp(log_x) >= decades - 1e-9)
    rule = f"log-log slope {target:g} ± {tol:g}, ≥ {points} points over ≥ {decades:g} decades"
    return Outcome(s, rule, bool(enough and abs(s - target) <= tol))


def unbiased(estimates: ArrayLike, reference: float, eps: float = 0.005, replicates: int = 64) -> Outcome:
    """|mean - reference| <= 4 SE and SE <= eps |reference|, over (R,) replicates, R >= `replicates`."""
    e = np.asarray(estimates, dtype=float)
    bias, error, text = _bias(e, reference)
    passed = abs(bias) <= 4 * error and error <= eps * abs(reference) and e.size >= replicates
    return Outcome(text, f"|bias| ≤ 4 SE, SE ≤ {eps:.3g} of the truth, R ≥ {replicates}", bool(passed))


def biased(estimates: ArrayLike, reference: float, low: float, high: float) -> Outcome:
    """|mean - reference| >= 8 SE and the relative bias lies in [low, high]: for what must be wrong; (R,)."""
    bias, error, text = _bias(np.asarray(estimates, dtype=float), reference)
    passed = abs(bias) >= 8 * error and abs(bias) > 0 and low <= bias / reference <= high
    return Outcome(text, f"|bias| ≥ 8 SE, relative bias in [{low:g}, {high:g}]", bool(passed))


def sidak(checks: int, replicates: float = np.inf, z: float = 4.0) -> float:
    """t with (1 - P(|T| > t))^checks = 1 - P(|Z| > z), Z normal, T Student's ratio of `replicates` (normal for inf).

    So many independent checks together exceed t as rarely as one exceeds z; checks that depend on one
    another, such as an image and its blocks, even less often (Sidak's inequality).
    """
    tail = -np.expm1(np.log1p(-2 * ndtr(-z)) / checks) / 2
    return float(-ndtri(tail) if np.isinf(replicates) else -stdtrit(replicates - 1, tail))


def all_unbiased(
    estimates: ArrayLike, references: ArrayLike, eps: float = 0.005, replicates: int = 64, families: int = 1
) -> Outcome:
    """|mean - reference| <= t SE and SE <= eps |reference| for all K columns of (R, K) replicates, R >= `replicates`.

    t = sidak(K families, R): all columns of so many families together raise a false alarm as rarely as one
    |z| > 4, 6 times in 100 000.  A bias of (t + 4) eps is always seen, one of t SE every other time.
    Hazard: replicates must be means of many samples; with one exponential sample each, nine columns
    raise a false alarm 4 times in 1000.
    """
    e, truth = np.asarray(estimates, dtype=float), np.asarray(references, dtype=float)
    if e.ndim != 2 or truth.shape != e.shape[1:] or not truth.size or len(e) < 2:
        raise ValueError(f"needs estimates (R, K), R > 1, and references (K,), got shapes {e.shape} and {truth.shape}")
    R, K = e.shape
    t, error, bias = sidak(K * families, R), e.std(axis=0, ddof=1) / np.sqrt(R), e.mean(axis=0) - truth
    passed = (np.abs(bias) <= t * error + 1e-12 * np.abs(truth)) & (error <= eps * np.abs(truth))
    worst = int(np.argmax(np.where(passed, ratio(np.abs(bias), error), np.inf)))
    text = f"worst of {K}, number {worst}: {_bias(e[:, worst], float(truth[worst]))[2]}"
    rule = f"each |bias| ≤ {t:.3g} SE (all together as one |z| ≤ 4), SE ≤ {eps:.3g} of the truth, R ≥ {replicates}"
    return Outcome(text, rule, bool(passed.all() and replicates <= R))


def mean_and_blocks(images: ArrayLike, blocks: int = 8) -> NDArray[np.float64]:
    """The image's mean and the means of blocks of neighbouring pixels, (..., n) -> (..., 1 + blocks)."""
    pixels = np.asarray(images, dtype=float)
    if not 0 < blocks <= pixels.shape[-1]:
        raise ValueError(f"{blocks} blocks need as many pixels, but the image has {pixels.shape[-1]}")
    parts = [pixels, *np.array_split(pixels, blocks, axis=-1)]
    return np.stack([part.mean(axis=-1) for part in parts], axis=-1)


def ratio_below(errors: ArrayLike, others: ArrayLike, limit: float) -> Outcome:
    """mean(errors) / mean(others) < limit with its whole bootstrap 95% interval; paired replicates (R,)."""
    _, high, text = ratio_interval(errors, others)
    return Outcome(text, f"ratio < {limit:g} at 95%", bool(high < limit))


def ratio_above(errors: ArrayLike, others: ArrayLike, limit: float) -> Outcome:
    """mean(errors) / mean(others) > limit with its whole bootstrap 95% interval; paired replicates (R,)."""
    low, _, text = ratio_interval(errors, others)
    return Outcome(text, f"ratio > {limit:g} at 95%", bool(low > limit))


def ratio_within(errors: ArrayLike, others: ArrayLike, low: float, high: float) -> Outcome:
    """mean(errors) / mean(others) in [low, high] with its whole bootstrap 95% interval; paired replicates (R,)."""
    least, most, text = ratio_interval(errors, others)
    return Outcome(text, f"ratio in [{low:g}, {high:g}] at 95%", bool(low <= least and most <= high))


def ratio_interval(errors: ArrayLike, others: ArrayLike) -> tuple[float, float, str]:
    """(low, high, text) of mean(errors) / mean(others), bootstrapped over paired replicates (R,), R >= 8.

    Raises Void for arms that are bitwise equal, ValueError for unequal or too few replicates.
    """
    a, b = np.asarray(errors, dtype=float), np.asarray(others, dtype=float)
    if a.shape != b.shape or a.ndim != 1 or a.size < 8:
        raise ValueError(f"a ratio needs at least 8 paired replicates, got shapes {a.shape} and {b.shape}")
    if np.array_equal(a, b):
        raise Void(
            f"both arms of a ratio are the same {a.size} numbers, {show(float(a[0]))}, ...: they compare a thing with "
            "itself. Choose a scene in which the arms differ, or leave the comparison out."
        )
    chosen = np.random.default_rng(STREAM).integers(a.size, size=(BOOTSTRAP, a.size))
    with np.errstate(divide="ignore", invalid="ignore"):
        low, high = np.quantile(a[chosen].mean(axis=1) / b[chosen].mean(axis=1), [0.025, 0.975])
        ratio = a.mean() / b.mean()
    return float(low), float(high), f"{ratio:.4g} (95% {low:.4g} to {high:.4g})"


def all_of(*outcomes: Outcome) -> Outcome:
    """Every one of the outcomes passes (use it for a counter-criterion with several conditions)."""
    measured = "; ".join(show(o.measured) for o in outcomes)
    return Outcome(measured, "; ".join(o.criterion for o in outcomes), all(bool(o.passed) for o in outcomes))


def show(measured: float | str) -> str:
    """A measured value as short text."""
    return measured if isinstance(measured, str) else f"{measured:.4g}"


def _log10(values: ArrayLike) -> NDArray[np.float64]:
    v = np.asarray(values, dtype=float)
    result = np.full(v.shape, np.nan)
    np.log10(v, out=result, where=v > 0)
    return result


def _bias(e: NDArray[np.float64], reference: float) -> tuple[float, float, str]:
    """Bias and its standard error of replicates e (R,), and both in words."""
    error = float(e.std(ddof=1) / np.sqrt(e.size)) if e.size > 1 else float("inf")
    bias = float(e.mean()) - reference
    size, z = abs(reference) or 1.0, bias / error if error > 0 else 0.0 if bias == 0 else float("inf")
    return bias, error, f"bias {bias / size:+.3%} (SE {error / size:.3%}, z = {z:.2f}, R = {e.size})"
