"""Path tracing that ends in a cache, to be compared with DDGI resampling: at x_1, and at x_2.  [DDGIR 4]

Both leave the direct light of x_1 to ReSTIR DI (`restir_di.direct_light`), and so does path tracing (`indirect_light`):

    path tracing     L_e + DI + all other leaves of a path tree
    primary DDGI     L_e + DI + rho / C_d E(x_1, n), E without direct light, + glossy paths       [DDGIR Eq. 2]
    secondary DDGI   L_e + DI + L+(x_2) by one ray                                                [DDGIR Eq. 5]

What stands here is the last term.  Only delta lobes of x_1 take emitted light by their rays.
"""

from dataclasses import replace

import numpy as np

from restir_ref.batch import Array, take
from restir_ref.chance import Chance
from restir_ref.transport.baselines.restir_di import LightIntegrals
from restir_ref.transport.cache.integrals import CacheIntegrals, Ray, ray
from restir_ref.transport.cache.leaving import Cache, diffuse, gloss, is_glossy
from restir_ref.transport.cache.shading import Shading, met
from restir_ref.transport.rays import arrive, emitted


def direct(of: CacheIntegrals) -> LightIntegrals:
    """The integrals of ReSTIR DI over the same x_1."""
    return LightIntegrals(of.scene, of.n, of.v, of.T)


def secondary(of: CacheIntegrals, index: Array, shading: Shading, chance: Chance) -> Array:
    """T f_r |cos_1| / p L+(x_2 -> x_1), (C, N): one ray.  [DDGIR 4, item 3]"""
    return scattered(of, index, ray(of, index, chance), shading, chance)


def primary(of: CacheIntegrals, original: Cache, index: Array, shading: Shading, chance: Chance) -> Array:
    """T rho / C_d E(x_1, n) of a cache without direct light, and what glossy lobes of x_1 see by a ray; (C, N).

    [DDGIR Eq. 2, 4]; behind the ray light is what the integrals' own, augmented cache says.
    """
    v, r, T = take((of.v, of.r, of.T), index)
    glossy = np.asarray(is_glossy(of.scene.materials, v).any(axis=0))
    L = np.asarray(T * diffuse(original, v, r))
    return L + scattered(of, index, glossy_ray(of, index, glossy, chance), shading, chance) if glossy.any() else L


def glossy_ray(of: CacheIntegrals, index: Array, glossy: Array, chance: Chance) -> Ray:
    """A ray by one of the glossy lobes of x_1, where `glossy` (N,) says that there are any; elsewhere weight 0."""
    u, columns = chance.uniform((of.scene.space.d, len(index))), np.flatnonzero(glossy)
    v, T = take((of.v, of.T), index[columns])
    g = gloss(of.cache, v, u.take(columns, axis=-1))
    z, r, hit = arrive(of.scene, v.x, g.w)
    own = np.maximum(np.cumsum(glossy) - 1, 0)  # elsewhere the ray of another column
    found = take(Ray(z, g.w, r, g.p, T * g.weight * hit), own)
    return replace(found, weight=found.weight * glossy)


def scattered(of: CacheIntegrals, index: Array, by: Ray, shading: Shading, chance: Chance) -> Array:
    """The ray's weight times L+(x_2), and L_e(x_2) of delta lobes, for which ReSTIR DI has no samples; (C, N)."""
    at = met(of, index, by, by.weight)
    L = emitted(of.scene, by.z) * (by.p == 0) + shading(of.cache, at, chance)
    return np.asarray(by.weight * np.where(at.wanted, L, 0.0))
