"""The map of z and of the bias, as one picture."""

from pathlib import Path

import numpy as np

from restir_ref.audit.images import TILE, ImageReport, Tested
from restir_ref.batch import Array

LARGEST_Z = 8.0
"""Where the scale of z ends."""


def draw(report: ImageReport, path: Path) -> None:
    """Four maps in a file: z and relative bias, of single pixels and of tiles; the channel that is off most."""
    from matplotlib.figure import Figure  # noqa: PLC0415

    picture = Figure(figsize=(9, 8), layout="constrained")
    maps = [each for each in report.families if each.family in ("pixel", "tile")]
    for row, each in enumerate(maps):
        z, bias = _maps(each, report.shape)
        end = float(np.quantile(abs(bias), 0.99)) or 1.0
        for column, (values, limit, what) in enumerate(((z, LARGEST_Z, "z"), (100 * bias, 100 * end, "bias in %"))):
            axes = picture.add_subplot(2, 2, 2 * row + column + 1)
            shown = axes.imshow(values, cmap="RdBu_r", vmin=-limit, vmax=limit, interpolation="nearest")
            axes.set(title=f"{what}, {each.family}s", xticks=[], yticks=[])
            picture.colorbar(shown, ax=axes)
    picture.suptitle(report.answer[:100])
    picture.savefig(path)


def _maps(each: Tested, shape: tuple[int, ...]) -> tuple[Array, Array]:
    """z and relative bias as maps (H, W), or of tiles."""
    channel = int(abs(each.z).max(axis=1).argmax())
    H, W = shape[1:] if each.family == "pixel" else (-(-shape[1] // TILE), -(-shape[2] // TILE))
    light = np.maximum(each.light[channel], each.light[channel].mean() / 100)
    return each.z[channel].reshape(H, W), (each.bias[channel] / light).reshape(H, W)
