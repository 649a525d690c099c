"""The README's two pictures: `python docs/pictures.py` draws them into docs/, the second from results in out/.

Light in two rooms that are joined by a slit, and [GRIS Fig. 7] from stored arrays, both without verdicts below.
"""

import sys
from pathlib import Path

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from figures.gris.gris_f07 import FIGURE
from figures.report import style
from flatland2d import setting
from flatland2d.fluence import fluence_map
from flatland2d.pictures import lights, outline, strands
from restir_ref.chance import Live
from restir_ref.transport.paths import RECONNECTION, Tracer

HERE = Path(__file__).resolve().parent
ROWS, SAMPLES, PATHS, FILM = 160, 256, 60, 1920


def flatland() -> Figure:
    """Fluence of the two rooms on a logarithmic scale, and path trees from the eye: broad where they carry light."""
    rooms, chance = setting("ajar"), Live(np.random.default_rng(1))
    (x, y), (X, Y) = rooms.low, rooms.high
    light = fluence_map(rooms, round(ROWS * (X - x) / (Y - y)), ROWS, SAMPLES, chance)
    t = Tracer(rooms.scene, rooms.pinhole(FILM, 0), rooms.depth, RECONNECTION)
    ends, carried = strands(t, chance.uniform((t.D, PATHS)), np.arange(PATHS) * FILM // PATHS)
    picture = Figure(figsize=(8, 4), layout="constrained")
    ax = picture.subplots()
    low, high = np.percentile(light, [5, 99.5])
    ax.imshow(light, cmap=style.IMAGE_MAP, norm=LogNorm(low, high), origin="lower", extent=(x, X, y, Y))
    share = np.clip(carried / np.percentile(carried[carried > 0], 90), 0, 1)
    ax.add_collection(LineCollection(list(ends), colors="w", linewidths=0.25 + 1.2 * share, alpha=0.5))
    outline(ax, rooms.scene, color="k", lw=2.5, ls="-")
    lights(ax, rooms.scene)
    ax.plot(*rooms.eye, "o", color="w", mec="k", ms=8)
    ax.set_axis_off()
    return picture


def figure_7(out: Path) -> Figure:
    """[GRIS Fig. 7] from the arrays in a folder of results."""
    with np.load(out / FIGURE.id / "arrays.npz") as arrays:
        return FIGURE.draw(dict(arrays))


def main() -> None:
    """Draw both; the folder of results is the first argument, or out."""
    out = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
    with style.context():
        flatland().savefig(HERE / "flatland.png", dpi=110, metadata={"Software": None})
        figure_7(out).savefig(HERE / "gris-f07.png", metadata={"Software": None})


if __name__ == "__main__":
    main()
