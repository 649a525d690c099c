"""Every mistake of the zoo planted in flatland: `python -m docs.site.planted` draws docs/symptoms/*.png, half an hour.

The zoo's loops know their integrals by the protocol only, so they run on path integrals as they are: `Film` stands in
for a finite scene, and `Flat` for its frames.  Neighbours are taken from a disk instead of a table.  Where a mistake is
made of cells (a table of densities, a sampler's index), its picture is that of its own small scene, and exact.
"""

import argparse
import io
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from PIL import Image as Raster

from docs.site.symptoms import slug
from figures.report import style
from flatland2d import scenes, setting
from flatland2d.pictures import outline
from flatland2d.scenes import Setting
from flatland2d.space import PLANE
from restir_ref.batch import Array
from restir_ref.chance import Chance, Live
from restir_ref.images import random_in_disk
from restir_ref.integrals import Image, Pixels, Reservoirs, Shifted
from restir_ref.oracle.cells import Frame
from restir_ref.oracle.scenes import Loop, Parts, next_pixel, one_frame
from restir_ref.oracle.zoo import BUGS, INEFFICIENT, Bug, exact_bias
from restir_ref.oracle.zoo.candidates import changed
from restir_ref.oracle.zoo.checks import statistics
from restir_ref.restir import initial, shade, spatial, temporal
from restir_ref.transport.paths import Connectability, Tracer
from restir_ref.transport.proofs.zoo import TRANSPORT_BUGS
from restir_ref.transport.proofs.zoo.bug import TransportBug
from restir_ref.transport.proofs.zoo.cached import CACHE_BUGS
from restir_ref.transport.proofs.zoo.gradients import GRADIENT_BUGS
from restir_ref.transport.restir_pt import PathIntegrals, ScatteredIntegrals
from restir_ref.transport.scene import Scene, scene

FOLDER = Path(__file__).resolve().parents[1] / "symptoms"
SIDE, RADIUS, DEPTH, RULE = 40, 5, 2, Connectability(roughness=0.2, distance=0.02)
REPLICAS, BATCHES = 60, 4
"""Images at a time, and how many times."""

EXPOSURE = 1 / 3
"""Brings targets near 1, where thresholds of the zoo are meant to be."""

STEP = 0.15
"""How far the right box moves between two frames, for the mistake that is about motion."""


@cache
def room() -> Setting:
    """Two boxes in a room: shadows, corners, a glossy side."""
    return setting("cornell")


def standing(step: float) -> Scene:
    """The same room with the right box so far to the left."""
    boxes = scenes.boxes(1)
    left, right = boxes[:4], [replace(each, corners=[(x - step, y) for x, y in each.corners]) for each in boxes[4:]]
    facets = [*scenes.room(0), *left, *right, *scenes.chain(scenes.LAMP, 0, 8.0)]
    return scene(PLANE, [scenes.mixed(0.5, 0.5, 0.2), scenes.mixed(0.3, 0.5, 0.5)], facets)


def seen(step: float = 0) -> ScatteredIntegrals:
    """Its fluence, SIDE x SIDE pixels."""
    return ScatteredIntegrals(Tracer(standing(step), room().fluence(SIDE, SIDE), DEPTH, RULE))


# ---------------------------------------------------------------- loops of the zoo in flatland


class Flat(Frame):
    """A frame of the zoo whose cells are path integrals."""

    @property
    def of(self) -> PathIntegrals:
        """The path integrals."""
        found: PathIntegrals = self.cells  # type: ignore[assignment]
        return found

    def candidates(self, index: Array, chance: Chance) -> Iterator[tuple[Any, Array]]:
        """One path tree."""
        return self.of.candidates(index, chance)

    def target(self, index: Array, x: Any) -> Array:
        """p_hat, exposed."""
        return self.of.target(index, x) * EXPOSURE

    def contribution(self, index: Array, x: Any) -> Array:
        """F, exposed."""
        return self.of.contribution(index, x) * EXPOSURE

    def shift(self, x: Any, index: Array, to: Pixels) -> Shifted:
        """The hybrid shift."""
        there: Flat = to.of  # type: ignore[assignment]
        return self.of.shift(x, index, Pixels(there.of, to.index))


@dataclass(frozen=True)
class Film:
    """Two frames of the same view, in place of a finite scene."""

    frames: tuple[Frame, ...]

    @property
    def now(self) -> Frame:
        """The last one."""
        return self.frames[-1]

    def made_of(self, kind: type[Frame]) -> "Film":
        """In frames of another kind: the kind's own methods come before those of `Flat`."""
        made = Flat if kind is Frame else type(kind.__name__, (kind, Flat), {})
        return Film(tuple(made(each.cells, each.n, each.t) for each in self.frames))


def film() -> Film:
    """The room."""
    of: Any = seen()
    return Film((Flat(of, of.n, 0), Flat(of, of.n, 1)))


def in_disk(of: Image, index: Array, X: Reservoirs, chance: Chance) -> Sequence[Pixels]:
    """One neighbour, within RADIUS pixels."""
    return random_in_disk((SIDE, SIDE))(of, index, 1, RADIUS, chance)


def loop_of(parts: Parts) -> Loop:
    """A loop of the zoo, right or wrong, on the film; neighbours are those of a map unless the parts choose."""
    scene: Any = film()
    return (replace(parts, neighbours=in_disk) if parts.neighbours is next_pixel else parts)(scene)


def rendered(loop: Loop, at: Image) -> Array:
    """Images of replicas, (replicas, SIDE, SIDE)."""
    n = SIDE * SIDE
    found = []
    for batch in range(BATCHES):
        here = Pixels(at, np.arange(n * REPLICAS))
        Y = loop(here.index, Live(np.random.default_rng(batch + 1)))
        found.append(shade(Y, here).mean(axis=0).reshape(-1, SIDE, SIDE))
    return np.concatenate(found)


def both(bug: Bug) -> tuple[Array, Array]:
    """Images of the right and of the wrong loop.  Raises AttributeError for a mistake that is made of cells."""
    right, wrong = (rendered(loop_of(parts), film().made_of(parts.here).now) for parts in (bug.right, bug.wrong))
    return right, wrong


# ---------------------------------------------------------------- mistakes about paths


def reusing(of: PathIntegrals) -> Loop:
    """New samples and two rounds with neighbours."""

    def loop(index: Array, chance: Chance) -> Reservoirs:
        here = Pixels(of, index)
        X = initial(here, chance)
        for _ in range(2):
            X = spatial(X, here, in_disk(of, index, X, chance), chance)
        return X

    return loop


def moving(rated: PathIntegrals) -> Loop:
    """New samples and the history of a frame in which the right box stood elsewhere, rated by some integrals."""
    now, before = seen(), seen(STEP)

    def loop(index: Array, chance: Chance) -> Reservoirs:
        here, Y = Pixels(now, index), initial(Pixels(before, index), chance)
        return temporal(initial(here, chance), here, Y, [Pixels(rated, index)], chance)

    return loop


def scattered(of: Any) -> Any:
    """The same integrals without the light that a ray meets at once, which hides all others in a map."""
    if isinstance(of, PathIntegrals):
        object.__setattr__(of, "leaves", ScatteredIntegrals(of.tracer).leaves)
    return of


def both_of(bug: TransportBug) -> tuple[Array, Array]:
    """Images of the right and of the wrong renderer."""
    if "camera" in bug.name:
        history = scattered(bug.wrong(seen().tracer))
        return tuple(rendered(moving(of), seen()) for of in (seen(STEP), history))  # type: ignore[return-value]
    of = seen()
    wrong = scattered(bug.wrong(of.tracer))
    right: Any = of if isinstance(wrong, PathIntegrals) else PathIntegrals(of.tracer)
    return rendered(reusing(right), right), rendered(reusing(wrong), wrong)


# ---------------------------------------------------------------- what is not in the zoo

RARE = 0.01
"""The share of null samples whose 0/0 is not caught."""

FRAMES, LATER, SHORT, LONG = 10, 3, 2, 60
"""Frames of a history, of how many later it is looked at again, and its caps."""

HALF = 2.0**14
"""The unit in which W is stored as a half float."""


def poisoned() -> Figure:
    """Images after passes of reuse: what has read a NaN is one."""
    of, chance = seen(), Live(np.random.default_rng(1))
    here = Pixels(of, np.arange(SIDE * SIDE))
    X = initial(here, chance)
    bad = (X.W == 0) & (chance.uniform(X.W.shape) < RARE)
    picture = Figure(figsize=(6.6, 2.5), layout="constrained")
    for k, ax in enumerate(picture.subplots(1, 3)):
        light = shade(X, here).mean(axis=0)
        image = np.where(bad, np.nan, light).reshape(SIDE, SIDE)
        shown(ax, image, f"after {2 * k} passes", cmap=style.IMAGE_MAP, vmin=0, vmax=4 * light.mean())
        for _ in range(2):
            (near,) = in_disk(of, here.index, X, chance)
            X, bad = spatial(X, here, [near], chance), bad | bad[near.index]
    return picture


def halved(W: Array, x: Array, coin: Array) -> Array:
    """W as a half float in units of 1 / HALF; what overflows is dropped."""
    with np.errstate(over="ignore"):
        stored = (W * HALF).astype(np.float16).astype(float) / HALF
    return np.where(np.isfinite(stored), stored, 0.0)


def overflown() -> Figure:
    """New samples whose W is stored as a half float."""
    at = film()
    right, wrong = (rendered(loop_of(Parts(one_frame, draw=draw)), at.now) for draw in (initial, changed(halved)))
    return beside(right, wrong)


def later(cap: float) -> tuple[Array, Array]:
    """Frame FRAMES of REPLICAS films with new samples, history up to a cap and a neighbour, and LATER frames on."""
    of, chance = seen(), Live(np.random.default_rng(1))
    here = Pixels(of, np.arange(SIDE * SIDE * REPLICAS))
    X, found = initial(here, chance), []
    for _ in range(FRAMES + LATER):
        X = temporal(initial(here, chance), here, X, [here], chance, cap=cap)
        X = spatial(X, here, in_disk(of, here.index, X, chance), chance)
        found.append(shade(X, here).mean(axis=0).reshape(-1, SIDE, SIDE))
    return found[FRAMES - 1], found[-1]


def correlation(before: Array, now: Array) -> Array:
    """Between two frames, over films (films, rows, columns) and 9 pixels; 0 where nothing varies."""
    x, y = (each - each.mean(axis=0) for each in (before, now))
    both, alone = smooth((x * y).mean(axis=0)), smooth((x**2).mean(axis=0)) * smooth((y**2).mean(axis=0))
    return np.asarray(both / np.sqrt(np.maximum(alone, 1e-30)))


def boiling() -> Figure:
    """A frame with a long history, a later one, and how they correlate; with a short history for comparison."""
    (before, now), brief = later(LONG), correlation(*later(SHORT))
    picture = Figure(figsize=(6.6, 2.5), layout="constrained")
    axes, bright = list(picture.subplots(1, 3)), 2 * np.percentile(before.mean(axis=0), 98)
    shown(axes[0], before[0], f"M up to {LONG}, a frame", vmin=0, vmax=bright, cmap=style.IMAGE_MAP)
    shown(axes[1], now[0], f"{LATER} frames later", vmin=0, vmax=bright, cmap=style.IMAGE_MAP)
    shared = correlation(before, now)
    title = f"correlated: {shared.mean():.2f}\n(M up to {SHORT}: {brief.mean():.2f})"
    drawn = shown(axes[2], shared, title, vmin=0, vmax=1, cmap="magma")
    picture.colorbar(drawn, ax=axes[2], shrink=0.85)
    return picture


OTHERS: Mapping[str, Callable[[], Figure]] = {
    "NaN spread by reuse": poisoned,
    "W beyond half floats": overflown,
    "history too long": boiling,
}
"""Mistakes of the page that are not in the zoo, planted all the same."""


# ---------------------------------------------------------------- pictures


def beside(right: Array, wrong: Array) -> Figure:
    """The right mean, the wrong one, and by how much they differ."""
    truth, found = right.mean(axis=0), wrong.mean(axis=0)
    picture = Figure(figsize=(6.6, 2.5), layout="constrained")
    axes = list(picture.subplots(1, 3))
    bright = np.percentile(truth, 98)
    shown(axes[0], truth, "right", vmin=0, vmax=bright, cmap=style.IMAGE_MAP)
    shown(axes[1], found, "with the mistake", vmin=0, vmax=bright, cmap=style.IMAGE_MAP)
    blurred = 100 * significant(wrong - right) / np.maximum(smooth(smooth(truth)), 0.1 * truth.mean())
    sizes = abs(blurred[blurred != 0])
    far = max(1.0, float(np.percentile(sizes, 97))) if len(sizes) else 1.0
    title = "difference (%)" if len(sizes) else "none above the noise"
    drawn = shown(axes[2], blurred, title, vmin=-far, vmax=far, cmap="RdBu_r")
    picture.colorbar(drawn, ax=axes[2], shrink=0.85)
    return picture


def noise_beside(right: Array, wrong: Array) -> Figure:
    """One frame of each, and the ratio of their standard deviations."""
    picture = Figure(figsize=(6.6, 2.5), layout="constrained")
    axes = list(picture.subplots(1, 3))
    bright = 2 * np.percentile(right.mean(axis=0), 98)
    shown(axes[0], right[0], "right, one image", vmin=0, vmax=bright, cmap=style.IMAGE_MAP)
    shown(axes[1], wrong[0], "with it, one image", vmin=0, vmax=bright, cmap=style.IMAGE_MAP)
    lit = right.mean(axis=0) > 0.05 * right.mean()
    ratios = np.where(lit, smooth(wrong.std(axis=0)) / np.maximum(smooth(right.std(axis=0)), 1e-9), 1)
    far = max(0.1, float(np.percentile(abs(np.log2(ratios)), 98)))
    drawn = shown(axes[2], np.log2(ratios), "noise (log2 of the ratio)", vmin=-far, vmax=far, cmap="PuOr_r")
    picture.colorbar(drawn, ax=axes[2], shrink=0.85)
    return picture


def shown(ax: Axes, image: Array, title: str, **look: Any) -> Any:
    """An image of the room with its walls."""
    (x, y), (X, Y) = room().low, room().high
    drawn = ax.imshow(image, origin="lower", extent=(x, X, y, Y), interpolation="nearest", **look)
    outline(ax, room().scene, color="k", lw=1, ls="-")
    ax.set(xlim=(x, X), ylim=(y, Y), title=title)
    ax.set_axis_off()
    return drawn


def smooth(image: Array) -> Array:
    """Means over 3 x 3 pixels, those at the borders repeated; (.., rows, columns)."""
    padded = np.pad(image, [(0, 0)] * (image.ndim - 2) + [(1, 1)] * 2, mode="edge")
    rows = padded[..., :-2, :] + padded[..., 1:-1, :] + padded[..., 2:, :]
    return np.asarray((rows[..., :-2] + rows[..., 1:-1] + rows[..., 2:]) / 9)


SURE = 3
"""Standard errors by which a difference has to be off 0 to be shown."""


def significant(difference: Array) -> Array:
    """The mean of differences (images, rows, columns) over images and 5 x 5 pixels, 0 where it may be noise."""
    each = smooth(smooth(difference))
    mean, error = each.mean(axis=0), each.std(axis=0, ddof=1) / np.sqrt(len(each))
    return np.asarray(np.where(abs(mean) > SURE * error, mean, 0))


def exact(bug: Bug) -> Figure:
    """The exact bias of every cell of the mistake's own scene, pixel by pixel."""
    scene = bug.scene()
    return bars(exact_bias(bug.wrong(scene), scene))


def bars(of: Array, place: str = "pixel", cell: str = "cell") -> Figure:
    """A bias (places, cells)."""
    bias = 100 * of
    picture = Figure(figsize=(6.6, 2.2), layout="constrained")
    axes = np.atleast_1d(picture.subplots(1, len(bias), sharey=True))
    for k, (ax, of_pixel) in enumerate(zip(axes, bias, strict=True)):
        ax.bar(np.arange(len(of_pixel)), of_pixel, color=[style.COLOURS[3 * (b > 0)] for b in of_pixel])
        ax.axhline(0, color="k", lw=0.8)
        ax.set(xlabel=cell, title=f"{place} {k}" if len(bias) > 1 else "", xticks=np.arange(len(of_pixel)))
    axes[0].set_ylabel("bias (%)")
    return picture


MODELLED = {**CACHE_BUGS, **GRADIENT_BUGS}
"""Mistakes on models that are exact."""

PAIRED = ("", "pair of pixels")

AXES = {
    **{name: PAIRED for name, bug in GRADIENT_BUGS.items() if "edges" in bug.symptom or "outlines" in bug.symptom},
    "constant of the glossy term as printed": ("", "a mirror in flatland (0) and in space (1)"),
    "probes without direct light at the second vertex": ("", "place"),
    "no residual beside bounded geometry": ("", "point of the wall, from the crease upwards"),
    "shading with the kept value": ("channel", "pixel"),
    "probability of the side left out": PAIRED,
    "difference from one pixel's samples": ("", "the difference (0) and its negative (1)"),
    "differences of hue in no part": ("channel", "pair of pixels"),
    "normals that agree mark an edge": ("", "pair of pixels; 2, 4 and 6 are edges"),
}
"""What places and cells are, where they are no pixels and cells."""


def exact_noise(bug: Bug) -> Figure:
    """The exact standard deviation of every pixel of the mistake's own scene, right and wrong."""
    scene = bug.scene()
    picture = Figure(figsize=(6.6, 2.2), layout="constrained")
    ax = picture.subplots()
    for k, (name, loop) in enumerate({"right": bug.right(scene), "with the mistake": bug.wrong(scene)}.items()):
        found = np.sqrt(statistics(loop, scene).variance(scene.p_hat))
        ax.bar(np.arange(len(found)) + 0.4 * k - 0.2, found, 0.38, color=style.COLOURS[3 * k], label=name)
    ax.set(xlabel="pixel", ylabel="standard deviation", xticks=np.arange(len(scene.v)))
    picture.legend(loc="outside right upper")
    return picture


def picture_of(name: str) -> tuple[Figure, str]:
    """A mistake's picture, and its kind: "planted" or "exact"."""
    if name in OTHERS:
        return OTHERS[name](), "planted"
    if name in MODELLED:
        return bars(MODELLED[name].wrong(), *AXES.get(name, ("pixel", "cell"))), "exact"
    if name in TRANSPORT_BUGS:
        return beside(*both_of(TRANSPORT_BUGS[name])), "planted"
    bug = {**BUGS, **INEFFICIENT}[name]
    try:
        images = both(bug)
    except (AttributeError, TypeError, IndexError):
        return (exact if name in BUGS else exact_noise)(bug), "exact"
    return (beside if name in BUGS else noise_beside)(*images), "planted"


def main() -> None:
    """Draw the pictures of all mistakes, or of those whose names contain the words given."""
    parser = argparse.ArgumentParser(prog="python -m docs.site.planted", description=main.__doc__)
    parser.add_argument("words", nargs="*", help="parts of names; none for all")
    words = parser.parse_args().words
    FOLDER.mkdir(exist_ok=True)
    for name in (*OTHERS, *BUGS, *INEFFICIENT, *TRANSPORT_BUGS, *MODELLED):
        if words and not any(word in name for word in words):
            continue
        with style.context():
            picture, kind = picture_of(name)
            write(picture, FOLDER / f"{slug(name)}.png")
        print(f"{kind}: {name}", flush=True)


def write(picture: Figure, file: Path) -> None:
    """A small file: 64 colours."""
    raw = io.BytesIO()
    picture.savefig(raw, dpi=90, format="png", metadata={"Software": None})
    few = Raster.open(raw).convert("RGB").quantize(64, Raster.Quantize.MAXCOVERAGE, dither=Raster.Dither.NONE)
    few.save(file, format="png", optimize=True)


if __name__ == "__main__":
    main()
