"""Pairs judged together: squared errors are summed, then divided by their summed squared standard errors.

Where rare paths carry much of a pair's light, the root mean square of its z-scores (`comparing.spread`) is no test: a
pair that met none of them has too small a mean and, divided by its own samples' scatter, too small an error.  Under the
null that rule turns red most of the time (tests/flatland/test_pooling.py).

Sums keep their promises whatever the tails.  With y_i = x_i - t of image i, a vector over pairs, numerator less
denominator is sum_{i != j} <y_i, y_j> / n^2: its mean is 0, and its variance 2 tr(C^2) / n^2 has second moments only.
Signs at random, chunk by chunk, keep both.  Events that come lambda times per run and that no image met add
lambda e^-lambda <= 1/e of their pair's noise to the numerator, however large they are; to a z-score, without bound.

Hazard: it must be many pairs that make the sum.  Those are put together whose noise is of one kind, for a loud pair
hides what is wrong with quiet ones; and which, is known before anything is measured.
"""

import numpy as np

from benchmarks.jobs.comparing import FLIPS, Sums, Truth
from restir_ref.batch import Array

LEAST_CHUNKS = 16
"""Of fewer, signs cannot tell."""


def among(found: Sums, these: Array) -> Sums:
    """Images in short, of some pixels only."""
    return Sums(found.blocks, found.total[:, these], found.square[these])


def pooled(found: Sums, truth: Truth) -> float:
    """S = sqrt(sum_p (m_p - t_p)^2 / sum_p (SE_p^2 + error_p^2)), about 1 without bias."""
    off, noise = (found.mean - truth.mean) ** 2, found.error**2 + truth.error**2
    return float(np.sqrt(off.sum() / noise.sum()))


def pooled_by_chance(found: Sums) -> float:
    """The largest S in FLIPS trials with random signs of chunks' deviations; no limit for too few chunks to tell."""
    d = found.total - found.total.mean(axis=0)
    if len(d) < LEAST_CHUNKS:
        return np.inf
    signs = np.random.default_rng(1).choice([-1.0, 1.0], (FLIPS, len(d)))
    return float(np.sqrt(((signs @ d) ** 2).sum(axis=1).max() / (d**2).sum()))
