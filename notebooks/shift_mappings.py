"""Behind `04_shift_mappings_you_can_see`: base paths and their offset paths in flatland, under three shifts.

Every function draws from a fixed seed, so that a slider changes one thing at a time.
"""

from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from figures.experiments.views import RULES
from figures.gris.gris_f05 import PIXEL, by_hand, corridor, tracer
from figures.report import style
from figures.trust.flat_scenes import whole_film
from flatland2d import SCENES
from flatland2d.pictures import bundle_picture, scene_picture
from flatland2d.shift_pictures import Pair, pair, pair_in_words, shift_picture
from notebooks.show import Table
from restir_ref import Live, Pixels, initial
from restir_ref.batch import Array, ratio, take
from restir_ref.transport.paths import REPLAY, Path, Tracer
from restir_ref.transport.proofs.inversion import traced
from restir_ref.transport.proofs.reading import factors
from restir_ref.transport.restir_pt import PathIntegrals
from restir_ref.transport.shifts import shift_path

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture

SEED = 1
SHIFTS = {"replay": REPLAY, "reconnection": RULES["reconnection"], "hybrid": RULES["hybrid"]}
NEAR = 10
"""Pixels between the two pixels of a shift where many are counted."""

# ---------------------------------------------------------------- scenes and paths


def scene(name: str, paths: int) -> "Picture":
    """A scene with its eye, and path trees of random numbers."""
    setting, rng = SCENES[name](), np.random.default_rng(SEED)
    t = whole_film(name)
    picture, ((left, right),) = style.panels(1, 2, width=3.9, height=3.4)
    scene_picture(left, setting)
    left.set_title(f"{name}: what is there")
    bundle_picture(right, setting, t, rng.random((t.D, paths)), rng.integers(0, t.sensor.n, paths))
    right.set_title(f"{paths} path trees")
    return picture


# ---------------------------------------------------------------- one path, shifted


def in_corridor(shift: str, pixels: int = 60, roughness: float = 0.1) -> Pair:
    """The path built by hand over two glossy and two matte walls, shifted by so many pixels of the film."""
    t = tracer(SHIFTS[shift], roughness)
    return pair(t, by_hand(t, 4), PIXEL, PIXEL + pixels)


def shifted(shift: str, pixels: int, roughness: float) -> "Picture":
    """Base and offset path in the corridor."""
    picture, axes = style.panels(width=7.6, height=3.2)
    found = in_corridor(shift, pixels, roughness)
    shift_picture(axes[0, 0], corridor(roughness), found)
    return _with_legend(picture, f"{shift.capitalize()}, {pixels:+} pixels", found)


def example(shift: str, number: int) -> "Picture":
    """A random path of the glossy Cornell room and its offset path, 100 pixels on."""
    t, x, i = lit_paths("glossy_cornell", shift)
    found = pair(t, take(x, np.array([number])), int(i[number]), int(i[number]) + 100)
    picture, axes = style.panels(width=6.4, height=4.0)
    shift_picture(axes[0, 0], SCENES["glossy_cornell"](), found)
    return _with_legend(picture, f"Path {number}, {shift}", found)


def _with_legend(picture: "Picture", what: str, found: Pair) -> "Picture":
    (ax,) = picture.axes
    ax.set_title(f"{what}: {pair_in_words(found)}")
    ax.legend(loc="upper left", bbox_to_anchor=(1.06, 1.0))
    return picture


@cache
def lit_paths(name: str, shift: str, count: int = 400) -> tuple[Tracer, Path, Array]:
    """Tracer, random paths with light, and their pixels: the same for every shift."""
    setting, rng = SCENES[name](), np.random.default_rng(SEED)
    t = Tracer(setting.scene, setting.pinhole(1920, 0), setting.depth, SHIFTS[shift])
    i, u = rng.integers(100, 1720, count), rng.random((t.D, count))
    k, nee = rng.integers(2, setting.depth + 1, count), rng.random(count) < 0.5
    x = traced(t, u, i, k, nee)
    lit = np.flatnonzero(x.F.any(axis=0))
    return t, take(x, lit), i[lit]


# ---------------------------------------------------------------- what J is made of


def jacobian(shift: str, pixels: int = 60, roughness: float = 0.1) -> Table:
    """The factors of J in primary sample space, and their product beside the J that the shift returns."""
    p = in_corridor(shift, pixels, roughness)
    rows = [[words, f"{x:.4g}", f"{y:.4g}", f"{factor:.4g}"] for words, x, y, factor in parts(p)]
    product = np.prod([factor for *_, factor in parts(p)])
    return Table(["", "x", "y", "factor"], [*rows, ["product", "", "", f"{product:.4g}"], ["J", "", "", f"{p.J:.4g}"]])


def parts(p: Pair) -> list[tuple[str, float, float, float]]:
    """(words, of x, of y, factor of J): Eq. 52 in the plane, and the densities that Eq. 54 puts before it."""
    if p.c == 0:
        return []
    x, y, c = factors(p.t, p.x), factors(p.t, p.y), p.c
    rows = [
        ("p at c-1", x.p[c - 1, 0], y.p[c - 1, 0], 1),
        ("cos at c", x.cos[c, 0], y.cos[c, 0], 1),
        ("r", x.r[c, 0], y.r[c, 0], -1),
    ]
    if p.x.k[0] > c or (p.x.k[0] == c and not p.x.nee[0]):
        rows.append(("p at c", x.p[c, 0], y.p[c, 0], 1))
    return [(words, float(a), float(b), float((b / a) ** power)) for words, a, b, power in rows]


# ---------------------------------------------------------------- many paths


@cache
def kept(name: str, shift: str, count: int = 4000) -> Array:
    """p_hat(y) J / p_hat(x) of paths that ReSTIR would offer, shifted NEAR pixels on; 0 where undefined, (N,)."""
    setting = SCENES[name]()
    of = PathIntegrals(Tracer(setting.scene, setting.pinhole(), setting.depth, SHIFTS[shift]))
    here = Pixels(of, np.arange(count) % (of.n - NEAR))
    X = initial(here, Live(np.random.default_rng(SEED)))
    lit = np.flatnonzero(X.W)
    x = take(X.x, lit)
    y, J = shift_path(of.tracer, x, here.index[lit] + NEAR)
    return np.asarray(ratio(y.F.mean(axis=0) * J, x.F.mean(axis=0)))


def quality(name: str) -> "Picture":
    """How much of a path's contribution its offset path keeps: the share of paths below each value."""
    picture, axes = style.panels(width=6.2, height=2.9)
    ax = axes[0, 0]
    for shift in SHIFTS:
        values = np.sort(np.maximum(kept(name, shift), 1e-4))
        ax.semilogx(values, (np.arange(len(values)) + 1) / len(values), label=shift)
    ax.axvline(1, color="k", lw=0.8)
    ax.set(xlim=(1e-4, 1e2), ylim=(0, 1), xlabel=r"$\hat p(y)\,J / \hat p(x)$, undefined at the left end")
    ax.set(ylabel="share of paths below", title=f"{name}, shifts by {NEAR} pixels")
    ax.legend(loc="upper left")
    return picture


def summary(name: str) -> Table:
    """Per shift: undefined or black, kept within a factor of two."""
    rows = [[s, f"{(v == 0).mean():.0%}", f"{alike(v):.0%}"] for s in SHIFTS for v in [kept(name, s)]]
    return Table(["shift", "undefined or black", "within a factor of 2"], rows)


def alike(values: Array) -> float:
    """Share of paths that keep their contribution within a factor of two."""
    return float(((values > 0.5) & (values < 2)).mean())


def there_and_back(name: str, shift: str) -> tuple[float, float]:
    """Largest |J J' - 1| over paths shifted there and back, and the share of those that do not come back."""
    t, x, i = lit_paths(name, shift)
    y, J = shift_path(t, x, i + NEAR)
    there = np.flatnonzero((J > 0) & y.F.any(axis=0))
    _, J_back = shift_path(t, take(y, there), i[there])
    product = J[there] * J_back
    return float(abs(product[J_back > 0] - 1).max(initial=0)), float((J_back == 0).mean())
