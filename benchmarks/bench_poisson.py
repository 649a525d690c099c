"""What reconstruction costs: L2 beside its own transforms, by elimination, and L1 by one inner solver or another.

Every number is a ratio of CPU times measured in one run, the least of interleaved repeats; L1 of large images runs
once, with a bar.  Images are in colour, with noise and with outliers.  Exits with 1 if a requirement is missed.
Takes 90 s.
"""

import sys
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from time import process_time
from typing import Any

import numpy as np
import scipy.sparse as sp
from bench_resampling import Row, keep_freed_memory, print_sections
from bench_transport import cpu
from scipy.fft import dctn, idctn
from scipy.sparse.linalg import splu
from tqdm import tqdm

from figures.claims.criteria import slope
from restir_ref.batch import Array
from restir_ref.poisson import ALPHA, by_elimination, by_transform, differences, gradient_matrix, l2, right_side
from restir_ref.poisson_l1 import (
    COOLING,
    conjugate_gradients,
    l1,
    l1_norm,
    misfits,
    normal_equations,
    scale,
    weighted,
    weights,
)

SIDES, LARGE, HALF = (64, 128, 256, 512), 512, 256
REPEATS = 7
AT = (5, 20, 40)
"""Rounds whose reweighted systems are solved in three ways."""


def main() -> int:
    """Print all rows; 1 if a requirement is missed."""
    keep_freed_memory()
    return print_sections({"L2": by_transforms, "L2 by elimination": elimination, "L1": robust, "Inside L1": inner})


def noisy(side: int, channels: int = 3) -> tuple[Array, list[Array]]:
    """Noise of a primal image and of gradients, of which 3% are outliers, around an image of ones."""
    dice, I = np.random.default_rng(1), np.ones((channels, side, side))
    chance = [0.015, 0.97, 0.015]
    G = [0.05 * dice.standard_normal(g.shape) + 2 * dice.choice([-1, 0, 1], g.shape, p=chance) for g in differences(I)]
    return I + 0.3 * dice.standard_normal(I.shape), G


def transforms(image: Array) -> Array:
    """Forth and back."""
    return np.asarray(idctn(dctn(image, axes=(-2, -1), norm="ortho"), axes=(-2, -1), norm="ortho"))


def by_transforms() -> Iterator[Row]:
    """L2 over its transforms, and its growth."""
    given = {side: noisy(side) for side in SIDES}
    primal, G = given[LARGE]
    found = cpu({"L2": partial(l2, primal, *G), "transforms": partial(transforms, primal)}, REPEATS)
    yield Row(f"L2 of {LARGE} x {LARGE} in colour over its transforms", found["L2"] / found["transforms"], most=3)
    grown = cpu({side: partial(l2, given[side][0], *given[side][1]) for side in SIDES}, REPEATS)
    yield growth("L2", grown)


def growth(what: str, seconds: dict[Any, float]) -> Row:
    """The exponent of CPU time in pixels."""
    exponent = slope([side**2 for side in seconds], [*seconds.values()])
    return Row(f"{what}: exponent in pixels, {min(seconds)}^2 to {max(seconds)}^2", exponent, most=1.1)


def elimination() -> Iterator[Row]:
    """The sparse solver beside the transform, whose answer it checks."""
    primal, G = noisy(HALF)
    b, factor = right_side(primal, *G), by_elimination((HALF, HALF))
    both = [solver((HALF, HALF), ALPHA)(b) for solver in (by_elimination, by_transform)]
    yield Row(f"{HALF} x {HALF}: largest difference of the two answers", abs(both[0] - both[1]).max(), most=1e-10)
    found = cpu(
        {
            "factor": partial(by_elimination, (HALF, HALF)),
            "solve": partial(factor, b),
            "transform": partial(by_transform((HALF, HALF)), b),
        },
        3,
    )
    yield Row("factorisation over solution by transform", found["factor"] / found["transform"])
    yield Row("solution with factors at hand over solution by transform", found["solve"] / found["transform"])


def robust() -> Iterator[Row]:
    """L1 over L2, and its growth."""
    seconds: dict[Any, float] = {}
    for side in SIDES:
        primal, G = noisy(side)
        seconds[side], _ = timed(lambda: l1(primal, *G, progress=partial(tqdm, desc=f"{side} x {side}")))  # noqa: B023
    primal, G = noisy(LARGE)
    yield Row(f"L1 of {LARGE} x {LARGE} in colour over L2", seconds[LARGE] / cpu({0: partial(l2, primal, *G)}, 3)[0])
    yield growth("L1", seconds)


def timed(run: Callable[[], Array]) -> tuple[float, Array]:
    """CPU seconds of one run, and what it returns."""
    start = process_time()
    found = run()
    return process_time() - start, found


def inner() -> Iterator[Row]:
    """Reweighted systems of one channel as they come up, by conjugate gradients in two ways, and by elimination."""
    primal, G = noisy(HALF, 1)
    first = l2(primal, *G)
    to_primal, to_gradients = misfits(first, primal, G)
    epsilon, step = scale([ALPHA * to_primal, *to_gradients], 2), np.zeros_like(first)
    for k in range(max(AT) + 1):
        w = weights(step, to_primal, to_gradients, epsilon * COOLING**k, ALPHA)
        if k in AT:
            yield from compared(k, step, to_primal, to_gradients, w)
        step = weighted(step, to_primal, to_gradients, w)


def compared(k: int, start: Array, primal: Array, G: Sequence[Array], w: Sequence[Array]) -> Iterator[Row]:
    """Times of one reweighted solution over that of the diagonal preconditioner."""
    product, b, _ = normal_equations(primal, G, w)
    smooth = by_transform((HALF, HALF))
    t, found = timed(lambda: weighted(start, primal, G, w))
    ts, _ = timed(lambda: conjugate_gradients(product, b, start, smooth, (-2, -1)))
    te, exact = timed(lambda: eliminated(b, w))
    yield Row(f"round {k}: conjugate gradients preconditioned by the transform over by the diagonal", ts / t)
    yield Row(f"round {k}: elimination over conjugate gradients by the diagonal", te / t)
    norms = [float(l1_norm(each, primal, *G).sum()) for each in (found, exact)]
    yield Row(f"round {k}: norm after the latter over that after elimination, less 1", norms[0] / norms[1] - 1)


def eliminated(b: Array, w: Sequence[Array]) -> Array:
    """The reweighted system by a factorisation of its own."""
    A = sp.vstack([ALPHA * sp.eye_array(b.size), gradient_matrix((HALF, HALF))], format="csr")
    W = sp.diags_array(np.concatenate([each.ravel() for each in w]))
    options = {"SymmetricMode": True}
    factors = splu((A.T @ W @ A).tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options)
    return np.asarray(factors.solve(b.ravel()).reshape(b.shape))


if __name__ == "__main__":
    sys.exit(main())
