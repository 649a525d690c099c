"""When reuse pays, exactly: a row of 64 bumps, where every expectation is a sum over cells.

The variance after one pass is S + Q / M with M initial samples per pixel (`experiments.reuse`): exact here, and the
real code beside it.  The farther the neighbours, the more a shifted sample's ratio g varies, and the sooner more
samples make reuse a loss.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims.figure import Arrays, Figure
from figures.experiments import reuse
from figures.trust.pays_2d import check, in_row, measured, pictured
from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.loop import random_in_row
from toy1d import Line, image_of_64

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture

RADII = (6, 10, 15)
NODES = 2000
NAME = "64 bumps"


def chunks(preset: Any) -> Sequence[dict[str, Any]]:
    """One per radius."""
    return [{"radius": radius} for radius in RADII]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """The exact split of every pixel, and what the real code measures with the same neighbours."""
    line = image_of_64()
    near = reuse.distinct(line, random_in_row, chunk["radius"], Live(rng))
    return {**measured(line, near, preset["replicas"], rng), **vars(exact_split(line, near))}


def exact_split(line: Line, near: Sequence[Array]) -> reuse.Split:
    """sigma^2, S and Q of every pixel, (n,), by the midpoint rule."""
    low, high = float(line.low.min()), float(line.high.max())
    dx = (high - low) / NODES
    x = low + dx * (np.arange(NODES) + 0.5)
    return reuse.exact(line, near, x, line.pdf, lambda index, x: np.full(len(x), dx))


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """Everything by "64 bumps.radius.name"."""
    named = zip(RADII, results, strict=True)
    return {f"{NAME}.{radius}.{name}": array for radius, part in named for name, array in part.items()}


def draw(a: Arrays) -> "Picture":
    """As in the other worlds, but predictions are exact."""
    return pictured(a, (NAME,), RADII, in_row, "gain, exact")


FIGURE = Figure(
    id="PAYS-1D",
    title="When reuse pays, exactly",
    world="toy1d",
    source="of this project, about [GRIS 8.3, 9.1]",
    claims=(),
    presets={"quick": {"replicas": 1000}, "paper": {"replicas": 20_000}},
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)
