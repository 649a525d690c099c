"""What pixels of space see: of which material it is, and how near other surfaces are.  [GRIS 7.5]

In flatland `corners` knows distances in closed form; here pixels look around.
"""

import numpy as np
from scipy.ndimage import binary_dilation

from figures.experiments.views import setting, standard
from restir_ref.batch import Array
from restir_ref.images import disk
from restir_ref.transport.rays import arrive
from tracer3d.gbuffer import gbuffer
from tracer3d.sensors import Mosaic

DIRECTIONS = 256
"""Directions in which a pixel looks for surfaces within reach."""

ASIDE = 0.05
"""Least cosine with the normal of directions that count: flatter ones meet the surface itself."""

LIFT = 1e-7
"""How far above its surface a pixel's look begins, in units of length."""


def of_material(scene: str, material: int) -> Array:
    """Whether the middle of each pixel sees that material, (n,)."""
    world, sensor = setting(scene).scene, standard(scene)
    v = gbuffer(world, sensor)
    return np.asarray(v.met & (world.material[v.prim] == material))


def within(scene: str, distance: float) -> Array:
    """Whether what the middle of each pixel sees has another surface in front of it, nearer than the distance, (n,).

    Looked for in DIRECTIONS, a spiral of golden angles on the sphere.
    """
    world, sensor = setting(scene).scene, standard(scene)
    v, near = gbuffer(world, sensor), np.zeros(sensor.n, dtype=bool)
    for w in spiral(DIRECTIONS).T:
        _, t, met = arrive(world, v.x + LIFT * v.n, np.repeat(w[:, None], sensor.n, axis=1))
        near |= (w @ v.n > ASIDE) & met & (t < distance)
    return np.asarray(near & v.met)


def spiral(count: int) -> Array:
    """Unit vectors all around, evenly spread, (3, count)."""
    k = np.arange(count) + 0.5
    z, turn = 1 - 2 * k / count, k * np.pi * (3 - np.sqrt(5))
    rim = np.sqrt(1 - z**2)
    return np.stack([rim * np.cos(turn), rim * np.sin(turn), z])


def around(mask: Array, sensor: Mosaic, radius: float) -> Array:
    """The masked pixels of each crop and all that have one of them within the radius, (n,)."""
    reach = int(radius)
    ball = np.zeros((2 * reach + 1,) * 2, dtype=bool)
    ball[tuple(disk(reach) + reach)] = ball[reach, reach] = True
    crops = mask.reshape(-1, *sensor.shape)
    return np.concatenate([binary_dilation(crop, ball).ravel() for crop in crops])
