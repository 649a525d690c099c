"""Facets in one place: lamps flush in walls, two-sided lamps, walls of two materials; against closed forms."""

from dataclasses import replace

import numpy as np
import pytest

from flatland2d import PLANE, SCENES, Pinhole, radiosity
from flatland2d.scenes import LAMP, chain, matte
from flatland2d.scenes import room as square
from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.transport import coincidence, intersection
from restir_ref.transport.coincidence import coincident
from restir_ref.transport.compact import Peephole
from restir_ref.transport.materials import Layer, Material
from restir_ref.transport.paths import RECONNECTION, Tracer, radiance, trace
from restir_ref.transport.proofs.judge import judge
from restir_ref.transport.proofs.shift_checks import Effort
from restir_ref.transport.rays import vertex
from restir_ref.transport.restir_pt import PathIntegrals
from restir_ref.transport.scene import Facet, Scene, scene
from restir_ref.transport.space import Space
from tests.transport.rooms import MATTE, directions, inside, simplex, soup, walls
from tests.transport.spaces import SPACES

every_space = pytest.mark.parametrize("space", SPACES.values(), ids=SPACES)
either_order = pytest.mark.parametrize("order", [1, -1], ids=["lamp last", "lamp first"])
SHINE = (8.0,)


def inset(wall: Facet, lift: float = 0.0) -> Facet:
    """A lamp in the middle of a wall of the simplex, half as large, moved inwards."""
    corners = np.array(wall.corners)
    middle = corners.mean(axis=0)
    inwards = simplex(len(corners)).mean(axis=0) - middle
    return Facet((middle + (corners - middle) / 2 + lift * inwards).tolist(), 0, SHINE)


def furnished(space: Space, order: int = 1, lift: float = 0.0) -> Scene:
    """The room that is a simplex, with a lamp in its first wall."""
    sides = walls(space.d)
    return scene(space, [MATTE], [*sides, inset(sides[0], lift)][::order])


def mean_light(s: Scene, depth: int = 3, n: int = 15_000) -> float:
    """Mean radiance that arrives at points of the room from everywhere; always the same chance."""
    at = Peephole(inside(s, n, 1), directions(s.space.d, n, 2))
    t = Tracer(s, at, depth, RECONNECTION)
    return float(radiance(trace(t, np.random.default_rng(3).random((t.D, n)), np.arange(n))).mean())


# ---------------------------------------------------------------- lamps in walls


@every_space
@either_order
def test_moving_a_flush_lamp_by_a_millionth_changes_no_mean(space, order):
    flush, moved = (mean_light(furnished(space, order, lift)) for lift in (0.0, 1e-6))
    assert flush == pytest.approx(moved, rel=1e-5)


@every_space
def test_the_order_of_the_list_is_no_matter(space):
    assert mean_light(furnished(space, 1)) == mean_light(furnished(space, -1))


@pytest.mark.parametrize("space", [PLANE, SPACES["solid"]], ids=["plane", "solid"])
def test_without_an_order_the_wall_hides_a_lamp_that_comes_first(space, monkeypatch):
    monkeypatch.setattr(intersection, "foremost", lambda s, x, prim, w: prim)
    assert mean_light(furnished(space, -1)) < 0.7 * mean_light(furnished(space, -1, 1e-6))


def polygon(x: Array, n: Array, corners: Array) -> float:
    """Share of the cosine-weighted hemisphere of n that a triangle fills: sum of angle (v_i x v_j).n / 2 pi."""
    v = corners - x
    v = v / np.linalg.norm(v, axis=1, keepdims=True)
    edges = [(v[i], v[(i + 1) % 3]) for i in range(3)]
    turns = [np.cross(a, b) @ n / np.linalg.norm(np.cross(a, b)) * np.arccos(a @ b) for a, b in edges]
    return abs(sum(turns)) / (2 * np.pi)


def segment(x: Array, n: Array, corners: Array) -> float:
    """(sin a - sin b) / 2, the same in the plane."""
    v = corners - x
    s = (v[:, 0] * n[1] - v[:, 1] * n[0]) / np.linalg.norm(v, axis=1)
    return abs(s[0] - s[1]) / 2


@pytest.mark.parametrize(("space", "share"), [(PLANE, segment), (SPACES["solid"], polygon)], ids=["plane", "solid"])
@either_order
def test_a_flush_lamp_lights_a_wall_as_the_closed_form_says(space, share, order):
    """albedo L_e times the share of the view; and its light comes by both techniques."""
    s, n = furnished(space, order), 40_000
    sides = walls(space.d)
    x, lamp = np.mean(sides[1].corners, axis=0), np.array(inset(sides[0]).corners)
    to = x - simplex(space.d).mean(axis=0)
    at = Peephole(np.repeat((x - to / 2)[:, None], n, axis=1), np.repeat(to[:, None] / np.linalg.norm(to), n, axis=1))
    t = Tracer(s, at, 1, RECONNECTION)
    L = radiance(trace(t, np.random.default_rng(4).random((t.D, n)), np.arange(n)))[0]
    k = int(s.intersect(at.x[:, :1], at.w[:, :1])[1][0])
    expected, error = 0.5 * SHINE[0] * share(x, s.normals[:, k], lamp), L.std() / np.sqrt(n)
    assert error < 0.01 * expected
    assert abs(L.mean() - expected) < 4 * error


@either_order
def test_a_flush_lamp_fills_a_room_as_radiosity_says(order):
    """To .2%, beside which the reference is exact."""
    lamp = chain([(x, 1.0) for x, _ in LAMP], 0, 8.0)
    s = scene(PLANE, [matte(0.6)], [*square(0), *lamp][::order])
    eye = Pinhole((0.5, 0.2), (0.5, 1.0), 64, 0.6, film=64)
    t, pixel = Tracer(s, eye, 3, RECONNECTION), np.arange(64 * 400) % 64
    L = radiance(trace(t, np.random.default_rng(5).random((t.D, len(pixel))), pixel))[0].reshape(-1, 64).mean(axis=1)
    expected, error = float(radiosity.render(s, eye, 3, 20).mean()), L.std() / np.sqrt(len(L))
    assert error < 0.002 * expected
    assert abs(L.mean() - expected) < 4 * error


# ---------------------------------------------------------------- two sides


def turned(facet: Facet, **changes: object) -> Facet:
    """The same place, front behind."""
    first, second, *rest = facet.corners
    return replace(facet, corners=[second, first, *rest], **changes)


def from_both_sides(s: Scene, facet: Facet, n: int = 100) -> list[Array]:
    """What rays meet that come towards points of a facet from its front, and from its back."""
    d = s.space.d
    x = np.array(facet.corners).T @ np.random.default_rng(6).dirichlet(np.ones(d), n).T
    w, normal = directions(d, n, 7), scene(s.space, [MATTE], [replace(facet, emission=(1.0,))]).normals[:, :1]
    w = w * -np.sign((w * normal).sum(axis=0))
    return [s.intersect(x - 0.01 * side * w, side * w)[1] for side in (1, -1)]


@every_space
@either_order
def test_a_lamp_is_seen_from_its_front_and_from_behind_its_wall(space, order):
    sides = walls(space.d)
    s, lamp = furnished(space, order), inset(sides[0])
    lit = s.emission[0] > 0
    front, back = from_both_sides(s, lamp)
    assert lit[front].all()
    assert not lit[back].any()


@every_space
@pytest.mark.parametrize("wall", [replace, turned], ids=["wall ahead", "wall turned over"])
@either_order
def test_a_lamp_wins_on_its_own_side_whichever_way_its_wall_is_turned(space, wall, order):
    plain, lamp = Facet(np.eye(space.d).tolist()), Facet((0.5 * np.eye(space.d) + 0.5 / space.d).tolist(), 0, SHINE)
    s = scene(space, [MATTE], [wall(plain), lamp][::order])
    front, back = from_both_sides(s, lamp)
    assert (s.emission[0, front] > 0).all()
    assert (s.emission[0, back] == 0).all()


@every_space
@either_order
def test_a_two_sided_lamp_shines_both_ways(space, order):
    up = Facet(np.eye(space.d).tolist(), 0, (1.0,))
    s = scene(space, [MATTE], [up, turned(up, emission=(2.0,))][::order])
    front, back = from_both_sides(s, up)
    assert (s.emission[0, front] == 1).all()
    assert (s.emission[0, back] == 2).all()
    x, w = np.ones((space.d, 1)), -np.ones((space.d, 1))
    t, prim = s.intersect(x, w)
    assert vertex(s, x + t * w, prim, -w).front.all()


@every_space
def test_of_two_materials_in_one_place_the_later_one_is_in_front(space):
    """So from behind it is the earlier one."""
    wall = Facet(np.eye(space.d).tolist(), 0)
    lamp = Facet((np.eye(space.d) + 5).tolist(), 0, SHINE)
    front, back = from_both_sides(scene(space, [MATTE] * 3, [lamp, wall, replace(wall, material=1)]), wall)
    assert (front == 2).all()
    assert (back == 1).all()
    front, back = from_both_sides(scene(space, [MATTE] * 3, [lamp, wall, turned(wall, material=1)]), wall)
    assert (front == 1).all()
    assert (back == 2).all()


# ---------------------------------------------------------------- which facets coincide


def coincide(s: Scene) -> set[tuple[int, int]]:
    """Pairs (a, b), a < b."""
    first, others = s.surfaces.coincidence.first, s.surfaces.coincidence.others
    return {(a, int(b)) for a in range(s.S) for b in others[first[a] : first[a + 1]] if a < b}


@pytest.mark.parametrize("name", SCENES)
def test_nothing_coincides_in_the_gallery(name):
    assert not coincide(SCENES[name]().scene)


@every_space
def test_walls_that_meet_and_facets_that_cross_do_not_coincide(space):
    assert not coincide(scene(space, [MATTE], walls(space.d, 0, SHINE)))
    assert not coincide(soup(space, 1))


@pytest.mark.parametrize("space", [PLANE, SPACES["solid"]], ids=["plane", "solid"])
def test_facets_of_one_plane_coincide_where_a_point_lies_on_both(space):
    """Random simplices of one slanted plane, against points."""
    d, rng = space.d, np.random.default_rng(8)
    plane = np.linalg.qr(rng.normal(size=(d, d)))[0][: d - 1]
    flat = rng.random((40, d, d - 1)) * rng.choice([0.3, 1.0], (40, 1, 1)) + rng.random((40, 1, d - 1))
    facets = [Facet((each @ plane + 0.3).tolist()) for each in flat]
    s = scene(space, [MATTE], [replace(facets[0], emission=SHINE), *facets[1:]])
    b = np.random.default_rng(9).dirichlet(np.full(d, 0.7), 2000)
    maps, offsets = s.surfaces.maps.reshape(d, s.S, d)[:-1], s.surfaces.offsets.reshape(d, s.S, 1)[:-1]
    shared = set()
    for a in range(s.S):
        inside_of = np.einsum("ksd,dn->ksn", maps, s.corners[..., a].T @ b.T) + offsets
        deep = (inside_of.min(axis=0) > 0) & (inside_of.sum(axis=0) < 1)
        shared |= {(min(a, c), max(a, c)) for c in np.flatnonzero(deep.any(axis=1)) if c != a}
    assert 50 < len(shared) < 700
    assert shared <= coincide(s)
    assert len(coincide(s) - shared) <= 0.02 * len(shared)  # overlaps that 2000 points miss


def test_tiles_that_share_an_edge_do_not_coincide_at_any_scale_or_place():
    for k, at in ((1e-3, 0.0), (1.0, 0.0), (1.0, 100.0), (1e3, 0.0)):
        v = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0.3], [0, 1, 0.3]]) * k + at
        tiles = [Facet(v[list(each)].tolist(), 0, SHINE) for each in ((0, 1, 2), (0, 2, 3))]
        assert not coincide(scene(SPACES["solid"], [MATTE], tiles))
        assert coincide(scene(SPACES["solid"], [MATTE], [tiles[0], turned(tiles[0])])) == {(0, 1)}


def test_a_gap_beyond_the_clearance_is_a_gap():
    wall, least = Facet(((0, 0), (1, 0))), intersection.CLEARANCE
    for gap, found in ((0.5 * least, {(0, 1)}), (2 * least, set())):
        lamp = Facet(((0.25, gap), (0.5, gap)), 0, SHINE)
        assert coincide(scene(PLANE, [MATTE], [wall, lamp])) == found


def test_blocks_of_pairs_are_a_matter_of_memory_only(monkeypatch):
    s = SPACES["solid"]
    wall = walls(3)[0]
    facets = [*walls(3), inset(wall), *walls(3, 0)]
    corners = np.array([f.corners for f in facets])
    whole = scene(s, [MATTE], facets)
    monkeypatch.setattr("restir_ref.transport.coincidence.AT_ONCE", 1)
    found = coincident(corners, whole.surfaces.maps, whole.surfaces.offsets, 1e-10)
    assert {(int(a), int(b)) for a, b in found.T if a < b} == coincide(whole)
    assert len(coincide(whole)) == 6


# ---------------------------------------------------------------- what cannot be


@every_space
def test_two_lamps_in_one_place_that_shine_to_one_side_are_refused(space):
    lamp = Facet(np.eye(space.d).tolist(), 0, SHINE)
    smaller = Facet((0.5 * np.eye(space.d) + 0.5 / space.d).tolist(), 0, SHINE)
    with pytest.raises(ValueError, match=r"facets 1 and 2 emit to the same side from the same place.*leave one out"):
        scene(space, [MATTE], [turned(lamp, emission=()), lamp, smaller])
    for fine in (turned(smaller), replace(smaller, emission=()), replace(smaller, emission=(0.0,))):
        assert scene(space, [MATTE], [lamp, fine]).S == 2


# ---------------------------------------------------------------- shifts


def frosted(roughness: float) -> Material:
    """A surface that reflects and transmits."""
    return Material([Layer(f"rough {kind}", (1.0,), roughness) for kind in ("reflection", "transmission")])


def divided() -> PathIntegrals:
    """A room with a pane, rougher on one side than on the other, seen from above on both sides.

    Shifts across the pane take what the base path reflects for light that it transmits.
    """
    pane = [(0.5, 0.0), (0.5, 0.35)]
    facets = [*square(0), *chain(LAMP, 0, 8.0), *chain(pane, 1), *chain(pane[::-1], 2)]
    s = scene(PLANE, [matte(0.6), frosted(0.3), frosted(0.6)], facets)
    return PathIntegrals(Tracer(s, Pinhole((0.5, 0.8), (0.5, 0.0), 256, 0.5, film=256), 3, RECONNECTION))


def convicted() -> set[str]:
    """The checks that turn red; none is undecided."""
    found = judge(divided(), Live(np.random.default_rng(1)), Effort(paths=5000, jacobians=40))
    assert not found.undecided
    return set(found.red)


def test_shifts_across_two_materials_in_one_place_are_right():
    assert convicted() == set()


def test_a_connection_to_the_back_of_what_is_there_is_convicted(monkeypatch):
    monkeypatch.setattr(Scene, "meets", lambda s, x, y, prim: s.visible(x, y))
    assert "traced from scratch" in convicted()


# ---------------------------------------------------------------- which boxes meet


def in_a_lattice(d: int, n: int) -> Array:
    """Corners (n, d, d) of facets on few planes, many of which touch or coincide."""
    return np.random.default_rng(d).integers(0, 4, (n, d, d)).astype(float)


def missing(corners: Array, least: float) -> set[tuple[int, int]]:
    """Pairs whose boxes are nowhere farther apart than `least`, by comparing all, against those that are found."""
    low, high = corners.min(axis=1) - least, corners.max(axis=1)
    all_pairs = (low[:, None] <= high[None]).all(axis=2) & (high[:, None] >= low[None]).all(axis=2)
    found = [pair for a, b in coincidence._boxes_that_meet(corners, least) for pair in zip(a, b, strict=True)]
    assert len(found) == len(set(found))
    return set(zip(*np.nonzero(np.triu(all_pairs, 1)), strict=True)) ^ set(found)


@every_space
@pytest.mark.parametrize("at_once", [1, 30, 2**18])
@pytest.mark.parametrize("n", [1, 2, 80])
def test_boxes_that_meet_are_those_of_comparing_all(space, n, at_once, monkeypatch):
    monkeypatch.setattr(coincidence, "AT_ONCE", at_once)
    assert missing(in_a_lattice(space.d, n), 1e-9) == set()
    assert missing(2.0 * in_a_lattice(space.d, n) + np.arange(n)[:, None, None] / n, 1e-9) == set()


def test_a_sweep_that_ends_too_early_is_noticed(monkeypatch):
    right = coincidence._until
    monkeypatch.setattr(coincidence, "_until", lambda *given: (right(*given)[0], np.maximum(right(*given)[1] - 1, 0)))
    assert missing(in_a_lattice(3, 80), 1e-9)
