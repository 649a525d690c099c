"""Means of n independent images have 1/n of their variance: what chunks keep of them, and the verdict."""

import numpy as np

from benchmarks.jobs.comparing import joined
from benchmarks.jobs.job import Row
from figures.claims.figure import Arrays
from figures.experiments.gradients import averaged
from restir_ref.batch import Array

COUNTS = (1, 4, 16)
"""How many images are averaged."""

WITHIN, EPS = 0.1, 0.03
"""How far off the variance of means may be, and the largest standard error."""


def squares(images: Array) -> Array:
    """Mean squares of means of n images (R, pixels), for every n; (COUNTS,)."""
    return np.array([(averaged(images, n) ** 2).mean() for n in COUNTS])


def ratios(square: Array, total: Array, R: int) -> Array:
    """n V_n / V_1 - 1 for every n > 1, with V_n = (mean square - squared mean) / (1 - n / R), which is unbiased.

    square (K, COUNTS) and the sums of images total (K, pixels) of K chunks, R images in all.
    """
    n = np.array(COUNTS)
    V = (square.mean(axis=0) - ((total.sum(axis=0) / R) ** 2).mean()) / (1 - n / R)
    return np.asarray(n[1:] * V[1:] / V[0] - 1)


def falling(claims: str, what: str, chunks: list[Arrays], name: str) -> list[Row]:
    """n V_n = V_1 within a tenth; standard errors are those of a jackknife over chunks."""
    found, square = joined(chunks, name), np.stack([chunk[f"{name}.squares"] for chunk in chunks])
    K, R, off = len(chunks), found.R, ratios(square, found.total, found.R)
    without = [ratios(*(np.delete(each, k, axis=0) for each in (square, found.total)), R - R // K) for k in range(K)]
    error = np.sqrt((K - 1) * np.var(without, axis=0))
    limit, holds = f"|it| <= {WITHIN:.0%}, SE <= {EPS:.0%}", (abs(off) <= WITHIN) & (error <= EPS)
    return [
        Row(claims, f"{what}: n V_n / V_1 - 1, n = {n}", float(off[k]), limit, bool(holds[k]), R, float(error[k]))
        for k, n in enumerate(COUNTS[1:])
    ]
