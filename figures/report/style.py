"""One look for all figures: readable without colour, drawn without pyplot, the same on every machine.

A method, a MIS weight or a cap has one colour, marker and dash wherever it appears (`LOOKS`).  Matplotlib is imported
when something is drawn: workers and listings do without.
"""
# ruff: noqa: PLC0415

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from cycler import cycler
from numpy.typing import NDArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Picture
    from matplotlib.image import AxesImage

# Okabe and Ito's colour-blind safe palette, ordered so that neighbours also differ in lightness.
BLUE, ORANGE, INK, VERMILLION, SKY, GREEN, PURPLE = (
    "#0072B2", "#E69F00", "#000000", "#D55E00", "#56B4E9", "#009E73", "#CC79A7",
)  # fmt: skip
COLOURS = (BLUE, ORANGE, INK, VERMILLION, SKY, GREEN, PURPLE)
GREY, PALE, PAPER = "#888888", "#dddddd", "#ffffff"
LINES = ("-", "--", "-.", ":", (0, (5, 1, 1, 1, 1, 1)), (0, (3, 1)), (0, (7, 2)))
MARKERS = ("o", "s", "^", "D", "v", "P", "X")
HATCHES = ("", "//", "..", "xx", "\\\\", "++", "oo")
LABELLED = 38.0
"""Height of ticks and label under an axis, in points."""
BETWEEN = 2
"""Pixels between crops of an image."""
SPARSE = 0.08
"""Distance between markers of a line, in diagonals of its axes."""

CYCLE = cycler(color=COLOURS, linestyle=LINES, marker=MARKERS, markevery=[SPARSE] * len(COLOURS))
IMAGE_MAP = "cividis"  # perceptually uniform, colour-blind safe, monotone in grey

RC: dict[str, Any] = {
    "axes.prop_cycle": CYCLE,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.titlesize": 10.0,
    "axes.titlelocation": "left",
    "font.size": 9.0,
    "grid.color": PALE,
    "grid.linewidth": 0.6,
    "hatch.linewidth": 0.8,
    "image.cmap": IMAGE_MAP,
    "image.interpolation": "nearest",
    "legend.frameon": False,
    "legend.fontsize": 8.5,
    "legend.handlelength": 2.8,
    "lines.linewidth": 1.5,
    "lines.markersize": 4.5,
    "figure.constrained_layout.use": True,
    "savefig.dpi": 150.0,
}


@contextmanager
def context() -> Iterator[None]:
    """The style, on top of matplotlib's own defaults: no user's matplotlibrc leaks into a figure."""
    import matplotlib as mpl

    with mpl.rc_context():
        mpl.rcdefaults()
        cast(dict[str, Any], mpl.rcParams).update(RC)
        yield


def panels(
    rows: int = 1, columns: int = 1, width: float = 3.6, height: float = 2.9
) -> tuple["Picture", NDArray[np.object_]]:
    """A picture and its (rows, columns) axes, `width` x `height` inches each.

    `fig, ax = panels(1, 2)`, then `ax[0, 1].loglog(n, variance, **look("talbot"))`: `ax` is always a 2D array.
    """
    from matplotlib.figure import Figure as Picture

    picture = Picture(figsize=(width * columns, height * rows), layout="constrained")
    return picture, picture.subplots(rows, columns, squeeze=False)


# ---------------------------------------------------------------- what a method looks like


@dataclass(frozen=True)
class Look:
    """Colour, marker, dash and hatch: any one but the colour tells it from its neighbours."""

    colour: str
    marker: str
    line: Any
    hatch: str


def _cycled(k: int) -> Look:
    return Look(COLOURS[k], MARKERS[k], LINES[k], HATCHES[k])


TALBOT, PAIRWISE, DEFENSIVE, UNCAPPED = _cycled(0), _cycled(1), _cycled(2), Look(VERMILLION, "*", ":", "xx")
CONTRIBUTION, CONSTANT = Look(VERMILLION, "D", ":", "xx"), Look(SKY, "v", LINES[4], "\\\\")
HYBRID = Look(BLUE, "o", "-", "")

LOOKS: Mapping[str, Look] = MappingProxyType(
    {
        # renderers and their shifts
        "hybrid": HYBRID,
        "ReSTIR PT": HYBRID,
        "reconnection": Look(VERMILLION, "D", "--", "xx"),
        "no distance test": Look(INK, "X", ":", "oo"),
        "path tracing": Look(ORANGE, "s", "-.", "//"),
        "path reuse": Look(GREEN, "v", LINES[5], "++"),
        "ReSTIR GI": Look(SKY, "^", LINES[4], ".."),
        "ReSTIR DI": Look(PURPLE, "P", LINES[6], "\\\\"),
        "reference": Look(INK, "", (0, (1, 1)), ""),
        "truth": Look(INK, "", (0, (1, 1)), ""),
        # what asks probes
        "primary DDGI": Look(SKY, "v", "--", "\\\\"),
        "secondary DDGI": Look(VERMILLION, "D", ":", "xx"),
        "resampled DDGI": Look(BLUE, "o", "-", ""),
        "resampled as printed": Look(GREEN, "P", LINES[5], "++"),
        # MIS weights
        "talbot": TALBOT,
        "Talbot": TALBOT,
        "generalised Talbot": TALBOT,
        "pairwise": PAIRWISE,
        "defensive": DEFENSIVE,
        "pairwise, defensive": DEFENSIVE,
        "1/Z": CONTRIBUTION,
        "1/M": CONSTANT,
        "constant": CONSTANT,
        # caps of the confidence
        "$M_c = 0$": Look(INK, "o", "-", ""),
        "$M_c = 1$": Look(SKY, "v", "--", ""),
        "$M_c = 5$": Look(GREEN, "^", "-.", ""),
        "$M_c = 20$": Look(BLUE, "s", LINES[5], ""),
        "$M_c = 50$": Look(PURPLE, "D", LINES[4], ""),
        "$M_c = 200$": Look(ORANGE, "P", LINES[6], ""),
        "$M_c = 1000$": Look(VERMILLION, "X", "-", ""),
        "no cap": UNCAPPED,
        # pixels of a pair, and their difference
        "$f_1$": Look(GREEN, "v", "-", ""),
        "$f_2$": Look(PURPLE, "P", "--", ""),
        "after": Look(SKY, "s", "--", "++"),
        "with": Look(BLUE, "o", "-", ""),
        "positivized": Look(INK, "^", "-.", ".."),
        "image alone": Look(GREEN, "v", LINES[4], "xx"),
        # reconstructions
        "primal": Look(ORANGE, "s", "--", "//"),
        "Poisson L2": Look(BLUE, "o", "-", ""),
        "Poisson L1": Look(INK, "^", "-.", ".."),
        # mutations
        "right": Look(BLUE, "o", "-", ""),
        "W inverted": Look(ORANGE, "s", "--", ""),
        "last accepted": Look(INK, "^", "-.", ""),
        "clamped": Look(VERMILLION, "D", ":", ""),
        "$w_{bn}$ = 0.25": Look(SKY, "v", LINES[4], ""),
        "$w_{bn}$ = 0.5": Look(GREEN, "P", LINES[5], ""),
        "$w_{bn}$ = 1": Look(PURPLE, "X", LINES[6], ""),
    }
)
"""What the project's pictures compare, by name: one look each, in every picture."""


def look(name: str, **changes: Any) -> dict[str, Any]:
    """A line of what is called `name`, which is its label too: `axis.plot(x, y, **look("hybrid"))`."""
    mine = _known(name)
    return {"color": mine.colour, "marker": mine.marker, "ls": mine.line, "label": name, **changes}


def bar(name: str, **changes: Any) -> dict[str, Any]:
    """A bar of what is called `name`."""
    return {"color": _known(name).colour, "hatch": _known(name).hatch, "edgecolor": PAPER, "label": name, **changes}


def _known(name: str) -> Look:
    if name not in LOOKS:
        raise KeyError(f"{name!r} has no look: add it to LOOKS in figures/report/style.py, or use `nth(k)`")
    return LOOKS[name]


def nth(k: int, **changes: Any) -> dict[str, Any]:
    """A line that only its own picture knows, by its number there."""
    return {"color": COLOURS[k], "marker": MARKERS[k], "ls": LINES[k], **changes}


def cap(M_c: float) -> str:
    """The name of a cap."""
    return f"$M_c = {M_c:g}$" if M_c < np.inf else "no cap"


def named(label: str) -> str:
    """The longest name of a look with which a label begins, such as "path tracing" of "path tracing, equal rays"."""
    ends = (",", ":", " (", " with ", "")
    fitting = [name for name in LOOKS if any(label.startswith(name + end) if end else label == name for end in ends)]
    return max(fitting, key=len, default="")


# ---------------------------------------------------------------- strips and legends


def strips(axis: "Axes", rows: Sequence[Any], names: Sequence[str], high: float, pixels: float, **bar: Any) -> None:
    """Rows of pixels above one another, each with its name, and the scale of their radiance from 0 to `high`."""
    place = (0.0, pixels, float(len(rows)), 0.0)
    shown: AxesImage = axis.imshow(np.stack(rows), vmin=0, vmax=high, aspect="auto", extent=place)
    axis.figure.colorbar(shown, ax=axis, **{"label": "radiance", "extend": "max", "pad": 0.02, **bar})
    axis.set_yticks(np.arange(len(rows)) + 0.5, list(names))
    axis.grid(visible=False)


def crops(axis: "Axes", images: "Mapping[str, NDArray[Any]]", *, side: int = 24, title: str = "") -> None:
    """Images (n,) of square crops by their names, the first one the reference, of whose pixels the scale is made."""
    reference = next(iter(images.values()))
    high = float(np.quantile(reference, 0.99)) * 1.3
    shown = np.concatenate([_side_by_side(image, side) for image in images.values()])
    found = axis.imshow(shown, vmin=0, vmax=high, aspect="equal")
    axis.figure.colorbar(found, ax=axis, label="radiance, mean of channels", shrink=0.8)
    height = side + BETWEEN
    axis.set_yticks(np.arange(len(images)) * height + side / 2, list(images))
    width = len(reference) // side**2
    axis.set_xticks(np.arange(width) * height + side / 2, [str(k + 1) for k in range(width)])
    axis.grid(visible=False)
    axis.set(xlabel=f"crop of the film, {side} pixels wide", title=title)


def _side_by_side(image: NDArray[Any], side: int) -> NDArray[Any]:
    """Crops side by side, NaN between them."""
    parts = image.reshape(-1, side, side)
    framed = np.pad(parts, ((0, 0), (0, BETWEEN), (0, BETWEEN)), constant_values=np.nan)
    return np.concatenate(list(framed), axis=1)


def below(axis: "Axes", **changes: Any) -> None:
    """A legend under the axis and its label, where it hides nothing."""
    from matplotlib.transforms import ScaledTranslation

    under = axis.transAxes + ScaledTranslation(0, -LABELLED / 72, axis.get_figure(root=True).dpi_scale_trans)  # type: ignore[union-attr]
    place = {"loc": "upper center", "bbox_to_anchor": (0.5, 0.0), "bbox_transform": under}
    axis.legend(**{**place, "ncols": 2, "columnspacing": 1.0, "borderaxespad": 0.0, **changes})
