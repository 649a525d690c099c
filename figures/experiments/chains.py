"""Chains of frames of the real code: candidates, temporal and spatial reuse, as figures about many frames need them."""

from collections.abc import Callable, Iterator, Sequence

import numpy as np

from restir_ref.batch import Array
from restir_ref.chance import Chance
from restir_ref.integrals import Image, Pixels, Reservoirs
from restir_ref.restir import initial, shade, spatial, temporal

Near = Callable[[Pixels, Chance], Sequence[Pixels]]
"""The neighbours of this frame, of every pixel."""


def chain(here: Pixels, cap: float, near: Near, chance: Chance) -> Iterator[Reservoirs]:
    """Frames of ReSTIR in a still scene, one after another without end; cap 0 leaves out temporal reuse.  [GRIS 6.3]"""
    history = None
    while True:
        X = initial(here, chance)
        if history is not None and cap > 0:
            X = temporal(X, here, history, [Pixels(here.of, here.index)], chance, cap=cap)
        neighbours = near(here, chance)
        history = spatial(X, here, neighbours, chance) if neighbours else X
        yield history


def nobody(here: Pixels, chance: Chance) -> Sequence[Pixels]:
    """No spatial reuse."""
    return []


def three_of_radius_5(here: Pixels, chance: Chance) -> Sequence[Pixels]:
    """Three random pixels at most 5 away in the row, reflected at its ends; never the pixel itself."""
    return [random_neighbour(here, chance) for _ in range(3)]


def random_neighbour(here: Pixels, chance: Chance, radius: int = 5) -> Pixels:
    """One pixel at distance 1 to `radius`, all equally likely before those beyond the ends are reflected."""
    image: Image = here.of  # type: ignore[assignment]
    i = here.index % image.n
    step = np.floor(2 * radius * chance.uniform(i.shape)).astype(int) - radius
    step += step >= 0
    beyond = (i + step < 0) | (i + step >= image.n)
    return Pixels(image, here.index + np.where(beyond, -step, step))


def images(X: Reservoirs, here: Pixels) -> Array:
    """The shaded frame of every replica, grey; (replicas, n)."""
    image: Image = here.of  # type: ignore[assignment]
    return np.asarray(shade(X, here).mean(axis=0).reshape(-1, image.n))
