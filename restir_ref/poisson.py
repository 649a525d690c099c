"""Screened Poisson reconstruction: the image whose differences fit measured ones and which stays near the primal.

minimise alpha^2 |I - I_prim|^2 + |grad I - G|^2.  [GPT 2.1]

A row (..., n) has one gradient, an image (..., rows, columns) two; leading axes are channels, replicas, frames, each
reconstructed by itself.  Gradients are forward differences, in the order of rows and columns of `images`:

    dx_c = I_(c+1) - I_c   (..., rows, columns - 1)        dy_r = I_(r+1) - I_r   (..., rows - 1, columns)

They have the opposite sign of the differences that pairs of pixels estimate, Delta_ij = I_i - I_j [GPT Eq. 1]: with
pairs (i, i + 1), dx = -Delta, which is `forward`.  Nothing is said about differences across the border (Neumann).
L2 is linear, hence unbiased if its inputs are; `poisson_l1` is neither, and keeps outliers out.
"""

from collections.abc import Callable, Sequence
from functools import reduce
from math import prod, tau
from typing import Any

import numpy as np
import scipy.sparse as sp
from scipy.fft import dctn, idctn
from scipy.sparse.linalg import splu

from restir_ref.batch import Array, total
from restir_ref.guards import positive

ALPHA = 0.2
"""The customary weight of the primal image; the paper gives none.  [Kettunen 2015]"""

AGAINST = -6.0
"""Standard errors by which gradients must point against the image to be taken for those of the other sign."""

NAMES = ("dx", "dy")
Solver = Callable[[Array], Array]
"""(alpha^2 + grad^T grad)^-1 of right sides (..., *shape)."""


# ---------------------------------------------------------------- differences


def differences(image: Array, dimensions: int = 2) -> list[Array]:
    """grad I = (dx, dy), or (dx,) of a row: forward differences, one pixel fewer along their axis each.

    >>> import numpy as np
    >>> from restir_ref.poisson import differences
    >>> dx, dy = differences(np.array([[1.0, 2.0, 4.0], [1.0, 1.0, 1.0]]))
    >>> dx, dy
    (array([[1., 2.],
           [0., 0.]]), array([[ 0., -1., -3.]]))
    """
    return [np.diff(image, axis=-1 - k) for k in range(dimensions)]


def forward(*deltas: Array) -> list[Array]:
    """dx_i = I_(i+1) - I_i = -Delta_i,i+1, from what pairs (i, i + 1) estimate; same shapes.  [GPT Eq. 1]"""
    return [-delta for delta in deltas]


def transposed(gradients: Sequence[Array], shape: tuple[int, ...]) -> Array:
    """grad^T G = sum over axes of g_(i-1) - g_i, without what is beyond the borders; of this whole shape."""
    b = np.zeros(shape)
    for k, g in enumerate(gradients):
        before, after = ends(b, k)
        after += g
        before -= g
    return b


def ends(image: Array, k: int) -> tuple[Array, Array]:
    """The pixels i and i + 1 of every difference along axis -1 - k, as views."""
    along = image.swapaxes(-1, -1 - k)
    return along[..., :-1].swapaxes(-1, -1 - k), along[..., 1:].swapaxes(-1, -1 - k)


def right_side(primal: Array, *gradients: Array, alpha: float = ALPHA) -> Array:
    """alpha^2 I_prim + grad^T G, right side of the normal equations (alpha^2 + grad^T grad) I; (..., *shape)."""
    return alpha**2 * primal + transposed(gradients, primal.shape)


# ---------------------------------------------------------------- L2


def by_transform(shape: tuple[int, ...], alpha: float = ALPHA) -> Solver:
    """(alpha^2 + D(k))^-1 in the basis of the cosine transform, which diagonalises grad^T grad exactly."""
    axes, denominator = tuple(range(-len(shape), 0)), alpha**2 + symbol(shape)

    def solve(b: Array) -> Array:
        spectrum = dctn(b, axes=axes, norm="ortho")
        spectrum /= denominator
        return np.asarray(idctn(spectrum, axes=axes, norm="ortho", overwrite_x=True))

    return solve


def by_elimination(shape: tuple[int, ...], alpha: float = ALPHA) -> Solver:
    """The same by a sparse factorisation of the matrix, which all right sides share."""
    A = gradient_matrix(shape)
    factors = splu(
        (alpha**2 * sp.eye_array(prod(shape)) + A.T @ A).tocsc(),
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )

    def solve(b: Array) -> Array:
        return np.asarray(factors.solve(b.reshape(-1, prod(shape)).T).T.reshape(b.shape))

    return solve


def gradient_matrix(shape: tuple[int, ...]) -> Any:
    """grad as a sparse matrix (differences, pixels), those along the last axis first."""
    return sp.vstack([_along(shape, k) for k in range(len(shape))], format="csr")


def _along(shape: tuple[int, ...], k: int) -> Any:
    """Differences along axis -1 - k, as a matrix."""
    n = shape[-1 - k]
    factors: list[Any] = [sp.eye_array(m) for m in shape]
    factors[-1 - k] = sp.eye_array(n - 1, n, k=1) - sp.eye_array(n - 1, n)
    return reduce(sp.kron, factors)


def l2(
    primal: Array,
    *gradients: Array,
    alpha: float = ALPHA,
    solver: Callable[[tuple[int, ...], float], Solver] = by_transform,
) -> Array:
    """argmin_I alpha^2 |I - I_prim|^2 + |grad I - G|^2 = (alpha^2 + grad^T grad)^-1 (alpha^2 I_prim + grad^T G).

    l2(row, dx), l2(image, dx, dy); (..., *shape) -> (..., *shape).  Linear, so unbiased if its inputs are.  [GPT 2.1]
    Raises ValueError as `checked` does.

    >>> import numpy as np
    >>> from restir_ref.poisson import differences, l2
    >>> rng, truth = np.random.default_rng(1), np.tile(np.linspace(0, 1, 32), (32, 1))
    >>> primal = truth + rng.normal(0, 0.1, truth.shape)
    >>> measured = [d + rng.normal(0, 0.01, d.shape) for d in differences(truth)]
    >>> abs(primal - truth).mean().round(3), abs(l2(primal, *measured) - truth).mean().round(3)
    (np.float64(0.079), np.float64(0.009))
    """
    I, G = checked(primal, gradients, alpha)
    return solver(I.shape[-len(G) :], alpha)(right_side(I, *G, alpha=alpha))


# ---------------------------------------------------------------- spectra


def symbol(shape: tuple[int, ...]) -> Array:
    """D(k) = sum over axes of 2 - 2 cos(pi k / n), the eigenvalues of grad^T grad; of this shape.

    >>> from restir_ref.poisson import symbol
    >>> symbol((4,)).round(3)
    array([0.   , 0.586, 2.   , 3.414])
    """
    along = [2 - 2 * np.cos(tau * np.arange(n) / (2 * n)) for n in shape]
    return total([*np.meshgrid(*along, indexing="ij", sparse=True)])


def output_spectrum(shape: tuple[int, ...], s_c: float, s_g: float, alpha: float = ALPHA) -> Array:
    """S(k) = (alpha^4 s_c + D(k) s_g) / (alpha^2 + D(k))^2 of the error of L2; of this shape.  [derived; GPT 2.1]

    s_c and s_g are the variances of white noise of the primal image and of the gradients, independent of each other.
    The transform is orthonormal and grad^T of white noise has the spectrum D s_g: this is exact at any size.
    """
    D = symbol(shape)
    return np.asarray((alpha**4 * s_c + D * s_g) / (alpha**2 + D) ** 2)


def cosine_power(errors: Array, dimensions: int = 2) -> Array:
    """|orthonormal cosine transform|^2, frequencies as in `symbol`; its mean is that of e^2, white noise is flat."""
    return np.asarray(dctn(errors, axes=tuple(range(-dimensions, 0)), norm="ortho") ** 2)


# ---------------------------------------------------------------- what is handed in


def checked(primal: Array, gradients: Sequence[Array], alpha: float) -> tuple[Array, list[Array]]:
    """The inputs in 64 bits.

    Raises ValueError for alpha <= 0, no gradients or too many, wrong shapes, an image of one pixel, numbers that are
    not finite, which are named, and gradients that point against the image as those of the other sign do.
    """
    positive(alpha, "alpha, the weight of the primal image,", f"take the customary {ALPHA}")
    if not np.isfinite(alpha):
        raise ValueError(f"alpha is {alpha}, which leaves the primal image as it is: take the customary {ALPHA}.")
    image, measured = np.asarray(primal, dtype=float), [np.asarray(g, dtype=float) for g in gradients]
    _shaped(image, measured)
    _finite(image, "the primal image", len(measured))
    for name, g, own in zip(NAMES, measured, differences(image, len(measured)), strict=False):
        _finite(g, name, len(measured))
        _forward(g, own, name)
    return image, measured


def _shaped(image: Array, gradients: Sequence[Array]) -> None:
    """Raise ValueError unless every gradient is the image's shape, less one along its axis."""
    n = len(gradients)
    if not 1 <= n <= min(len(NAMES), image.ndim):
        raise ValueError(
            f"an image of shape {image.shape} came with {n} gradients: hand in dx for rows (..., n), dx and dy for "
            f"images (..., rows, columns)."
        )
    if (pixels := prod(image.shape[-n:])) <= 1:
        raise ValueError(
            f"an image of {pixels} pixel, shape {image.shape}, has no differences to reconstruct from: keep the primal "
            f"image as it is."
        )
    for k, (name, g) in enumerate(zip(NAMES, gradients, strict=False)):
        needed = list(image.shape)
        needed[-1 - k] -= 1
        if g.shape != tuple(needed):
            raise ValueError(
                f"{name} must have shape {tuple(needed)} for an image of shape {image.shape}, but has {g.shape}: it is "
                f"the difference of neighbours along axis {-1 - k}, one fewer than pixels."
            )


def _finite(values: Array, what: str, dimensions: int) -> None:
    """Raise ValueError naming the first number that is not finite, and its place."""
    if np.isfinite(values).all():
        return
    bad = np.argwhere(~np.isfinite(values))
    place = bad[0].tolist()
    words = [f"{name} {at}" for name, at in zip(("row", "column")[-dimensions:], place[-dimensions:], strict=True)]
    of = f" of image {place[:-dimensions]}" if place[:-dimensions] else ""
    raise ValueError(
        f"{what} is {values[tuple(place)]} in {', '.join(words)}{of} ({len(bad)} of {values.size} values are not "
        f"finite): it would spread over the whole image. Mend the estimate, or set it to 0 if nothing was found."
    )


def _forward(g: Array, own: Array, name: str) -> None:
    """Raise ValueError for a gradient that points against the image's own differences.

    E[sum g grad I_prim] = |grad I|^2 >= 0 for noise that is independent, and more for noise that is shared.  Many
    differences must speak: an image that is flat but for one or two edges is never doubted.
    """
    along = (g * own).ravel()
    size = np.sqrt(along @ along)
    z = along.sum() / size if size > 0 else 0.0
    if z < AGAINST:
        raise ValueError(
            f"{name} points against the differences of the primal image, by {-z:.1f} standard errors: it must be "
            f"I_(i+1) - I_i, and looks like Delta_i,i+1 = I_i - I_(i+1). Hand in its negative, see `poisson.forward`."
        )
