"""Behind `06_the_3d_tracer_in_ten_minutes`: scenes of space, what a moving camera remembers, and where reuse pays.

Every function draws from a fixed seed.  Insets are crops of a film of 1920 x 1080 pixels, so that 20 pixels are what
they are in the paper.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

import numpy as np

from figures.claims import criteria
from figures.claims.figure import Claim
from figures.experiments import offline, reuse, solid
from figures.experiments.rendering import film as filmed
from figures.experiments.rendering import lattice_tracing
from figures.experiments.views import HYBRID, Traced, at_random
from figures.report import style
from notebooks.frames import error
from notebooks.show import Table
from restir_ref import Live
from restir_ref.batch import Array
from restir_ref.loop import REAL_TIME
from restir_ref.metrics import rel_mse
from restir_ref.transport.baselines.restir_di import indirect_light
from restir_ref.transport.paths import RECONNECTION, Tracer
from restir_ref.transport.restir_pt import PathIntegrals
from tracer3d import SCENES, Pinhole
from tracer3d.files import exposure, tone
from tracer3d.gbuffer import gbuffer
from tracer3d.methods import METHODS, Shot, traced
from tracer3d.motion import motion
from tracer3d.scene_files import read
from tracer3d.scenes import INSET, Setting
from tracer3d.sensors import FILM

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Picture

SEED = 1
SIDE, WHOLE = 32, (64, 36)
"""Columns and rows of an inset; of the whole film, coarsely."""


def inset(setting: Setting, side: int = SIDE) -> Pinhole:
    """The middle of the standard inset, side x side pixels of the film."""
    left, top = (corner + (INSET - side) // 2 for corner in setting.crop)
    return setting.pinhole(side, side, (left, top))


# ---------------------------------------------------------------- pictures


@cache
def reference(scene: str, trees: int = 32) -> Array:
    """The inset by path tracing, (C, n)."""
    setting = SCENES[scene]()
    return by_paths(setting, inset(setting), trees)


def by_paths(setting: Setting, camera: Pinhole, trees: int) -> Array:
    """The mean of so many path trees per pixel, (C, n)."""
    t, chance = Tracer(setting.scene, camera, setting.depth, RECONNECTION), Live(np.random.default_rng(SEED))
    found = traced(t, np.tile(np.arange(camera.n), trees), chance)
    return np.asarray(found.reshape(len(found), trees, camera.n).mean(axis=1))


def paint(axis: "Axes", L: Array, shape: tuple[int, int], e: float) -> None:
    """Tone mapped light (C, n) of rows x columns."""
    axis.imshow(tone(L, e).reshape(-1, *shape).transpose(1, 2, 0))
    axis.set_xticks([])
    axis.set_yticks([])
    axis.grid(visible=False)


def scene(name: str) -> "Picture":
    """The whole film, coarsely, with the place of its inset; and the inset, 32 x 32 pixels."""
    setting, (columns, rows) = SCENES[name](), WHOLE
    whole = by_paths(setting, setting.view(columns, rows), 8)
    picture, ((left, right),) = style.panels(1, 2, width=3.9, height=2.8)
    paint(left, whole, (rows, columns), exposure(whole))
    place = (np.array(setting.crop) + INSET / 2) * columns / FILM[0] - 0.5
    left.plot(*place, marker="s", ms=9, mfc="none", mew=1.5, color=style.ORANGE, ls="", markevery=1)
    left.set_title(f"{name}: the film, and its inset")
    paint(right, reference(name), (SIDE, SIDE), exposure(reference(name)))
    right.set_title("the inset, 32 path trees")
    return picture


def seen(name: str) -> "Picture":
    """What the middles of pixels see: distance, and how much the surface is turned away."""
    setting = SCENES[name]()
    camera = inset(setting)
    g = gbuffer(setting.scene, camera)
    _, w, _ = camera.ray(np.arange(camera.n), np.full((2, camera.n), 0.5))
    picture, axes = style.panels(1, 2, width=3.9, height=2.8)
    shown = {"distance": g.t, "cosine at the surface": -(g.n * w).sum(axis=0)}
    for axis, (words, values) in zip(axes[0], shown.items(), strict=True):
        image = axis.imshow(values.reshape(SIDE, SIDE))
        picture.colorbar(image, ax=axis, label=words)
        axis.set(xlabel="column of the inset", ylabel="row", title=f"{name}: {words}")
        axis.grid(visible=False)
    return picture


def passes(found: Mapping[str, Array], scene: str) -> "Picture":
    """The inset after one pass and after another, and its reference; images (C, n)."""
    images = {**found, "reference": reference(scene)}
    picture, axes = style.panels(1, len(images), width=2.4, height=2.6)
    for axis, (words, L) in zip(axes[0], images.items(), strict=True):
        paint(axis, L, (SIDE, SIDE), exposure(reference(scene)))
        axis.set_title(words)
    return picture


# ---------------------------------------------------------------- a moving camera

FRAMES, REPLICAS, CROP = 6, 6, 16
HISTORY = {"motion vectors": "moving", "the same pixel": "moving", "a still camera": "still"}
"""Where a pixel's history comes from, and what the camera does."""


@cache
def film(scene: str, history: str) -> Array:
    """Frames of the real-time preset, (FRAMES, REPLICAS, n); the camera slides by its pace per frame, or stands."""
    setting, moves = SCENES[scene](), HISTORY[history] == "moving"
    steps = [k - FRAMES + 1 if moves else 0 for k in range(FRAMES)]
    views = [integrals(setting, inset(setting.at(step), CROP)) for step in steps]
    of = vectors if history == "motion vectors" else None
    return np.stack([*filmed(views, REPLICAS, Live(np.random.default_rng(SEED)), REAL_TIME, of)])


def integrals(setting: Setting, camera: Pinhole) -> PathIntegrals:
    """A setting's integrals seen by a camera, under the hybrid shift."""
    return PathIntegrals(Tracer(setting.scene, camera, setting.depth, HYBRID))


def vectors(now: Traced, before: Traced) -> Array:
    """The previous pixel of every pixel, (n,)."""
    t = now.tracer
    return motion(t.scene, t.sensor, before.tracer.sensor).source  # type: ignore[arg-type]


def histories(scene: str) -> "Picture":
    """Error of each frame, by where pixels take their history from."""
    picture, ((axis,),) = style.panels(1, 1, width=5.6, height=3.0)
    t = np.arange(1, FRAMES + 1)
    for k, history in enumerate(HISTORY):
        axis.plot(t, error(film(scene, history)), **style.nth(k, label=history, markevery=1))
    axis.set(xlabel="frame t", ylabel="relative error", title=f"{scene}: history from ...", ylim=(0, None))
    style.below(axis, ncols=3)
    return picture


# ---------------------------------------------------------------- a scene of one's own


def opened(text: str) -> Setting:
    """The scene that a TOML text says.  Raises ValueError for what is wrong in it, with its place."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "mine.toml"
        path.write_text(text, encoding="utf-8")
        try:
            return read(path).setting
        except ValueError as error:
            raise ValueError(str(error).replace(str(path), path.name)) from error


def complaint(text: str) -> str:
    """What is wrong in a TOML text; empty if nothing is."""
    try:
        opened(text)
    except ValueError as error:
        return str(error)
    return ""


def by_methods(setting: Setting, frames: int = 4) -> "Picture":
    """A setting's whole view by path tracing and by ReSTIR PT, the mean of a few frames of one tree each."""
    columns, rows = WHOLE
    picture, axes = style.panels(1, 2, width=3.9, height=2.6)
    for axis, name in zip(axes[0], ("path", "restir-pt"), strict=True):
        method = METHODS[name]
        t = Tracer(setting.scene, setting.view(columns, rows), setting.depth, method.rule)
        shots = [Shot(t, Live(np.random.default_rng([SEED, k]))) for k in range(frames)]
        L = np.mean([*method.frames(shots, REAL_TIME, (rows, columns))], axis=0)
        paint(axis, L, (rows, columns), exposure(L))
        axis.set_title(f"{method.words}, {frames} frames")
    return picture


# ---------------------------------------------------------------- when does reuse pay?

AROUND, KNOWN, TREES, PASSES = 8, 4, (1, 4, 16), 20
"""Columns and rows of a neighbourhood; trees that predict, and that are measured; replicas."""


@dataclass(frozen=True, eq=False)
class Pays:
    """Of a neighbourhood's pixels together: the split, and variances at TREES without reuse and with one round."""

    split: reuse.Split
    without: Array
    reused: Array


@cache
def pays(scene: str, radius: int) -> Pays:
    """The middle of the standard inset; six different neighbours within the radius."""
    setting = SCENES[scene]()
    of, chance = integrals(setting, inset(setting, AROUND)), Live(np.random.default_rng(SEED))
    near = reuse.distinct(of, at_random, radius, chance)
    found = reuse.split(of, near, KNOWN, PASSES, chance)
    whole = reuse.Split(*(each.sum(keepdims=True) for each in (found.sigma2, found.S, found.Q)))
    made = [reuse.images(of, near, M, PASSES, chance) for M in TREES]
    without, reused = (np.array([each[k].var(axis=0, ddof=1).sum() for each in made]) for k in (0, 1))
    return Pays(whole, without, reused)


def paying(scene: str, radius: int) -> "Picture":
    """Variance over trees per pixel, without reuse and with one round of it: predicted, and measured."""
    found, M = pays(scene, radius), np.geomspace(1, 100, 50)
    picture, ((axis,),) = style.panels(1, 1, width=5.6, height=3.6)
    scale = float(found.split.without(1)[0])
    axis.loglog(M, [found.split.without(m)[0] / scale for m in M], **style.nth(0, marker="", label="without reuse"))
    axis.loglog(
        M, [found.split.with_reuse(m)[0] / scale for m in M], **style.nth(1, marker="", label="with, predicted")
    )
    axis.loglog(TREES, found.reused / scale, **style.nth(2, ls="", label="with, measured"), markevery=1)
    words = f"reuse pays up to M* = {rounded(found.split.break_even[0])}"
    axis.set(xlabel="trees per pixel M", ylabel="variance, of one tree's", title=f"{scene}, radius {radius}: {words}")
    style.below(axis, ncols=3)
    return picture


def break_even(scenes: tuple[str, ...], radii: tuple[int, ...] = (3,)) -> Table:
    """M* by scene and radius, predicted from KNOWN trees, and the gains of one round at TREES, measured."""
    rows = []
    for scene in scenes:
        for radius in radii:
            found = pays(scene, radius)
            gains = (f"{gain:.2f}" for gain in found.without / found.reused)
            rows.append([scene, radius, rounded(found.split.break_even[0]), *gains])
    return Table(["scene", "radius", f"M*, from {KNOWN} trees", *(f"gain, M = {M}" for M in TREES)], rows)


def rounded(x: float) -> str:
    """Two digits, as that is what so few replicas tell."""
    return f"{float(f'{x:.2g}'):g}"


# ---------------------------------------------------------------- a claim

GLOSSY, ASKED, IMAGES = "CB3-glossy, box", 8, 12
"""An inset of `solid`; its columns and rows here, and images per shift."""
LIMIT = 0.85
"""Of the ledger's criterion for GRIS-F11b."""


@cache
def errors(shift: str, scene: str = GLOSSY) -> Array:
    """relMSE of offline frames of indirect light, (IMAGES,), against `truth`."""
    rng, inset = np.random.default_rng(SEED), solid.inset(scene, ASKED)
    return rel_mse(offline.render(offline.METHODS[shift], scene, IMAGES, rng, inset)["images"], truth(scene))


@cache
def truth(scene: str) -> Array:
    """Indirect light by path trees on a lattice, with random numbers of its own, (n,)."""
    many, inset = offline.Method(lattice_tracing(indirect_light), 0), solid.inset(scene, ASKED)
    return np.asarray(offline.render(many, scene, 1, np.random.default_rng(SEED + 1), inset)["images"][0])


def claim(errors_of: Array, others: Array) -> Claim:
    """GRIS-F11b at one frame: relMSE of the first over that of the second, paired images (R,)."""
    return Claim(
        "GRIS-F11b",
        criteria.ratio_below(errors_of, others, LIMIT),
        "glossy: hybrid / reconnection, equal samples, one frame",
        counter=criteria.ratio_above(errors_of, others, 1),
    )
