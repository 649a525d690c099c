"""What x_1 takes from all surfaces, by quadrature over directions; and frames of resampling the same."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from restir_ref.batch import Array, take
from restir_ref.chance import Chance
from restir_ref.integrals import Image, Pixels, Reservoirs
from restir_ref.loop import GOLDEN, random_in_row
from restir_ref.mis import WEIGHTS, Weights
from restir_ref.restir import resample, spatial, temporal
from restir_ref.transport import materials as mat
from restir_ref.transport.cache.integrals import CacheIntegrals, Found, by_ray, cache_integrals, on_lights
from restir_ref.transport.cache.leaving import Cache, leaving
from restir_ref.transport.cache.shading import bounded, plain, residual
from restir_ref.transport.paths import Tracer
from restir_ref.transport.rays import arrive, emitted
from tests.transport.lobe_cases import grid

CENTRE = 0.5
TURNS = np.array([[GOLDEN], [np.sqrt(2)]])
"""Grids of neighbouring pixels, and of neighbouring directions, are turned by these, so that their errors cancel."""


def at_centres(t: Tracer, cache: Cache, replicas: int, G_max: float = np.inf) -> Pixels:
    """Replicas of an image whose x_1 are what the middles of pixels see."""
    index = np.arange(replicas * t.sensor.n)
    u = np.full((t.sensor.numbers, len(index)), CENTRE)
    return Pixels(cache_integrals(t, cache, u, index % t.sensor.n, G_max), index)


def gathered(of: CacheIntegrals, cells: int, glossy: int = 4) -> Array:
    """int T f_r |cos_1| (L_e + L+) dw of the first image's pixels, (C, n), by midpoints on the ball."""
    s, d, n = of.scene, of.scene.space.d, of.n
    points = grid(d - 1, cells)
    K = points.shape[-1]
    v, T = take((of.v, of.T), np.repeat(np.arange(n), K))
    x = s.space.ball((np.tile(points, n) + np.repeat(TURNS[: d - 1] * np.arange(n), K, axis=1)) % 1)
    cos = np.sqrt(1 - (x * x).sum(axis=0))
    i = np.concatenate([x, cos[None]])
    f, _ = mat.evaluate_all(s.materials, s.space, v, mat.lobe_shares(s.materials, v), i)
    z, r, met = arrive(s, v.x, s.space.to_world(v.n, i))
    L, numbers = emitted(s, z), grid(d - 1, glossy)
    turned = TURNS[: d - 1] * np.arange(len(r))
    for k in range(numbers.shape[-1]):
        u = np.concatenate([np.full((1, len(r)), 0.5), (numbers[:, k : k + 1] + turned) % 1])
        L = L + leaving(of.cache, z, r, u) / numbers.shape[-1]
    size = {2: 2.0, 3: np.pi}[d] / K
    return (T * f / cos * L * met).reshape(s.C, n, K).sum(axis=2) * size


@dataclass(frozen=True)
class Drawn:
    """A frame's candidates, resampled, and the ray among them."""

    X: Reservoirs
    found: Found


def drawn(here: Pixels, chance: Chance) -> Drawn:
    """The candidates of one frame."""
    of: CacheIntegrals = here.of
    lights, found = [*on_lights(of, here.index, chance)], by_ray(of, here.index, chance)
    return Drawn(resample([*lights, (found.x, found.mW)], here, chance), found)


After = Callable[[Pixels, Reservoirs, Chance], Reservoirs]
"""What a mistake does to reservoirs after every pass."""


def unchanged(here: Pixels, X: Reservoirs, chance: Chance) -> Reservoirs:
    return X


def reused(
    here: Pixels, chance: Chance, frames: int, mis: Weights = WEIGHTS["talbot"], after: After = unchanged
) -> Drawn:
    """The last of some frames with temporal reuse and three neighbours within 10 pixels."""
    image: Image = here.of
    now = drawn(here, chance)
    X = after(here, now.X, chance)
    for k in range(frames):
        if k:
            now = drawn(here, chance)
            X = after(here, temporal(now.X, here, X, [here], chance, mis=mis), chance)
        X = spatial(X, here, random_in_row(image, here.index, 3, 10, chance), chance, mis=mis)
        X = after(here, X, chance)
    return Drawn(X, now.found)


def shown(here: Pixels, frame: Drawn, chance: Chance, shading=plain) -> Array:
    """Both parts of the bounded light, (C, N)."""
    ceil = bounded(frame.X, here, shading, chance)
    return ceil + residual(here.of, here.index, frame.found, shading, chance)
