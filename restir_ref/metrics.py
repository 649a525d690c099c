"""Errors of an image against its reference, and how they are spread over it.

Pixels come last, leading axes (replicas, frames) are kept.  Where neighbourhoods or frequencies matter,
`axes` names the pixel axes: ROW for (..., n), MAP for (..., rows, columns).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import prod, tau

import numpy as np

from restir_ref.batch import Array, ratio, total

SMALL = 0.01
"""What keeps dark pixels from dividing by zero: a hundredth of the mean, or of one."""

ROW = (-1,)
MAP = (-2, -1)
Axes = tuple[int, ...]

REPLICAS = 64
"""The fewest replicas of which bias and variance are told apart."""


def mape(image: Array, reference: Array, axes: Axes = ROW) -> Array:
    """mean |I - R| / (.01 mean R + R): free of the images' scale; (..., pixels) -> (...).  [GRIS 9.3, footnote 13]

    >>> import numpy as np
    >>> from restir_ref.metrics import mape
    >>> reference = np.array([1.0, 2.0, 3.0])
    >>> mape(1.1 * reference, reference).round(3)  # a little below .1: the floor
    np.float64(0.099)
    """
    return np.asarray((abs(image - reference) / (SMALL * _mean(reference, axes) + reference)).mean(axis=axes))


def mape_with_floor(image: Array, reference: Array, axes: Axes = ROW) -> Array:
    """mean |I - R| / (R + .01): depends on the images' scale; (..., pixels) -> (...).  [DDGIR 4]"""
    return np.asarray((abs(image - reference) / (reference + SMALL)).mean(axis=axes))


def rel_mse(image: Array, reference: Array, axes: Axes = ROW) -> Array:
    """mean (I - R)^2 / (R^2 + (.01 mean R)^2); (..., pixels) -> (...).

    >>> import numpy as np
    >>> from restir_ref.metrics import rel_mse
    >>> reference = np.array([1.0, 2.0, 3.0])
    >>> rel_mse(1.1 * reference, reference).round(4)
    np.float64(0.01)
    """
    scale2 = reference**2 + (SMALL * _mean(reference, axes)) ** 2
    return np.asarray(((image - reference) ** 2 / scale2).mean(axis=axes))


def rmse(image: Array, reference: Array, axes: Axes = ROW) -> Array:
    """sqrt(mean (I - R)^2); (..., pixels) -> (...).

    >>> import numpy as np
    >>> from restir_ref.metrics import rmse
    >>> rmse(np.array([1.0, 2.0, 3.0]), np.array([1.0, 2.0, 6.0])).round(3)
    np.float64(1.732)
    """
    return np.asarray(np.sqrt(((image - reference) ** 2).mean(axis=axes)))


def _mean(reference: Array, axes: Axes) -> Array:
    """The mean of every reference of its own, pixel axes kept."""
    return np.asarray(reference.mean(axis=axes, keepdims=True))


# ---------------------------------------------------------------- many images of the same


def rmse_over_images(images: Array, reference: Array) -> Array:
    """mean_i sqrt(sum_m (I_mi - R_i)^2 / K) over K images; (..., K, n) -> (...).  [MCMC 6.1]"""
    # erratum: the prose calls it an average difference; the formula is a root mean square.
    return np.asarray(np.sqrt(((images - reference) ** 2).mean(axis=-2)).mean(axis=-1))


@dataclass(frozen=True)
class Split:
    """What the mean squared error of every pixel (..., n) is made of: mean (I - R)^2 = bias2 + variance."""

    bias2: Array
    variance: Array


def bias_and_variance(images: Array, reference: Array) -> Split:
    """(mean_m I - R)^2 - s^2 / K and s^2 = sum_m (I_m - mean I)^2 / (K - 1), both unbiased; (..., K, n) -> (..., n).

    s^2 / K is the squared standard error of the mean, which the square of a measured bias contains;
    without a bias, bias2 is as often negative.  Raises ValueError for fewer than 64 images.

    >>> import numpy as np
    >>> from restir_ref.metrics import bias_and_variance
    >>> images = 2.1 + np.random.default_rng(1).normal(0, 0.5, (1000, 8))
    >>> bias_and_variance(images, np.full(8, 2.0)).variance.round(1)
    array([0.2, 0.3, 0.2, 0.3, 0.2, 0.2, 0.3, 0.2])
    """
    K = images.shape[-2]
    if K < REPLICAS:
        raise ValueError(
            f"bias and variance are told apart over at least {REPLICAS} replicas, but here are {K}: "
            f"take more replicas, of fewer samples each."
        )
    variance = images.var(axis=-2, ddof=1)
    return Split(np.asarray((images.mean(axis=-2) - reference) ** 2 - variance / K), variance)


def box_covariance(images: Array, reference: Array, radius: int = 8, axes: Axes = ROW) -> Array:
    """mean_i mean_(j in box of i, j != i) c_ij / (mean R)^2 over K images; (..., K, pixels) -> (...).  [MCMC 6.2]

    c_ij = sum_m (I_mi - mean I_i)(I_mj - mean I_j) / (K - 1); boxes end where the image ends.
    Raises ValueError for a single image.

    >>> import numpy as np
    >>> from restir_ref.metrics import box_covariance
    >>> images = 1 + np.repeat(np.random.default_rng(1).normal(0, 0.1, (1000, 32)), 2, axis=-1)  # pixels err in pairs
    >>> box_covariance(images, np.ones(64), radius=1).mean().round(4)
    np.float64(0.005)
    """
    # erratum: [MCMC 6.2] calls it relative, but prints no division, and does not say that j = i is left out,
    # without which it holds the variance.
    over = -1 - len(axes)
    K = images.shape[over]
    if K < 2:
        raise ValueError("a covariance is one over images, but here is 1: pass at least 2 replicas.")
    d = images - images.mean(axis=over, keepdims=True)
    c = (d * (_box_sum(d, radius, axes) - d)).sum(axis=over) / (K - 1)
    others = _box_sum(np.ones_like(c), radius, axes) - 1
    return np.asarray(ratio(c, others).mean(axis=axes) / reference.mean(axis=axes) ** 2)


def _box_sum(values: Array, radius: int, axes: Axes) -> Array:
    """Sum over the box around every pixel, clipped to the image."""
    for axis in axes:
        edges = [(radius, radius) if k == axis % values.ndim else (0, 0) for k in range(values.ndim)]
        windows = np.lib.stride_tricks.sliding_window_view(np.pad(values, edges), 2 * radius + 1, axis=axis)
        values = windows.sum(axis=-1)
    return values


# ---------------------------------------------------------------- spectra


def power_spectrum(errors: Array, axes: Axes = ROW) -> Array:
    """S(k) = |sum_x e(x) exp(-2 pi i k.x)|^2 / n, in the order of `numpy.fft`.

    Its mean is that of e^2, and white noise is flat.

    >>> import numpy as np
    >>> from restir_ref.metrics import power_spectrum
    >>> noise = np.random.default_rng(1).normal(0, 2, (500, 64))
    >>> power_spectrum(noise).mean().round(1)
    np.float64(3.9)
    """
    n = prod(errors.shape[axis] for axis in axes)
    return np.asarray(abs(np.fft.fftn(errors, axes=axes)) ** 2 / n)


def low_frequency_ratio(errors: Array, axes: Axes = ROW) -> Array:
    """mean_(0 < |k| <= 1/8) S / mean_(k != 0) S: 1 for white, less for blue, more for red noise; -> (...).  [MCMC 6.3]

    |k| is radial, in cycles per pixel, of which one half is the most along an axis; k = 0 is in neither mean.
    """
    radial = np.sqrt(total([k**2 for k in _frequencies(errors, axes)]))
    low, high = _means(power_spectrum(errors, axes), axes, (radial > 0) & (radial <= 1 / 8), radial > 0)
    return ratio(low, high)


def band_powers(errors: Array, alpha: float, axes: Axes = ROW) -> tuple[Array, Array]:
    """mean S where D(k) < alpha^2, and elsewhere, each (...); D = sum_axes 2 - 2 cos 2 pi k.  [GPT 2.1]

    D is the spectrum of finite differences, so below alpha the screened Poisson equation keeps the
    primal image, above it the gradients.  White noise has mean e^2 in both bands; k = 0 is in the low one.
    """
    D = total([2 - 2 * np.cos(tau * k) for k in _frequencies(errors, axes)])
    kept = np.sqrt(D) < alpha
    low, high = _means(power_spectrum(errors, axes), axes, kept, ~kept)
    return low, high


def _frequencies(errors: Array, axes: Axes) -> list[Array]:
    """Frequencies along each of the axes, in cycles per pixel, that broadcast to the spectrum of one image."""
    return [*np.meshgrid(*(np.fft.fftfreq(errors.shape[axis]) for axis in axes), indexing="ij", sparse=True)]


def _means(S: Array, axes: Axes, *bands: Array) -> list[Array]:
    """Mean of the spectrum over each band, (...).  Raises ValueError for an empty one."""
    if not all(band.any() for band in bands):
        raise ValueError(
            f"a band of frequencies is empty in an image of {' x '.join(str(S.shape[axis]) for axis in axes)} pixels: "
            f"take a larger image, or another alpha."
        )
    return [np.asarray(S[..., band].mean(axis=-1)) for band in bands]


# ---------------------------------------------------------------- structure


def correlation(a: Array, b: Array) -> Array:
    """sum a b / sqrt(sum a^2 sum b^2) of errors, whose mean is 0 where nothing is biased; in [-1, 1]."""
    return _correlation([(a, b)])


def _correlation(pairs: Sequence[tuple[Array, Array]]) -> Array:
    """The same, with sums over all pairs of arrays."""
    ab, a2, b2 = (total([*terms]) for terms in zip(*map(_sums, pairs), strict=True))
    return ratio(ab, np.sqrt(a2 * b2))


def _sums(pair: tuple[Array, Array]) -> tuple[Array, Array, Array]:
    """sum a b, sum a^2, sum b^2."""
    a, b = pair
    return (a * b).sum(), (a**2).sum(), (b**2).sum()


def neighbour_correlation(errors: Array, reach: int = 8, axes: Axes = ROW) -> Array:
    """Correlation of e(x) and e(x + r) for r = 1 .. reach, over all x and all images; (..., pixels) -> (reach,).

    In a map, x + r is r pixels away along either axis; along one of them with that axis alone.
    Raises ValueError for a reach that leaves the image.
    """
    n = min(errors.shape[axis] for axis in axes)
    if not 0 < reach < n:
        raise ValueError(f"the reach must be 1 .. {n - 1} pixels in an image of {n}, but is {reach}.")
    along = _along(errors, axes)
    return np.array([_correlation([(e[..., :-r], e[..., r:]) for e in along]) for r in range(1, reach + 1)])


def tile_contrast(errors: Array, tile: int = 16, axes: Axes = ROW) -> Array:
    """Correlation of next neighbours inside tiles minus that across their borders; (..., pixels) -> ().  [GRIS Fig. 14]

    0 if tiles leave no trace.  Tiles begin at the first pixel; in a map they are squares of this side.  Raises
    ValueError for tiles without an inside, or an image without a border between two.
    """
    n = min(errors.shape[axis] for axis in axes)
    if not 1 < tile < n:
        raise ValueError(f"tiles must have 2 .. {n - 1} pixels in an image of {n}, but have {tile}.")
    inside, across = [], []
    for e in _along(errors, axes):
        left, right = e[..., :-1], e[..., 1:]
        border = np.arange(1, e.shape[-1]) % tile == 0
        inside.append((left[..., ~border], right[..., ~border]))
        across.append((left[..., border], right[..., border]))
    return np.asarray(_correlation(inside) - _correlation(across))


def _along(errors: Array, axes: Axes) -> list[Array]:
    """The errors with each of the axes last in turn."""
    return [np.moveaxis(errors, axis, -1) for axis in axes]
