"""Rays against a reference that solves linear systems, and where floating point is most likely to go astray."""

import numpy as np
import pytest

from restir_ref.batch import Array
from restir_ref.transport import intersection, sheets
from restir_ref.transport.intersection import CLEARANCE
from restir_ref.transport.rays import arrive, normal, vertex
from restir_ref.transport.scene import Ball, Facet, Scene, scene
from restir_ref.transport.space import Space
from tests.transport.rooms import MATTE, crossings, directions, inside, room, simplex, soup
from tests.transport.spaces import SPACES

every_space = pytest.mark.parametrize("space", SPACES.values(), ids=SPACES)


def somewhere(d: int, n: int, seed: int) -> Array:
    """Points (d, n) in and around the unit cube."""
    return np.random.default_rng(seed).random((d, n)) * 1.4 - 0.2


def repeated(point, n: int) -> Array:
    """One point or direction in n columns."""
    return np.repeat(np.array(point, dtype=float)[:, None], n, axis=1)


# ---------------------------------------------------------------- against the reference


@every_space
def test_rays_meet_what_linear_systems_say(space):
    s, x, w = soup(space, 1), somewhere(space.d, 4000, 2), directions(space.d, 4000, 3)
    t, prim = s.intersect(x, w)
    found = crossings(s, x, w)
    expected, first = found.min(axis=0), found.argmin(axis=0)
    hit = np.isfinite(expected)
    assert 0.05 < hit.mean() < 0.99
    assert (np.isfinite(t) == hit).all()
    assert np.abs(t[hit] - expected[hit]).max() < 1e-9
    owner = np.where(first < s.S, first, s.S + (first - s.S) // 2)
    assert (prim == owner)[hit].all()


@every_space
def test_blocks_of_rays_are_a_matter_of_speed_only(space, monkeypatch):
    s, x, w = soup(space, 1), somewhere(space.d, 3000, 2), directions(space.d, 3000, 3)
    whole = (*s.intersect(x, w), s.visible(x, w))
    monkeypatch.setattr(intersection, "BLOCK", 1)
    assert all((a == b).all() for a, b in zip(whole, (*s.intersect(x, w), s.visible(x, w)), strict=True))


def alone_and_among_others(space: Space) -> bool:
    """Whether rays give the same bytes column by column as all at once."""
    s, x, w = soup(space, 1), somewhere(space.d, 300, 2), directions(space.d, 300, 3)
    t, prim = s.intersect(x, w)
    alone = [s.intersect(x[:, k : k + 1], w[:, k : k + 1]) for k in range(300)]
    clear = [s.visible(x[:, k : k + 1], w[:, k : k + 1]) for k in range(300)]
    ours = [np.concatenate(each) for each in (*zip(*alone, strict=True), clear)]
    return all((a == b).all() for a, b in zip((t, prim, s.visible(x, w)), ours, strict=True))


@every_space
def test_a_lone_column_is_rounded_as_it_is_among_others(space):
    assert alone_and_among_others(space)


def test_if_blas_were_given_lone_columns_it_would_not_be(monkeypatch):
    monkeypatch.setattr(intersection, "_product", lambda maps, x: maps @ x)
    assert not all(alone_and_among_others(space) for space in SPACES.values())


def blocks(simplices: int, n: int) -> list[slice]:
    return [*intersection.blocks(simplices, n)]


@pytest.mark.parametrize("simplices", [1, 20, 128, 129, 700, 5000, 40_000])
def test_no_block_exceeds_the_cache_and_none_is_a_lone_column_that_need_not_be(simplices):
    wide = max(intersection.BLOCK // simplices, 256)
    for n in (0, 1, 2, 3, 7, 255, 257, 1000, 70_001):
        found = blocks(simplices, n)
        assert [k for each in found[:100] for k in range(n)[each]] == [*range(found[:100][-1].stop if n else 0)]
        widths = [each.stop - each.start for each in found]
        assert sum(widths) == n
        assert simplices * max(widths, default=0) <= 4 * intersection.BLOCK
        assert widths.count(1) == (n % wide == 1)


@every_space
def test_directions_need_not_be_unit_vectors(space):
    s, x, w = soup(space, 1), somewhere(space.d, 1000, 2), directions(space.d, 1000, 3)
    t, prim = s.intersect(x, w)
    t_long, prim_long = s.intersect(x, 3 * w)
    hit = np.isfinite(t)
    assert (prim_long == prim)[hit].all()
    assert np.allclose(3 * t_long[hit], t[hit], rtol=1e-12)


@every_space
def test_visibility_is_that_no_crossing_lies_between(space):
    s, x, y = soup(space, 1), somewhere(space.d, 4000, 4), somewhere(space.d, 4000, 5)
    r = np.linalg.norm(y - x, axis=0)
    expected = (crossings(s, x, (y - x) / r) >= r).all(axis=0)
    assert 0.02 < expected.mean() < 0.98
    assert (s.visible(x, y) == expected).all()


# ---------------------------------------------------------------- corners and shared edges


def on_edges(d: int, n: int, seed: int) -> Array:
    """Points (d, n) where two or more walls of the room meet, its corners among them."""
    rng = np.random.default_rng(seed)
    share = rng.dirichlet(np.ones(d - 1), n) if d > 2 else np.ones((n, 1))
    corners = np.stack([rng.permutation(d + 1)[: d - 1] for _ in range(n)])
    points = np.einsum("nk,nkd->dn", share, simplex(d)[corners])
    points[:, : d + 1] = simplex(d).T
    return points


def leaks(space: Space) -> int:
    """Rays that leave the closed room, among some aimed at its edges and corners."""
    s, n = room(space), 50_000
    x = inside(s, n, 6)
    to = on_edges(space.d, n, 7) - x
    return int(np.isinf(s.intersect(x, to / np.linalg.norm(to, axis=0))[0]).sum())


@every_space
def test_no_ray_slips_out_between_two_walls(space):
    assert leaks(space) == 0


@every_space
def test_without_an_edge_rays_do_slip_out(space, monkeypatch):
    monkeypatch.setattr(sheets, "EDGE", 0.0)
    assert leaks(space) > 0


@every_space
def test_rays_that_start_on_a_wall_do_not_meet_it_and_stay_inside(space):
    s, n = room(space), 50_000
    t, prim = s.intersect(x := inside(s, n, 8), w := directions(space.d, n, 9))
    x = x + t * w
    n_x = normal(s, x, prim)
    for lift in (1.0, 1e-3, 1e-6, 1e-9, 1e-12):
        w = directions(space.d, n, 10)
        across = (w * n_x).sum(axis=0)
        w = w + (lift * np.abs(across) - across) * n_x  # flatter and flatter
        t, met = s.intersect(x, w / np.linalg.norm(w, axis=0))
        near_edge = (
            np.abs((s.surfaces.maps @ x + s.surfaces.offsets).reshape(space.d, s.S, n)[-1]) <= CLEARANCE * s.extent
        )
        assert (np.isfinite(t) | (near_edge.sum(axis=0) > 1)).all()
        assert (met != prim)[np.isfinite(t)].all()


def test_a_ray_along_a_surface_does_not_meet_it():
    plane = SPACES["plane"]
    s = scene(plane, [MATTE], [Facet(((0, 0), (1, 0))), Facet(((0, 1), (1, 1)), 0, (1.0,)), Facet(((2, -1), (2, 2)))])
    x = np.array([[-1, 0, 0.5, 1, 0.5, 0.5], [0, 0, 0, 1, 1, 0.5]], dtype=float)
    t, prim = s.intersect(x, repeated((1, 0), 6))
    assert t.tolist() == [3, 2, 1.5, 1, 1.5, 1.5]
    assert (prim == 2).all()


@every_space
def test_a_direction_of_length_zero_meets_nothing_and_makes_no_warning(space):
    s, x = soup(space, 1), somewhere(space.d, 1000, 11)
    x[:, :5] = s.centres
    assert np.isinf(s.intersect(x, np.zeros_like(x))[0]).all()
    v, _, met = arrive(s, x, np.zeros_like(x))
    assert not met.any()
    assert all(np.isfinite(part).all() for part in (v.x, v.n, v.o))


@every_space
def test_a_ray_that_meets_nothing_goes_to_plus_infinity(space):
    s, x, w = room(space), 5 + somewhere(space.d, 1000, 11), directions(space.d, 1000, 12)
    away = np.where((w * (x - simplex(space.d).mean(axis=0)[:, None])).sum(axis=0) > 0, w, -w)
    t, prim = s.intersect(x, away)
    assert (t == np.inf).all()
    assert (prim == 0).all()


@every_space
def test_every_point_sees_itself(space):
    s, x = soup(space, 1), somewhere(space.d, 1000, 12)
    assert s.visible(x, x).all()


# ---------------------------------------------------------------- what is on a surface


def hair_off_a_wall(space: Space, gap: float) -> tuple[Array, Array]:
    """Whether rays from points so far off a wall, in units of the extent, meet it, and whether it hides its other side.

    Far from the wall's edges, where another wall would.
    """
    s, n = room(space), 1000
    b = 0.5 / space.d + 0.5 * np.random.default_rng(8).dirichlet(np.ones(space.d), n).T
    x, out = s.corners[..., 0].T @ b, s.normals[:, :1]
    start = x + gap * s.extent * out
    t, prim = s.intersect(start, np.repeat(-out, n, axis=1))
    return (prim == 0) & (t < 2 * gap * s.extent), ~s.visible(start, x - 1e-3 * out)


def hair_off_a_ball(space: Space, gap: float, side: int) -> tuple[Array, Array]:
    """The same for a ball, from outside (side 1) or inside (-1)."""
    s, out = bowl(space, 0.2, 0.3), directions(space.d, 1000, 17)
    start = 0.2 + (0.3 + side * gap * s.extent) * out
    t, _ = s.intersect(start, -side * out)
    return t < 2 * gap * s.extent, ~s.visible(start, 0.2 + (0.3 - side * 0.01) * out)


@every_space
@pytest.mark.parametrize("gap", [1e-8, 1e-9, 1.5 * CLEARANCE])
def test_what_lies_farther_off_a_surface_than_the_clearance_is_off_it(space, gap):
    for found in (hair_off_a_wall(space, gap), hair_off_a_ball(space, gap, 1), hair_off_a_ball(space, gap, -1)):
        assert all(each.all() for each in found)


@every_space
@pytest.mark.parametrize("gap", [0.0, 1e-14, 1e-12, 0.5 * CLEARANCE])
def test_what_lies_nearer_is_on_it(space, gap):
    for found in (hair_off_a_wall(space, gap), hair_off_a_ball(space, gap, 1), hair_off_a_ball(space, gap, -1)):
        assert not any(each.any() for each in found)


@pytest.mark.parametrize("clearance", [1e-7, 1e-13])
def test_another_clearance_is_noticed(clearance, monkeypatch):
    monkeypatch.setattr(intersection, "CLEARANCE", clearance)
    sides = [hair_off_a_wall(SPACES["solid"], 1e-9)[0], hair_off_a_ball(SPACES["solid"], 1e-9, 1)[0]]
    if clearance < CLEARANCE:
        sides = [hair_off_a_wall(SPACES["solid"], 1e-12)[0], hair_off_a_ball(SPACES["solid"], 1e-12, 1)[0]]
    assert [each.any() for each in sides] == [clearance < CLEARANCE] * 2


# ---------------------------------------------------------------- symmetry


def pairs(space: Space, n: int = 100_000) -> tuple[Array, Array]:
    """Points on surfaces, in corners, a hair off surfaces, and in the open."""
    s = soup(space, 1)
    x, w = somewhere(space.d, 2 * n, 13), directions(space.d, 2 * n, 14)
    t, prim = s.intersect(x, w)
    on = np.isfinite(t)
    hair = np.random.default_rng(15).choice([0, 1e-15, 1e-12, 1e-9, 1e-7], 2 * n)
    x = np.where(on, x + np.where(on, t, 0) * w + hair * normal(s, x, prim), x)
    x[:, ::9] = np.random.default_rng(16).choice(s.corners[0], x[:, ::9].shape[1], axis=1)
    return x[:, :n], x[:, n:]


def asymmetries(sees, space: Space) -> int:
    """How many of 1e5 pairs see each other one way only."""
    x, y = pairs(space)
    s = soup(space, 1)
    return int((sees(s, x, y) != sees(s, y, x)).sum())


@every_space
def test_visibility_is_symmetric_to_the_last_bit(space):
    assert asymmetries(Scene.visible, space) == 0


def by_ray(s, x, y):
    """A mistake: shoot from x towards y and compare lengths."""
    to = y - x
    r = np.maximum(np.linalg.norm(to, axis=0), 1e-300)
    return s.intersect(x, to / r)[0] >= r - 1e-8


@every_space
def test_shooting_a_ray_one_way_is_not_symmetric(space):
    assert asymmetries(by_ray, space) > 10


# ---------------------------------------------------------------- balls


def bowl(space: Space, centre=0.0, radius=1.0):
    """One ball, and a light far away."""
    far = [Facet((simplex(space.d)[: space.d] + 50).tolist(), 0, (1.0,))]
    return scene(space, [MATTE], far, [Ball([centre] * space.d, radius)])


@every_space
def test_balls_are_met_from_outside_inside_and_from_themselves(space):
    s, n = bowl(space), 20_000
    w, out = directions(space.d, n, 16), directions(space.d, n, 17)
    cos = (w * out).sum(axis=0)
    assert np.abs(s.intersect(-3 * w, w)[0] - 2).max() < 1e-12
    assert np.abs(s.intersect(0 * w, w)[0] - 1).max() < 1e-12
    t, prim = s.intersect(out, w)  # starts on the ball: a chord, or the light
    assert (np.isinf(t) | (prim < s.S))[cos > 1e-8].all()
    assert np.allclose(t[cos < -1e-8], -2 * cos[cos < -1e-8], rtol=1e-6)


@every_space
def test_points_on_a_ball_see_out_but_not_through_it(space):
    s, n = bowl(space), 20_000
    out, y = directions(space.d, n, 18), 3 * directions(space.d, n, 19)
    to = y - out
    slope = (to * out).sum(axis=0)
    assert (s.visible(out, y) == (slope > 0))[np.abs(slope) > 1e-8].all()
    assert s.visible(out, directions(space.d, n, 20)).all()  # through the inside, as in glass
    assert s.visible(0.1 * out, 0.2 * y / 3).all()
    assert not s.visible(0.1 * out, y).any()


@every_space
def test_grazing_rays_past_a_ball_either_touch_it_or_do_not(space):
    s = bowl(space)
    along = np.eye(space.d)[0]
    for gap, touches in ((1e-6, False), (-1e-6, True)):
        x = repeated(-3 * along + (1 + gap) * np.eye(space.d)[1], 1)
        assert np.isfinite(s.intersect(x, repeated(along, 1))[0]).all() == touches
    assert s.intersect(repeated(-3 * along + np.eye(space.d)[1], 1), repeated(along, 1))[0].shape == (1,)


# ---------------------------------------------------------------- vertices


@every_space
def test_the_normal_of_a_vertex_looks_back_along_the_ray(space):
    s, x, w = soup(space, 1), somewhere(space.d, 4000, 21), directions(space.d, 4000, 22)
    v, t, met = arrive(s, x, w)
    assert np.abs(np.linalg.norm(v.n, axis=0) - 1).max() < 1e-12
    cos = -(v.n * w).sum(axis=0)
    assert cos[met].min() > 0
    assert np.abs(cos - v.o[-1])[met].max() < 1e-12
    assert np.abs(np.linalg.norm(v.o, axis=0) - 1).max() < 1e-9
    assert np.allclose(s.space.to_world(v.n, v.o), -w, atol=1e-12)
    assert np.allclose(v.x, x + t * w)
    assert (v.front == ((normal(s, v.x, v.prim) * w).sum(axis=0) < 0))[met].all()


@every_space
def test_fronts_of_facets_are_where_the_determinant_is_positive_and_of_balls_outside(space):
    s = soup(space, 1)
    edges = np.moveaxis(s.corners[1:] - s.corners[:1], -1, 0)
    frames = np.concatenate([edges, s.normals.T[:, None]], axis=1)
    assert (np.linalg.det(frames) > 0).all()
    assert np.abs(np.einsum("skd,ds->sk", edges, s.normals)).max() < 1e-12
    out = directions(space.d, 100, 23)
    x = s.centres[:, :1] + s.radii[0] * out
    assert np.abs(normal(s, x, np.full(100, s.S)) - out).max() < 1e-12


def test_a_segment_s_front_is_on_its_left():
    s = scene(SPACES["plane"], [MATTE], [Facet(((0, 0), (1, 0)), 0, (1.0,))])
    assert np.allclose(s.normals[:, 0], [0, 1])


@every_space
def test_a_vertex_at_the_horizon_keeps_a_positive_cosine(space):
    s = room(space)
    n = s.normals[:, :1]
    tangent = simplex(space.d)[2:3].T - simplex(space.d)[1:2].T
    prim = next(k for k in range(s.S) if abs((s.normals[:, k] * tangent[:, 0]).sum()) < 1e-12)
    v = vertex(s, inside(s, 2, 24), np.full(2, prim), np.concatenate([tangent, -tangent], axis=1))
    assert n.shape == (space.d, 1)
    assert (v.o[-1] > 0).all()
