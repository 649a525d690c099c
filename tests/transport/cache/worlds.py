"""Worlds to test volumes in: those that there are, and d = 4, whose directions are divided here."""

from dataclasses import dataclass

import numpy as np

import flatland2d.directions
import tracer3d.directions
from flatland2d import PLANE
from restir_ref import Live
from restir_ref.batch import Array
from restir_ref.chance import Chance
from restir_ref.transport.cache.grid import Grid
from restir_ref.transport.cache.maps import Maps
from restir_ref.transport.cache.volume import Volume, unlit
from restir_ref.transport.scene import Scene
from restir_ref.transport.space import Space
from tests.transport.rooms import simplex
from tests.transport.spaces import Hyper
from tracer3d.space import SOLID


@dataclass(frozen=True)
class Axes:
    """2 d texels, one on each half axis; a direction w is interpolated from d of them by w_i^2, which sum to 1."""

    d: int

    @property
    def K(self) -> int:
        return 2 * self.d

    def centres(self) -> Array:
        return np.concatenate([np.eye(self.d), -np.eye(self.d)], axis=1)

    def fetch(self, w: Array) -> tuple[Array, Array]:
        axis = np.arange(self.d)[:, None]
        return np.where(w >= 0, axis, axis + self.d), w**2 + (np.abs(w).max(axis=0) == 0) / self.d


def lattice(space: Space):
    """Rays from a lattice of numbers, shifted as a whole."""

    def rays(R: int, chance: Chance) -> Array:
        steps = np.sqrt(np.array([2.0, 3.0, 5.0])[: space.d - 1])[:, None]
        return space.sphere((np.arange(R) * steps + chance.uniform((space.d - 1, 1))) % 1)

    return rays


HYPER = Hyper()
WORLDS: dict[str, tuple[Space, Maps]] = {
    "plane": (PLANE, flatland2d.directions.MAPS),
    "solid": (SOLID, tracer3d.directions.MAPS),
    "hyper": (HYPER, Maps(Axes(4), Axes(4), lattice(HYPER))),
}


def live(seed: int) -> Live:
    return Live(np.random.default_rng(seed))


def middle(d: int, step: float = 0.06) -> Grid:
    """2^d probes around the middle of the simplex that is a room."""
    centre = simplex(d).mean(axis=0) - step / 2
    return Grid(tuple(centre.tolist()), (step,) * d, (2,) * d)


def volume(name: str, scene: Scene, step: float = 0.06) -> Volume:
    """A volume in the middle of a simplex."""
    space, maps = WORLDS[name]
    return unlit(scene, middle(space.d, step), maps)
