"""Differences with the signs of the true ones, over their mean size: their mean does not telescope, and should be 1."""

from collections.abc import Sequence

import numpy as np

from benchmarks.jobs.comparing import Truth, joined, judged, stored, sums
from benchmarks.jobs.job import Row
from restir_ref.batch import Array


def signed(d: Array, true: Array) -> Array:
    """Differences (R, n) with the signs of the true ones (n,), over their mean size."""
    return np.asarray(d * np.sign(true) / abs(true).mean())


def probed(claims: str, what: str, found: Sequence[Array], truths: Sequence[Array], eps: float) -> Row:
    """Chunks of differences (R, n) against the mean of independent true ones."""
    each = np.concatenate(truths)
    true, root = each.mean(axis=0), np.sqrt(max(len(each) - 1, 1))
    probes = signed(each, true)
    truth = Truth(signed(true[None], true)[0], probes.std(axis=0) / root, float(probes.mean(axis=1).std() / root))
    mine = [stored(sums(signed(d, true)), "d") for d in found]
    return judged(claims, what, joined(mine, "d"), truth, 1.0, eps)
