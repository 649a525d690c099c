"""A base path and its offset path side by side: what is replayed, where they reconnect, and why some shifts are not."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from flatland2d.pictures import eye, lights, measure, outline
from flatland2d.scenes import Setting
from restir_ref.batch import Array
from restir_ref.transport.paths import Path, Tracer
from restir_ref.transport.proofs.reading import (
    ExtendedPath,
    extended_path,
    factors,
    first_connectable,
    offset_path,
    positions,
    roughnesses,
)
from restir_ref.transport.shifts import shift_path

if TYPE_CHECKING:
    from matplotlib.axes import Axes

BASE, OFFSET, JOINT = "#000000", "#56B4E9", "#D55E00"

MARKS = (
    ("o", BASE, "connectable by this rule"),
    ("o", "w", "not connectable by it"),
    ("D", BASE, "where the paths meet"),
    ("s", "w", "on a light"),
)
"""Marks of vertices, their faces and their words in a legend."""


@dataclass(frozen=True, eq=False)
class Pair:
    """One path x and its offset path y, of one column; c is where x reconnects, 0 for pure replay.

    J and gain = p_hat(y) / p_hat(x) are 0 where the shift is undefined; y is then what it came to.
    """

    t: Tracer
    x: ExtendedPath
    y: ExtendedPath
    c: int
    J: float
    gain: float


def pair(t: Tracer, path: Path, i: int, j: int) -> Pair:
    """The recorded path of pixel i, one column with light, and its offset path in pixel j."""
    here, there = np.array([i]), np.array([j])
    x = extended_path(t, path.u, here, path.k, path.nee)
    y, J = shift_path(t, path, there)
    gain = y.F.mean() / path.F.mean()
    return Pair(t, x, offset_path(t, x, path.c, there), int(path.c[0]), float(J[0]), float(gain))


def pair_in_words(p: Pair) -> str:
    """The Jacobian and the change of p_hat, or why the shift is undefined."""
    where = f"reconnects at $x_{p.c}$" if p.c else "replays everything"
    if p.J > 0:
        return f"{where}: $J$ = {p.J:.3g}, $\\hat p(y) / \\hat p(x)$ = {p.gain:.3g}"
    return f"{where}: $J$ = 0, {why_undefined(p)}"


def why_undefined(p: Pair) -> str:
    """The first reason that the offset path gives for J = 0."""
    seen, last = p.y.seen[:, 0], p.c - 1 if p.c else int(p.y.k[0])
    if not seen[:last].all():
        return f"the replay is lost after $y_{int(np.argmin(seen))}$"
    c = int(first_connectable(p.t, p.y, factors(p.t, p.y))[0])
    if c != p.c:
        return f"$y$ would reconnect at {c}" if c else "$y$ cannot reconnect there"
    if not seen[last]:
        return f"something stands between $y_{last}$ and $x_{p.c}$" if p.c else "its light is hidden"
    return "no lobe leads there"


def shift_picture(ax: "Axes", setting: Setting, p: Pair) -> None:
    """Base path black, replayed part of the offset path blue, its reconnection broad and red.

    Full vertices are connectable under the rule of the path's tracer, that is rough enough for it: under
    replay none is, under reconnection nearly all are, however smooth.  Open ones are not.  A diamond is where
    the paths meet, a square is on a light.  The title is `pair_in_words`.
    """
    outline(ax, setting.scene)
    lights(ax, setting.scene)
    eye(ax, setting)
    x, y = (positions(path)[0][:, :, 0] for path in (p.x, p.y))
    replayed = y[: p.c] if p.c else y
    ax.plot(*x.T, color=BASE, ls="-", lw=1.3, marker="", zorder=3, label="base path")
    ax.plot(*replayed.T, color=OFFSET, ls="--", lw=2.0, marker="", zorder=3.2, label="offset path, replayed")
    if p.c:
        ax.plot(*y[p.c - 1 : p.c + 1].T, color=JOINT, ls="-", lw=3.0, marker="", zorder=3.1, label="reconnection")
    for mark, colour, words in MARKS:
        ax.scatter([], [], s=38, marker=mark, color=colour, edgecolors=BASE, lw=1.4, label=words)
    _vertices(ax, p, p.x, len(x), "x", BASE)
    _vertices(ax, p, p.y, p.c or len(y), "y", OFFSET)
    measure(ax)
    (left, low), (right, high) = setting.low, setting.high
    ax.set(xlim=(left - 0.15, right + 0.18), ylim=(low - 0.15, high + 0.15))
    ax.set_title(pair_in_words(p))


def connectable_vertices(t: Tracer, x: ExtendedPath) -> Array:
    """Which vertices of a path of one column are rough enough for its tracer's rule, never a mirror; (K,) bool."""
    rough = roughnesses(t, x)[:, 0]
    return np.asarray((rough > 0) & (rough >= t.rule.roughness))


def _vertices(ax: "Axes", p: Pair, path: ExtendedPath, upto: int, name: str, colour: str) -> None:
    """Marks and names of vertices 1 .. upto - 1."""
    full, k = connectable_vertices(p.t, path), int(path.k[0])
    for i in range(1, min(upto, k + 2)):
        x, y = path.x[i, :, 0]
        mark, size = ("D", 55) if i == p.c else ("s", 30) if i == k + 1 else ("o", 38)
        face = colour if full[i] else "w"
        ax.scatter(x, y, s=size, marker=mark, color=face, edgecolors=colour, lw=1.4, zorder=4)
        common = np.array_equal(p.x.x[i], p.y.x[i])
        if path is p.x or not common:
            look: dict[str, Any] = {"ha": "center", "va": "center", "fontsize": 8, "zorder": 3.5}
            text, away = f"$x_{i} = y_{i}$" if common else f"${name}_{i}$", _away(p, path, i)
            ax.annotate(text, (x, y), (away[0] * (1 + common), away[1]), textcoords="offset points", **look)


def _away(p: Pair, path: ExtendedPath, i: int) -> Array:
    """Where a vertex has its name, in points: behind the surface, and on the side where the other path is not."""
    other = p.x if path is p.y else p.y
    out = path.w[i, :, 0] if i <= path.k[0] else np.zeros(2)
    aside = np.nan_to_num(path.x[i, :, 0] - other.x[i, :, 0])
    return np.asarray(12 * _unit(path.w[i - 1, :, 0] - out) + 6 * _unit(aside))


def _unit(v: Array) -> Array:
    length = float(np.linalg.norm(v))
    return v / length if length > 1e-9 else np.zeros(2)
