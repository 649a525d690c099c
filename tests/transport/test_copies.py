"""Half vectors and directions copied: decisions at one vertex, their Jacobians, and where there is none.  [GRIS 7.2]

What whole paths must keep is judged in `test_judge`.
"""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from flatland2d import PLANE, SCENES
from flatland2d.scenes import LAMP, chain, matte, room
from flatland2d.sensors import FILM, Pinhole
from restir_ref.batch import Array, take
from restir_ref.chance import Live
from restir_ref.integrals import Pixels
from restir_ref.loop import random_in_row
from restir_ref.restir import initial, shade, spatial
from restir_ref.transport.lobes import LOBES, Lobe
from restir_ref.transport.materials import Layer, Material, Vertex
from restir_ref.transport.paths import REPLAY, Connectability, Tracer
from restir_ref.transport.proofs.copies import (
    COPIES,
    Copy,
    Copying,
    copied_numbers,
    half_vector_stretch,
    mirrored_or_refracted,
    unit_stretch,
)
from restir_ref.transport.proofs.inversion import traced
from restir_ref.transport.proofs.reading import extended_path
from restir_ref.transport.scene import Ball, scene
from restir_ref.transport.space import Space
from restir_ref.transport.vectors import dot, norm
from tests.transport.lobe_cases import Plain, plain, stretch, tilted, views
from tests.transport.paths import HYBRID
from tests.transport.spaces import SEEING, SPACES

N = 200
CASES = [
    (copy, space, lobe)
    for copy in COPIES
    for lobe in ("lambert", "ggx", "rough transmission")
    for space in (SPACES if lobe == "lambert" else SEEING)
]
every_case = pytest.mark.parametrize(("copy", "space", "lobe"), CASES)
SIDES = pytest.mark.parametrize("eta", [1.5, 1 / 1.5])


def vertices(space: Space, n: int, rng: np.random.Generator) -> Vertex:
    """Random views of a random plane through the origin."""
    normal = rng.normal(size=(space.d, 1)).repeat(n, axis=1)
    zero = np.zeros(n, dtype=int)
    return Vertex(np.zeros((space.d, n)), normal / norm(normal), views(space.d, n, rng), zero, zero, zero == 0)


@dataclass(frozen=True)
class Local:
    """The map i_x -> z -> i_y of n random pairs of vertices whose surfaces are turned and of different index."""

    space: Space
    lobe: Lobe
    copy: Copy
    x: Vertex
    y: Vertex
    at_x: Plain
    at_y: Plain
    u: Array

    def i_x(self, u: Array) -> Array:
        return self.lobe.sample(self.space, self.at_x, self.x.o, u)

    def i_y(self, u: Array) -> Array:
        z = self.copy.read(self.space, self.at_x, self.x, self.i_x(u))
        return self.copy.follow(self.space, self.at_y, self.y, z)

    def formula(self, stretched) -> Array:
        """|d omega_y / d omega_x|."""
        i_x, i_y = self.i_x(self.u), self.i_y(self.u)
        return stretched(self.space, self.at_x, self.x, i_x) / stretched(self.space, self.at_y, self.y, i_y)

    def measured(self) -> Array:
        return stretch(self.i_y, self.u) / stretch(self.i_x, self.u)


def local(copy: str, space: str, lobe: str, n: int = 600) -> Local:
    """Those of n whose directions exist on both sides, and away from the horizon; at most N."""
    rng, where = np.random.default_rng(3), SPACES[space]
    x, y = vertices(where, n, rng), vertices(where, n, rng)
    u = 0.05 + 0.9 * rng.random((where.d - 1, n))
    found = Local(where, LOBES[lobe], COPIES[copy], x, y, plain(0.5, 1.5), plain(0.3, 1.4), u)
    clear = (np.abs(found.i_x(u)[-1]) > 0.05) & (np.abs(found.i_y(u)[-1]) > 0.05)
    kept = np.flatnonzero(clear)[:N]
    assert len(kept) > N / 4
    return replace(found, x=take(x, kept), y=take(y, kept), u=u[:, kept])


@pytest.mark.claims("GRIS-A21")
@every_case
def test_what_is_copied_leads_back(copy, space, lobe):
    at = local(copy, space, lobe)
    z = at.copy.read(at.space, at.at_y, at.y, at.i_y(at.u))
    assert np.abs(at.copy.follow(at.space, at.at_x, at.x, z) - at.i_x(at.u)).max() < 1e-9
    assert np.abs(norm(z) - 1).max() < 1e-12


@pytest.mark.claims("GRIS-A21")
@every_case
def test_the_local_jacobian_is_that_of_finite_differences(copy, space, lobe):
    at = local(copy, space, lobe)
    assert np.abs(at.formula(at.copy.stretch) / at.measured() - 1).max() < 1e-5


@pytest.mark.parametrize(("space", "lobe"), [("solid", "ggx"), ("hyper", "lambert"), ("plane", "rough transmission")])
def test_a_half_vector_taken_for_a_direction_is_noticed(space, lobe):
    at = local("half vector", space, lobe)
    assert np.quantile(np.abs(at.formula(unit_stretch) / at.measured() - 1), 0.25) > 1e-2


@pytest.mark.claims("GRIS-A21")
@pytest.mark.parametrize("space", SPACES)
def test_mirrored_half_vectors_turn_by_the_closed_form(space):
    """1 / (2^(d-1) |o.m|^(d-2)): 1/2 in flatland, where copying half vectors keeps angles."""
    at = local("half vector", space, "lambert")
    d, m = at.space.d, at.copy.read(at.space, at.at_x, at.x, at.i_x(at.u))
    expected = 1 / (2 ** (d - 1) * dot(at.x.o, m) ** (d - 2))
    np.testing.assert_allclose(half_vector_stretch(at.space, at.at_x, at.x, at.i_x(at.u)), expected, rtol=1e-12)


@pytest.mark.claims("GRIS-A21")
@pytest.mark.parametrize("space", SPACES)
def test_total_internal_reflection_has_no_direction(space):
    """From inside glass, sin > 1 / 1.5 is reflected; the sign of z says that light should be refracted."""
    where, s = SPACES[space], plain(0.3, 1 / 1.5)
    sines = np.array([0.5, 0.66, 0.67, 0.9])
    o = np.concatenate([tilted(where.d, np.sqrt(1 - sine**2)) for sine in sines], axis=1)
    v = replace(vertices(where, 4, np.random.default_rng(0)), o=o)
    z = -tilted(where.d, 1.0, 4)
    assert (mirrored_or_refracted(where, s, v, z)[-1] < 0).tolist() == (sines < 1 / 1.5).tolist()
    assert (mirrored_or_refracted(where, s, v, -z)[-1] > 0).all()


def test_a_half_vector_that_o_does_not_see_has_no_direction():
    v = replace(vertices(PLANE, 1, np.random.default_rng(0)), o=tilted(2, 0.1))
    away = tilted(2, 0.1) * np.array([[-1.0], [1.0]])
    assert (mirrored_or_refracted(PLANE, plain(), v, away) == 0).all()
    assert (mirrored_or_refracted(PLANE, plain(), v, -away) == 0).all()


# Whole paths.

GLASS = {
    "smooth": Material([Layer("glass reflection", (1.0,)), Layer("glass transmission", (1.0,))]),
    "rough": Material([Layer("rough reflection", (1.0,), 0.3), Layer("rough transmission", (1.0,), 0.3)]),
}


def inside_glass(kind: str, rule: Connectability) -> Tracer:
    """The eye is in a disc of glass, off its middle: it sees its surface at all angles."""
    facets, disc = [*room(0), *chain(LAMP, 0, 8.0)], Ball((0.5, 0.4), 0.2, 1)
    eye = Pinhole((0.335, 0.4), (0.45, 1.0), FILM)
    return Tracer(scene(PLANE, [matte(0.6), GLASS[kind]], facets, [disc]), eye, 3, rule)


@pytest.mark.claims("GRIS-A21")
@pytest.mark.parametrize("kind", GLASS)
def test_no_path_is_refracted_where_light_is_reflected_totally(kind):
    t, rng = inside_glass(kind, REPLAY), np.random.default_rng(5)
    of, i = Copying(t, COPIES["half vector"]), rng.integers(100, FILM, 20_000)
    ((x, W),) = of.candidates(i, Live(rng))
    y = of.shift(x, i, Pixels(of, i - 100))
    at_x, at_y = (extended_path(t, u, p, x.k, x.nee) for u, p in ((x.u, i), (y.x.u, i - 100)))
    refracted = (W > 0) & (at_x.prim[1] == t.scene.S) & (x.k > 1) & (at_x.lobe[1] == 1)
    o_x, o_y = (-_local(t, path, path.w[0]) for path in (at_x, at_y))
    h = o_x + _local(t, at_x, at_x.w[1]) / 1.5
    total = np.sqrt(1 - (dot(o_y, h) / norm(h)) ** 2) > 1 / 1.5
    assert (refracted & total).sum() > 100
    assert (y.J[refracted & total] == 0).all()
    assert (y.J[refracted & ~total] > 0).mean() > 0.5


def _local(t, path, w):
    """A direction at x_1 in the frame of the disc's normal there, which points inwards."""
    n = (t.scene.centres - path.x[1]) / t.scene.radii
    return t.scene.space.to_local(n, w)


@pytest.mark.parametrize("name", COPIES)
@pytest.mark.parametrize("rule", [HYBRID, REPLAY], ids=["hybrid", "alone"])
def test_copying_a_path_into_its_own_pixel_changes_nothing(name, rule):
    of = Copying(inside_glass("rough", rule), COPIES[name])
    i, rng = np.arange(FILM), np.random.default_rng(6)
    ((x, W),) = of.candidates(i, Live(rng))
    y, lit = of.shift(x, i, Pixels(of, i)), W > 0
    assert np.abs(y.J - 1)[lit].max() < 1e-9
    assert np.abs(y.x.u - x.u)[:, lit].max() < 1e-9
    assert np.abs(y.x.F / np.where(lit, x.F, 1) - 1)[:, lit].max() < 1e-6


@pytest.mark.claims("GRIS-A21")
@pytest.mark.parametrize("name", COPIES)
def test_two_rounds_of_reuse_with_copies_change_no_mean(name):
    """Differences to the same frames' initial samples; 2 tests, |z| < 4."""
    setting, pixels, replicas = SCENES["glossy_cornell"](), 32, 1000
    view = Pinhole(setting.eye, setting.towards, pixels, setting.half, film=pixels)
    of = Copying(Tracer(setting.scene, view, setting.depth, HYBRID), COPIES[name])
    here, chance = Pixels(of, np.arange(pixels * replicas)), Live(np.random.default_rng(7))
    X = Y = initial(here, chance)
    for _ in range(2):
        Y = spatial(Y, here, random_in_row(of, here.index, 2, 5, chance), chance)
    start, added = (
        each.reshape(replicas, pixels).mean(axis=1) for each in (shade(X, here), shade(Y, here) - shade(X, here))
    )
    error = added.std() / np.sqrt(replicas)
    assert error < 0.01 * start.mean()
    assert abs(added.mean()) < 4 * error


def frosted_disc(x: float) -> Tracer:
    """A disc of rough glass at this place in a box, seen by the whole film."""
    layers = [Layer("rough reflection", (1.0,), 0.15), Layer("rough transmission", (1.0,), 0.15)]
    facets = [*room(0), *chain(LAMP, 0, 8.0)]
    s = scene(PLANE, [matte(0.6), Material(layers)], facets, [Ball((x, 0.25), 0.14, 1)])
    return Tracer(s, Pinhole((0.12, 0.45), (0.6, 0.0), FILM, first=0), 4, REPLAY)


@pytest.mark.parametrize("name", COPIES)
def test_copies_lead_back_from_another_frame_whose_scene_has_moved(name):
    now, then, rng, i = frosted_disc(0.5), frosted_disc(0.55), np.random.default_rng(8), np.arange(FILM)
    k, nee = np.full(FILM, 4), np.ones(FILM, dtype=bool)
    x = traced(now, rng.random((now.D, FILM)), i, k, nee)
    u, J = copied_numbers(COPIES[name], now, x, i, then, i)
    back, J_back = copied_numbers(COPIES[name], then, traced(then, u, i, k, nee), i, now, i)
    both = (J > 0) & (J_back > 0)
    assert both.sum() > FILM / 8
    assert np.abs(back - x.u)[:, both].max() < 1e-6
    assert np.abs(u - x.u)[:, both].max() > 0.01
    np.testing.assert_allclose((J * J_back)[both], 1, rtol=1e-6)
