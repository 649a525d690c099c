"""Chains of frames with mutations, as the thesis evaluates them: 50 frames and M_c = 50.  [MCMC 6]

An image is the last frame of a chain of its own; nothing is averaged over frames.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import prod
from types import MappingProxyType
from typing import Any

import numpy as np
from scipy.ndimage import uniform_filter

from figures.experiments.references import reference
from figures.experiments.views import HYBRID, at_random
from flatland2d import SCENES, radiosity
from flatland2d.sensors import FILM, Pinhole
from restir_ref.batch import Array, ratio
from restir_ref.chance import Chance
from restir_ref.decorrelation import Move, Mutation, blue, metropolis, mutations, ready
from restir_ref.images import random_in_disk
from restir_ref.integrals import Image, Pixels, Reservoirs, target
from restir_ref.loop import REAL_TIME, WHOLE, Preset, frame, random_in_row
from restir_ref.metrics import rmse
from restir_ref.restir import shade
from restir_ref.transport.paths import Tracer

FRAMES, CAP, RADIUS, ENOUGH = 50, 50, 8, 100
"""Frames of a chain, M_c, and the radius of covariances [MCMC 6]; and the fewest images of which they are judged.

The thesis has 10; 64 leave a quarter of a covariance behind the slit uncertain.
"""

BLUE_NEIGHBOURS, BLUE_RADIUS, BLUE_WEIGHT = 8, 4, 1.0
"""Of the acceptance that prefers blue noise.  [MCMC 6]"""

LOOP = replace(REAL_TIME, cap=CAP)
PIXELS = 128


@dataclass(frozen=True)
class View:
    """A scene by name, and of how many pixels the film is: its inset of 128, or a film of 128."""

    scene: str
    film: int

    @property
    def sensor(self) -> Pinhole:
        """The camera."""
        inset = SCENES[self.scene]().pinhole(PIXELS)
        return inset if self.film > PIXELS else replace(inset, first=0, film=PIXELS)

    @property
    def tracer(self) -> Tracer:
        """The scene seen by it, with the hybrid shift."""
        setting = SCENES[self.scene]()
        return Tracer(setting.scene, self.sensor, setting.depth, HYBRID)

    @property
    def truth(self) -> Array:
        """The image, (128,): the stored reference of an inset, radiosity of a film."""
        if self.film > PIXELS:
            return reference(self.scene).mean
        return np.asarray(radiosity.render(self.tracer.scene, self.sensor, self.tracer.depth, film=4))


VIEWS: Mapping[str, View] = MappingProxyType(
    {
        "FS2, inset": View("glossy_cornell", FILM),
        "FS3, whole film": View("ajar", PIXELS),
        "FS3, inset": View("ajar", FILM),
        "FS5, whole film": View("occluders", PIXELS),
        "FS3 nearly closed, whole film": View("nearly_closed", PIXELS),
    }
)


def near_by(here: Pixels, chance: Chance) -> tuple[Sequence[Array], Sequence[Array | float]]:
    """Neighbours for the energy of blue noise, in a row or in a plane."""
    image: Any = here.of
    shape: Any = getattr(image, "shape", (image.n,))
    place = np.stack(np.unravel_index(here.index % image.n, shape))
    choose = random_in_row if len(shape) == 1 else random_in_disk(shape)
    around = [each.index for each in choose(image, here.index, BLUE_NEIGHBOURS, BLUE_RADIUS, chance)]
    apart = [np.stack(np.unravel_index(each % image.n, shape)) - place for each in around]
    return around, [np.sqrt((each**2).sum(axis=0)) for each in apart]


@dataclass(frozen=True)
class Arm:
    """Mutations of a frame: between temporal and spatial reuse, and after both."""

    between: Mutation
    after: Mutation


NONE = mutations(0)
ARMS: Mapping[str, Arm] = MappingProxyType(
    {
        **{f"k = {k}": Arm(mutations(k), NONE) for k in (0, 1, 2, 5, 20, 50)},
        "k = 5, blue": Arm(mutations(5, blue(BLUE_WEIGHT, near_by)), NONE),
        "k = 5, after spatial reuse": Arm(NONE, mutations(5)),
    }
)


def chain(
    of: Image, arm: Arm, frames: int, replicas: int, chance: Chance, *, loop: Preset = LOOP
) -> tuple[Reservoirs, Pixels]:
    """The reservoirs after the last frame of a still camera's chain."""
    here, passes = Pixels(of, np.arange(replicas * of.n)), replace(WHOLE, mutation=arm.between)
    X = arm.after(frame(here, chance, loop, at_random, passes=passes), here, chance)
    for _ in range(frames - 1):
        X = arm.after(frame(here, chance, loop, at_random, X, [here], passes=passes), here, chance)
    return X, here


def shown(X: Reservoirs, here: Pixels) -> Array:
    """Their images, grey; (replicas, n)."""
    image: Image = here.of  # type: ignore[assignment]
    return np.asarray(shade(X, here).mean(axis=0).reshape(-1, image.n))


def accepted(X: Reservoirs, here: Pixels, chance: Chance) -> float:
    """Mean acceptance of a proposal, over the paths that can move."""
    there = ready(X, here)
    x_new, T = there.of.propose(here.index, X.x, chance)  # type: ignore[attr-defined]
    move = Move(here, X, x_new, target(here, X.x), target(here, x_new), T)
    movable = (X.x.c > 0) & (X.W > 0)
    return float(metropolis(move)[movable].mean())


# ---------------------------------------------------------------- what of images is compared


def covariances(images: Array, radius: int = RADIUS) -> Array:
    """What each of K images adds to the box covariance of a row, (K, n) -> (K,); its mean is `box_covariance`.

    Not divided by (mean R)^2, which ratios do not need.  [MCMC 6.2]
    """
    d = images - images.mean(axis=0)
    near = np.abs(np.subtract.outer(np.arange(images.shape[1]), np.arange(images.shape[1])))
    box = ((near <= radius) & (near > 0)).astype(float)
    per_pixel = ratio(d @ box, np.broadcast_to(box.sum(axis=0), d.shape))
    return np.asarray((d * per_pixel).mean(axis=1) * len(images) / (len(images) - 1))


def covariances_of_map(images: Array, reach: tuple[int, int] = (RADIUS, RADIUS)) -> Array:
    """The same of maps, (K, rows, columns) -> (K,), with pixels so far away in rows and in columns."""
    size = (1, *(2 * each + 1 for each in reach))
    d = images - images.mean(axis=0)
    box, others = (uniform_filter(each, size, mode="constant") * prod(size) for each in (d, np.ones_like(d)))
    return np.asarray((d * ratio(box - d, np.round(others - 1))).mean(axis=(1, 2)) * len(d) / (len(d) - 1))


def errors(images: Array, truth: Array) -> Array:
    """RMSE of each image over its pixels, (K,)."""
    return rmse(images, truth)
