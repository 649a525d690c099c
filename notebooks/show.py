"""How a notebook shows things: a picture in the house style, a table, and controls for a picture's arguments.

Everything works without `ipywidgets`; the first value of every control is shown then.
"""
# ruff: noqa: PLC0415

import io
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from html import escape
from typing import TYPE_CHECKING, Any

from figures.report import style

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture

Draw = Callable[..., "Picture"]


@dataclass(frozen=True)
class Shown:
    """A picture as Jupyter displays it."""

    png: bytes

    def _repr_png_(self) -> bytes:
        return self.png

    def __repr__(self) -> str:
        return f"a picture of {len(self.png)} bytes"


@dataclass(frozen=True)
class Table:
    """Rows of cells under their headings, as text and as HTML."""

    headings: Sequence[str]
    rows: Sequence[Sequence[object]]

    def _repr_html_(self) -> str:
        lines = [_html(self.headings, "th"), *(_html(row, "td") for row in self.rows)]
        return f"<table>{''.join(lines)}</table>"

    def __repr__(self) -> str:
        cells = [[str(cell) for cell in row] for row in [self.headings, *self.rows]]
        widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
        padded = ((cell.ljust(width) for cell, width in zip(row, widths, strict=True)) for row in cells)
        return "\n".join("  ".join(row).rstrip() for row in padded)


def _html(cells: Sequence[object], tag: str) -> str:
    inner = (f"<{tag} style='text-align:left'>{escape(str(cell))}</{tag}>" for cell in cells)
    return f"<tr>{''.join(inner)}</tr>"


def show(draw: Draw, /, *args: Any, **options: Any) -> Shown:
    """draw(*args, **options), a function that returns a picture, in the house style."""
    with style.context():
        file = io.BytesIO()
        draw(*args, **options).savefig(file, format="png", dpi=110)
    return Shown(file.getvalue())


def explore(draw: Draw, /, **options: Sequence[Any]) -> Any:
    """The picture with a control for every option: a list of words, or a slider over numbers; the first value first."""
    first = {name: values[0] for name, values in options.items()}
    try:
        import ipywidgets
    except ImportError:
        return show(draw, **first)
    controls = {name: _control(name, values) for name, values in options.items()}
    image = ipywidgets.Image(value=show(draw, **first).png, format="png")

    def redraw(_: Any) -> None:
        image.value = show(draw, **{name: control.value for name, control in controls.items()}).png

    for control in controls.values():
        control.observe(redraw, "value")
    return ipywidgets.VBox([*controls.values(), image])


def _control(name: str, values: Sequence[Any]) -> Any:
    """Numbers slide in ascending order, words drop down in theirs."""
    import ipywidgets

    if all(isinstance(value, str) for value in values):
        return ipywidgets.Dropdown(options=list(values), value=values[0], description=name)
    return ipywidgets.SelectionSlider(
        options=sorted(values), value=values[0], description=name, continuous_update=False
    )
