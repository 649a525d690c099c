"""Rays that go where the nearest probe's last rays found light, or by the BSDF.  [DDGIR 5.1]"""

import numpy as np

from restir_ref.batch import Array, ratio, take
from restir_ref.chance import Chance
from restir_ref.transport import materials as mat
from restir_ref.transport.cache.integrals import CacheIntegrals, Ray
from restir_ref.transport.cache.leaving import gloss_of
from restir_ref.transport.cache.probe_rays import ProbeRays, nearest
from restir_ref.transport.rays import arrive


def guided(of: CacheIntegrals, rays: ProbeRays, index: Array, chance: Chance, share: float = 0.5) -> Ray:
    """A ray by the probe with probability `share`, else by the BSDF; what it carries is weighed by both densities.

    A cell is chosen by its mean radiance over channels times its size, a direction in it evenly.  Where the probe saw
    nothing, and by delta lobes, the BSDF alone is asked.  Raises ValueError for a share outside [0, 1).
    """
    if not 0 <= share < 1:
        raise ValueError(f"the share of guided rays must be in [0, 1), but is {share}: 1 would leave the BSDF no part.")
    s, d = of.scene, of.scene.space.d
    v, T = take((of.v, of.T), index)
    first, u, place = chance.uniform((len(index),)), chance.uniform(v.x.shape), chance.uniform((d - 1, len(index)))
    powers = cell_powers(rays, v.x)
    a = share * (powers.sum(axis=0) > 0)
    by_probe = first < a
    P = mat.lobe_shares(s.materials, v)
    lobe = mat.choose_lobe(P, u[0])
    g = gloss_of(s, v, P, lobe, mat.sample_lobe(s.materials, s.space, v, lobe, u[1:]))
    w = np.where(by_probe, rays.cells.within(chance.choose(powers), place), g.w)
    f, p_bsdf = mat.evaluate_all(s.materials, s.space, v, P, s.space.to_local(v.n, w))
    by_delta = ~by_probe & (g.p == 0)
    p = np.where(by_delta, 0, (1 - a) * p_bsdf + a * pdf(rays, powers, w))
    z, r, met = arrive(s, v.x, w)
    weight = np.where(by_delta, g.weight / (1 - a), ratio(f, p)) * (met & (by_probe | ~g.lost))
    return Ray(z, w, r, p, np.asarray(T * weight))


def cell_powers(rays: ProbeRays, x: Array) -> Array:
    """Mean of L over channels, times the cell's size, of the probe nearest to x (d, N); (R, N)."""
    return np.asarray((rays.L.mean(axis=0)[nearest(rays, x)] * rays.cells.size).T)


def pdf(rays: ProbeRays, powers: Array, w: Array) -> Array:
    """Density of w (d, N), evenly in its cell: power / (sum of powers) / size; (N,)."""
    cell = rays.cells.cell(w)
    return ratio(powers[cell, np.arange(len(cell))], powers.sum(axis=0)) / rays.cells.size[cell]
