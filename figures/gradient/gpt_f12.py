"""GPT Fig. 12 and 8: what reconstruction makes of its inputs, and where differences have outliers.

The crop of the ajar map is reconstructed (L2) from every pairing of an image and differences, by path tracing or by
ReSTIR, at the rays of one frame with pair reuse.  The occluder row moves as in all real-time figures; its inset tells
what the differences repair, band by band, how large the largest errors of differences are, and what L2 and L1 add in
bias.  Differences are unbiased, so that variances over replicas are squared errors.
"""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.stats import bootstrap, kurtosis

from figures.claims import criteria
from figures.claims.figure import Arrays, Claim, Conditions, Figure, Setup
from figures.experiments.gradients import METHODS, SIDE, averaged, rendered, spread, temporal_only
from figures.experiments.references import reference
from figures.experiments.replicas import Interval, Window, compared, few, inside, placed, smaller, told, under
from figures.experiments.spectra import CLOSE, expected, explained, in_bands
from figures.report import style
from restir_ref.batch import Array
from restir_ref.metrics import ROW, band_powers
from restir_ref.poisson import ALPHA, cosine_power, l2
from restir_ref.poisson_l1 import l1

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture

ROW_VIEW, MAP_VIEW = "occluders row", "ajar map"
ARMS = {**METHODS, "temporal": temporal_only}
SHARES = {"with": 1, "after": 2, "path tracing": 4, "temporal": 3}
"""Images of each method that are averaged: about as many as cost one frame's rays."""

INPUTS = ("path tracing", "with")
"""Where image and differences come from; the image of ReSTIR is the better one without differences."""

HIGHEST = 99.9
"""Percentile of the errors of differences that stands for outliers."""


def chunks(preset: Any) -> Sequence[dict[str, Any]]:
    """One per view, method and block of replicas."""
    return [
        {"view": view, "method": method, "block": block}
        for view in (ROW_VIEW, MAP_VIEW)
        for method in ARMS
        for block in range(preset["blocks"])
    ]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """Image and differences, (replicas, n) each, and rays per pixel; as many more as are averaged."""
    method = chunk["method"]
    return rendered(chunk["view"], ARMS[method], preset["replicas"] * SHARES[method], rng)


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """All blocks by "view.method.name", rays once, and the row's reference."""
    found: dict[str, list[Array]] = {}
    for at, part in zip(chunks(preset), results, strict=True):
        for key, each in part.items():
            found.setdefault(f"{at['view']}.{at['method']}.{key}", []).append(each)
    named = {key: parts[0] if parts[0].ndim == 0 else np.concatenate(parts) for key, parts in found.items()}
    return named | {"reference": reference("occluders").mean}


def equal(a: Arrays, view: str, method: str, name: str) -> Array:
    """Means over images that cost about one frame with pair reuse, (R, ...) in the shape of the view."""
    images = averaged(a[f"{view}.{method}.{name}"], SHARES[method])
    shape = {"primal": (SIDE, SIDE), "dx": (SIDE, SIDE - 1), "dy": (SIDE - 1, SIDE)}[name]
    return images if view == ROW_VIEW else images.reshape(-1, *shape)


def dearer(a: Arrays, view: str, method: str) -> float:
    """Rays of the averaged images over those of one frame with pair reuse."""
    return float(a[f"{view}.{method}.rays"] * SHARES[method] / a[f"{view}.with.rays"])


# ---------------------------------------------------------------- the matrix of inputs


def best_image(a: Arrays, view: str) -> tuple[Array, float]:
    """The better image of ReSTIR without differences, and its rays over those of one frame with pair reuse."""
    each = [(equal(a, view, name, "primal"), dearer(a, view, name)) for name in ("after", "temporal")]
    return min(each, key=lambda found: float(found[0].var(axis=0).mean()) * found[1])


def matrix(a: Arrays) -> dict[tuple[str, str], Array]:
    """Variance of L2 by (image, differences), every replica; (R,)."""
    found = {}
    for image in INPUTS:
        primal = best_image(a, MAP_VIEW)[0] if image == "with" else equal(a, MAP_VIEW, image, "primal")
        for gradient in INPUTS:
            rebuilt = l2(primal, equal(a, MAP_VIEW, gradient, "dx"), equal(a, MAP_VIEW, gradient, "dy"))
            found[image, gradient] = spread([rebuilt.reshape(len(rebuilt), -1)])
    return found


def pairings(a: Arrays) -> list[Claim]:
    """Both from ReSTIR is best, and either alone is better than none."""
    none, gradient, image, both = matrix(a).values()
    return [
        smaller("GPT-F12", (both, none), 1, "both from ReSTIR / none", EACH),
        smaller("GPT-F12", (both, gradient), 1, "both / differences alone", EACH),
        smaller("GPT-F12", (both, image), 1, "both / image alone", EACH),
        smaller("GPT-F12", (gradient, none), 1, "differences alone / none", EACH),
        smaller("GPT-F12", (image, none), 1, "image alone / none", EACH),
        norms(a),
    ]


EACH = (
    "Each input has the rays of one frame with pair reuse, so that all pairings but none from ReSTIR, whose image and "
    "differences share their trees, cost two."
)


def norms(a: Arrays) -> Claim:
    """L1 against L2 of path tracing's own image and differences: squared distance from the mean of L2, bias and all."""
    inputs = [equal(a, MAP_VIEW, "path tracing", name) for name in ("primal", "dx", "dy")]
    mean = l2(*inputs).mean(axis=0)
    errors = [((norm(*inputs) - mean) ** 2).mean(axis=(-2, -1)) for norm in (l1, l2)]
    part = "L1 / L2, ajar map by path tracing, which is not among its scenes"
    return judged("GPT-C03", part, few(errors[0]), lambda: criteria.reported(criteria.ratio_interval(*errors)[2]))


# ---------------------------------------------------------------- the row


def rebuilt_row(a: Arrays, norm: Any) -> Array:
    """The row from the image and differences of pair reuse, (R, n)."""
    return np.asarray(norm(equal(a, ROW_VIEW, "with", "primal"), equal(a, ROW_VIEW, "with", "dx")))


def powers(images: Array) -> tuple[Array, Array]:
    """Power of the noise below and above alpha, of every replica; (R,) each."""
    R = len(images)
    return band_powers((images - images.mean(axis=0)) * np.sqrt(R / (R - 1)), ALPHA, ROW)


def noise_ratio(a: Arrays) -> float:
    """s_g / s_c: variance of a difference over that of a pixel."""
    dx, primal = (a[f"{ROW_VIEW}.with.{name}"] for name in ("dx", "primal"))
    return float(dx.var(axis=0).mean() / primal.var(axis=0).mean())


def predicted(a: Arrays) -> tuple[Array, Array, Array, Array]:
    """Power of the row's noise after reconstruction and that by GPT-P03 from measured spectra, below and above alpha.

    (R,) each: measured below and above, expected below and above.
    """
    image, dx, after = (
        each - each.mean(axis=0)
        for each in (a[f"{ROW_VIEW}.with.primal"], a[f"{ROW_VIEW}.with.dx"], rebuilt_row(a, l2))
    )
    return *in_bands(cosine_power(after, 1)), *in_bands(expected(image, dx))


def repaired(a: Arrays) -> list[Claim]:
    """Which frequencies of ReSTIR's image the differences repair, and what GPT-P03 expects at the measured spectra."""
    id_, s_g = "GPT-P06", noise_ratio(a)
    before, after = powers(a[f"{ROW_VIEW}.with.primal"]), powers(rebuilt_row(a, l2))
    found = predicted(a)
    by = "judged by its sentence" if s_g < LITTLE else "outside of its sentence, held against GPT-P03"
    claims = [Claim(id_, criteria.reported(f"{s_g:.3g}: {by}"), "noise of differences over that of pixels")]
    for k, (band, window) in enumerate(BANDS.items()):
        own, formula = (after[k], before[k]), (found[k], found[2 + k])
        parts = f"power after / before, {band} alpha", f"power after / by GPT-P03, {band} alpha"
        first = compared(id_, own, window, parts[0]) if s_g < LITTLE else told(id_, own, parts[0])
        second = told(id_, formula, parts[1]) if s_g < LITTLE else compared(id_, formula, inside(*CLOSE), parts[1])
        claims += [first, explained(second, formula)]
    return claims


BANDS: Mapping[str, Window] = MappingProxyType({"below": inside(0.8, 1.2), "above": under(0.5)})
"""What the sentence says of power after reconstruction over power before."""

LITTLE = 0.15
"""s_g / s_c up to which the sentence's own limits decide; beyond it nothing does."""


def judged(id_: str, part: str, why_not: str, outcome: Callable[[], criteria.Outcome]) -> Claim:
    """A claim of an outcome, unless there is a reason why it cannot be judged."""
    return Claim(id_, None, part, reason=why_not) if why_not else Claim(id_, outcome(), part)


def biases(a: Arrays) -> list[Claim]:
    """What L2 and L1 have as mean of the row, and of its bright less its dark half."""
    truth = a["reference"]
    halves = np.sign(truth - np.median(truth))
    l2_row, l1_row = (rebuilt_row(a, norm) for norm in (l2, l1))
    off = partial(criteria.reported, f"{l1_row.mean() / truth.mean() - 1:+.2%}")
    return [
        told_apart("L2, mean of the occluder row", l2_row.mean(axis=1), float(truth.mean())),
        told_apart(
            "L2, bright less dark half of the row", (l2_row * halves).mean(axis=1), float((truth * halves).mean())
        ),
        judged("GPT-C03", "bias of L1, mean of the occluder row", few(l2_row), off),
    ]


def told_apart(part: str, estimates: Array, truth: float) -> Claim:
    """Unbiased to EXACT, unless no bias is seen and one of that size could not be: then it is left open."""
    outcome = criteria.unbiased(estimates, truth, EXACT)
    error = float(estimates.std(ddof=1) / np.sqrt(len(estimates)))
    blind = error > EXACT * abs(truth) and abs(float(estimates.mean()) - truth) <= 4 * error
    open_ = f"Measured {outcome.measured}, asked {outcome.criterion}: too noisy to tell." if blind else ""
    return judged("GPT-C03", part, few(estimates) or open_, lambda: outcome)


EXACT = 0.005
"""The largest standard error, over the truth, that tells an unbiased estimate."""


def outliers(a: Arrays) -> list[Claim]:
    """Large errors of differences by pair reuse against those after ReSTIR, at equal samples."""
    ours, theirs = (abs(a[f"{ROW_VIEW}.{method}.dx"] - np.diff(a["reference"])) for method in ("with", "after"))
    theirs, part = theirs[: len(ours)], f"{HIGHEST}th percentile of the error of dx, with / after, equal samples"
    text = " and ".join(f"{kurtosis(each.ravel(), fisher=False):.0f}" for each in (ours, theirs))
    peaked = partial(criteria.reported, text)
    short = few(ours)
    tails = Claim("GPT-F08o", None, part, reason=short) if short else placed("GPT-F08o", tail(ours, theirs), LESS, part)
    return [
        tails,
        judged("GPT-F08o", "kurtosis of the error of dx, with and after", short, peaked),
        smaller("GPT-C05", ((ours**2).mean(axis=1), (theirs**2).mean(axis=1)), 1, "with / after, equal samples"),
    ]


LESS = under(0.7)
"""The ratio of outliers, with / after."""


def tail(ours: Array, theirs: Array) -> Interval:
    """(low, high, text) of the ratio of the highest percentiles, bootstrapped over replicas."""

    def ratio(mine: Array, others: Array) -> float:
        return float(np.percentile(ours[mine], HIGHEST) / np.percentile(theirs[others], HIGHEST))

    each = np.arange(len(ours))
    found = bootstrap((each, each), ratio, n_resamples=999, vectorized=False, method="percentile", rng=1)
    low, high = (float(end) for end in found.confidence_interval)
    return low, high, f"{ratio(each, each):.3g} (95% {low:.3g} to {high:.3g})"


def check(a: Arrays) -> list[Claim]:
    """Inputs of the map, bands, biases and outliers of the row."""
    return [*pairings(a), *repaired(a), *biases(a), *outliers(a)]


# ---------------------------------------------------------------- the picture


def draw(a: Arrays) -> "Picture":
    """Variance of L2 by its inputs; spectra of the row's noise; the tail of the errors of differences."""
    picture, axes = style.panels(1, 3, width=4.0, height=3.2)
    left, middle, right = axes[0]
    for k, error in enumerate(matrix(a).values()):
        left.bar(k, error.mean(), color=style.nth(k)["color"], hatch=style.HATCHES[k], edgecolor=style.PAPER)
        left.text(k, error.mean(), f"{error.mean():.2g}", ha="center", va="bottom")
    left.set_xticks(range(4), ["neither", "dx, dy", "image", "both"])
    left.set(xlabel="what ReSTIR gives to L2", ylabel="variance ((radiance x radian)$^2$)", title="ajar map, L2")
    left.grid(axis="x", visible=False)
    spectra(middle, a)
    for method in ("with", "after"):
        errors = np.sort(abs(a[f"{ROW_VIEW}.{method}.dx"] - np.diff(a["reference"])).ravel())[::-1]
        share = np.arange(1, len(errors) + 1) / len(errors)
        right.loglog(errors, share, **style.look(method, marker=""))
    right.axhline(1 - HIGHEST / 100, color=style.GREY, linewidth=0.8, marker="", label=f"{HIGHEST}th percentile")
    right.set(xlabel="|error of dx| (radiance)", ylabel="share of differences above", title="occluder row: outliers")
    right.legend()
    return picture


def spectra(axis: Any, a: Arrays) -> None:
    """Power of the row's noise before and after reconstruction."""
    k = np.fft.rfftfreq(a["reference"].size)[1:]
    for name, images in (("primal", a[f"{ROW_VIEW}.with.primal"]), ("Poisson L2", rebuilt_row(a, l2))):
        power = (abs(np.fft.rfft(images - images.mean(axis=0))[:, 1:]) ** 2).mean(axis=0) / images.shape[1]
        axis.loglog(k, power, **style.look(name, marker=""))
    axis.axvline(ALPHA / (2 * np.pi), color=style.GREY, linewidth=0.8, marker="", label="alpha")
    axis.set(xlabel="frequency (cycles per pixel)", ylabel="power of the noise (radiance$^2$)", title="occluder row")
    axis.legend()


FIGURE = Figure(
    id="GPT-F12",
    title="What reconstruction makes of its inputs",
    world="flatland2d",
    source="[GPT Fig. 8, 12; 2.1, 4.1]",
    claims=("GPT-F12", "GPT-P06", "GPT-C03", "GPT-F08o", "GPT-C05"),
    conditions=(
        Conditions(
            ("GPT-F12",),
            "[GPT Fig. 12]",
            Setup("real time", "moving", "all", "Veach-Ajar; the caption is missing"),
            Setup("real time", "still", "all", "a map at the slit of the door (FS3)"),
            "A fluence map has no camera to move.  Light that its own rays meet is left out: it would hide all else.",
        ),
        Conditions(
            ("GPT-P06", "GPT-C03", "GPT-F08o", "GPT-C05"),
            "[GPT 2.1, 4.1, 5.1]",
            Setup("real time", "moving", "all", "not named"),
            Setup("real time", "moving", "all", "inset of the occluder row (FS5)"),
        ),
    ),
    arm="method",
    presets={"quick": {"replicas": 2, "blocks": 1}, "paper": {"replicas": 32, "blocks": 4}},
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)
