"""Paths and shifts in a coloured room with a glass ball, in any dimension."""

from dataclasses import dataclass, replace

import numpy as np

from restir_ref.batch import Array
from restir_ref.transport.materials import Layer, Material
from restir_ref.transport.paths import Connectability, Tracer
from restir_ref.transport.proofs.inversion import traced
from restir_ref.transport.scene import Ball, scene
from restir_ref.transport.shifts import shift_path
from restir_ref.transport.space import Space
from tests.transport.paths import Shifts
from tests.transport.rooms import simplex, walls
from tests.transport.spaces import SPACES


@dataclass(frozen=True)
class Places:
    """A sensor whose pixels are places beside each other that take radiance from all directions."""

    space: Space
    n: int = 8

    @property
    def numbers(self) -> int:
        return self.space.d - 1

    def ray(self, pixel: Array, u: Array) -> tuple[Array, Array, Array]:
        aside = np.linspace(-1, 1, self.space.d)[:, None] * 0.01 * pixel
        return simplex(self.space.d).mean(axis=0)[:, None] + aside, self.space.sphere(u), np.ones(len(pixel))


WHITE = (1.0, 1.0, 1.0)
GREY = Material([Layer("lambert", (0.5, 0.3, 0.1))])
COLOURED = Material([Layer("lambert", (0.5, 0.3, 0.1)), Layer("ggx", (0.2, 0.3, 0.4), 0.5)])
ROUGH_GLASS = Material([Layer("rough reflection", WHITE, 0.4), Layer("rough transmission", WHITE, 0.4)])
CLEAR_GLASS = Material([Layer("glass reflection", WHITE, 0.0), Layer("glass transmission", WHITE, 0.0)])
FURNISHED = {"plane": (COLOURED, ROUGH_GLASS), "solid": (COLOURED, ROUGH_GLASS), "hyper": (GREY, CLEAR_GLASS)}
"""Materials of the walls and of the ball, by space; visible normals are not known in d = 4."""


def furnished_shifts(name: str, rule: Connectability, N: int, seed: int) -> Shifts:
    """Random leaves and their shifts to other places; every other wall shines."""
    space, rng = SPACES[name], np.random.default_rng(seed)
    facets = [replace(f, emission=(1.0, 2.0, 3.0) if n % 2 else ()) for n, f in enumerate(walls(space.d))]
    ball = Ball((simplex(space.d).mean(axis=0) + 0.1).tolist(), 0.07, 1)
    t = Tracer(scene(space, FURNISHED[name], facets, [ball]), Places(space), 3, rule)
    i, j = rng.integers(8, size=(2, N))
    x = traced(t, rng.random((t.D, N)), i, rng.integers(1, 4, N), rng.random(N) < 0.5)
    y, J = shift_path(t, x, j)
    return Shifts(t, x, i, y, j, J)
