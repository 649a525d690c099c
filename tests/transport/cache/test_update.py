"""Laws of a frame of a volume: what is read before it is written, how it is blended, and how far direct light goes."""

from dataclasses import replace

import numpy as np
import pytest

from flatland2d.directions import MAPS, turned
from flatland2d.probe_rooms import open_room, probes
from flatland2d.scenes import chain, matte
from flatland2d.space import PLANE
from restir_ref.transport.cache import grid as grids
from restir_ref.transport.cache.converge import converge
from restir_ref.transport.cache.grid import Grid
from restir_ref.transport.cache.rules import ORIGINAL
from restir_ref.transport.cache.update import Updating, diffuse, scattered_once, update
from restir_ref.transport.cache.volume import chebyshev, unlit
from restir_ref.transport.cache.walls import bundle
from restir_ref.transport.rays import arrive, emitted, vertex
from restir_ref.transport.scene import Facet, scene
from restir_ref.transport.space import ball_volume
from restir_ref.transport.vectors import dot
from tests.transport.cache.worlds import WORLDS, live, volume
from tests.transport.rooms import MATTE, room


def nothing(s, field, v, r, chance):
    """Surfaces that send nothing on."""
    return np.zeros((s.C, len(r)))


FURNACE = Updating(attenuation=0.0)


@pytest.mark.parametrize("albedo", [0.5, 0.75])
@pytest.mark.parametrize("name", WORLDS)
def test_light_bounces_once_more_with_every_frame_of_a_furnace(name, albedo):
    """e_1 = 1, e_(t+1) = a e_t + (1 - a) (1 + albedo e_t) exactly, e = E / C_d."""
    s = room(WORLDS[name][0], albedo)
    v, e, a = volume(name, s), 0.0, 0.0
    for t in range(6):
        v = update(v, s, replace(FURNACE, hysteresis=0.9), live(t))
        e, a = a * e + (1 - a) * (1 + albedo * e), 0.9
        np.testing.assert_allclose(v.E / ball_volume(v.grid.d), e, rtol=1e-9)
    assert v.frames == 6


def test_a_frame_reads_the_volume_before_it_and_writes_another():
    """Jacobi: many probes in one batch, or one by one, get the same."""
    s, v = open_room().scene, unlit(open_room().scene, probes(open_room(), 4), MAPS)
    v = update(v, s, Updating(rays=16), live(1))
    before = v.E.copy()
    together = update(v, s, Updating(rays=16), live(2))
    np.testing.assert_array_equal(v.E, before)
    for k in range(v.grid.P):
        only = replace(v, active=np.arange(v.grid.P) == k)
        alone = update(only, s, replace(Updating(rays=16), leaving=lambda s, f, *at: diffuse(s, v, *at)), live(2))
        np.testing.assert_allclose(alone.E[:, k], together.E[:, k], rtol=1e-12)


@pytest.mark.parametrize("name", WORLDS)
def test_a_probe_that_takes_no_part_learns_nothing(name):
    s = room(WORLDS[name][0])
    v = volume(name, s)
    active = np.arange(v.grid.P) % 2 == 0
    v = update(replace(v, active=active), s, FURNACE, live(1))
    assert (v.E[:, active] > 0).all()
    assert not v.E[:, ~active].any()
    assert not v.r[:, ~active].any()


@pytest.mark.parametrize("name", WORLDS)
def test_the_first_frame_forgets_what_was_there(name):
    s = room(WORLDS[name][0])
    v = volume(name, s)
    full = replace(v, E=v.E + 7, r=v.r + 7)
    how = replace(FURNACE, leaving=nothing)
    np.testing.assert_array_equal(update(full, s, how, live(1)).E, update(v, s, how, live(1)).E)
    later = update(replace(full, frames=1), s, how, live(1)).E
    np.testing.assert_allclose(later, 0.97 * 7 + 0.03 * update(v, s, how, live(1)).E, rtol=1e-9)


@pytest.mark.parametrize("rule", [Updating().rule, ORIGINAL], ids=["augmented", "original"])
def test_a_room_that_nothing_is_scattered_in_has_emission_or_nothing(rule):
    s = room(PLANE, 0.0)
    v = update(volume("plane", s), s, replace(FURNACE, rule=rule), live(1))
    np.testing.assert_allclose(v.E, 2 * rule.emitted, rtol=1e-12)


def quadrature(v, s, how, probe, n, R=4096):
    """E of a probe (1,) for normals n (2, K), by so many rays: C_d sum max(0, n.w) L / sum max(0, n.w)."""
    w = turned((np.arange(R) + 0.5) / R)
    vertex, t, met = arrive(s, *bundle(v.grid, probe, w))
    L = ((emitted(s, vertex) + how.leaving(s, v, vertex, t, live(1))) * met)[0]
    return np.maximum(n.T @ w, 0) @ L * (2 * np.pi / R)


@pytest.mark.claims("DDGIR-A01", part="what a probe's own rays meet", world="flatland2d")
def test_probes_know_the_light_around_them_within_2_percent():
    """E+ of [DDGIR Eq. 5] by quadrature over 4096 directions, L+ from the volume itself, at convergence."""
    s, how = open_room().scene, Updating(attenuation=0, rays=128)
    v = converge(unlit(s, probes(open_room(), 8), MAPS), s, how, live(1), tolerance=0.003)
    off = turned(np.linspace(0, 1, 77))
    for probe in np.flatnonzero(v.active)[::5]:
        x = np.repeat(v.grid.place(np.array([probe])), 77, axis=1)
        truth = quadrature(v, s, how, np.array([probe]), off)
        np.testing.assert_allclose(v.irradiance(x, off, off, 0 * x)[0], truth, rtol=0.02)


def blended_by_fifth_roots(rays) -> float:
    """(mean E^(1/5))^5 over mean E, less 1, of direct light; means over frames, then over texels."""
    s = open_room().scene
    v = unlit(s, probes(open_room(), 4), replace(MAPS, rays=rays))
    how, chance = Updating(attenuation=0, leaving=nothing, hysteresis=0), live(3)
    frames = np.stack([update(v, s, how, chance).E for _ in range(150)])
    return float(((frames ** (1 / 5)).mean(axis=0) ** 5).sum() / frames.mean(axis=0).sum() - 1)


def test_blending_fifth_roots_is_too_dark_where_rays_are_independent():
    """DDGI's perceptual encoding: harmless while frames hardly vary, biased by 5 % where they do."""
    assert blended_by_fifth_roots(lambda R, chance: turned(chance.uniform((R,)))) < -0.04
    assert -0.01 < blended_by_fifth_roots(MAPS.rays) < 0


# ---------------------------------------------------------------- depth


@pytest.mark.parametrize("name", WORLDS)
def test_depth_is_the_distance_of_walls_clipped(name):
    """All moments are of distances up to the reach: r1 <= reach, r1^2 <= r2 <= reach r1; some walls are nearer."""
    s = room(WORLDS[name][0])
    v = update(volume(name, s, 0.15), s, replace(FURNACE, rays=500), live(1))
    r1, r2 = v.r
    assert r1.max() <= v.grid.reach * (1 + 1e-12)
    assert (r1**2 <= r2 * (1 + 1e-12)).all()
    assert (r2 <= v.grid.reach * r1 * (1 + 1e-12)).all()
    assert r1.min() < 0.9 * v.grid.reach


def test_depth_towards_a_flat_wall_is_its_distance_over_the_cosine_averaged():
    """int r cos^50 / int cos^50 with r = h / cos: a ratio of integrals of cos^49 and cos^50."""
    s = scene(PLANE, [MATTE], [Facet(((-9, 0), (9, 0)), 0, (1.0,))])
    at = 0.15
    v = unlit(s, Grid((0.0, at), (1.0, 1.0), (1, 1)), MAPS)
    v = update(v, s, replace(FURNACE, rays=4096), live(1))
    r1, r2 = v.r[:, 0]
    down = v.maps.depth.centres()[1].argmin()
    angle = np.linspace(-np.pi / 2, np.pi / 2, 20_001)[1:-1]
    tilt = np.arcsin(v.maps.depth.centres()[0, down])
    weight = np.cos(angle - tilt).clip(0) ** 50
    r = np.minimum(at / np.cos(angle), v.grid.reach)
    assert r1[down] == pytest.approx((weight * r).sum() / weight.sum(), rel=2e-3)
    assert r2[down] == pytest.approx((weight * r**2).sum() / weight.sum(), rel=4e-3)


SLIT = [*chain([(-9, 0.1), (-0.012, 0.1)], 0), *chain([(0.012, 0.1), (9, 0.1)], 0), *chain([(9, 60), (-9, 60)], 0, 1.0)]
"""A wall with a slit, and another far behind it."""


def hidden(monkeypatch, clipped):
    """Visibility of a point behind the wall, from a probe before it."""
    monkeypatch.setattr(grids, "CLIPPED", clipped)
    s = scene(PLANE, [matte(0.5)], SLIT)
    v = update(unlit(s, Grid((0.0, 0.0), (0.2, 0.2), (1, 1)), MAPS), s, replace(FURNACE, rays=4096), live(1))
    k = v.maps.depth.centres()[1].argmax() - 2
    return chebyshev(np.array([0.25]), v.r[0, :, k], v.r[1, :, k])[0]


def test_distances_that_are_not_clipped_let_light_leak_beside_a_slit(monkeypatch):
    assert hidden(monkeypatch, 1.5) < 0.5
    assert hidden(monkeypatch, 1e9) == 1


def test_rays_that_meet_nothing_bring_no_light_and_see_as_far_as_is_stored():
    s = scene(PLANE, [MATTE], [Facet(((-1, 0), (1, 0)), 0, (1.0,))])
    v = unlit(s, Grid((0.0, 0.5), (0.1, 0.1), (1, 1)), MAPS)
    v = update(v, s, replace(FURNACE, rays=512), live(1))
    up = v.maps.irradiance.centres()[1].argmax()
    assert v.E[0, 0, up] == 0
    assert v.E[0, 0, v.maps.irradiance.centres()[1].argmin()] > 1
    np.testing.assert_allclose(v.r[0], v.grid.reach, rtol=1e-12)


def test_texels_that_no_ray_tells_of_keep_what_they_had():
    s = room(PLANE)
    v = replace(volume("plane", s), frames=1)
    v = replace(v, E=v.E + 5)
    after = update(v, s, Updating(rays=1, attenuation=0, hysteresis=0.0), live(1)).E
    assert (after == 5).sum() > 0.4 * after.size
    assert (after != 5).any()


# ---------------------------------------------------------------- direct light from further away

HEIGHT, PROBE, SMALL = 0.5, 0.2, 0.05
"""Of the lamp and the probe above the floor, and the size of a small lamp."""


def under_a_lamp(name, size):
    """A floor through 0, and a lamp that faces it along an axis (d, 1), a texel's centre: the scene and the axis."""
    space, maps = WORLDS[name]
    d, axis = space.d, maps.irradiance.centres()[:, :1]

    def facet(corners, height, n, emission=()):
        local = np.concatenate([corners, np.full((1, d), height)])
        world = space.to_world(np.repeat(axis, d, axis=1), local).T
        front = np.linalg.det(np.concatenate([world[1:] - world[0], n.T])) > 0
        return Facet(world[:: 1 if front else -1].tolist(), 0, emission)

    small = np.concatenate([np.zeros((d - 1, 1)), np.eye(d - 1)], axis=1) - 1 / d
    facets = [facet(20 * small, 0.0, axis), facet(size * small, HEIGHT, -axis, (1.0,))]
    return scene(space, [MATTE], facets), axis


def at_the_floor(name, spacing, attenuation, size=SMALL):
    """E+ at 0 from one probe between floor and lamp; direct light alone."""
    s, axis = under_a_lamp(name, size)
    v = unlit(s, Grid(tuple((PROBE * axis[:, 0]).tolist()), (spacing,) * len(axis), (1,) * len(axis)), WORLDS[name][1])
    how, chance = Updating(nothing, rays=2000, attenuation=attenuation, hysteresis=0), live(7)
    E = np.mean([update(v, s, how, chance).E for _ in range(10)], axis=0)
    return float(replace(v, E=E).irradiance(0 * axis, axis, axis, 0 * axis)[0, 0])


def irradiated(name, height, size=SMALL):
    """Irradiance at a height over the floor from the lamp, for its normal: L A cos cos' / r^(d-1) over its points."""
    s, n = under_a_lamp(name, size)
    light, d = s.lights, s.space.d
    share = np.random.default_rng(1).dirichlet(np.ones(d), 20_000).T
    y = np.einsum("kd,kn->dn", light.corners[:, :, 0], share) - height * n
    r = np.sqrt(dot(y, y))
    G = dot(n, y) * -dot(light.normals[:, :1], y) / r ** (d + 1)
    return float(light.emission[0, 0] / light.pdf_area[0] * G.mean())


@pytest.mark.claims("DDGIR-E11", part="one probe", world="flatland2d")
@pytest.mark.claims("DDGIR-E11", part="one probe", world="tracer3d")
@pytest.mark.parametrize("name", ["plane", "solid"])
def test_a_surface_beyond_a_probe_is_lit_as_if_it_were_at_the_probe_unless_light_is_attenuated(name):
    """Attenuated over naive has no noise, as both see the same rays; of the naive one, a larger lamp has little."""
    d, truth = WORLDS[name][0].d, irradiated(name, 0.0)
    naive = irradiated(name, PROBE) / truth
    assert at_the_floor(name, 1.0, 0.0, 0.2) == pytest.approx(irradiated(name, PROBE, 0.2), rel=0.03)
    assert naive == pytest.approx((HEIGHT / (HEIGHT - PROBE)) ** (d - 1), rel=0.03)
    attenuated = naive * at_the_floor(name, 1.0, 1.0) / at_the_floor(name, 1.0, 0.0)
    assert 0.97 < attenuated < 1


@pytest.mark.parametrize("name", ["plane", "solid"])
def test_attenuation_scales_with_the_user_s_number(name):
    """(d / (d + s db))^(dim - 1); db is a little more than the probe's height, as depth is blurred."""
    d, way = WORLDS[name][0].d, HEIGHT - PROBE
    E = [at_the_floor(name, 1.0, scale) for scale in (0.0, 1.0, 2.0)]
    for s in (1, 2):
        assert 0.95 < E[s] / E[0] / (way / (way + s * PROBE)) ** (d - 1) < 1


def test_what_is_behind_a_probe_counts_up_to_its_boundary():
    """Spacing is half the probe's height above the floor: db = .1 instead of .2."""
    way = HEIGHT - PROBE
    ratio = at_the_floor("plane", PROBE / 2, 1.0) / at_the_floor("plane", PROBE / 2, 0.0)
    assert ratio == pytest.approx(way / (way + PROBE / 2), rel=0.01)


@pytest.mark.parametrize("name", ["plane", "solid"])
def test_light_scattered_once_is_that_of_the_lamp(name):
    """T_fd L_e at a point of the floor: albedo / C_d times its irradiance."""
    s, n = under_a_lamp(name, SMALL)
    floor = vertex(s, np.zeros((s.space.d, 20_000)), np.zeros(20_000, dtype=int), np.repeat(n, 20_000, axis=1))
    L = scattered_once(s, floor, live(2))
    assert L.mean() == pytest.approx(0.5 / ball_volume(s.space.d) * irradiated(name, 0.0), rel=0.01)


# ---------------------------------------------------------------- bad input

BAD = {
    "no rays": (lambda: Updating(rays=0), "the number of rays of a probe must be a whole number >= 1, but is 0"),
    "half a ray": (lambda: Updating(rays=0.5), "Without rays a probe learns nothing."),
    "no learning": (lambda: Updating(hysteresis=1.0), r"hysteresis must be in \[0, 1\), but is 1.0"),
    "an overshooting hysteresis": (lambda: Updating(hysteresis=-0.1), "but is -0.1"),
    "a negative attenuation": (
        lambda: Updating(attenuation=-1),
        "must be finite and >= 0, but is -1: 1 is the paper's",
    ),
    "an endless attenuation": (lambda: Updating(attenuation=np.inf), "0 none"),
    "no attenuation": (lambda: Updating(attenuation=np.nan), "but is nan"),
}


@pytest.mark.parametrize("name", BAD)
def test_an_update_that_makes_no_sense_is_refused_with_its_number(name):
    make, words = BAD[name]
    with pytest.raises(ValueError, match=words):
        make()
