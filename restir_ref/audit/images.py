"""Frames against a reference: is the image biased, where, by how much, or is it too early to tell?

All that most people have.  Frames are independent renderings of one view.  What is tested is the mean over frames in
every *unit*: pixels, tiles, rows, columns, edges, the whole image; Welch's t with the noise of both sides, corrected
for skewness as noise of renderers needs [Hall 1992], with one error probability for all units together.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from math import sqrt
from types import MappingProxyType

import numpy as np

from restir_ref.batch import Array, ratio

FALSE_ALARM = 1e-3
"""Probability that an unbiased image is called biased, over all units and families together."""

MARGIN = 2
"""So much is left for what is approximate: tails of noise that are further from normal than their skewness says."""

TILE = 8
"""Side of a tile."""

EPS = 0.02
"""An image is unbiased to EPS if every tile's interval lies within, relative to the tile."""

INTERVAL = 3.3
"""Half a width of an interval, in standard errors: 99.9 %."""

FEWEST = 16
"""Fewer frames say nothing about their own noise."""


class BadImages(ValueError):
    """Images that cannot be compared; the message says which and what to do."""


# ---------------------------------------------------------------- units

Units = Mapping[str, Array]
"""Families of units: number of the unit of every pixel (H, W), -1 for pixels in none."""


def units(reference: Array) -> Units:
    """The families that are averaged over, by name; reference (C, H, W)."""
    H, W = reference.shape[1:]
    y, x = np.mgrid[:H, :W]
    return MappingProxyType(
        {
            "tile": tiles(y, x, TILE, 0),
            "tile between": tiles(y, x, TILE, TILE // 2),
            "small tile": tiles(y, x, TILE // 2, 0),
            "row": y,
            "column": x,
            "edges": edges(reference),
            "whole image": np.zeros((H, W), dtype=int),
        }
    )


def tiles(y: Array, x: Array, side: int, by: int) -> Array:
    """The number of the tile of every pixel, the first one moved back by some pixels; (H, W)."""
    across = -(-(int(x.max()) + 1 + by) // side)
    return np.asarray((y + by) // side * across + (x + by) // side)


STEPS = {"row step": "row", "column step": "column"}
"""Families of differences between a unit and the next one: what one pixel loses its neighbour gains."""


def steps(families: Units) -> dict[str, str]:
    """The steps that there are: images of one row have none between rows."""
    return {step: of for step, of in STEPS.items() if families[of].max() > 0}


def edges(reference: Array) -> Array:
    """0 for the tenth of the pixels between the most different neighbours, 1 elsewhere; (H, W).

    Hazard: a pixel's own value must not decide, or a reference with noise would put its outliers into one class.
    """
    padded = np.pad(reference.mean(axis=0), 1, mode="reflect")
    pairs = [(padded[1:-1, 2:], padded[1:-1, :-2]), (padded[2:, 1:-1], padded[:-2, 1:-1])]
    contrast = np.max([ratio(abs(a - b), np.maximum(abs(a) + abs(b), 1e-300)) for a, b in pairs], axis=0)
    return np.asarray(np.where((contrast >= np.quantile(contrast, 0.9)) & (contrast > 0), 0, 1))


def averaged(image: Array, unit: Array) -> Array:
    """The mean of an image (C, H, W) over every unit, (C, units)."""
    flat, count = unit.ravel(), np.bincount(unit.ravel())
    return np.stack([np.bincount(flat, channel.ravel()) / np.maximum(count, 1) for channel in image])


def place(family: str, number: int, shape: tuple[int, ...]) -> str:
    """A unit in words, for images of `shape` (C, H, W)."""
    W = shape[-1]
    if family == "pixel":
        return f"pixel (row {number // W}, column {number % W})"
    if family in SIDES:
        side, by = SIDES[family]
        across = -(-(W + by) // side)
        top, left = number // across * side - by, number % across * side - by
        bottom, right = top + side, left + side
        rows = f"rows {max(top, 0)} to {min(bottom, shape[1]) - 1}"
        return f"tile of {rows}, columns {max(left, 0)} to {min(right, W) - 1}"
    if family in STEPS:
        return f"the step from {STEPS[family]} {number} to {STEPS[family]} {number + 1}"
    if family == "edges":
        return "pixels beside edges" if number == 0 else "pixels away from edges"
    return family if family == "whole image" else f"{family} {number}"


SIDES = {"tile": (TILE, 0), "tile between": (TILE, TILE // 2), "small tile": (TILE // 2, 0)}
"""The sides of tiles, and by how much they are moved."""


# ---------------------------------------------------------------- moments of frames


@dataclass
class Moments:
    """Sums over frames of d, d^2, d^3, d the difference from the reference."""

    frames: int = 0
    sums: list[Array] = field(default_factory=list)

    def add(self, d: Array) -> None:
        """Another frame, in any units."""
        terms = [d, d**2, d**3]
        self.sums = [a + b for a, b in zip(self.sums, terms, strict=True)] if self.sums else terms
        self.frames += 1

    @property
    def mean(self) -> Array:
        """Mean of d."""
        return np.asarray(self.sums[0] / self.frames)

    @property
    def variance(self) -> Array:
        """Variance of d between frames."""
        n = self.frames
        return np.asarray(np.maximum(self.sums[1] / n - self.mean**2, 0) * n / max(n - 1, 1))

    @property
    def skewness(self) -> Array:
        """E[(d - mean)^3] / sd^3, 0 without noise."""
        m, n = self.mean, self.frames
        third = self.sums[2] / n - 3 * m * self.sums[1] / n + 2 * m**3
        noisy = self.variance > 1e-9 * (self.sums[1] / n)  # what is left by rounding has no shape
        return np.asarray(np.where(noisy, ratio(third, np.where(noisy, self.variance, 1) ** 1.5), 0))


# ---------------------------------------------------------------- tests


@dataclass(frozen=True, eq=False)
class Tested:
    """Units of one family: bias and its standard error (C, units), z (C, units), and the z that is too much."""

    family: str
    bias: Array
    error: Array
    z: Array
    limit: float
    light: Array

    @property
    def found(self) -> Array:
        """Channel and unit of those that are biased, the surest first, (2, k)."""
        over = np.argwhere(abs(self.z) > self.limit)
        return np.asarray(over[np.argsort(-abs(self.z[tuple(over.T)]))].T)


def tested(family: str, frames: Moments, ref_error: Array, light: Array, level: float, inflation: float) -> Tested:
    """Welch's t of every unit, corrected for skewness; ref_error (C, units) is the reference's standard error.

    z is the number of standard deviations of a normal distribution that is as improbable.
    """
    from scipy.stats import norm, t  # noqa: PLC0415

    n = frames.frames
    own = frames.variance / n * inflation
    if family == "pixel":
        own = np.maximum(own, pooled(own, light))
    error = np.sqrt(own + ref_error**2)
    q = ratio(frames.mean, error)
    g = frames.skewness / sqrt(n) * ratio(own, error**2) ** 1.5
    T = np.clip(q + g * q**2 / 3 + g**2 * q**3 / 27 + g / 6, -1e6, 1e6)
    freedom = np.maximum(n - 1, 1) * ratio(error**2, own) ** 2
    freedom = np.where(own > 0, np.minimum(freedom, 1e9), 1e9)
    z = -norm.ppf(np.maximum(t.sf(abs(T), freedom), 1e-300)) * np.sign(T)
    exact = (error == 0) & (abs(frames.mean) > 1e-6 * np.maximum(light, light.mean()))
    z = np.where(exact, np.sign(frames.mean) * 37.0, np.where(error == 0, 0.0, z))
    count = z.size
    limit = float(-norm.ppf(-np.expm1(np.log1p(-level) / count) / 2))
    return Tested(family, frames.mean, error, np.asarray(z), limit, light)


def pooled(own: Array, light: Array) -> Array:
    """The squared relative error of 3 x 3 pixels, times the squared light of each; (C, H, W).

    A pixel without fireflies so far is as noisy as those around it.
    """
    relative = ratio(own, np.maximum(light, light.mean() / 100) ** 2)
    wide = np.pad(relative, ((0, 0), (1, 1), (1, 1)), mode="edge")
    H, W = own.shape[1:]
    nine = [wide[:, i : i + H, j : j + W] for i in range(3) for j in range(3)]
    return np.asarray(np.mean(nine, axis=0) * np.maximum(light, light.mean() / 100) ** 2)


# ---------------------------------------------------------------- the report


@dataclass(frozen=True, eq=False)
class ImageReport:
    """Whether frames are biased against a reference, and where.

    families     what was tested, pixels first
    scattered    z of all pixels together: that their biases repeat in two halves of the frames
    frames, eps  how many there were, and to what an image has to be right
    correlation  between one frame and the next, of whole tiles; 0 if frames are independent
    half_width   the widest 99.9 % interval of a tile with light, relative to it
    bad          the first pixel that is not finite, in words
    """

    shape: tuple[int, ...]
    families: Sequence[Tested]
    scattered: float
    frames: int
    eps: float
    correlation: float
    half_width: float
    bad: str = ""

    @property
    def biased(self) -> bool:
        """Some unit is off, by more than chance."""
        return bool(self.bad) or self.scattered > SCATTERED or any(each.found.size for each in self.families)

    @property
    def unbiased(self) -> bool:
        """No unit is off, and every tile is known well enough."""
        return not self.biased and self.half_width <= self.eps

    @property
    def frames_needed(self) -> int:
        """So many frames would make the widest interval as narrow as eps."""
        return int(np.ceil(self.frames * (self.half_width / self.eps) ** 2))

    @property
    def answer(self) -> str:
        """BIASED, UNBIASED or UNDECIDED, with numbers, on one line."""
        if self.bad:
            return f"BIASED: {self.bad}"
        if self.biased:
            return f"BIASED: {self._worst()}"
        if self.unbiased:
            return f"UNBIASED to {self.eps:.1%} in every tile of {TILE} x {TILE} pixels ({self.frames} frames)"
        return (
            f"UNDECIDED: nothing is off by more than noise, but tiles are known to {self.half_width:.1%} only; to "
            f"decide to {self.eps:.1%} some {self.frames_needed} frames are needed, {self.frames} are there"
        )

    def _worst(self) -> str:
        found = [each for each in self.families if each.found.size]
        if not found:
            return (
                f"single pixels, scattered over the image (their biases repeat in both halves of the frames, "
                f"z = {self.scattered:.1f}); no tile, row or column by itself"
            )
        best = max(found, key=lambda each: abs(each.z[tuple(each.found[:, 0])]) / each.limit)
        return _in_words(best, 0, self.shape)

    def __str__(self) -> str:
        return "\n".join(_lines(self))


SCATTERED = 4.2
"""From here on pixels are biased together."""


def _in_words(each: Tested, k: int, shape: tuple[int, ...]) -> str:
    """One biased unit: where, by how much, between what."""
    channel, number = (int(i) for i in each.found[:, k])
    light = float(each.light.reshape(each.z.shape)[channel, number])
    bias, error = (float(a[channel, number]) for a in (each.bias, each.error))
    scale = light if light > 0 else float("nan")
    where = place(each.family, number, shape) + (f", channel {channel}" if shape[0] > 1 else "")
    low, high = (100 * (bias + sign * INTERVAL * error) / scale for sign in (-1, 1))
    return (
        f"{where} is off by {100 * bias / scale:+.2f} % (99.9 %: {low:+.2f} to {high:+.2f} %, "
        f"z = {each.z[channel, number]:.1f})"
    )


def _lines(report: ImageReport) -> Iterator[str]:
    yield report.answer
    if report.biased and not report.bad:
        yield LOOK
    for each in report.families:
        count = each.found.shape[1] if each.found.size else 0
        whole = next(f for f in report.families if f.family == "whole image")
        if each is whole:
            channel = int(abs(each.z[:, 0]).argmax())
            mean, error = (float(a[channel, 0]) / float(each.light[channel, 0]) for a in (each.bias, each.error))
            yield f"  {'whole image':12} {100 * mean:+.3f} % +- {100 * INTERVAL * error:.3f} %"
        else:
            units = f"{count} of {each.z.size} biased (|z| > {each.limit:.1f}), largest |z| {abs(each.z).max():.1f}"
            yield f"  {each.family:12} {units}"
        if each.family != "pixel" and each is not whole:
            yield from (f"    {_in_words(each, k, report.shape)}" for k in range(min(count, 3)))
    if report.correlation > CORRELATED:
        yield (
            f"frames are not independent (correlation {report.correlation:.2f} from one to the next): errors were "
            "widened. Start every frame anew, with another seed and no history, or keep every k-th only."
        )


LOOK = "where to go on: switch reuse off first, then compare step by step (ladder); docs/symptoms.md"
CORRELATED = 0.1
"""Correlations that are not larger are chance."""


# ---------------------------------------------------------------- doing it


def audit_images(
    frames: Iterable[Array], reference: Array | Sequence[Array], *, eps: float = EPS, reference_error: float = 0.0
) -> ImageReport:
    """Whether the mean of frames, each (H, W) or (H, W, C), is the reference.

    The reference is one image, with a relative standard error if it has noise of its own, or several renderings of it,
    (R, H, W) or (R, H, W, C) as a list, whose noise is measured.  Raises BadImages for shapes that differ, for fewer
    than 16 frames, and for a reference that is not finite.

    >>> import numpy as np
    >>> from restir_ref.audit import audit_images
    >>> rng, reference = np.random.default_rng(1), np.ones((8, 8))
    >>> dark = np.where(np.arange(8) < 2, 0.9, 1.0)  # the two columns at the left
    >>> frames = [reference * dark + rng.normal(0, 0.2, (8, 8)) for _ in range(64)]
    >>> print(str(audit_images(frames, reference)).splitlines()[0])
    BIASED: column 0 is off by -9.96 % (99.9 %: -13.46 to -6.47 %, z = -7.5)
    """
    images = [planes(each) for each in (reference if isinstance(reference, Sequence) else [reference])]
    _check_reference(images)
    truth = np.mean(images, axis=0)
    families = units(truth)
    if len(images) > 1:
        each = [{"pixel": image, **means_of(image, families)} for image in images]
        noise = {name: np.std([one[name] for one in each], axis=0, ddof=1) / sqrt(len(each)) for name in each[0]}
    else:
        noise = stated(reference_error, truth, families)
    return _compared(frames, truth, families, noise, eps)


def means_of(image: Array, families: Units) -> dict[str, Array]:
    """The means over all units, and their steps; (C, units) each."""
    means = {name: averaged(image, unit) for name, unit in families.items()}
    return {**means, **{step: np.diff(means[of], axis=1) for step, of in steps(families).items()}}


def stated(relative: float, truth: Array, families: Units) -> dict[str, Array]:
    """The standard errors of a reference whose pixels have independent errors, relative to each."""
    error = {"pixel": relative * abs(truth)}
    for name, unit in families.items():
        count = np.maximum(np.bincount(unit.ravel()), 1)
        error[name] = np.sqrt(averaged(error["pixel"] ** 2, unit) / count)
    between = {step: np.hypot(error[of][:, 1:], error[of][:, :-1]) for step, of in steps(families).items()}
    return {**error, **between}


def planes(image: Array) -> Array:
    """(H, W) or (H, W, C) as (C, H, W), float64; raises BadImages for other shapes."""
    values = np.asarray(image, dtype=float)
    if values.ndim == 2:
        return values[None]
    if values.ndim != 3 or values.shape[-1] > 4:
        raise BadImages(f"an image has shape {values.shape}: give (rows, columns) or (rows, columns, 1 to 4 channels).")
    return np.moveaxis(values, -1, 0)


def _check_reference(images: Sequence[Array]) -> None:
    if not images or any(each.shape != images[0].shape for each in images):
        raise BadImages("the reference images have different shapes, or there are none: give renderings of one view.")
    if not all(np.isfinite(each).all() for each in images):
        raise BadImages("the reference has pixels that are not finite: mend it first, everything is compared with it.")
    if not any((each != 0).any() for each in images):
        raise BadImages("the reference is black: it shows nothing to compare with.")


def _compared(
    frames: Iterable[Array], truth: Array, families: Units, noise: Mapping[str, Array], eps: float
) -> ImageReport:
    """All frames, one after the other."""
    sums = {name: Moments() for name in ("pixel", *families, *steps(families))}
    halves = [np.zeros(truth.shape), np.zeros(truth.shape)]
    in_tiles: list[Array] = []
    count = 0
    for count, frame in enumerate(frames, 1):
        if np.shape(frame) != _shape_of(truth, frame):
            raise BadImages(
                f"frame {count} has shape {np.shape(frame)}, the reference {_shape_of(truth, truth)}: give renderings "
                "of one view."
            )
        d = planes(frame) - truth
        if not np.isfinite(d).all():
            return _not_finite(d, truth, count, eps)
        sums["pixel"].add(d)
        for name, values in means_of(d, families).items():
            sums[name].add(values)
        in_tiles.append(averaged(d, families["tile"]).astype(np.float32))
        halves[count % 2] += d
    if count < FEWEST:
        raise BadImages(f"there are {count} frames, but at least {FEWEST} are needed to know their noise.")
    r = correlation(np.array(in_tiles))
    inflation = (1 + r) / (1 - r) if r > CORRELATED else 1.0
    light = {"pixel": truth, **{name: averaged(truth, unit) for name, unit in families.items()}}
    light |= {step: np.maximum(light[of][:, 1:], light[of][:, :-1]) for step, of in steps(families).items()}
    level = FALSE_ALARM / (MARGIN * (len(sums) + 1))
    results = []
    for name, moments in sums.items():
        error = noise[name].reshape(light[name].shape)
        one = tested(name, moments, error, light[name], level, inflation)
        results.append(_flat(one) if name == "pixel" else one)
    spread = scattered(halves, count, sums["pixel"], noise["pixel"].reshape(truth.shape), light["pixel"], inflation)
    return ImageReport(truth.shape, results, spread, count, eps, r, _half_width(results), "")


def _shape_of(truth: Array, frame: Array) -> tuple[int, ...]:
    """The shape that a frame must have."""
    C, H, W = truth.shape
    return (H, W) if np.ndim(frame) == 2 and C == 1 else (H, W, C)


def _not_finite(d: Array, truth: Array, count: int, eps: float) -> ImageReport:
    """The finding that ends everything: NaN spreads to whatever reuses it."""
    channel, row, column = (int(k) for k in np.argwhere(~np.isfinite(d))[0])
    said = (
        f"frame {count} is {d[channel, row, column]:g} in pixel (row {row}, column {column}), the first of "
        f"{int((~np.isfinite(d)).sum())}: 0/0 of a null sample, or an overflow; with reuse it spreads and stays"
    )
    return ImageReport(truth.shape, (), 0.0, count, eps, 0.0, float("inf"), said)


def _flat(one: Tested) -> Tested:
    """Pixels as one row of units per channel."""
    C = len(one.z)
    arrays = {name: getattr(one, name).reshape(C, -1) for name in ("bias", "error", "z", "light")}
    return Tested(one.family, limit=one.limit, **arrays)


def correlation(tiles: Array) -> float:
    """Correlation of a frame's tiles with those of the next frame, tiles (F, C, tiles) as differences."""
    centred = tiles - tiles.mean(axis=0)
    both, alone = float((centred[1:] * centred[:-1]).sum()), float((centred**2).sum())
    return max(0.0, min(both / alone if alone > 0 else 0.0, 0.98))


def scattered(halves: Sequence[Array], n: int, all_frames: Moments, noise: Array, light: Array, by: float) -> float:
    """z of sum_pixels d_a d_b: biases of pixels repeat in two halves of the frames, noise does not.

    The reference's own noise is in both halves, and is subtracted.
    """
    if by > 1:
        return 0.0  # halves of correlated frames are not independent
    a, b = halves[0] / (n // 2), halves[1] / (n - n // 2)
    variance = all_frames.variance / (n / 2)
    scale = np.maximum(np.maximum(variance, pooled(variance, light)), 1e-12 * light.mean() ** 2)
    terms = (a * b - noise**2) / (scale + noise**2)
    clipped = np.clip(terms, -9, 9)
    spread = float(np.sqrt((clipped**2).sum()))
    return float(clipped.sum() / spread) if spread > 0 else 0.0


def _half_width(results: Sequence[Tested]) -> float:
    """The widest 99.9 % interval of a tile, relative to it; tiles with little light are left out."""
    tile = next(each for each in results if each.family == "tile")
    lit = tile.light > tile.light.mean() / 100
    return float(INTERVAL * (tile.error[lit] / tile.light[lit]).max())


# ---------------------------------------------------------------- the ladder


@dataclass(frozen=True)
class Ladder:
    """Steps of a renderer, from the simplest on, each with its report."""

    steps: Mapping[str, ImageReport]

    @property
    def first_wrong(self) -> str:
        """The first biased step, "" if none is."""
        return next((name for name, report in self.steps.items() if report.biased), "")

    def __str__(self) -> str:
        undecided = [name for name, report in self.steps.items() if not (report.biased or report.unbiased)]
        if self.first_wrong:
            before = [name for name in self.steps if name != self.first_wrong][: [*self.steps].index(self.first_wrong)]
            right = (
                f"; {', '.join(before)} show nothing" if before else ", the first of all: look at it before any reuse"
            )
            head = f"the first wrong step is {self.first_wrong!r}{right}"
        else:
            head = f"no step is biased{'; undecided: ' + ', '.join(undecided) if undecided else ''}"
        return "\n".join([head, *(f"  {name}: {report.answer}" for name, report in self.steps.items())])


def audit_ladder(
    steps: Mapping[str, Iterable[Array]], reference: Array | Sequence[Array], *, eps: float = EPS, error: float = 0.0
) -> Ladder:
    """Every step against the reference: initial samples only, with temporal reuse, with spatial reuse, ...

    Frames of steps and errors as in `audit_images`, which raises BadImages.

    >>> import numpy as np
    >>> from restir_ref.audit import audit_ladder
    >>> rng, reference = np.random.default_rng(1), np.ones((8, 8))
    >>> steps = {
    ...     name: [level * reference + rng.normal(0, 0.1, (8, 8)) for _ in range(64)]
    ...     for name, level in (("new samples", 1.0), ("temporal", 1.0), ("spatial", 0.97))
    ... }
    >>> print(str(audit_ladder(steps, reference)).splitlines()[0])
    the first wrong step is 'spatial'; new samples, temporal show nothing
    """
    return Ladder(
        {name: audit_images(frames, reference, eps=eps, reference_error=error) for name, frames in steps.items()}
    )


Decode = Callable[[Array], Array]
"""From what is stored in a picture to linear light."""
