"""Screened Poisson reconstruction in the L1 norm, by iteratively reweighted least squares.

minimise |alpha (I - I_prim)|_1 + |grad I - G|_1.  [GPT 2.1; Kettunen 2015]

An outlier costs its size, not its square, so that it is left standing if the others agree: around closed loops of an
image differences must add up to zero, in a row there are no loops.  What is minimised are medians of a kind, which
skewed noise shifts: L1 is biased.  Every value counts by itself, channels do not know each other.
"""

from collections.abc import Callable, Iterable, Sequence
from math import prod

import numpy as np

from restir_ref.batch import Array, ratio, total
from restir_ref.guards import whole
from restir_ref.poisson import ALPHA, by_transform, checked, differences, ends, right_side, transposed

ROUNDS, COOLING = 60, 0.8
"""How often weights are made anew, and by which factor epsilon falls each time: to 2e-6 of where it began."""

TOLERANCE, STEPS = 1e-5, 2000
"""Where conjugate gradients end: residual over right side, in the norm of the preconditioner, or so many steps."""

Linear = Callable[[Array], Array]
Progress = Callable[[Iterable[int]], Iterable[int]]
"""What goes over the rounds with a bar or without, such as `tqdm`."""


def silent(rounds: Iterable[int]) -> Iterable[int]:
    """No bar."""
    return rounds


def l1(
    primal: Array, *gradients: Array, alpha: float = ALPHA, rounds: int = ROUNDS, progress: Progress = silent
) -> Array:
    """argmin_I |alpha (I - I_prim)|_1 + |grad I - G|_1; l1(row, dx), l1(image, dx, dy); (..., *shape) -> same.

    Each round minimises sum w r^2 over the residuals r = (alpha (I - I_prim), grad I - G), with the weights
    w = 1 / sqrt(r^2 + epsilon^2) of the last image, which lowers sum sqrt(r^2 + epsilon^2).  It begins at the L2 image,
    and epsilon at the mean |r| there, image by image; then epsilon falls geometrically, for if it began small, weights
    would freeze the first guess.  Solved for is the step from the L2 image, whose size does not depend on the image's.
    l1(..., progress=tqdm) shows a bar.
    Raises ValueError as `poisson.checked` does, and for fewer than 1 round.

    >>> import numpy as np
    >>> from restir_ref.poisson import differences, l2
    >>> from restir_ref.poisson_l1 import l1
    >>> truth = np.zeros((16, 16))
    >>> dx, dy = differences(truth)
    >>> dx[8, 8] = 1.0  # an outlier
    >>> abs(l2(truth, dx, dy)).max().round(3), abs(l1(truth, dx, dy)).max().round(3)
    (np.float64(0.246), np.float64(0.0))
    """
    whole(rounds, 1, "the number of rounds", f"The customary number is {ROUNDS}.")
    I_prim, G = checked(primal, gradients, alpha)
    first = by_transform(I_prim.shape[-len(G) :], alpha)(right_side(I_prim, *G, alpha=alpha))
    to_primal, to_gradients = misfits(first, I_prim, G)
    epsilon, step = scale([alpha * to_primal, *to_gradients], len(G)), np.zeros_like(first)
    for _ in progress(range(rounds)):
        w = weights(step, to_primal, to_gradients, epsilon, alpha)
        step = weighted(step, to_primal, to_gradients, w, alpha)
        epsilon = COOLING * epsilon
    return np.asarray(first + step)


def l1_norm(image: Array, primal: Array, *gradients: Array, alpha: float = ALPHA) -> Array:
    """|alpha (I - I_prim)|_1 + |grad I - G|_1, (..., *shape) -> (...)."""
    axes, (to_primal, to_gradients) = _axes(gradients), misfits(image, primal, gradients)
    return total([abs(r).sum(axis=axes) for r in (alpha * to_primal, *to_gradients)])


def misfits(image: Array, primal: Array, gradients: Sequence[Array]) -> tuple[Array, list[Array]]:
    """I_prim - I and G - grad I: what a step from the image has to make up for."""
    own = differences(image, len(gradients))
    return primal - image, [g - each for g, each in zip(gradients, own, strict=True)]


def weights(image: Array, primal: Array, gradients: Sequence[Array], epsilon: Array, alpha: float) -> list[Array]:
    """epsilon w = 1 / sqrt(1 + (r / epsilon)^2) in (0, 1] for r = alpha (I - I_prim), then per axis grad I - G."""
    to_primal, to_gradients = misfits(image, primal, gradients)
    return [1 / np.sqrt(1 + (r / epsilon) ** 2) for r in (alpha * to_primal, *to_gradients)]


def scale(r: Sequence[Array], dimensions: int) -> Array:
    """Mean |r| of every image, pixel axes kept; 1 where all fits exactly."""
    axes = tuple(range(-dimensions, 0))
    count = sum(prod(each.shape[-dimensions:]) for each in r)
    mean = total([abs(each).sum(axis=axes, keepdims=True) for each in r]) / count
    return np.where(mean > 0, mean, 1.0)


def weighted(
    start: Array, primal: Array, gradients: Sequence[Array], w: Sequence[Array], alpha: float = ALPHA
) -> Array:
    """argmin_I sum w_0 alpha^2 (I - I_prim)^2 + sum w (grad I - G)^2 by conjugate gradients; (..., *shape).

    Preconditioned by the diagonal: the weights are as rough as noise, which a smooth solver does not undo.
    """
    product, b, diagonal = normal_equations(primal, gradients, w, alpha)
    return conjugate_gradients(product, b, start, lambda r: r / diagonal, _axes(gradients))


def normal_equations(
    primal: Array, gradients: Sequence[Array], w: Sequence[Array], alpha: float = ALPHA
) -> tuple[Linear, Array, Array]:
    """alpha^2 w_0 + grad^T w grad as a product, the right side alpha^2 w_0 I_prim + grad^T w G, the diagonal."""
    w_c, w_g = alpha**2 * w[0], w[1:]

    def product(v: Array) -> Array:
        steps = differences(v, len(w_g))
        return np.asarray(w_c * v + transposed([a * g for a, g in zip(w_g, steps, strict=True)], v.shape))

    b = w_c * primal + transposed([a * g for a, g in zip(w_g, gradients, strict=True)], primal.shape)
    diagonal = w_c.copy()
    for k, a in enumerate(w_g):
        for pixels in ends(diagonal, k):
            pixels += a  # noqa: PLW2901  # a view
    return product, b, diagonal


def conjugate_gradients(product: Linear, b: Array, start: Array, precondition: Linear, axes: tuple[int, ...]) -> Array:
    """x of product(x) = b from a start; image by image over these axes, each until its own residual is small."""

    def dot(a: Array, c: Array) -> Array:
        return np.asarray((a * c).sum(axis=axes, keepdims=True))

    x, r = start, b - product(start)
    p = z = precondition(r)
    rz, enough = dot(r, z), TOLERANCE**2 * dot(b, precondition(b))
    for _ in range(STEPS):
        if not (going := rz > enough).any():
            break
        Ap = product(p)
        step = ratio(rz, np.where(going, dot(p, Ap), 0.0))
        x, r = x + step * p, r - step * Ap
        z, last = precondition(r), rz
        rz = np.where(going, dot(r, z), rz)
        p = z + ratio(rz, last) * p
    return x


def _axes(gradients: Sequence[Array]) -> tuple[int, ...]:
    return tuple(range(-len(gradients), 0))
