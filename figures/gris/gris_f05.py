"""GRIS Fig. 5: the hybrid shift reconnects at the first two consecutive rough vertices.

A path built by hand in a corridor: x_1 and x_2 on glossy walls, x_3 and x_4 on rough ones.  Its
numbers are found by inverting the lobes, so that the tracer itself finds the path.  Beside the
recorded index, the offset path is found again from scratch, and random paths of the corridor are
compared with a count of their rough vertices.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims import criteria
from figures.claims.figure import Arrays, Claim, Conditions, Figure, Setup
from figures.experiments.views import HYBRID
from figures.report import style
from flatland2d.scenes import Setting, chain, matte
from flatland2d.shift_pictures import pair, pair_in_words, shift_picture
from flatland2d.space import PLANE
from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.transport import materials as mat
from restir_ref.transport.materials import Layer, Material
from restir_ref.transport.paths import RECONNECTION, REPLAY, Connectability, Path, Tracer, first_hit
from restir_ref.transport.proofs.inversion import primary_sample, traced
from restir_ref.transport.proofs.reading import extended_path, roughnesses
from restir_ref.transport.rays import arrive
from restir_ref.transport.scene import scene
from restir_ref.transport.shifts import shift_path
from restir_ref.transport.vectors import normalize

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture

SHIFTS = {"hybrid": HYBRID, "reconnection": RECONNECTION, "replay": REPLAY}
ROUGHNESS = 0.1
"""Perceptual roughness of the glossy walls, alpha = .01."""

EYE = (0.1, 0.55)
POINTS = ((0.4, 0.0), (0.95, 1.0), (1.45, 0.0), (2.0, 0.6), (1.7, 0.0))
"""Where the eye looks, and x_2 .. x_5: nearly a mirror's path at x_1 and x_2; only the longer path has x_5."""

PIXEL, STEP = 960, 60
"""Pixel of the base path on the film, and how many further on the offset path is."""


def corridor(roughness: float = ROUGHNESS) -> Setting:
    """A room of 2 x 1: glossy floor up to .9 and glossy ceiling up to 1.25, all else matte; a light above."""
    glossy = Material([Layer("ggx", (0.9,), roughness)])
    smooth = [*chain([(0, 0), (0.9, 0)], 1), *chain([(1.25, 1), (0, 1)], 1)]
    rough = [*chain([(0.9, 0), (2, 0), (2, 1), (1.25, 1)], 0), *chain([(0, 1), (0, 0)], 0)]
    facets = [*smooth, *rough, *chain([(1.8, 0.99), (1.4, 0.99)], 0, 8.0)]
    return Setting(scene(PLANE, [matte(0.7), glossy], facets), EYE, POINTS[0], depth=5, high=(2.0, 1.0))


def tracer(rule: Connectability, roughness: float = ROUGHNESS) -> Tracer:
    """The corridor on the whole film."""
    setting = corridor(roughness)
    return Tracer(setting.scene, setting.pinhole(1920, 0), setting.depth, rule)


def by_hand(t: Tracer, k: int) -> Path:
    """The path over the first k of POINTS that ends in light sampling, one column in pixel PIXEL."""
    u, here = np.full((t.D, 1), 0.5), np.full(1, PIXEL)
    v, _, _ = first_hit(t, u, here)
    for i, point in enumerate(POINTS[1:], start=1):
        w = normalize(np.array(point)[:, None] - v.x)
        local = t.scene.space.to_local(v.n, w)
        t.direction_numbers(u, i)[:] = mat.invert_lobe(t.scene.materials, t.scene.space, v, np.array([0]), local)
        v, _, _ = arrive(t.scene, v.x, w)
    return traced(t, u, here, np.array([k]), np.array([True]))


def chunks(preset: Any) -> Sequence[Any]:
    """All at once."""
    return [{}]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """Indices of the two paths under the three rules, the hybrid offset path from scratch, and random paths."""
    index = [[int(by_hand(tracer(rule), k).c[0]) for k in (4, 5)] for rule in SHIFTS.values()]
    found, counted = indices(preset["paths"], Live(rng))
    return {"index": np.array(index), **offset_from_scratch(), "found": found, "counted": counted}


def offset_from_scratch() -> Arrays:
    """Vertices x_0 .. of base and offset path (K, 2), the numbers u of both, and F of the shift and from scratch."""
    t, i, j = tracer(HYBRID), np.full(1, PIXEL), np.full(1, PIXEL + STEP)
    x = by_hand(t, 4)
    y, J = shift_path(t, x, j)
    u = primary_sample(t, x, i, t, y, j)
    again = traced(t, u, j, x.k, x.nee)
    vertices = [extended_path(t, numbers, pixel, x.k, x.nee).x[:6, :, 0] for numbers, pixel in ((x.u, i), (u, j))]
    F = np.array([y.F.mean(), again.F.mean()])
    numbers = np.stack([np.stack([t.direction_numbers(each, k)[0, 0] for k in (1, 2, 3)]) for each in (x.u, u)])
    return {"x": vertices[0], "y": vertices[1], "u": numbers, "F": F, "J": J, "index_again": again.c}


def indices(N: int, chance: Live) -> tuple[Array, Array]:
    """Recorded reconnection indices of N random paths, and the first of two consecutive rough vertices, counted."""
    t = tracer(HYBRID)
    u, pixel = chance.uniform((t.D, N)), (chance.uniform((N,)) * 1920).astype(int)
    k, nee = 1 + (chance.uniform((N,)) * t.depth).astype(int), chance.uniform((N,)) < 0.5
    found, x = traced(t, u, pixel, k, nee), extended_path(t, u, pixel, k, nee)
    rough, gap = roughnesses(t, x) >= HYBRID.roughness, np.linalg.norm(np.diff(x.x, axis=0), axis=1)
    last = np.where(nee, k, k + 1)
    counted = [_first(rough[:, n], gap[:, n], last[n]) for n in range(N)]
    lit = found.F.any(axis=0)
    return found.c[lit], np.array(counted)[lit]


def _first(rough: Array, gap: Array, last: int) -> int:
    """The first i with x_(i-1) and x_i rough and not too close, by going along the path; 0 if there is none."""
    pairs = (i for i in range(2, last + 1) if rough[i - 1] and rough[i] and gap[i - 1] >= HYBRID.distance)
    return next(pairs, 0)


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """The one chunk."""
    return results[0]


def check(a: Arrays) -> list[Claim]:
    """The index is 4; y_2 and y_3 come from x's numbers, y_4 is x_4; random paths do as the rule says."""
    gap, many = np.linalg.norm(a["x"] - a["y"], axis=-1), f"{len(a['found'])} paths that carry light."
    return [
        Claim("GRIS-F05", criteria.equal_to(a["index"][0, 0], 4, 0), "reconnection index, light sampled at x_4"),
        Claim("GRIS-F05", criteria.equal_to(a["index"][0, 1], 4, 0), "reconnection index, path going on to x_5"),
        Claim("GRIS-F05", criteria.equal_to(a["u"][1, :2], a["u"][0, :2], 0), "numbers of x_1 and x_2 in y"),
        Claim("GRIS-F05", criteria.above(gap[2:4].min(), 0.01), "y_2, y_3 are not x_2, x_3: distance"),
        Claim("GRIS-F05", criteria.below(gap[4], 1e-12), "y traced from scratch meets x_4: distance"),
        Claim("GRIS-F05", criteria.equal_to(a["F"][1], a["F"][0], 1e-9), "its contribution is the shift's"),
        Claim("GRIS-F05", criteria.equal_to(a["index_again"][0], 4, 0), "and its own reconnection index"),
        Claim("GRIS-F05", criteria.equal_to(a["found"], a["counted"], 0), "indices of random paths", reason=many),
    ]


def draw(a: Arrays) -> "Picture":
    """Base and offset path under the three rules."""
    picture, axes = style.panels(3, 1, width=6.6, height=2.9)
    setting = corridor()
    for ax, (name, rule) in zip(axes[:, 0], SHIFTS.items(), strict=True):
        t = tracer(rule)
        shifted = pair(t, by_hand(t, 4), PIXEL, PIXEL + STEP)
        shift_picture(ax, setting, shifted)
        ax.set_title(f"{name.capitalize()}: {pair_in_words(shifted)}")
    style.below(axes[2, 0], ncols=3)
    return picture


FIGURE = Figure(
    id="GRIS-F05",
    title="The hybrid shift connects the first two consecutive rough vertices",
    world="flatland2d",
    source="[GRIS Fig. 5; 7.4]",
    claims=("GRIS-F05",),
    conditions=(
        Conditions(
            ("GRIS-F05",),
            "Fig. 5; 7.4",
            Setup("candidates only", "still", "all", "one path over two glossy and two rough vertices"),
            Setup("candidates only", "still", "all", "such a path in a corridor, and random paths there"),
        ),
    ),
    presets={"quick": {"paths": 2000}, "paper": {"paths": 100_000}},
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)
