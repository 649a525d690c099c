"""A cache that knows: irradiance by path tracing from the very point that is asked, in place of probes.

What is left of an error with it is not the probes': it is that of asking for irradiance, which filters what arrives by
a cosine, where a lobe is narrower.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from restir_ref.batch import Array
from restir_ref.chance import Chance
from restir_ref.transport.paths import RECONNECTION, Tracer, radiance, trace
from restir_ref.transport.scene import Scene
from restir_ref.transport.space import ball_volume

OFF = 1e-6
"""How far off its surface a point asks, scene units: directions about a lobe's may lead into the surface."""

SAME = 1e-12
"""Directions that differ by less are the same."""

DEPTH = 16
"""Scattering events, of which the rest is less than 1% of the light in rooms that absorb a third."""


@dataclass(frozen=True, eq=False)
class Rays:
    """A sensor that looks from each of N points x (d, N) in its own direction w (d, N)."""

    x: Array
    w: Array
    numbers: int = 0
    film_numbers: int = 0

    @property
    def n(self) -> int:
        """One pixel per ray."""
        return len(self.x[0])

    def ray(self, pixel: Array, u: Array) -> tuple[Array, Array, Array]:
        """Start, direction, and weight 1."""
        return self.x.take(pixel, axis=-1), self.w.take(pixel, axis=-1), np.ones(len(pixel))


def filtered(s: Scene, n: Array, w: Array, chance: Chance) -> Array:
    """Directions (d, N) about w in the cosine's measure: so a cache is asked, of the normal and of lobes alike."""
    m = s.space.ball(chance.uniform((s.space.d - 1, w.shape[-1])))
    return s.space.to_world(w, np.concatenate([m, np.sqrt(np.maximum(1 - (m**2).sum(axis=0, keepdims=True), 0))]))


def narrow(s: Scene, n: Array, w: Array, chance: Chance) -> Array:
    """w itself where a lobe asks, `filtered` where w = n: a path that ends so has the mean of one that goes on."""
    return np.where(abs(w - n).max(axis=0) < SAME, filtered(s, n, w, chance), w)


Towards = Callable[[Scene, Array, Array, Chance], Array]
"""(scene, n, w, chance) -> where from the light is taken that a query about w tells, (d, N)."""


@dataclass(frozen=True, eq=False)
class Traced:
    """A `Field` without bias, noisy: C_d times the radiance that one path brings from where `towards` looks."""

    scene: Scene
    spacing: Array
    chance: Chance
    towards: Towards = filtered

    @property
    def C(self) -> int:
        """Number of channels."""
        return self.scene.C

    def irradiance(self, x: Array, n: Array, w: Array, b: Array) -> Array:
        """E+ (C, N) at x itself, wherever b displaces it to."""
        t = Tracer(self.scene, Rays(x + OFF * n, self.towards(self.scene, n, w, self.chance)), DEPTH, RECONNECTION)
        u, ray = self.chance.uniform((t.D, x.shape[-1])), np.arange(x.shape[-1])
        return ball_volume(self.scene.space.d) * radiance(trace(t, u, ray))
