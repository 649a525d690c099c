"""Behind `08_why_blotches_dissolve`: chains of frames with mutations, whose path a pixel shows, and what stays.

Every film draws from a fixed seed.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np

from figures.experiments.mutated import BLUE_WEIGHT, LOOP, VIEWS, near_by
from figures.report import style
from notebooks.show import Table
from restir_ref import Live, Pixels, Reservoirs, shade
from restir_ref.batch import Array
from restir_ref.decorrelation import Blue, Move, metropolis, mutate, mutations, ready
from restir_ref.loop import WHOLE, frame, random_in_row
from restir_ref.transport.mutations import TwoRays

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture

SEED, FRAMES = 1, 32
SCENES: Mapping[str, str] = MappingProxyType({"glossy_cornell": "FS2, inset", "ajar": "FS3, whole film"})
KS = ("0", "1", "5")
SAME = 1e-9
"""Vertices this near to each other are one."""


@dataclass(frozen=True, eq=False)
class Film:
    """FRAMES frames of 128 pixels, one chain.

    images (T, n); copies (T, n)  how many pixels of the frame show a path through the very x_c that this one does
    last, here  the reservoirs of the last frame, and their pixels
    """

    images: Array
    copies: Array
    last: Reservoirs
    here: Pixels


@cache
def film(scene: str, k: str) -> Film:
    """A chain with M_c = 50 and k mutations between temporal and spatial reuse."""
    of, chance = TwoRays(VIEWS[SCENES[scene]].tracer), Live(np.random.default_rng(SEED))
    here, passes = Pixels(of, np.arange(of.n)), replace(WHOLE, mutation=mutations(int(k)))
    X, rows = frame(here, chance, LOOP, random_in_row, passes=passes), []
    for _ in range(FRAMES):
        rows.append((shade(X, here)[0], copies(X)))
        X = frame(here, chance, LOOP, random_in_row, X, [here], passes=passes)
    images, counts = (np.stack(each) for each in zip(*rows, strict=True))
    return Film(images, counts, X, here)


def copies(X: Reservoirs) -> Array:
    """Pixels whose path goes through the same x_c, this one included; 1 where nothing reconnects. (n,)"""
    z = np.where(X.x.c > 0, X.x.z, np.arange(len(X.W)) + 1e3)
    apart = np.abs(z[:, :, None] - z[:, None]).max(axis=0)
    return np.asarray((apart < SAME).sum(axis=1))


def waterfall(scene: str, k: str) -> "Picture":
    """Frames from top to bottom: what pixels show, and how many others show a path through the same vertex."""
    found = film(scene, k)
    picture, axes = style.panels(1, 2, width=5.2, height=3.4)
    high = 2.5 * float(film(scene, "0").images.mean())
    names = {"radiance": (found.images, high), "pixels with the same $x_c$": (found.copies, 20)}
    for axis, (label, (values, top)) in zip(axes[0], names.items(), strict=True):
        shown = axis.imshow(values, vmin=0, vmax=top, aspect="auto")
        picture.colorbar(shown, ax=axis, label=label, extend="max")
        axis.set(xlabel="pixel", ylabel="frame", title=f"{k} mutations per frame")
        axis.grid(visible=False)
    return picture


def sharing(scene: str) -> Table:
    """Over the second half of each film: pixels that show the same x_c, and how like neighbours are."""
    rows = []
    for k in KS:
        half = slice(FRAMES // 2, None)
        images, counts = film(scene, k).images[half], film(scene, k).copies[half]
        rows.append((k, f"{counts.mean():.2f}", f"{counts.max()}", f"{streak(images):.2f}"))
    return Table(("mutations", "pixels per x_c", "at most", "likeness of successive frames"), rows)


def streak(images: Array) -> float:
    """Correlation of a pixel's deviation from the film's mean in one frame and the next."""
    d = images - images.mean(axis=0)
    return float((d[1:] * d[:-1]).sum() / np.sqrt((d[1:] ** 2).sum() * (d[:-1] ** 2).sum()))


@dataclass(frozen=True)
class Kept:
    """After 50 mutations: the largest change of a pixel over the mean, the largest |e' - e|, and how far x_c moved."""

    luminance: float
    energy: float
    moved: float


@cache
def kept(scene: str, steps: int = 50) -> Kept:
    """What mutations of the last frame keep, and what they move."""
    X, here = film(scene, "0").last, film(scene, "0").here
    chance, before, energies = Live(np.random.default_rng(SEED)), shade(X, here)[0], [0.0]
    noise = Blue(before, *near_by(here, chance), BLUE_WEIGHT)

    def watched(move: Move) -> Array:
        e, e_new = noise.energies(move)
        energies.append(float(np.abs(e_new - e)[(move.p_hat_new > 0) & (move.X.W > 0)].max(initial=0)))
        return metropolis(move)

    Y, there = X, ready(X, here)
    for _ in range(steps):
        Y = mutate(Y, there, chance, watched)
    changed = float(np.abs(shade(Y, here)[0] - before).max() / before.mean())
    return Kept(changed, max(energies), float(np.sqrt(((Y.x.z - X.x.z) ** 2).sum(axis=0)).max()))
