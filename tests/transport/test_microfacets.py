"""GGX, Fresnel and Snell against closed forms and quadrature written here; d = 2 and 3 as special cases."""

import numpy as np
import pytest

from restir_ref.batch import Array
from restir_ref.transport import lobes
from restir_ref.transport.lobes import LOBES, evaluate, fresnel, ggx_D, masking, refract, smith_area
from restir_ref.transport.space import ball_volume, sphere_area
from restir_ref.transport.vectors import dot, normalize, power
from tests.transport.lobe_cases import facing, integral, plain, samples, spread, stretch, tilted, views
from tests.transport.spaces import SEEING

every_space = pytest.mark.parametrize("space", SEEING.values(), ids=SEEING)
every_alpha = pytest.mark.parametrize("alpha", [0.0225, 0.15, 0.5, 1.0])
every_eta = pytest.mark.parametrize("eta", [1.1, 1.5, 2.4, 1 / 1.1, 1 / 1.5, 1 / 2.4])


def test_the_two_constants_of_a_dimension():
    assert [ball_volume(d) for d in (2, 3, 4)] == pytest.approx([2, np.pi, 4 * np.pi / 3])
    assert [sphere_area(d) for d in (2, 3, 4)] == pytest.approx([2 * np.pi, 4 * np.pi, 2 * np.pi**2])


def test_powers_are_products():
    x = np.array([0.3, 2.0])
    assert all(np.allclose(power(x, n), x**n) for n in range(6))


# ---------------------------------------------------------------- closed forms of the plane and of space


def slope_form(d: int, a: float, cos: Array) -> Array:
    """D as printed for each dimension."""
    if d == 2:
        return (cos**2 + (1 - cos**2) / a**2) ** -1.5 / (2 * a)
    return a**2 / (np.pi * ((a**2 - 1) * cos**2 + 1) ** 2)


def G1(a: float, cos: Array) -> Array:
    return 2 / (1 + np.sqrt(1 + a**2 * (1 - cos**2) / cos**2))


def G2(a: float, o: Array, i: Array) -> Array:
    return 1 / (1 / G1(a, o[-1]) + 1 / G1(a, i[-1]) - 1)


def printed_f(d: int, a: float, o: Array, i: Array) -> Array:
    """F = 1: D G (o.h) / (2 c_i c_o) in the plane, D G / (4 c_i c_o) in space."""
    h = normalize(o + i)
    DG = slope_form(d, a, h[-1]) * G2(a, o, i)
    return DG * dot(o, h) / (2 * i[-1] * o[-1]) if d == 2 else DG / (4 * i[-1] * o[-1])


def printed_pdf(d: int, a: float, o: Array, i: Array) -> Array:
    """G_1 (o.h) D / c_o of the visible normal times 1/2 in the plane, 1 / (4 o.h) in space."""
    h = normalize(o + i)
    visible = G1(a, o[-1]) * dot(o, h) * slope_form(d, a, h[-1]) / o[-1]
    return visible / 2 if d == 2 else visible / (4 * dot(o, h))


@pytest.mark.claims("COM-A04")
@every_space
@every_alpha
def test_ggx_is_the_printed_formula_of_its_dimension(space, alpha):
    rng = np.random.default_rng(1)
    o, i, s = views(space.d, 1000, rng), views(space.d, 1000, rng), plain(alpha)
    lobe = LOBES["ggx"]
    assert np.allclose(ggx_D(space, s.alpha, o), slope_form(space.d, alpha, o[-1]), rtol=1e-9, atol=0)
    assert np.allclose(o[-1] / smith_area(s.alpha, o), G1(alpha, o[-1]), rtol=1e-12, atol=0)
    assert np.allclose(masking(s.alpha, o, i), G2(alpha, o, i) / G1(alpha, o[-1]), rtol=1e-12, atol=0)
    assert np.allclose(evaluate(lobe, space, s, o, i), printed_f(space.d, alpha, o, i) * i[-1], rtol=1e-9, atol=0)
    assert np.allclose(lobe.pdf(space, s, o, i), printed_pdf(space.d, alpha, o, i), rtol=1e-9, atol=0)


def test_the_formula_of_space_is_not_that_of_the_plane():
    o, i = views(2, 100, np.random.default_rng(2)), views(2, 100, np.random.default_rng(3))
    wrong = printed_pdf(3, 0.5, o, i) / LOBES["ggx"].pdf(SEEING["plane"], plain(0.5), o, i)
    assert np.abs(wrong - 1).min() > 1e-3


@pytest.mark.claims("COM-A02")
@pytest.mark.parametrize(("d", "constant"), [(2, 2.0), (3, np.pi)])
def test_lambert_is_cos_over_2_in_the_plane_and_over_pi_in_space(d, constant):
    space = next(space for space in SEEING.values() if space.d == d)
    o, i = views(d, 100, np.random.default_rng(4)), views(d, 100, np.random.default_rng(5))
    for value in (LOBES["lambert"].pdf, lambda *a: evaluate(LOBES["lambert"], *a)):
        assert np.allclose(value(space, plain(), o, i), i[-1] / constant, rtol=1e-15)


# ---------------------------------------------------------------- the microsurface

POINTS = {2: 20_000, 3: 300}
ERROR = {2: 1e-7, 3: 3e-5}
"""Midpoints per angle, and what they can resolve."""


def over_normals(space, f) -> float:
    """int f over the upper hemisphere."""
    return integral(space, f, np.eye(space.d)[:, -1:], POINTS[space.d], np.pi / 2)


@pytest.mark.claims("COM-A04")
@every_space
@every_alpha
def test_the_normals_projected_area_is_that_of_the_surface(space, alpha):
    """int D(m) cos dm = 1."""
    area = over_normals(space, lambda m: ggx_D(space, plain(alpha).alpha, m) * m[-1])
    assert area == pytest.approx(1, abs=ERROR[space.d])


@pytest.mark.claims("COM-A04")
@every_space
@every_alpha
@pytest.mark.parametrize("cos", [1.0, 0.7, 0.2, 0.02])
def test_the_visible_normals_projected_area_is_cos_o(space, alpha, cos):
    """G_1(o) int max(0, o.m) D(m) dm = cos_o.  (Heitz 2014)"""
    s, o = plain(alpha), tilted(space.d, cos)
    seen = over_normals(space, lambda m: ggx_D(space, s.alpha, m) * facing(spread(o, m), m))
    assert G1(alpha, cos) * seen == pytest.approx(cos, abs=ERROR[space.d])


def test_the_normals_of_space_do_not_fit_the_plane():
    wrong = over_normals(SEEING["plane"], lambda m: slope_form(3, 0.5, m[-1]) * m[-1])
    assert abs(wrong - 1) > 0.05


# ---------------------------------------------------------------- d omega_m / d omega_i


def tangent_stretch(f, w: Array) -> Array:
    """How much a map of directions (d, N) stretches the sphere at w."""
    frame = np.linalg.svd(w.T[:, None, :])[2][:, 1:, :]  # (N, d-1, d): a basis of the tangents
    return stretch(
        lambda x: f(normalize(w + np.einsum("kn,nkd->dn", x, frame))), np.zeros((len(w) - 1, w.shape[1])), 1e-6
    )


def half_vector_jacobian(space, alpha, o: Array, i: Array, h: Array) -> Array:
    """What the code has put into the density for d omega_m / d omega_i."""
    m = normalize(h)
    normals = np.abs(dot(o, m)) * ggx_D(space, alpha, m) / smith_area(alpha, o)
    return lobes.half_vector_pdf(space, alpha, o, i, h) / normals


@every_space
@every_alpha
def test_the_half_vector_moves_by_one_over_2_to_the_d_minus_1_o_m_to_the_d_minus_2(space, alpha):
    x = samples(LOBES["ggx"], space, plain(alpha), 500, seed=6)
    measured = tangent_stretch(lambda i: normalize(x.o + i), x.i)
    om = dot(x.o, normalize(x.o + x.i))
    assert np.allclose(1 / (2 ** (space.d - 1) * om ** (space.d - 2)), measured, rtol=1e-6, atol=0)
    assert np.allclose(half_vector_jacobian(space, x.s.alpha, x.o, x.i, x.o + x.i), measured, rtol=1e-6, atol=0)


@every_space
@every_eta
def test_the_normal_of_transmission_moves_by_walter_s_jacobian(space, eta):
    x = samples(LOBES["rough transmission"], space, plain(0.5, eta), 500, seed=7)
    h = lobes.transmission_normal(x.s, x.o, x.i)
    m = normalize(h)
    measured = tangent_stretch(lambda i: normalize(x.o + eta * i), x.i)
    printed = eta ** (space.d - 1) * np.abs(dot(x.i, m)) / np.abs(dot(x.o, m) + eta * dot(x.i, m)) ** (space.d - 1)
    coded = half_vector_jacobian(space, x.s.alpha, x.o, x.i, h) * eta ** (space.d - 1)
    assert np.allclose(printed, measured, rtol=1e-5, atol=0)
    assert np.allclose(coded, measured, rtol=1e-5, atol=0)
    assert not np.allclose(coded / eta ** (space.d - 1), measured, rtol=0.05)


# ---------------------------------------------------------------- Fresnel and Snell


def amplitudes(eta: float, cos_o: Array) -> tuple[Array, Array]:
    """Parallel and perpendicular reflectance from the angles, by tangents and sines."""
    o = np.arccos(cos_o)
    t = np.arcsin(np.sin(o) / eta)
    return (np.tan(o - t) / np.tan(o + t)) ** 2, (np.sin(o - t) / np.sin(o + t)) ** 2


@every_eta
def test_fresnel_is_the_mean_of_both_polarisations(eta):
    critical = np.sqrt(max(1 - eta**2, 0))
    cos = np.linspace(critical + 1e-3, 1 - 1e-6, 500)
    assert np.allclose(fresnel(eta, cos), np.mean(amplitudes(eta, cos), axis=0), rtol=1e-6)


@every_eta
def test_fresnel_s_limits(eta):
    assert fresnel(eta, np.ones(1)) == pytest.approx(((eta - 1) / (eta + 1)) ** 2)
    assert fresnel(eta, np.array([0.0, 1e-300, 1e-12])) == pytest.approx(1, abs=1e-10)
    brewster = 1 / np.sqrt(1 + eta**2)
    assert fresnel(eta, np.array([brewster])) == pytest.approx(((1 - eta**2) / (1 + eta**2)) ** 2 / 2)


@every_eta
def test_fresnel_is_the_same_from_both_sides(eta):
    o = views(2, 500, np.random.default_rng(8))
    i = LOBES["glass transmission"].sample(SEEING["plane"], plain(eta=eta), o, o[:1])
    passed = i[-1] < 0
    assert np.allclose(fresnel(eta, o[-1])[passed], fresnel(1 / eta, i[-1])[passed], rtol=1e-9)


def test_an_interface_between_equals_does_not_reflect():
    assert (fresnel(np.ones(1), np.linspace(1e-3, 1, 100)) < 1e-12).all()


@pytest.mark.parametrize("eta", [1 / 1.1, 1 / 1.5])
def test_total_internal_reflection_reflects_all_and_refracts_nothing(eta):
    critical = np.sqrt(1 - eta**2)
    for space in SEEING.values():
        o = np.concatenate([tilted(space.d, c) for c in critical * np.array([0.01, 0.5, 0.999])], axis=1)
        i = LOBES["glass transmission"].sample(space, plain(eta=eta), o, o[:-1])
        assert (i == 0).all()
        assert (fresnel(eta, o[-1]) == 1).all()


@every_space
@every_eta
def test_refraction_keeps_snell_s_invariant_and_comes_back(space, eta):
    """sin_o = eta sin_i in the plane of incidence, i a unit vector."""
    rng = np.random.default_rng(9)
    o, m = views(space.d, 500, rng), views(space.d, 500, rng)
    m = np.where(dot(o, m) < 0, -m, m)
    i = refract(o, m, eta)
    passed = np.flatnonzero(i.any(axis=0))
    o, m, i = o[:, passed], m[:, passed], i[:, passed]
    assert np.abs(dot(i, i) - 1).max() < 1e-12
    assert np.abs((o - dot(o, m) * m) + eta * (i - dot(i, m) * m)).max() < 1e-12
    assert (dot(i, m) < 0).all()
    assert np.abs(refract(i, -m, 1 / eta) - o).max() < 1e-7


@every_space
@every_eta
def test_glass_reflects_f_and_transmits_the_rest(space, eta):
    o, s = views(space.d, 500, np.random.default_rng(10)), plain(eta=eta)
    ways = [LOBES[f"glass {way}"] for way in ("reflection", "transmission")]
    weights = [lobe.weight(space, s, o, lobe.sample(space, s, o, o[:-1])) for lobe in ways]
    assert np.allclose(weights[0], fresnel(eta, o[-1]))
    assert np.abs(sum(weights) - 1).max() < 1e-15
    for lobe, weight in zip(ways, weights, strict=True):
        assert np.allclose(lobe.share(s, o), weight)


@every_space
def test_mirrors_keep_the_angle_and_turn_the_tangent(space):
    o = views(space.d, 100, np.random.default_rng(11))
    for name in ("mirror", "glass reflection"):
        i = LOBES[name].sample(space, plain(), o, o[:-1])
        assert (i[-1] == o[-1]).all()
        assert (i[:-1] == -o[:-1]).all()


@every_space
def test_a_smooth_surface_is_the_limit_of_a_rough_one(space):
    o, u = views(space.d, 2000, np.random.default_rng(12)), np.random.default_rng(13).random((space.d - 1, 2000))
    o = o[:, o[-1] > 0.1]
    u = u[:, : o.shape[1]]
    for way in ("reflection", "transmission"):
        rough, smooth = LOBES[f"rough {way}"], LOBES[f"glass {way}"]
        i = rough.sample(space, plain(1e-5), o, u)
        assert np.quantile(np.abs(i - smooth.sample(space, plain(1e-5), o, u)), 0.99) < 1e-3
        assert (
            np.quantile(np.abs(rough.weight(space, plain(1e-5), o, i) - smooth.weight(space, plain(), o, i)), 0.99)
            < 1e-3
        )
