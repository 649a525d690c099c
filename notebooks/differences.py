"""Behind `07_differences_of_pixels`: pairs of pixels on a line, and what reconstruction does to frequencies.

Every function draws from a fixed seed.
"""

from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from figures.gradient.gpt_f03 import draw_chosen, draw_integrands, real_passes
from figures.report import style
from notebooks.show import Table
from restir_ref import Live
from restir_ref.batch import Array
from restir_ref.poisson import cosine_power, l2, output_spectrum, symbol
from restir_ref.poisson_l1 import l1
from toy1d import TOYS

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture

SEED = 1
METHODS = ("after ReSTIR", "with pairs, one reservoir", "with pairs, one per sign")

# ---------------------------------------------------------------- two bumps


@cache
def estimates(toy: str, M: int, count: int = 4000) -> tuple[Array, Array]:
    """`count` estimates of int f_1 - int f_2 by each of METHODS (3, count), and the positions chosen (5, count)."""
    found = real_passes(TOYS[toy](), M, count, Live(np.random.default_rng(SEED)))
    return found["estimates"], found["chosen"]


def chosen(toy: str = "shared_peak", M: int = 32) -> "Picture":
    """Two integrands with their difference, and where samples of either method fall."""
    picture, ((left, right),) = style.panels(1, 2)
    draw_integrands(left, toy)
    draw_chosen(right, estimates(toy, M)[1], M)
    return picture


def spread(toy: str = "shared_peak", counts: tuple[int, ...] = (1, 4, 16, 64, 256)) -> Table:
    """Standard deviation of the difference by method and number of candidates."""
    rows = [(M, *(f"{each:.3f}" for each in estimates(toy, M)[0].std(axis=1))) for M in counts]
    return Table(["candidates M", *METHODS], rows)


def mean(toy: str, M: int) -> Array:
    """Mean of each method's estimates and its standard error, (2, 3)."""
    found = estimates(toy, M)[0]
    return np.stack([found.mean(axis=1), found.std(axis=1) / found.shape[1] ** 0.5])


# ---------------------------------------------------------------- a checkerboard


SIDE, TILE = 64, 8


def board() -> Array:
    """A checkerboard of 8 x 8 squares, dark .2 and light .8; (64, 64)."""
    row, column = np.indices((SIDE, SIDE)) // TILE
    return np.where((row + column) % 2, 0.8, 0.2)


def noisy(s_c: float, s_g: float, outliers: float = 0.0) -> tuple[Array, Array, Array]:
    """Image, dx and dy of the board with white noise of variances s_c and s_g; a share of dx, dy is off by 1."""
    rng, I = np.random.default_rng(SEED), board()
    parts = [I, np.diff(I, axis=-1), np.diff(I, axis=-2)]
    image, *gradients = (
        each + np.sqrt(s) * rng.standard_normal(each.shape) for each, s in zip(parts, (s_c, s_g, s_g), strict=True)
    )
    dx, dy = (each + (rng.random(each.shape) < outliers) * rng.choice([-1, 1], each.shape) for each in gradients)
    return image, dx, dy


def repaired(alpha: float = 0.2, s_g: float = 0.002, s_c: float = 0.02) -> "Picture":
    """The noisy board, its reconstruction, and the noise of both by frequency beside what is predicted."""
    image, dx, dy = noisy(s_c, s_g)
    found = l2(image, dx, dy, alpha=alpha)
    picture, ((left, middle, right),) = style.panels(1, 3)
    for axis, each, title in ((left, image, "image"), (middle, found, f"L2, alpha = {alpha:g}")):
        shown = axis.imshow(each, vmin=-0.2, vmax=1.2, cmap=style.IMAGE_MAP)
        axis.set(
            title=f"{title}: rms error {np.sqrt(((each - board()) ** 2).mean()):.3f}", xlabel="column", ylabel="row"
        )
        axis.grid(visible=False)
        picture.colorbar(shown, ax=axis, label="radiance", shrink=0.8)
    k = np.sqrt(symbol((SIDE, SIDE)))
    for name, each in (("primal", image), ("Poisson L2", found)):
        right.loglog(*rings(k, cosine_power(each - board())), **style.look(name, marker=""))
    right.loglog(*rings(k, output_spectrum((SIDE, SIDE), s_c, s_g, alpha)), **style.look("truth", label="predicted"))
    right.axvline(alpha, color=style.GREY, lw=1, marker="")
    right.set(xlabel="$\\sqrt{D(k)}$ (grey: alpha)", ylabel="power of the noise (radiance$^2$)", title="By frequency")
    right.legend()
    return picture


def rings(k: Array, S: Array, count: int = 14) -> tuple[Array, Array]:
    """Means of k and S over rings of like k, without k = 0."""
    edges = np.geomspace(k[k > 0].min(), k.max() * 1.001, count + 1)
    which = np.digitize(k[k > 0], edges)
    masks = [which == j for j in range(1, count + 1) if (which == j).any()]
    return np.array([k[k > 0][m].mean() for m in masks]), np.array([S[k > 0][m].mean() for m in masks])


def norms(outliers: float = 0.02) -> Table:
    """Errors of L2 and L1 where a share of the differences is off by 1."""
    inputs = noisy(0.02, 0.0005, outliers)
    errors = {"image": inputs[0], "L2": l2(*inputs), "L1": l1(*inputs)}
    rows = [(name, f"{np.sqrt(((each - board()) ** 2).mean()):.4f}") for name, each in errors.items()]
    return Table(["", f"rms error with {outliers:.0%} outliers"], rows)
