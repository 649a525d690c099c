"""Pictures of a volume of probes on an axis that is handed in: what probes know of light and distance, and leaks.

Nothing here chooses a style, opens a window or draws random numbers.
"""
# ruff: noqa: PLC0415

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from flatland2d.directions import turned
from flatland2d.pictures import LIGHT, eye, lights, measure, outline
from flatland2d.scenes import Setting
from restir_ref.batch import Array, ratio
from restir_ref.transport.cache.biases import self_shadow
from restir_ref.transport.cache.leaks import leaked
from restir_ref.transport.cache.volume import Volume
from restir_ref.transport.rays import arrive

if TYPE_CHECKING:
    from matplotlib.axes import Axes

DEPTH, LEAK, EMBEDDED = "#0072B2", "#D55E00", "#999999"
SHOWN = 0.45
"""Radius of the largest lobe, in spacings: lobes of neighbours do not touch."""

WORTH = 0.01
"""Leaks are marked from this share of what a query is told."""

AREA = 150
"""Of the mark of a leak that is all that a query is told, square points."""


def volume_picture(ax: "Axes", setting: Setting, v: Volume) -> None:
    """Every probe with its irradiance by direction; walls are marked where probes that do not see them tell of light.

    A lobe's radius in direction n is E(n), channels averaged, over the largest of all.  Leaks are marked on what can be
    seen from the eye, looking all around, by areas in proportion to their share.  Probes inside walls are crosses.
    """
    from matplotlib.collections import PolyCollection

    E = v.E.mean(axis=0)
    size = SHOWN * min(v.grid.spacing) * ratio(E, E.max())
    shapes = around(v, np.flatnonzero(v.active), size, v.maps.irradiance.centres())
    ax.add_collection(
        PolyCollection(list(shapes), facecolors=LIGHT, edgecolors="k", linewidths=0.4, label="irradiance")
    )
    _places(ax, v)
    outline(ax, setting.scene)
    lights(ax, setting.scene)
    x, share = leaks(v, setting)
    shown = np.flatnonzero(share > WORTH)
    label = f"leaks, {100 * WORTH:.0f} % of E or more"
    _dots(ax, x[:, shown], s=AREA * share[shown], color=LEAK, lw=0, zorder=4, label=label)
    eye(ax, setting)
    measure(ax)


def depth_picture(ax: "Axes", setting: Setting, v: Volume, probe: Sequence[int]) -> None:
    """How far some probes see, by direction: the mean distance, and dotted one standard deviation more and less.

    Distances are clipped where they are stored, at 1.5 diagonals of a cell.
    """
    from matplotlib.collections import LineCollection

    r1, r2 = v.r
    sd = np.sqrt(np.maximum(r2 - r1**2, 0))
    for size, look in ((r1, "-"), (r1 - sd, ":"), (r1 + sd, ":")):
        shapes = around(v, np.asarray(probe), size, v.maps.depth.centres())
        closed = np.concatenate([shapes, shapes[:, :1]], axis=1)
        label = "mean distance" if look == "-" else "_one standard deviation"
        ax.add_collection(LineCollection(list(closed), color=DEPTH, ls=look, lw=1.2, label=label, zorder=3))
    _places(ax, v)
    outline(ax, setting.scene)
    lights(ax, setting.scene)
    measure(ax)


def around(v: Volume, probe: Array, size: Array, directions: Array) -> Array:
    """Corners (n, K, 2) around probes (n,), at distances size (P, K) in directions (2, K)."""
    return np.asarray(v.grid.place(probe).T[:, None] + size[probe][..., None] * directions.T)


def leaks(v: Volume, setting: Setting, count: int = 720) -> tuple[Array, Array]:
    """Points (2, N) that are seen from the eye in `count` directions, and the share of what is told there that leaks.

    Queries look along the normal, displaced by the self-shadow bias; channels are averaged.
    """
    w = turned((np.arange(count) + 0.5) / count)
    at, _, met = arrive(setting.scene, np.repeat(np.array(setting.eye)[:, None], count, axis=1), w)
    x, n = at.x[:, met], at.n[:, met]
    b = self_shadow(n, n, v.spacing)
    E = v.irradiance(x, n, n, b).mean(axis=0)
    return x, ratio(leaked(v, setting.scene, x, n, b).mean(axis=0), E)


def _places(ax: "Axes", v: Volume) -> None:
    """Dots where probes stand, crosses where they are inside walls."""
    places = v.grid.place(np.arange(v.grid.P))
    _dots(ax, places[:, v.active], s=3, color="k", zorder=3)
    if not v.active.all():
        _dots(ax, places[:, ~v.active], s=14, marker="x", color=EMBEDDED, lw=0.8, zorder=3, label="inside a wall")


def _dots(ax: "Axes", x: Array, **look: Any) -> None:
    """Marks at points (2, N)."""
    ax.scatter(x[0], x[1], **look)
