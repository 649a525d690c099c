"""BSDF lobes in d dimensions: sampling, density, weight and inversion side by side.

All directions are local, (d, N), cosine last, on the side of the outgoing direction o, where
o[-1] > 0.  A lobe's value is f |cos_i| = pdf * weight, without colour: the weight is what one sample
carries, so it also serves delta lobes, which have no density.

Reflection is reciprocal, f(o, i) = f(i, o).  Transmission is for basic radiance, radiance divided by
n^(d-1) on its side, which passes interfaces without a factor; there f(o, i) = eta^(d-1) f(i, o).
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Protocol

import numpy as np

from restir_ref.batch import Array
from restir_ref.transport.space import Space, ball_volume
from restir_ref.transport.vectors import dot, norm, normalize, power, reflect

TINY = 1e-100
"""Keeps denominators positive where the numerator is 0; its powers stay above the smallest float."""


class Surface(Protocol):
    """What a lobe may ask of its surface."""

    @property
    def alpha(self) -> Array:
        """GGX width (N,), the square of the perceptual roughness."""

    @property
    def eta(self) -> Array:
        """Index of refraction on the other side over the one on the side of o, (N,)."""


@dataclass(frozen=True)
class Lobe:
    """One kind of lobe.

    sample(space, s, o, u)    incident direction i from u (d-1, N); i = 0 where there is none
    pdf(space, s, o, i)       density of `sample` in directions (solid angle; angle in flatland); 0 for delta lobes
    weight(space, s, o, i)    f |cos_i| / pdf where that is positive; for delta lobes of their one direction
    invert(space, s, o, i)    the u of `sample`
    share(s, o)               fraction of this lobe's weight in choosing lobes, such as Fresnel's; None if constant
    """

    sample: Callable[[Space, Surface, Array, Array], Array]
    pdf: Callable[[Space, Surface, Array, Array], Array]
    weight: Callable[[Space, Surface, Array, Array], Array]
    invert: Callable[[Space, Surface, Array, Array], Array]
    share: Callable[[Surface, Array], Array] | None = None
    delta: bool = False


def evaluate(lobe: Lobe, space: Space, s: Surface, o: Array, i: Array) -> Array:
    """f |cos_i| without colour, (N,); 0 for delta lobes."""
    return lobe.pdf(space, s, o, i) * lobe.weight(space, s, o, i)


def unit_weight(space: Space, s: Surface, o: Array, i: Array) -> Array:
    """f |cos_i| = pdf."""
    return np.ones(o.shape[-1])


# Lambert: f = 1 / C_d, sampled by lifting a uniform point of the ball (Malley in any dimension).


def lambert_sample(space: Space, s: Surface, o: Array, u: Array) -> Array:
    """i = (x, sqrt(1 - |x|^2)), x uniform in B^(d-1)."""
    x = space.ball(u)
    return np.concatenate([x, np.sqrt(np.maximum(1 - dot(x, x), 0))[None]])


def lambert_pdf(space: Space, s: Surface, o: Array, i: Array) -> Array:
    """cos / C_d."""
    return np.asarray(np.maximum(i[-1], 0) / ball_volume(space.d))


def lambert_invert(space: Space, s: Surface, o: Array, i: Array) -> Array:
    """Drop the cosine, invert the ball."""
    return space.unball(i[:-1])


# GGX, any dimension: the microsurface is the unit hemisphere with its tangential components stretched
# by alpha, so its normals are those of the hemisphere, squeezed by alpha in the other sense.


def smith_area(alpha: Array, w: Array) -> Array:
    """cos (1 + Lambda) = (cos + sqrt(cos^2 + a^2 sin^2)) / 2, the microsurface's area projected along w.

    Smith's masking is G_1 = cos / area.  This form is the same in any dimension and never 0 / 0.
    """
    return np.asarray((np.abs(w[-1]) + np.sqrt(w[-1] ** 2 + alpha**2 * dot(w[:-1], w[:-1]))) / 2)


def masking(alpha: Array, o: Array, i: Array) -> Array:
    """G_2(o, i) / G_1(o) = (1 + Lambda_o) / (1 + Lambda_o + Lambda_i), height-correlated Smith."""
    c_o, c_i = o[-1], np.abs(i[-1])
    visible = smith_area(alpha, o) * c_i
    return np.asarray(visible / np.maximum(visible + (smith_area(alpha, i) - c_i) * c_o, TINY))


def ggx_D(space: Space, alpha: Array, m: Array) -> Array:
    """D(m) = 1 / (C_d a^(d-1) (cos^2 + sin^2 / a^2)^((d+1)/2)), with integral of D cos = 1; for m of any length > 0.

    That is a^2 |m|^(d+1) / (C_d (a^2 m_z^2 + |m_t|^2)^((d+1)/2)): one length of the squeezed normal.
    """
    stretched = np.sqrt(alpha**2 * m[-1] ** 2 + dot(m[:-1], m[:-1]))
    return np.asarray(alpha**2 * power(norm(m) / stretched, space.d + 1) / ball_volume(space.d) * (m[-1] > 0))


def visible_normal(space: Space, alpha: Array, o: Array, u: Array) -> Array:
    """m with density G_1(o) max(0, o.m) D(m) / o_z: stretch o, sample the hemisphere, unstretch."""
    m = space.visible(u, _stretched(alpha, o))
    return normalize(np.concatenate([alpha * m[:-1], np.maximum(m[-1:], TINY)]))


def visible_number(space: Space, alpha: Array, o: Array, m: Array) -> Array:
    """The u of `visible_normal`."""
    return space.unvisible(normalize(np.concatenate([m[:-1], alpha * m[-1:]])), _stretched(alpha, o))


def _stretched(alpha: Array, o: Array) -> Array:
    return normalize(np.concatenate([alpha * o[:-1], o[-1:]]))


def half_vector_pdf(space: Space, alpha: Array, o: Array, i: Array, h: Array) -> Array:
    """a^2 |o.h| |i.h| / (C_d area(o) (a^2 h_z^2 + |h_t|^2)^((d+1)/2)) for h = o + eta i, up to eta^(d-1).

    The density |o.m| D(m) / area(o) of the visible normal m = h / |h|, times its d omega_m / d omega_i
    = eta^(d-1) |i.m| / |o.m + eta i.m|^(d-1) = eta^(d-1) |i.h| / |h|^d  [Walter 2007]: all powers of |h|
    cancel.  Reflection is the case eta = 1, where |i.m| = |o.m| gives 1 / (2^(d-1) |o.m|^(d-2)).
    """
    stretched = np.sqrt(alpha**2 * h[-1] ** 2 + dot(h[:-1], h[:-1]))
    cosines = np.abs(dot(o, h) * dot(i, h))
    below = ball_volume(space.d) * smith_area(alpha, o) * power(stretched, space.d + 1)
    return np.asarray(alpha**2 * cosines / np.maximum(below, TINY))


def ggx_sample(space: Space, s: Surface, o: Array, u: Array) -> Array:
    """Mirror o at a visible normal; 0 below the surface."""
    i = reflect(o, visible_normal(space, s.alpha, o, u))
    return np.asarray(i * (i[-1] > 0))


def ggx_pdf(space: Space, s: Surface, o: Array, i: Array) -> Array:
    """G_1(o) D(m) |o.m|^(3-d) / (2^(d-1) o_z), m the half vector."""
    return np.asarray(half_vector_pdf(space, s.alpha, o, i, o + i) * (i[-1] > 0))


def ggx_weight(space: Space, s: Surface, o: Array, i: Array) -> Array:
    """G_2 / G_1, so that f = D G_2 |o.m|^(3-d) / (2^(d-1) cos_i cos_o)."""
    return masking(s.alpha, o, i)


def ggx_invert(space: Space, s: Surface, o: Array, i: Array) -> Array:
    """The visible normal is the half vector."""
    return visible_number(space, s.alpha, o, o + i)


# Mirror: a delta lobe.


def mirror_sample(space: Space, s: Surface, o: Array, u: Array) -> Array:
    """o mirrored at the normal."""
    return np.concatenate([-o[:-1], o[-1:]])


def no_density(space: Space, s: Surface, o: Array, i: Array) -> Array:
    """Delta lobes have no density."""
    return np.zeros(o.shape[-1])


def no_numbers(space: Space, s: Surface, o: Array, i: Array) -> Array:
    """Delta lobes read no numbers: any u will do."""
    return np.full((space.d - 1, o.shape[-1]), 0.5)


# Dielectrics: reflection and transmission are two lobes, chosen by Fresnel's term at the normal.


def fresnel(eta: Array, cos_o: Array) -> Array:
    """Unpolarised reflectance of a dielectric, eta = eta_t / eta_i; 1 in total internal reflection."""
    c = np.clip(np.abs(cos_o), TINY, 1)
    t = np.sqrt(np.maximum(1 - (1 - c**2) / eta**2, 0))
    parallel, perpendicular = (eta * c - t) / (eta * c + t), (c - eta * t) / (c + eta * t)
    return np.asarray((parallel**2 + perpendicular**2) / 2)


def reflected_share(s: Surface, o: Array) -> Array:
    """F(o . n)."""
    return fresnel(s.eta, o[-1])


def transmitted_share(s: Surface, o: Array) -> Array:
    """1 - F(o . n)."""
    return 1 - fresnel(s.eta, o[-1])


def refract(o: Array, m: Array, eta: Array) -> Array:
    """o refracted at m (o.m > 0) into the other side; 0 in total internal reflection."""
    c = dot(o, m)
    cos2_t = 1 - (1 - c**2) / eta**2
    i = (c / eta - np.sqrt(np.maximum(cos2_t, 0))) * m - o / eta
    return np.asarray(i * (cos2_t > 0))


def glass_transmit_sample(space: Space, s: Surface, o: Array, u: Array) -> Array:
    """Snell's law at the normal."""
    up = np.zeros_like(o)
    up[-1] = 1
    return refract(o, up, s.eta)


def glass_reflect_weight(space: Space, s: Surface, o: Array, i: Array) -> Array:
    """F."""
    return reflected_share(s, o)


def glass_transmit_weight(space: Space, s: Surface, o: Array, i: Array) -> Array:
    """1 - F."""
    return transmitted_share(s, o)


# Rough dielectrics: microfacets see F at their own normal, so a lobe has value where F(o . n) gives it
# no share (total internal reflection); shares are kept away from 0, or that light would be lost.

LEAST_SHARE = 0.05


def rough_reflected_share(s: Surface, o: Array) -> Array:
    """F(o . n), kept in [.05, .95]."""
    return np.clip(fresnel(s.eta, o[-1]), LEAST_SHARE, 1 - LEAST_SHARE)


def rough_transmitted_share(s: Surface, o: Array) -> Array:
    """1 - F(o . n), kept in [.05, .95]."""
    return 1 - rough_reflected_share(s, o)


def rough_reflect_weight(space: Space, s: Surface, o: Array, i: Array) -> Array:
    """F(o.m) G_2 / G_1; |o.m| = |o + i| / 2."""
    return fresnel(s.eta, norm(o + i) / 2) * masking(s.alpha, o, i)


def transmission_normal(s: Surface, o: Array, i: Array) -> Array:
    """m = -(o + eta i) up to its length, turned to the side of the normal.  [Walter 2007]"""
    h = o + s.eta * i
    return np.asarray(np.where(h[-1] < 0, -h, h))


def rough_transmit_sample(space: Space, s: Surface, o: Array, u: Array) -> Array:
    """Refract o at a visible normal; 0 if it stays above."""
    i = refract(o, visible_normal(space, s.alpha, o, u), s.eta)
    return np.asarray(i * (i[-1] < 0))


def rough_transmit_pdf(space: Space, s: Surface, o: Array, i: Array) -> Array:
    """G_1(o) |o.m| D(m) / o_z times d omega_m / d omega_i = eta^(d-1) |i.m| / |o.m + eta i.m|^(d-1)."""
    eta, h = s.eta, transmission_normal(s, o, i)
    crosses = (i[-1] < 0) & (dot(o, h) > 0) & (dot(i, h) < 0)
    return np.asarray(power(eta, space.d - 1) * half_vector_pdf(space, s.alpha, o, i, h) * crosses)


def rough_transmit_weight(space: Space, s: Surface, o: Array, i: Array) -> Array:
    """(1 - F(o.m)) G_2 / G_1."""
    h = transmission_normal(s, o, i)
    return (1 - fresnel(s.eta, dot(o, h) / np.maximum(norm(h), TINY))) * masking(s.alpha, o, i)


def rough_transmit_invert(space: Space, s: Surface, o: Array, i: Array) -> Array:
    """The visible normal is the transmission normal."""
    return visible_number(space, s.alpha, o, transmission_normal(s, o, i))


LOBES: Mapping[str, Lobe] = MappingProxyType(
    {
        "lambert": Lobe(lambert_sample, lambert_pdf, unit_weight, lambert_invert),
        "ggx": Lobe(ggx_sample, ggx_pdf, ggx_weight, ggx_invert),
        "rough reflection": Lobe(ggx_sample, ggx_pdf, rough_reflect_weight, ggx_invert, rough_reflected_share),
        "rough transmission": Lobe(
            rough_transmit_sample,
            rough_transmit_pdf,
            rough_transmit_weight,
            rough_transmit_invert,
            rough_transmitted_share,
        ),
        "mirror": Lobe(mirror_sample, no_density, unit_weight, no_numbers, delta=True),
        "glass reflection": Lobe(
            mirror_sample, no_density, glass_reflect_weight, no_numbers, reflected_share, delta=True
        ),
        "glass transmission": Lobe(
            glass_transmit_sample, no_density, glass_transmit_weight, no_numbers, transmitted_share, delta=True
        ),
    }
)

KINDS = tuple(LOBES)
