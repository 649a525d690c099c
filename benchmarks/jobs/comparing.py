"""Means over replicas against a truth: for the image, for eight blocks of pixels, and for all pixels at once.

The spread of the pixels' z-scores is about 1 without bias and more where pixels err, in whatever direction.
Pixels that share samples err together, so what chance allows is measured: the largest spread in FLIPS
trials in which each chunk's deviation from the mean gets a random sign.
"""

from dataclasses import dataclass

import numpy as np

from benchmarks.jobs.job import Row
from figures.claims.figure import Arrays
from restir_ref.batch import Array

BLOCKS = 8
SIGMA = 4.0
FLIPS = 10_000


@dataclass(frozen=True, eq=False)
class Truth:
    """What a mean image should be, (n,), the standard errors of its pixels (n,) and of its mean."""

    mean: Array
    error: Array
    image_error: float


@dataclass(frozen=True, eq=False)
class Sums:
    """R images in short: means of blocks (R, BLOCKS), sums of pixels by chunk (K, n), and of their squares (n,)."""

    blocks: Array
    total: Array
    square: Array

    @property
    def R(self) -> int:
        """Number of images."""
        return len(self.blocks)

    @property
    def mean(self) -> Array:
        """The mean image."""
        return np.asarray(self.total.sum(axis=0) / self.R)

    @property
    def error(self) -> Array:
        """Standard errors of the mean's pixels."""
        return np.asarray(np.sqrt(np.maximum(self.square / self.R - self.mean**2, 0) / (self.R - 1)))


def nothing(n: int) -> Truth:
    """The truth of differences: 0."""
    return Truth(np.zeros(n), np.zeros(n), 0.0)


def sums(images: Array) -> Sums:
    """Of images (R, n)."""
    R = len(images)
    return Sums(images.reshape(R, BLOCKS, -1).mean(axis=-1), images.sum(axis=0)[None], (images**2).sum(axis=0))


def stored(found: Sums, name: str) -> Arrays:
    """Sums as arrays of a chunk."""
    return {f"{name}.{part}": value for part, value in vars(found).items()}


def joined(chunks: list[Arrays], name: str) -> Sums:
    """The sums of several chunks."""
    blocks, total, square = ([chunk[f"{name}.{part}"] for chunk in chunks] for part in ("blocks", "total", "square"))
    return Sums(np.concatenate(blocks), np.concatenate(total), np.sum(square, axis=0))


def refined(images: Array) -> Truth:
    """The finer of two images, (2, n); its change is the error."""
    coarse, fine = images
    return Truth(fine, np.abs(fine - coarse), float(abs(fine.mean() - coarse.mean())))


def as_truth(found: Sums) -> Truth:
    """A mean image as the truth for another one."""
    image = found.blocks.mean(axis=1)
    return Truth(found.mean, found.error, float(image.std(ddof=1) / np.sqrt(found.R)))


def judged(claims: str, what: str, found: Sums, truth: Truth, scale: float, eps: float) -> Row:
    """Unbiased: |z| <= 4 for the image and its blocks, SE of the image <= eps, all relative to `scale`."""
    means, errors = truth.mean.reshape(BLOCKS, -1).mean(axis=1), truth.error.reshape(BLOCKS, -1)
    by_block = z_scores(found.blocks, means, np.sqrt((errors**2).sum(axis=1)) / errors.shape[1])
    z, error = (
        float(each[0]) for each in z_scores(found.blocks.mean(axis=1)[:, None], means.mean(), truth.image_error)
    )
    worst, block_error = np.abs(by_block[0]).max(), by_block[1].max()
    wide, chance = spread(found, truth), spread_by_chance(found)
    holds = error <= eps * scale and max(abs(z), worst) <= SIGMA and wide <= chance
    note = (
        f"z {z:+.2f}; blocks |z| <= {worst:.2f}, SE <= {block_error / scale:.2%}; z-spread {wide:.2f} of {chance:.2f}"
    )
    bias = float(found.mean.mean() - truth.mean.mean()) / scale
    limit = f"|z| <= {SIGMA:g}, SE <= {eps:.1%}"
    return Row(claims, what, bias, limit, bool(holds), found.R, error / scale, note)


def spread(found: Sums, truth: Truth) -> float:
    """Root mean square of the pixels' z-scores."""
    error = np.hypot(found.error, truth.error)
    return float(np.sqrt(np.mean(((found.mean - truth.mean) / np.where(error > 0, error, np.inf)) ** 2)))


def spread_by_chance(found: Sums) -> float:
    """The largest spread without bias in FLIPS trials; no limit for too few chunks to tell."""
    K = len(found.total)
    if K < 16:
        return np.inf
    d = found.total - found.total.mean(axis=0)
    scale = np.sqrt((d**2).sum(axis=0))
    signs = np.random.default_rng(1).choice([-1.0, 1.0], (FLIPS, K))
    z = signs @ (d / np.where(scale > 0, scale, np.inf))
    return float(np.sqrt((z**2).mean(axis=1)).max())


def biased(claims: str, what: str, found: Sums, truth: Truth, least: float) -> Row:
    """A control: the image or a block of it is certainly biased, |bias| > least with |z| >= 8; the surest is shown.

    Biases are relative to the truth of the image, or of the block.
    """
    means = np.append(truth.mean.mean(), truth.mean.reshape(BLOCKS, -1).mean(axis=1))
    samples = np.concatenate([found.blocks.mean(axis=1)[:, None], found.blocks], axis=1)
    z, error = z_scores(samples, means, 0.0)
    bias = samples.mean(axis=0) / means - 1
    worst = int(np.argmax(np.abs(z) * (np.abs(bias) > least)))
    holds = abs(bias[worst]) > least and abs(z[worst]) >= 8
    where = f"block {worst} of {BLOCKS}" if worst else "the image"
    note = f"{where}, z {z[worst]:+.1f}; the image {bias[0]:+.2%}, z {z[0]:+.1f}"
    limit = f"control: |bias| > {least:.0%}, |z| >= 8"
    return Row(claims, what, float(bias[worst]), limit, bool(holds), found.R, float((error / means)[worst]), note)


def of_image(found: Sums, truth: Truth) -> tuple[float, float]:
    """z of the image's mean, and its standard error."""
    z, error = z_scores(found.blocks.mean(axis=1)[:, None], truth.mean.mean(), truth.image_error)
    return float(z[0]), float(error[0])


def z_scores(samples: Array, truth: Array | float, truth_error: Array | float) -> tuple[Array, Array]:
    """z of means over replicas against the truth, and standard errors with the truth's; samples (R, K)."""
    error = np.hypot(samples.std(axis=0, ddof=1) / np.sqrt(len(samples)), truth_error)
    return np.asarray((samples.mean(axis=0) - truth) / error), np.asarray(error)
