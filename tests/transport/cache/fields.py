"""Fields of irradiance in closed form, and a vertex that they are asked from."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from restir_ref.batch import Array
from restir_ref.transport.cache.leaving import Cache
from restir_ref.transport.materials import Layer, Material, Vertex
from restir_ref.transport.scene import scene
from restir_ref.transport.space import Space, ball_volume
from tests.transport.lobe_cases import tilted
from tests.transport.rooms import simplex, walls


@dataclass(frozen=True)
class Uniform:
    """Radiance 1 from everywhere."""

    d: int
    C: int = 1

    @property
    def spacing(self) -> Array:
        return np.full(self.d, 0.1)

    def irradiance(self, x: Array, n: Array, w: Array, b: Array) -> Array:
        return np.full((self.C, x.shape[-1]), ball_volume(self.d))


@dataclass(frozen=True)
class Smooth(Uniform):
    """What changes with the place that is asked, the direction, the side, and from channel to channel; positive."""

    def irradiance(self, x: Array, n: Array, w: Array, b: Array) -> Array:
        y = x + b
        at = 1 + 0.5 * np.sin(3 * y[0]) + 0.2 * np.cos(4 * y[1]) + 0.2 * w[0] - 0.1 * w[1] * w[0] + 0.05 * n[0]
        return ball_volume(self.d) * at * np.linspace(1, 0.5, self.C)[:, None]


@dataclass(frozen=True)
class Beam(Uniform):
    """Bright from one side, and dim from all others: where a surface looks decides what it sends."""

    def irradiance(self, x: Array, n: Array, w: Array, b: Array) -> Array:
        return ball_volume(self.d) * (0.05 + np.maximum(w[:1], 0) ** 4) * np.ones((self.C, 1))


def asking(space: Space, layers: Sequence[Layer], field: Uniform, cos: float, n: int) -> tuple[Cache, Vertex]:
    """A cache in a room of one material, and n equal vertices on one of its walls, seen under a cosine."""
    s = scene(space, [Material(layers)], walls(space.d, 0, (1.0,) * field.C))
    one, zero = np.ones(n), np.zeros(n, dtype=int)
    x = simplex(space.d)[1:].mean(axis=0)[:, None] * one
    normal = s.normals[:, :1] * one
    return Cache(s, field), Vertex(x, normal, tilted(space.d, cos, n), zero, zero, zero == 0)
