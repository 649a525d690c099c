"""Pictures of flatland on an axis that is handed in: scenes, bundles of paths, fluence.

Nothing here chooses a style, opens a window or draws random numbers.  Materials differ in line style
and lightness as well as in colour.
"""
# ruff: noqa: PLC0415

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from flatland2d.scenes import INSET, Setting
from flatland2d.sensors import FILM, Pinhole
from flatland2d.tone import exposure, tone
from restir_ref.batch import Array, ratio
from restir_ref.transport.lobes import KINDS
from restir_ref.transport.paths import Tracer, leaves, trace
from restir_ref.transport.rays import arrive, sample_light
from restir_ref.transport.scene import Scene

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.colorbar import Colorbar
    from matplotlib.figure import Figure

MATERIALS: Sequence[dict[str, Any]] = (
    {"color": "#000000", "ls": "-", "lw": 1.6},
    {"color": "#0072B2", "ls": (0, (4, 0.7)), "lw": 2.4},
    {"color": "#D55E00", "ls": (0, (1.2, 0.6)), "lw": 2.4},
    {"color": "#009E73", "ls": (0, (6, 0.7, 1, 0.7)), "lw": 2.0},
)
"""Looks of materials by their number."""

LIGHT = "#E69F00"
EYE = "#CC79A7"
UNIT = "unit lengths"


def scene_picture(ax: "Axes", setting: Setting, n: int = INSET) -> None:
    """The scene, its eye, and what the crop of n pixels of the film sees; what is drawn has labels for a legend."""
    outline(ax, setting.scene)
    lights(ax, setting.scene)
    view(ax, setting, n)
    measure(ax)


def outline(ax: "Axes", scene: Scene, **look: Any) -> None:
    """Segments and circles by material, each with its words as label; `look` overrides how they are drawn."""
    from matplotlib.collections import LineCollection

    for m in np.unique(scene.material):
        facets = np.flatnonzero(scene.material[: scene.S] == m)
        circles = [circle(scene, int(b)) for b in np.flatnonzero(scene.material[scene.S :] == m)]
        lines = [*scene.corners[:, :, facets].transpose(2, 0, 1), *circles]
        style = {**MATERIALS[m % len(MATERIALS)], "label": material_in_words(scene, int(m)), "zorder": 2.5, **look}
        ax.add_collection(LineCollection(lines, **style))
    ax.autoscale_view()


def circle(scene: Scene, b: int, corners: int = 97) -> Array:
    """Ball b as a closed polygon, (corners, 2)."""
    angle = np.linspace(0, 2 * np.pi, corners)
    return np.asarray(scene.centres[:, b] + scene.radii[b] * np.stack([np.cos(angle), np.sin(angle)], axis=-1))


def material_in_words(scene: Scene, m: int) -> str:
    """The lobes of material m, "lambert + ggx r .15", black ones left out."""
    t = scene.materials
    rows = [row for row in range(m * t.L, (m + 1) * t.L) if t.colour[:, row].any()]
    return " + ".join(KINDS[t.kind[row]] + _roughness(t.roughness[row]) for row in rows) or "black"


def _roughness(r: float) -> str:
    return f" r {r:.2g}".replace("0.", ".") if 0 < r < 1 else ""


def lights(ax: "Axes", scene: Scene, most: int = 4) -> None:
    """Lights as broad bars, each with a word on the side they shine to; more than `most` share one word."""
    from matplotlib.collections import LineCollection

    lamps = scene.lights
    ends = lamps.corners.transpose(2, 0, 1)
    for width, colour, order in ((5.5, "#000000", 2.6), (3.5, LIGHT, 2.7)):
        ax.add_collection(LineCollection(list(ends), color=colour, lw=width, zorder=order, capstyle="butt"))
    middle, n = lamps.corners.mean(axis=0), lamps.normals
    if len(ends) <= most:
        for k in range(len(ends)):
            _word(ax, "light", middle[:, k], n[:, k])
    else:
        _word(ax, f"{len(ends)} lights", middle.mean(axis=1), n.mean(axis=1), 10)


def _word(ax: "Axes", text: str, at: Array, towards: Array, away: float = 6) -> None:
    """Text `away` points from a place, in the given direction."""
    x, y = np.round(towards).astype(int)
    ha, va = ("right", "center", "left")[x + 1], ("top", "center", "bottom")[y + 1]
    look = {"boxstyle": "square,pad=0.1", "fc": "w", "ec": "none", "alpha": 0.75}
    place: dict[str, Any] = {"xytext": (away * x, away * y), "textcoords": "offset points", "ha": ha, "va": va}
    ax.annotate(text, tuple(at), **place, fontsize=8, bbox=look, zorder=6)


def view(ax: "Axes", setting: Setting, n: int) -> None:
    """The eye, the borders of its film (dotted), and the region that n pixels of its inset see."""
    from matplotlib.patches import Polygon

    film, crop = setting.pinhole(FILM, 0), setting.pinhole(n)
    for pixel, u in ((0, 0.0), (FILM - 1, 1.0)):
        x, y = np.stack([setting.eye, _seen(setting, film, np.array([pixel]), u)[:, 0]], axis=1)
        ax.plot(x, y, color=EYE, ls=":", lw=0.9, marker="", zorder=2)
    seen = _seen(setting, crop, np.arange(n), 0.5)
    corners = np.concatenate([[setting.eye], seen.T])
    ax.add_patch(Polygon(corners, color=EYE, alpha=0.35, lw=0, zorder=1.5, label=f"seen by {n} of {FILM} pixels"))
    eye(ax, setting)


def eye(ax: "Axes", setting: Setting) -> None:
    """The eye."""
    ax.scatter(*setting.eye, s=30, color=EYE, edgecolors="k", zorder=5, label="eye")


def _seen(setting: Setting, sensor: Pinhole, pixel: Array, u: float) -> Array:
    """What pixels see first, (2, N)."""
    x, w, _ = sensor.ray(pixel, np.full((1, len(pixel)), u))
    return arrive(setting.scene, x, w)[0].x


def measure(ax: "Axes") -> None:
    """Axes in unit lengths, equally scaled."""
    ax.set(xlabel=f"$x$ ({UNIT})", ylabel=f"$y$ ({UNIT})", aspect="equal")
    ax.grid(visible=False)


# ---------------------------------------------------------------- bundles


def strands(t: Tracer, u: Array, pixel: Array) -> tuple[Array, Array]:
    """Every straight piece of the path trees of u (D, N), (K, 2 ends, 2), and the light it carries (K,).

    The piece from x_i to x_(i+1) carries the leaf (i, BSDF) and all leaves with k > i; the one from x_i
    to its light carries the leaf (i, NEE).  Channels are averaged.
    """
    tree = trace(t, u, pixel)
    F = {(k, nee): value.mean(axis=0) for k, nee, value in leaves(tree)}
    x = [t.sensor.ray(pixel, u[: t.sensor.numbers])[0], *(v.x for v in tree.x)]
    ends, carried, beyond = [], [], np.zeros(len(pixel))
    for i in range(t.depth, -1, -1):
        beyond = beyond + F[i, False]
        ends.append((x[i], x[i + 1]))
        carried.append(beyond)
        if i > 0:
            ends.append((x[i], light_point(t, u, i)))
            carried.append(F[i, True])
            beyond = beyond + F[i, True]
    return np.concatenate([np.stack(e).transpose(2, 0, 1) for e in ends]), np.concatenate(carried)


def light_point(t: Tracer, u: Array, i: int) -> Array:
    """The point (d, N) that light sampling at x_i chooses."""
    return sample_light(t.scene, *t.light_numbers(u, i)).y


def bundle_picture(ax: "Axes", setting: Setting, t: Tracer, u: Array, pixel: Array) -> None:
    """Path trees of primary samples u (D, N): the more light a piece carries, the broader and darker it is."""
    from matplotlib.collections import LineCollection

    ends, carried = strands(t, u, pixel)
    lit = np.flatnonzero(carried > 0)
    order = lit[np.argsort(carried[lit])]
    share = tone(carried[order], exposure(carried[order], 75))
    colour = np.zeros((len(order), 4))
    colour[:, 3] = 0.03 + 0.5 * share**2
    ax.add_collection(LineCollection(list(ends[order]), colors=colour, linewidths=0.3 + share, zorder=2))
    outline(ax, setting.scene)
    lights(ax, setting.scene)
    eye(ax, setting)
    measure(ax)


# ---------------------------------------------------------------- fluence


def fluence_picture(ax: "Axes", setting: Setting, values: Array, percentile: float = 99.0) -> "Colorbar":
    """A fluence map (rows, columns), row 0 at the bottom, with the scene on top; returns its logarithmic scale.

    Fluence is radiance integrated over all directions of the plane: radiance x radians.
    What is darker or brighter than the scale has the tone of its end.
    """
    from matplotlib.colors import LogNorm
    from matplotlib.ticker import NullLocator

    low, high = fluence_limits(values, percentile)
    norm, values = LogNorm(low, high), np.maximum(values, low)
    (x, y), (X, Y) = setting.low, setting.high
    image = ax.imshow(values, cmap="cividis", norm=norm, origin="lower", extent=(x, X, y, Y), interpolation="nearest")
    for look in ({"color": "k", "lw": 2.0}, {"color": "w", "lw": 0.9}):
        outline(ax, setting.scene, ls="-", label="_outline", **look)
    measure(ax)
    scale = ax.inset_axes((1.03, 0.0, 0.04 * (Y - y) / (X - x), 1.0))
    bar = _figure(ax).colorbar(image, cax=scale, ticks=fluence_ticks(low, high), format="%g", extend="both")
    bar.ax.yaxis.set_minor_locator(NullLocator())
    bar.set_label("fluence (radiance × rad)")
    return bar


def _figure(ax: "Axes") -> "Figure":
    figure = ax.get_figure(root=True)
    assert figure is not None
    return figure


def fluence_limits(values: Array, percentile: float = 99.0, least: float = 10.0) -> tuple[float, float]:
    """Between which fluences a map shows its tones: percentiles of the lit places, at least a factor `least` apart."""
    lit = values[values > 0]
    if not lit.size:
        return 1.0, least
    low, high = np.percentile(lit, [100 - percentile, percentile])
    spread = max(1.0, float(np.sqrt(least * low / high)))
    return float(low) / spread, float(high) * spread


def fluence_ticks(low: float, high: float, count: int = 5) -> Array:
    """Round numbers between `low` and `high`, about equally spaced on a scale of logarithms."""
    wanted = np.geomspace(low, high, count)
    size = 10.0 ** np.floor(np.log10(wanted))
    rounded = np.round(ratio(wanted, size) * 2) / 2 * size
    return np.unique(rounded[(rounded >= low) & (rounded <= high)])
