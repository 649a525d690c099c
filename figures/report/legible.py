"""Can a picture be read?  At the width of the report's page, in grey, and without a guide.

Every law lists its offenders in words.  They are asked of a picture whose layout is settled, as far as Matplotlib tells
where things are.
"""
# ruff: noqa: PLC0415

import json
from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.report import style

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure as Picture
    from matplotlib.legend import Legend
    from matplotlib.text import Text
    from matplotlib.transforms import Bbox

NAME = "legible.json"
PAGE, LEAST = 1000, 9.0
"""Width at which a picture is shown, and the least size of its text there, in pixels."""
APART = 0.15
"""Least difference in lightness, of 1, by which two bars without hatching are told apart."""

Looks = Mapping[str, Sequence[str]]
"""Colour, marker, dash and hatch by label."""


def troubles(picture: "Picture") -> list[str]:
    """Everything that keeps the picture from being read."""
    laws = (small, cut_off, unlabelled, covered, colliding, alike, unexplained, scaleless, contradictory)
    return [trouble for law in laws for trouble in law(picture)]


# ---------------------------------------------------------------- text


def small(picture: "Picture") -> Iterator[str]:
    """Text of less than `LEAST` pixels when the picture is `PAGE` pixels wide."""
    scale = PAGE / (72 * picture.get_size_inches()[0])
    for text in texts(picture):
        if (size := scale * float(text.get_fontsize())) < LEAST - 1e-9:
            yield f"{text.get_text()!r} is {size:.1f} px high, less than {LEAST:g}"


def cut_off(picture: "Picture") -> Iterator[str]:
    """Text that runs over the border of the picture."""
    page = picture.bbox.padded(1)
    for text in texts(picture):
        box = text.get_window_extent()
        if min(box.x0 - page.x0, box.y0 - page.y0, page.x1 - box.x1, page.y1 - box.y1) < 0:
            yield f"{text.get_text()!r} is cut off at the border"


def texts(picture: "Picture") -> "list[Text]":
    """All text that is drawn."""
    on_axes = [text for axis in axes(picture) for text in of_axes(axis)]
    legends = [text for legend in all_legends(picture) for text in [*legend.get_texts(), legend.get_title()]]
    return [text for text in [*picture.texts, *on_axes, *legends] if drawn(text)]


def of_axes(axes: "Axes") -> "Iterator[Text]":
    """Title, words, labels and ticks of one panel, its tables included."""
    yield from (axes.title, axes._left_title, axes._right_title)  # type: ignore[attr-defined]
    yield from axes.texts
    for table in axes.tables:
        yield from (cell.get_text() for cell in table.get_celld().values())
    if axes.axison:
        for axis in sides(axes):
            yield from (axis.label, *ticks(axis))


def drawn(text: "Text") -> bool:
    """Whether a text is to be seen."""
    return text.get_visible() and bool(text.get_text().strip())


def axes(picture: "Picture") -> "list[Axes]":
    """All panels, those inside others included."""
    found: list[Any] = list(picture.axes)
    for each in found:  # grows by what it finds
        found += each.child_axes
    return [each for each in found if each.get_visible()]


def sides(axes: "Axes") -> "tuple[Axis, Axis]":
    """Both axes of a panel."""
    return axes.xaxis, axes.yaxis


def ticks(axis: "Axis") -> "list[Text]":
    """Labels of ticks within the limits of their axis, on whichever side they stand."""
    if not axis.get_visible():
        return []
    low, high = sorted(axis.get_view_interval())
    slack = 1e-6 * (high - low)
    marks = [*axis.get_major_ticks(), *axis.get_minor_ticks()]
    inside = [tick for tick in marks if low - slack <= tick.get_loc() <= high + slack]
    return [text for tick in inside for text in (tick.label1, tick.label2) if drawn(text)]


def unlabelled(picture: "Picture") -> Iterator[str]:
    """Axes with numbers but without words for what they count; names for ticks speak for themselves."""
    for panel in axes(picture):
        for side in sides(panel) if panel.axison else ():
            numbers = [text.get_text() for text in ticks(side) if numeric(text.get_text())]
            if numbers and not side.label.get_text().strip() and not borrowed(panel, side):
                yield f"axis {named(side)} of {title(panel)} has ticks {', '.join(numbers[:3])} and no label"


def numeric(text: str) -> bool:
    """Whether a label of a tick is a number, written plainly or as a power."""
    return any(letter.isdigit() for letter in text) and not any(
        letter.isalpha() for letter in text.replace("mathdefault", "").replace("times", "").replace("mathrm", "")
    )


def named(side: "Axis") -> str:
    """The letter of an axis."""
    return "x" if side is side.axes.xaxis else "y"


def borrowed(panel: "Axes", side: "Axis") -> bool:
    """Whether a panel of the same row or column has the words, as a grid of panels has them at its border."""
    mine = panel.get_subplotspec()
    for other in panel.figure.axes if mine else ():
        theirs = other.get_subplotspec()
        if mine is None or theirs is None or theirs.get_gridspec() is not mine.get_gridspec():
            continue
        fits = theirs.colspan == mine.colspan if named(side) == "x" else theirs.rowspan == mine.rowspan
        if fits and (other.xaxis if named(side) == "x" else other.yaxis).label.get_text().strip():
            return True
    return False


def title(panel: "Axes") -> str:
    """A name for a panel in messages."""
    return repr(panel.get_title("left") or panel.get_title() or panel.get_ylabel() or "a panel")


# ---------------------------------------------------------------- legends


def all_legends(picture: "Picture") -> "list[Legend]":
    """Legends of all panels and of the picture."""
    found = [each.get_legend() for each in axes(picture)]
    return [*(legend for legend in found if legend is not None and legend.get_visible()), *picture.legends]


def covered(picture: "Picture") -> Iterator[str]:
    """Text, lines, marks and bars under a legend."""
    words = {id(text): text for text in texts(picture)}
    for legend in all_legends(picture):
        box = legend.get_window_extent().padded(-1)
        own = {id(text) for text in [*legend.get_texts(), legend.get_title()]}
        for key, text in words.items():
            if key not in own and box.overlaps(text.get_window_extent()):
                yield f"a legend covers the text {text.get_text()!r}"
        for panel in axes(picture):
            if any(inside(points, box) for points in marks(panel)):
                yield f"a legend covers what {title(panel)} shows"


def inside(points: Any, box: "Bbox") -> bool:
    """Whether any of the points (n, 2), in pixels of the screen, is in the box."""
    x, y = np.asarray(points, dtype=float).reshape(-1, 2).T
    return bool(((x > box.x0) & (x < box.x1) & (y > box.y0) & (y < box.y1)).any())


def marks(panel: "Axes") -> Iterator[Any]:
    """Points along all that a panel shows, in pixels of the screen, cut off at its borders."""
    from matplotlib.patches import Rectangle

    for line in panel.lines:
        if line.get_visible() and not is_guide(line):
            yield within(panel, along(line.get_transform().transform(line.get_xydata()), str(line.get_linestyle())))
    for patch in panel.patches:
        if not is_guide(patch) and isinstance(patch, Rectangle):
            yield within(panel, grid(patch.get_window_extent()))
    for each in panel.collections:
        offsets = np.asarray(each.get_offsets())
        if len(offsets) > 1:
            yield within(panel, each.get_offset_transform().transform(offsets))


def within(panel: "Axes", points: Any) -> Any:
    """The points that are not cut off."""
    box = panel.get_window_extent()
    return points[(points >= (box.x0, box.y0)).all(axis=1) & (points <= (box.x1, box.y1)).all(axis=1)]


def along(points: Any, dash: str, pieces: int = 20) -> Any:
    """The points and those between them; no line, no points between."""
    points = points[np.isfinite(points).all(axis=1)]
    if dash == "None" or len(points) < 2:
        return points
    t = np.linspace(0, 1, pieces)[:, None, None]
    return ((1 - t) * points[None, :-1] + t * points[None, 1:]).reshape(-1, 2)


def grid(box: "Bbox", n: int = 12) -> Any:
    """Points all over a box."""
    x, y = np.meshgrid(np.linspace(box.x0, box.x1, n), np.linspace(box.y0, box.y1, n))
    return np.stack([x.ravel(), y.ravel()], axis=1)


def is_guide(artist: "Artist") -> bool:
    """Whether a line or bar spans its panel, as `axhline` and `axvspan` draw them."""
    from matplotlib.patches import Patch

    panel, own = artist.axes, artist.get_data_transform() if isinstance(artist, Patch) else artist.get_transform()
    return panel is not None and own in (panel.get_xaxis_transform(), panel.get_yaxis_transform())


def colliding(picture: "Picture") -> Iterator[str]:
    """Labels of ticks that run into one another."""
    for panel in axes(picture):
        for side in sides(panel) if panel.axison else ():
            boxes = [(text.get_text(), text.get_window_extent(), text.get_rotation()) for text in ticks(side)]
            for (one, a, _), (two, b, _) in combinations([each for each in boxes if each[2] % 90 == 0], 2):
                if a.padded(-0.5).overlaps(b.padded(-0.5)):
                    yield f"ticks {one!r} and {two!r} of {title(panel)} collide"


# ---------------------------------------------------------------- looks


def shown(panel: "Axes") -> list[tuple[str, tuple[str, str, str, str]]]:
    """What of a panel a legend of its picture names: labels with colour, marker, dash and hatch."""
    picture: Any = panel.get_figure(root=True)
    named = {text.get_text() for legend in all_legends(picture) for text in legend.get_texts()}
    pairs = zip(*panel.get_legend_handles_labels(), strict=True)
    return [(str(label), look(handle)) for handle, label in pairs if label in named]


def look(handle: Any) -> tuple[str, str, str, str]:
    """Colour, marker, dash and hatch of a line, a bar, or the first of a bundle of them."""
    from matplotlib.collections import Collection
    from matplotlib.colors import to_hex
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    if isinstance(handle, tuple):
        return look(next(each for each in handle if each is not None))
    if isinstance(handle, Line2D):
        return to_hex(handle.get_color()), str(handle.get_marker()), dashes(handle), ""
    if isinstance(handle, Patch):
        colour = handle.get_facecolor() if handle.get_fill() else handle.get_edgecolor()
        return on_paper(colour), "", dashes(handle), handle.get_hatch() or ""
    if isinstance(handle, Collection):
        colours = [*handle.get_facecolor(), *handle.get_edgecolor()]
        shape = [str(len(np.asarray(path.vertices))) for path in handle.get_paths()[:1]]
        return on_paper(colours[0]), "", str(handle.get_linestyle()[0]), "".join(shape)
    return "", "", "", ""


def on_paper(colour: Any) -> str:
    """A colour as it is seen on white paper."""
    from matplotlib.colors import to_hex, to_rgba

    red, green, blue, alpha = to_rgba(colour)
    white = 1 - alpha
    return to_hex((alpha * red + white, alpha * green + white, alpha * blue + white))


def dashes(handle: Any) -> str:
    """The pattern of a line as it is drawn; none where there is no line."""
    plain = str(handle.get_linestyle())
    return "None" if plain == "None" else str(getattr(handle, "_dash_pattern", plain))


def looks(picture: "Picture") -> dict[str, list[str]]:
    """All labels of a picture with their looks."""
    return {label: list(mine) for panel in axes(picture) for label, mine in shown(panel)}


def contradictory(picture: "Picture") -> Iterator[str]:
    """Labels with two colours, and names of `style.LOOKS` with another colour than there."""
    colours: dict[str, str] = {}
    for label, (colour, *_) in (each for panel in axes(picture) for each in shown(panel)):
        if colours.setdefault(label, colour) != colour:
            yield f"{label!r} is {colours[label]} and {colour}"
        name = style.named(label)
        if name and colour != style.LOOKS[name].colour.lower():
            yield f"{label!r} is {colour}, and {name!r} is {style.LOOKS[name].colour.lower()} everywhere"


def alike(picture: "Picture") -> Iterator[str]:
    """Lines of one panel that only their colour tells apart; bars and dots alike in hatching, shape and lightness."""
    for panel in axes(picture):
        for (one, a), (two, b) in combinations(dict(shown(panel)).items(), 2):
            is_bar = not a[1]
            if a[1:] == b[1:] and not (is_bar and abs(lightness(a[0]) - lightness(b[0])) >= APART):
                yield f"{one!r} and {two!r} of {title(panel)} differ in colour only"


def lightness(colour: str) -> float:
    """Luma of a colour, 0 to 1: what is left of it in grey."""
    from matplotlib.colors import to_rgb

    return float(np.dot(to_rgb(colour), (0.299, 0.587, 0.114)))


def unexplained(picture: "Picture") -> Iterator[str]:
    """Lines across a panel of which no legend of the picture says what they are."""
    named = {mine for panel in axes(picture) for _, mine in shown(panel)}
    for panel in (each for each in axes(picture) if each.axison):
        for line in panel.lines:
            if is_guide(line) and look(line) not in named:
                yield f"a line across {title(panel)} is not explained"


def scaleless(picture: "Picture") -> Iterator[str]:
    """Images of numbers without a scale; colours that are colours need none."""
    for panel in axes(picture):
        for image in panel.images:
            values = image.get_array()
            if values is not None and values.ndim == 2 and image.colorbar is None:
                yield f"the image {title(panel)} has no scale"


# ---------------------------------------------------------------- pictures of a folder


def problems(out: Path) -> Iterator[str]:
    """What cannot be read in the stored pictures of a folder, and what looks otherwise in another picture."""
    stored = {path.parent.name: json.loads(path.read_bytes()) for path in sorted(out.glob(f"*/{NAME}"))}
    for id_, seen in stored.items():
        yield from (f"{id_}: {trouble}" for trouble in seen["troubles"])
    yield from contradictions({id_: seen["looks"] for id_, seen in stored.items()})


def contradictions(pictures: Mapping[str, Looks]) -> Iterator[str]:
    """Labels that have another colour in another picture."""
    first: dict[str, tuple[str, str]] = {}
    for id_, seen in pictures.items():
        for label, (colour, *_) in seen.items():
            where, before = first.setdefault(label, (id_, colour))
            if before != colour:
                yield f"{label!r} is {before} in {where} and {colour} in {id_}"
