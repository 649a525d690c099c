"""The nearest probe's rays as a control variate of diffuse transport: only the difference is resampled.  [DDGIR 5.1]

    int f (L_e + L+) dy = T rho / C_d int g(w) cos dw + int (f (L_e + L+) - f_d g) dy

f_d is the diffuse part of f, g what the nearest probe to x_1 saw, constant around each of its rays: the first integral
is exact.  Selection is by |f (L_e + L+) - f_d g|, and estimates may be negative.

Hazard: in an open scene directions that meet nothing are in the first integral and not in the second.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from restir_ref.batch import Array, ratio, take
from restir_ref.chance import Chance
from restir_ref.integrals import Pixels, Shifted
from restir_ref.transport.cache.integrals import (
    CacheIntegrals,
    Found,
    Second,
    asked,
    bound,
    connection,
    radiance,
)
from restir_ref.transport.cache.leaving import diffuse_albedo, gloss
from restir_ref.transport.cache.probe_rays import ProbeRays, arriving, irradiance
from restir_ref.transport.cache.shading import Shading, met, sent
from restir_ref.transport.space import ball_volume
from restir_ref.transport.vectors import dot


@dataclass(frozen=True, eq=False)
class ControlledIntegrals:
    """What is left of cached light beside a control variate; a difference, which `target` takes without its sign.

    Raises ValueError for integrals with kept values: the target is no product, and MIS weights would see them.
    """

    of: CacheIntegrals
    rays: ProbeRays

    def __post_init__(self) -> None:
        if self.of.value is not asked:
            raise ValueError(
                f"the difference to a control variate needs values asked of every x_1, but these integrals have "
                f"value={self.of.value.__name__}: say value=asked."
            )

    @property
    def n(self) -> int:
        """Number of pixels."""
        return self.of.n

    def candidates(self, index: Array, chance: Chance) -> Iterator[tuple[Second, Array]]:
        """Those of the light itself."""
        return self.of.candidates(index, chance)

    def target(self, index: Array, x: Second) -> Array:
        """p_hat = mean over channels of |f (L_e + L+) - f_d g|."""
        return np.asarray(abs(x.f * x.L - self.controlled(index, x)).mean(axis=0))

    def contribution(self, index: Array, x: Second) -> Array:
        """f (L_e + L+) - f_d g, (C, N), of either sign."""
        L = radiance(self.of.cache, x, connection(self.of, index, x), gloss)
        return np.asarray(x.f * L - self.controlled(index, x))

    def controlled(self, index: Array, x: Second) -> Array:
        """f_d g, (C, N), with the bound and V of f."""
        of, at = self.of, connection(self.of, index, x)
        v = take(of.v, index)
        above = (dot(v.n, at.w) > 0) & x.f.any(axis=0)
        f_d = base(of, index) * at.G * bound(of.G_max, at.G) * above
        return np.asarray(f_d * arriving(self.rays, v.x, at.w))

    def shift(self, x: Second, index: Array, to: Pixels) -> Shifted:
        """The same point."""
        there: ControlledIntegrals = to.of  # type: ignore[assignment]
        return self.of.shift(x, index, Pixels(there.of, to.index))


def base(of: CacheIntegrals, index: Array) -> Array:
    """T rho / C_d of x_1, (C, N)."""
    v, T = take((of.v, of.T), index)
    return np.asarray(T * diffuse_albedo(of.scene.materials, v) / ball_volume(of.scene.space.d))


def variate(of: ControlledIntegrals, index: Array) -> Array:
    """T rho / C_d int g cos dw at x_1, (C, N)."""
    v = take(of.of.v, index)
    return base(of.of, index) * irradiance(of.rays, v.x, v.n)


def residual_difference(of: ControlledIntegrals, index: Array, found: Found, shading: Shading, chance: Chance) -> Array:
    """floor(T)(L_e + L+) by the candidate's ray, less the part of f_d g that the bound leaves out; (C, N)."""
    whole, ray = of.of, found.ray
    v = take(whole.v, index)
    light = found.rest * sent(whole.cache, met(whole, index, ray, found.rest), shading, chance)
    left = 1 - bound(whole.G_max, connection(whole, index, found.x).G)
    cos = np.maximum(dot(v.n, ray.w), 0) * ray.weight.any(axis=0)
    return np.asarray(light - base(whole, index) * ratio(cos, ray.p) * left * arriving(of.rays, v.x, ray.w))
