"""Behind `05_restir_pt_frame_by_frame`: films of the real-time preset in flatland, with still and moving cameras.

Every film draws from a fixed seed.  Frames are unbiased, so the spread over replicas is their error.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from figures.experiments.flatland import moving
from figures.experiments.rendering import path_tracing
from figures.experiments.views import RULES
from figures.report import style
from flatland2d import SCENES
from flatland2d.motion import motion, sources
from flatland2d.pictures import fluence_ticks, scene_picture
from flatland2d.tone import exposure, tone
from notebooks.show import Table
from restir_ref import Live, Pixels, Reservoirs, shade
from restir_ref.batch import Array
from restir_ref.chance import Chance
from restir_ref.loop import REAL_TIME, frame, random_in_row
from restir_ref.transport.paths import Tracer
from restir_ref.transport.restir_pt import PathIntegrals

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture

SEED = 1
FRAMES, REPLICAS = 24, 8
CAPS = {"1": 1.0, "5": 5.0, "20": 20.0, "none": np.inf}
STEPS = {"still": 0.0, "slow": 0.001, "fast": 0.003}
"""How far the camera moves sideways per frame, in unit lengths."""
SCALE_UP_TO = 20
"""Largest number on the scale of a picture, in units of the radiance in the middle of its tones."""


@dataclass(frozen=True, eq=False)
class Film:
    """T frames of R replicas of n pixels.

    images, confidence (T, R, n)  of ReSTIR PT;  paths (T, R, n)  one path tree per pixel and frame, nothing reused
    seen (T, n)  whether the previous frame saw what the pixel sees
    """

    images: Array
    confidence: Array
    paths: Array
    seen: Array


# ---------------------------------------------------------------- films


@cache
def film(scene: str, cap: str, camera: str) -> Film:
    """FRAMES frames of the real-time preset with another cap, and of path tracing with one tree per pixel."""
    views, chance = images(scene, camera), Live(np.random.default_rng(SEED))
    index = np.arange(REPLICAS * views[0].n)
    found = [(shade(X, here)[0], X.c, seen) for X, here, seen in steps(views, index, CAPS[cap], chance)]
    shape = (FRAMES, REPLICAS, views[0].n)
    light, confidence = (np.stack([each[k] for each in found]).reshape(shape) for k in (0, 1))
    paths = np.stack([path_tracing(1)(of, index, chance) for of in views]).reshape(shape)
    return Film(light, confidence, paths, np.stack([seen for *_, seen in found]))


def images(scene: str, camera: str) -> list[PathIntegrals]:
    """One image per frame: the scene's integrals, seen by a camera that ends at the standard inset."""
    setting, rule = SCENES[scene](), RULES["hybrid"]
    views = moving(scene, FRAMES, STEPS[camera])
    return [PathIntegrals(Tracer(setting.scene, view, setting.depth, rule)) for view in views]


def steps(
    views: Sequence[PathIntegrals], index: Array, cap: float, chance: Chance
) -> Iterator[tuple[Reservoirs, Pixels, Array]]:
    """Frame by frame: reservoirs, their pixels, and which pixels the previous frame saw, (n,)."""
    preset = replace(REAL_TIME, cap=cap)
    X, before, seen = None, [], np.zeros(views[0].n, dtype=bool)
    for k, of in enumerate(views):
        if k:
            m = motion(of.tracer.scene, of.tracer.sensor, views[k - 1].tracer.sensor)  # type: ignore[arg-type]
            before, seen = [Pixels(views[k - 1], sources(m, index))], m.seen
        here = Pixels(of, index)
        X = frame(here, chance, preset, random_in_row, X, before)
        yield X, here, seen


@cache
def reference(scene: str, samples: int = 512) -> Array:
    """The standard inset by path tracing, (n,)."""
    of = images(scene, "still")[0]
    index = np.arange(8 * of.n)
    found = path_tracing(samples // 8)(of, index, Live(np.random.default_rng(SEED)))
    return np.asarray(found.reshape(8, of.n).mean(axis=0))


# ---------------------------------------------------------------- numbers


def error(values: Array) -> Array:
    """Spread over replicas, root mean square over pixels, relative to the mean; (T, R, n) -> (T,)."""
    return np.asarray(np.sqrt(values.var(axis=1, ddof=1).mean(axis=-1)) / values.mean(axis=(1, 2)))


def means(values: Array) -> Array:
    """Means of frames 1 .. t, (T, R, n)."""
    return np.asarray(np.cumsum(values, axis=0) / np.arange(1, len(values) + 1)[:, None, None])


def likeness(values: Array) -> Array:
    """Correlation of the errors of successive frames, over replicas and pixels; (T, R, n) -> (T - 1,)."""
    e = values - values.mean(axis=1, keepdims=True)
    together = (e[1:] * e[:-1]).sum(axis=(1, 2))
    return np.asarray(together / np.sqrt((e[1:] ** 2).sum(axis=(1, 2)) * (e[:-1] ** 2).sum(axis=(1, 2))))


def summary(scene: str) -> Table:
    """Per cap, for a still camera: error of a late frame and of the mean of all, and how alike frames are."""
    films = {f"cap {cap}": film(scene, cap, "still").images for cap in CAPS}
    films["one path tree"] = film(scene, "20", "still").paths
    rows = [[name, *(f"{value:.2f}" for value in late(values))] for name, values in films.items()]
    return Table(["", "error of a frame", "error of the mean of all", "correlation of frames"], rows)


def late(values: Array) -> tuple[float, float, float]:
    """Error of one of the last 8 frames, error of the mean of all frames, and likeness of the last 8."""
    one = float(np.sqrt((error(values)[-8:] ** 2).mean()))
    return one, float(error(means(values))[-1]), float(likeness(values)[-8:].mean())


# ---------------------------------------------------------------- pictures


def scene(name: str) -> "Picture":
    """The scene, and what its inset should look like."""
    picture, ((left, right),) = style.panels(1, 2, width=3.9, height=3.0)
    scene_picture(left, SCENES[name]())
    left.set_title(name)
    right.plot(reference(name), marker="", ls="-")
    right.set(xlabel="pixel of the inset", ylabel="radiance", title="reference: 512 path trees", ylim=(0, None))
    return picture


def waterfall(scene: str, cap: str, camera: str) -> "Picture":
    """All frames of one replica, one below the other, by path tracing and by ReSTIR."""
    found = film(scene, cap, camera)
    e = exposure(reference(scene), 90)
    picture, (axes,) = style.panels(1, 2, width=3.9, height=3.0)
    titles = (f"{scene}, {camera}: one path tree", f"ReSTIR PT, cap {cap}")
    for ax, values, title in zip(axes, (found.paths, found.images), titles, strict=True):
        extent = (-0.5, values.shape[-1] - 0.5, FRAMES + 0.5, 0.5)
        image = ax.imshow(tone(values[:, 0], e), vmin=0, vmax=1, aspect="auto", extent=extent)
        ax.set(xlabel="pixel of the inset", ylabel="frame", title=title)
        ax.grid(visible=False)
    ticks = fluence_ticks(e, SCALE_UP_TO / e)
    bar = picture.colorbar(image, ax=axes[1], label="radiance")
    bar.set_ticks(list(tone(ticks, e)), labels=[f"{L:g}" for L in ticks])
    return picture


def over_time(scene: str, camera: str) -> "Picture":
    """Error of each frame, and confidence, for all caps."""
    picture, ((left, right),) = style.panels(1, 2, width=3.9, height=3.0)
    t = np.arange(1, FRAMES + 1)
    for cap in CAPS:
        found = film(scene, cap, camera)
        left.loglog(t, error(found.images), label=f"cap {cap}")
        right.loglog(t, found.confidence.mean(axis=(1, 2)), label=f"cap {cap}")
    left.loglog(t, error(film(scene, "20", camera).paths), color="#888888", ls="-", marker="", label="one path tree")
    left.set(xlabel="frame t", ylabel="relative error", title=f"{scene}, {camera}: frame t")
    right.set(xlabel="frame t", ylabel="confidence of a reservoir", title="after frame t", ylim=(1, 1e4))
    left.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
    return picture


def averages(scene: str) -> "Picture":
    """A still camera: error of the mean of frames 1 .. t, and how alike successive frames are, for all caps."""
    picture, ((left, right),) = style.panels(1, 2, width=3.9, height=3.0)
    t = np.arange(1, FRAMES + 1)
    films = {f"cap {cap}": film(scene, cap, "still").images for cap in CAPS}
    for name, values in films.items():
        left.loglog(t, error(means(values)), label=name)
        right.plot(t[1:], likeness(values), label=name)
    left.loglog(
        t, error(means(film(scene, "20", "still").paths)), color="#888888", ls="-", marker="", label="one path tree"
    )
    left.set(xlabel="frame t", ylabel="relative error", title=f"{scene}, still: mean of frames 1..t")
    right.set(xlabel="frame t", ylabel="correlation of errors", title="frame t and frame t - 1", ylim=(-0.1, 1.05))
    left.legend(loc="lower left")
    return picture
