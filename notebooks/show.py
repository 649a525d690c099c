"""How a notebook shows things: a picture in the house style, a table, and controls for a picture's arguments.

A picture is always an ordinary output of its cell, and controls stand above it: so it survives when a notebook is
saved, exported or read where no widgets run.  Without `ipywidgets` the first value of every control is shown.
"""
# ruff: noqa: PLC0415

import base64
import functools
import inspect
import io
import re
import time
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from html import escape
from typing import TYPE_CHECKING, Any, Protocol

from figures.report import style

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture

Draw = Callable[..., "Picture"]

LONGEST_ALT = 300
"""Letters of an alternative text."""

WORKING = "working ..."


@dataclass(frozen=True)
class Shown:
    """A picture as Jupyter displays it, with a text for those who do not see it."""

    png: bytes
    alt: str

    def _repr_png_(self) -> tuple[bytes, dict[str, str]]:
        return self.png, {"alt": self.alt}

    def _repr_html_(self) -> str:
        """The words reach the page only this way: JupyterLab does not show those of a PNG."""
        return f'<img alt="{escape(self.alt)}" src="data:image/png;base64,{base64.b64encode(self.png).decode()}">'

    def __repr__(self) -> str:
        return f"Picture: {self.alt}"


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
        file, picture = io.BytesIO(), draw(*args, **options)
        picture.savefig(file, format="png", dpi=110)
    return Shown(file.getvalue(), described(draw, picture))


def described(draw: Draw, picture: "Picture") -> str:
    """What draw's docstring says first, and the titles of the panels, which tell the setting."""
    while isinstance(draw, functools.partial):
        draw = draw.func
    first = (inspect.getdoc(draw) or "A picture").split("\n")[0]
    titles = [picture.get_suptitle(), *(ax.get_title(loc="left") or ax.get_title() for ax in picture.axes)]
    text = " ".join([first.rstrip(".") + ".", "; ".join(_plain(title) for title in titles if title)]).strip()
    return text if len(text) <= LONGEST_ALT else text[: LONGEST_ALT - 4] + " ..."


def _plain(title: str) -> str:
    """A title without the marks of its formulas."""
    return " ".join(re.sub(r"\\hat (\w)", r"\1_hat", title).replace("$", "").replace("\\", "").split())


# ---------------------------------------------------------------- controls


class Handle(Protocol):
    """A displayed output that can be replaced, like IPython's."""

    def update(self, obj: Any) -> None:
        """Show this instead."""


@dataclass(frozen=True, eq=False)
class Explored:
    """A picture of several settings, the first of which is shown, and the controls that Jupyter has for the others.

    An option of one value has no control.
    """

    draw: Draw
    options: Mapping[str, Sequence[Any]]

    def at(self, **setting: Any) -> Shown:
        """The picture with these options, and the first value of every other."""
        return show(self.draw, **{name: setting.get(name, values[0]) for name, values in self.options.items()})

    @property
    def choices(self) -> Mapping[str, Sequence[Any]]:
        """The options that can be chosen."""
        return {name: values for name, values in self.options.items() if len(values) > 1}

    def _ipython_display_(self) -> None:
        from IPython.display import DisplayHandle, display

        handle, first = DisplayHandle(), self.at()
        if has_widgets():
            display(controls(self, first, handle))
        handle.display(first)

    def __repr__(self) -> str:
        return repr(self.at())


def explore(draw: Draw, /, **options: Sequence[Any]) -> Explored:
    """The picture with a control for every option: a list of words, or a slider over numbers; the first value first."""
    return Explored(draw, options)


def has_widgets() -> bool:
    """Whether `ipywidgets` is installed."""
    try:
        import ipywidgets  # noqa: F401
    except ImportError:
        return False
    return True


def controls(explored: Explored, first: Shown, handle: Handle) -> Any:
    """Controls that update the picture of a handle; a line beside them says when they work, and how it went.

    What was drawn once is kept, and shown again at once.
    """
    import ipywidgets

    each = {name: _control(name, values) for name, values in explored.choices.items()}
    said = ipywidgets.Label("")
    drawn = {tuple(control.value for control in each.values()): first}

    def redraw(_: Any) -> None:
        setting, said.value = tuple(control.value for control in each.values()), ""
        if setting not in drawn:
            with _working(each.values(), said):
                drawn[setting] = explored.at(**dict(zip(each, setting, strict=True)))
        handle.update(drawn[setting])

    for control in each.values():
        control.observe(redraw, "value")
    return ipywidgets.VBox([ipywidgets.HBox(list(each.values())), said])


@contextmanager
def _working(widgets: Collection[Any], said: Any) -> Iterator[None]:
    """Controls that wait, and a label that says so, then how long it took, or what went wrong."""
    said.value, start = WORKING, time.perf_counter()
    for widget in widgets:
        widget.disabled = True
    try:
        yield
    except Exception as error:
        said.value = f"failed: {error}"
        raise
    else:
        said.value = f"drawn in {time.perf_counter() - start:.1f} s, from now on at once"
    finally:
        for widget in widgets:
            widget.disabled = False


def _control(name: str, values: Sequence[Any]) -> Any:
    """Numbers slide in ascending order, words drop down in theirs."""
    import ipywidgets

    if _are_words(values):
        return ipywidgets.Dropdown(options=list(values), value=values[0], description=name)
    return ipywidgets.SelectionSlider(
        options=ordered(values), value=values[0], description=name, continuous_update=False
    )


def ordered(values: Sequence[Any]) -> list[Any]:
    """Words as they are given, numbers in ascending order."""
    return list(values) if _are_words(values) else sorted(values)


def _are_words(values: Sequence[Any]) -> bool:
    return all(isinstance(value, str) for value in values)
