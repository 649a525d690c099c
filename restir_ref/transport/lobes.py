"""BSDF lobes in d dimensions: sampling, density, value and inversion side by side.

All directions are local, (d, N), cosine last, on the side of the outgoing direction o where
o[-1] > 0.  `evaluate` returns f |cos| without colour; a delta lobe has no density and no value off
its direction, and `weight` is what one sample of it carries.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from restir_ref.batch import Array
from restir_ref.transport.space import Space, ball_volume
from restir_ref.transport.vectors import dot, norm, normalize, reflect


@dataclass(frozen=True)
class Surface:
    """What a lobe must know of its surface: GGX alpha (N,), relative index of refraction eta = eta_t / eta_i (N,)."""

    alpha: Array
    eta: Array


@dataclass(frozen=True)
class Lobe:
    """One kind of lobe.

    sample(space, s, o, u)     incident direction i from u (d-1, N); i = 0 where there is none
    pdf(space, s, o, i)        density of `sample` in directions (solid angle; angle in flatland)
    evaluate(space, s, o, i)   f |cos_i|, without colour; for delta lobes the weight f cos / p of their direction
    invert(space, s, o, i)     the u of `sample`
    share(s, o)                fraction of this lobe's weight in choosing lobes, such as Fresnel's
    """

    sample: Callable[[Space, Surface, Array, Array], Array]
    pdf: Callable[[Space, Surface, Array, Array], Array]
    evaluate: Callable[[Space, Surface, Array, Array], Array]
    invert: Callable[[Space, Surface, Array, Array], Array]
    share: Callable[[Surface, Array], Array]
    delta: bool = False


def always(s: Surface, o: Array) -> Array:
    """Weight independent of the direction."""
    return np.ones(o.shape[-1])


# Lambert: f = 1 / C_d, sampled by lifting a uniform point of the ball (Malley in any dimension).


def lambert_sample(space: Space, s: Surface, o: Array, u: Array) -> Array:
    """i = (x, sqrt(1 - |x|^2)), x uniform in B^(d-1)."""
    x = space.ball(u)
    return np.concatenate([x, np.sqrt(np.maximum(1 - dot(x, x), 0))[None]])


def lambert_pdf(space: Space, s: Surface, o: Array, i: Array) -> Array:
    """cos / C_d."""
    return np.maximum(i[-1], 0) / ball_volume(space.d)


def lambert_invert(space: Space, s: Surface, o: Array, i: Array) -> Array:
    """Drop the cosine, invert the ball."""
    return space.unball(i[:-1])


# GGX: visible normals by stretching, any dimension.


def ggx_D(space: Space, alpha: Array, m: Array) -> Array:
    """D(m) = 1 / (C_d a^(d-1) (cos^2 + sin^2 / a^2)^((d+1)/2)), with integral of D cos = 1."""
    d = space.d
    spread = m[-1] ** 2 + (1 - m[-1] ** 2) / alpha**2
    return np.asarray((m[-1] > 0) / (ball_volume(d) * alpha ** (d - 1) * spread ** ((d + 1) / 2)))


def smith_Lambda(alpha: Array, w: Array) -> Array:
    """Lambda = (sqrt(1 + a^2 tan^2) - 1) / 2: the same in any dimension."""
    cos2 = np.maximum(w[-1] ** 2, 1e-30)
    return np.asarray((np.sqrt(1 + alpha**2 * (1 - np.minimum(cos2, 1)) / cos2) - 1) / 2)


def visible_normal(space: Space, alpha: Array, o: Array, u: Array) -> Array:
    """m with density G_1(o) max(0, o.m) D(m) / o_z: stretch o, sample the hemisphere, unstretch."""
    v = normalize(np.concatenate([alpha * o[:-1], o[-1:]]))
    m = space.visible(u, v)
    return normalize(np.concatenate([alpha * m[:-1], np.maximum(m[-1:], 1e-30)]))


def visible_number(space: Space, alpha: Array, o: Array, m: Array) -> Array:
    """The u of `visible_normal`."""
    v = normalize(np.concatenate([alpha * o[:-1], o[-1:]]))
    return space.unvisible(normalize(np.concatenate([m[:-1] / alpha, m[-1:]])), v)


def visible_pdf(space: Space, alpha: Array, o: Array, m: Array) -> Array:
    """G_1(o) max(0, o.m) D(m) / o_z."""
    G1 = 1 / (1 + smith_Lambda(alpha, o))
    return np.asarray(G1 * np.maximum(dot(o, m), 0) * ggx_D(space, alpha, m) / o[-1])


def half_vector(o: Array, i: Array) -> Array:
    """(o + i) / |o + i|, or the normal where they cancel."""
    h = o + i
    length = norm(h)
    up = np.zeros_like(h)
    up[-1] = 1
    return np.where(length > 1e-12, h / np.where(length > 1e-12, length, 1), up)


def ggx_sample(space: Space, s: Surface, o: Array, u: Array) -> Array:
    """Mirror o at a visible normal; 0 below the surface."""
    i = reflect(o, visible_normal(space, s.alpha, o, u))
    return np.where(i[-1] > 0, i, 0)


def ggx_pdf(space: Space, s: Surface, o: Array, i: Array) -> Array:
    """Density of the visible normal times d omega_m / d omega_i = 1 / (2^(d-1) |o.m|^(d-2))."""
    m = half_vector(o, i)
    jacobian = 1 / (2 ** (space.d - 1) * np.maximum(dot(o, m), 1e-30) ** (space.d - 2))
    return np.where(i[-1] > 0, visible_pdf(space, s.alpha, o, m) * jacobian, 0)


def ggx_evaluate(space: Space, s: Surface, o: Array, i: Array) -> Array:
    """f cos_i = D G_2 |o.m|^(3-d) / (2^(d-1) cos_o) = pdf G_2 / G_1."""
    return ggx_pdf(space, s, o, i) * masking(s.alpha, o, i)


def masking(alpha: Array, o: Array, i: Array) -> Array:
    """G_2(o, i) / G_1(o), height-correlated Smith: (1 + Lambda_o) / (1 + Lambda_o + Lambda_i)."""
    L_o = smith_Lambda(alpha, o)
    return np.asarray((1 + L_o) / (1 + L_o + smith_Lambda(alpha, i)))


def ggx_invert(space: Space, s: Surface, o: Array, i: Array) -> Array:
    """The visible normal is the half vector."""
    return visible_number(space, s.alpha, o, half_vector(o, i))


# Mirror: a delta lobe.


def mirror_sample(space: Space, s: Surface, o: Array, u: Array) -> Array:
    """o mirrored at the normal."""
    return np.concatenate([-o[:-1], o[-1:]])


def no_density(space: Space, s: Surface, o: Array, i: Array) -> Array:
    """Delta lobes have no density."""
    return np.zeros(o.shape[-1])


def unit_weight(space: Space, s: Surface, o: Array, i: Array) -> Array:
    """f cos / p = 1 in the one direction of a delta lobe."""
    return np.ones(o.shape[-1])


def no_numbers(space: Space, s: Surface, o: Array, i: Array) -> Array:
    """Delta lobes read no numbers: any u will do."""
    return np.full((space.d - 1, o.shape[-1]), 0.5)


# Dielectrics: reflection and transmission are two lobes, chosen by Fresnel's term at the normal.


def fresnel(eta: Array, cos_o: Array) -> Array:
    """Unpolarised reflectance of a dielectric, eta = eta_t / eta_i; 1 in total internal reflection."""
    c = np.minimum(np.abs(cos_o), 1)
    sin2_t = (1 - c**2) / eta**2
    t = np.sqrt(np.maximum(1 - sin2_t, 0))
    parallel, perpendicular = (eta * c - t) / (eta * c + t), (c - eta * t) / (c + eta * t)
    return np.where(sin2_t >= 1, 1.0, (parallel**2 + perpendicular**2) / 2)


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
    return np.where(cos2_t > 0, i, 0)


def glass_transmit_sample(space: Space, s: Surface, o: Array, u: Array) -> Array:
    """Snell's law at the normal."""
    up = np.zeros_like(o)
    up[-1] = 1
    return refract(o, up, s.eta)


def glass_reflect_weight(space: Space, s: Surface, o: Array, i: Array) -> Array:
    """F."""
    return fresnel(s.eta, o[-1])


def glass_transmit_weight(space: Space, s: Surface, o: Array, i: Array) -> Array:
    """1 - F, for radiance divided by eta^(d-1) ("basic radiance"), which needs no factor at interfaces."""
    return 1 - fresnel(s.eta, o[-1])


def rough_reflect_evaluate(space: Space, s: Surface, o: Array, i: Array) -> Array:
    """F(o.m) times GGX reflection."""
    return ggx_evaluate(space, s, o, i) * fresnel(s.eta, dot(o, half_vector(o, i)))


def transmission_normal(s: Surface, o: Array, i: Array) -> Array:
    """m = -(o + eta i) / |...|, turned to the side of o.  [Walter 2007]"""
    h = -(o + s.eta * i)
    length = np.maximum(norm(h), 1e-30)
    m = h / length
    return np.where(m[-1] < 0, -m, m)


def rough_transmit_sample(space: Space, s: Surface, o: Array, u: Array) -> Array:
    """Refract o at a visible normal; 0 if it stays above."""
    i = refract(o, visible_normal(space, s.alpha, o, u), s.eta)
    return np.where(i[-1] < 0, i, 0)


def rough_transmit_pdf(space: Space, s: Surface, o: Array, i: Array) -> Array:
    """Density of the visible normal times d omega_m / d omega_i = eta^(d-1) |i.m| / |o.m + eta i.m|^(d-1)."""
    m = transmission_normal(s, o, i)
    om, im = dot(o, m), dot(i, m)
    jacobian = s.eta ** (space.d - 1) * np.abs(im) / np.maximum(np.abs(om + s.eta * im), 1e-30) ** (space.d - 1)
    return np.where((i[-1] < 0) & (om > 0) & (im < 0), visible_pdf(space, s.alpha, o, m) * jacobian, 0)


def rough_transmit_evaluate(space: Space, s: Surface, o: Array, i: Array) -> Array:
    """f |cos_i| = (1 - F(o.m)) pdf G_2 / G_1, for basic radiance."""
    m = transmission_normal(s, o, i)
    below = np.concatenate([i[:-1], np.abs(i[-1:])])
    return rough_transmit_pdf(space, s, o, i) * (1 - fresnel(s.eta, dot(o, m))) * masking(s.alpha, o, below)


def rough_transmit_invert(space: Space, s: Surface, o: Array, i: Array) -> Array:
    """The visible normal is the transmission normal."""
    return visible_number(space, s.alpha, o, transmission_normal(s, o, i))


LAMBERT, GGX, ROUGH_REFLECT, ROUGH_TRANSMIT, MIRROR, GLASS_REFLECT, GLASS_TRANSMIT = KINDS = (
    "lambert",
    "ggx",
    "rough reflection",
    "rough transmission",
    "mirror",
    "glass reflection",
    "glass transmission",
)

LOBES: Mapping[str, Lobe] = MappingProxyType(
    {
        LAMBERT: Lobe(lambert_sample, lambert_pdf, lambert_pdf, lambert_invert, always),
        GGX: Lobe(ggx_sample, ggx_pdf, ggx_evaluate, ggx_invert, always),
        ROUGH_REFLECT: Lobe(ggx_sample, ggx_pdf, rough_reflect_evaluate, ggx_invert, reflected_share),
        ROUGH_TRANSMIT: Lobe(
            rough_transmit_sample, rough_transmit_pdf, rough_transmit_evaluate, rough_transmit_invert, transmitted_share
        ),
        MIRROR: Lobe(mirror_sample, no_density, unit_weight, no_numbers, always, delta=True),
        GLASS_REFLECT: Lobe(mirror_sample, no_density, glass_reflect_weight, no_numbers, reflected_share, delta=True),
        GLASS_TRANSMIT: Lobe(
            glass_transmit_sample, no_density, glass_transmit_weight, no_numbers, transmitted_share, delta=True
        ),
    }
)
