"""One look for all figures: readable without colour, drawn without pyplot, the same on every machine.

Matplotlib is imported when something is drawn: workers and listings do without.
"""
# ruff: noqa: PLC0415

import io
import textwrap
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from cycler import cycler
from numpy.typing import NDArray

from figures.claims.figure import Arrays, Claim, Figure, conditions_of, verdict_line

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture

# Okabe and Ito's colour-blind safe palette, ordered so that neighbours also differ in lightness.
COLOURS = ("#0072B2", "#E69F00", "#000000", "#D55E00", "#56B4E9", "#009E73", "#CC79A7")
LINES = ("-", "--", "-.", ":", (0, (5, 1, 1, 1, 1, 1)), (0, (3, 1)), (0, (7, 2)))
MARKERS = ("o", "s", "^", "D", "v", "P", "X")
CYCLE = cycler(color=COLOURS, linestyle=LINES, marker=MARKERS, markevery=[0.08] * len(COLOURS))
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
    "grid.color": "#dddddd",
    "grid.linewidth": 0.6,
    "image.cmap": IMAGE_MAP,
    "image.interpolation": "nearest",
    "legend.frameon": False,
    "legend.fontsize": 8.0,
    "lines.linewidth": 1.5,
    "lines.markersize": 4.5,
    "figure.constrained_layout.use": True,
    "savefig.dpi": 150.0,
}

FOOT: dict[str, Any] = {
    "fontsize": 7.5,
    "family": "DejaVu Sans",
    "va": "top",
    "ha": "left",
    "linespacing": 1.3,
    "parse_math": False,
}
LINE_INCHES = 0.138

METADATA: dict[str, dict[str, Any]] = {"png": {"Software": None}, "pdf": {"CreationDate": None}}


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

    `fig, ax = panels(1, 2)`, then `ax[0, 1].loglog(n, variance, label="Talbot")`: `ax` is always a 2D array.
    """
    from matplotlib.figure import Figure as Picture

    picture = Picture(figsize=(width * columns, height * rows), layout="constrained")
    return picture, picture.subplots(rows, columns, squeeze=False)


def drawn(figure: Figure, arrays: Arrays, claims: Sequence[Claim]) -> dict[str, bytes]:
    """A figure's picture as PNG and PDF, by the names of their files, each with the verdicts at its foot."""
    lines = [verdict_line(claim, conditions_of(figure, claim.id)) for claim in claims]
    with context():
        picture = settled(figure.draw(arrays))
        return {f"figure.{kind}": render(picture, lines, kind) for kind in METADATA}


def settled(picture: "Picture") -> "Picture":
    """The picture, its layout worked out once for all the files to come."""
    picture.draw_without_rendering()
    picture.set_layout_engine("none")
    return picture


def render(picture: "Picture", lines: Sequence[str], kind: str) -> bytes:
    """The picture as a file with `lines` at its foot, which hangs below so that no layout is disturbed.

    The same picture gives the same bytes: whatever depends on the time is left out.
    """
    from matplotlib.transforms import Bbox

    width, height = picture.get_size_inches()
    text = "\n".join(wrapped(lines, width))
    depth = LINE_INCHES * (text.count("\n") + 1) + 0.1
    foot = picture.text(0.08 / width, -0.03 / height, text, **FOOT)
    page, file = Bbox.from_bounds(0, -depth, width, height + depth), io.BytesIO()
    picture.savefig(file, format=kind, bbox_inches=page, metadata=METADATA[kind])
    foot.remove()
    return file.getvalue()


def wrapped(lines: Sequence[str], width: float) -> list[str]:
    """The lines of a foot, broken to `width` inches."""
    columns = max(30, int(width * 16.5))
    return [piece for line in lines for piece in textwrap.wrap(line, columns, subsequent_indent="    ")]
