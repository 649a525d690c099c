"""Two triangles asked as one parallelogram: found in any order of corners, met and hiding as the two apiece would."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import permutations, product

import numpy as np
import pytest

from restir_ref.batch import Array
from restir_ref.transport.scene import Ball, Facet, Scene, scene
from restir_ref.transport.sheets import FLUSH, Sheets
from tests.transport.rooms import MATTE, crossings, directions, room, soup
from tests.transport.spaces import SPACES
from tracer3d.scenes import SCENES
from tracer3d.space import SOLID

QUAD = np.array([[0.1, 0.2, 0.9], [1.3, 0.3, 0.8], [1.1, 1.0, 0.5], [-0.1, 0.9, 0.6]])
"""Corners (4, 3) of a slanted parallelogram, in a circle."""

WAYS = [(*three, *other) for three, other in product(permutations((0, 1, 2)), permutations((0, 2, 3)))]
"""Every order and side of its two triangles."""


def made_of(triangles: Sequence[Array], lamps: int = 1, balls: Sequence[Ball] = ()) -> Scene:
    """A scene of triangles (3, 3), the first of which emit, and balls."""
    emission = [(1.0,)] * lamps + [()] * (len(triangles) - lamps)
    facets = [Facet(v.tolist(), 0, shines) for v, shines in zip(triangles, emission, strict=True)]
    return scene(SOLID, [MATTE], facets, balls)


def halves(corners: Array, way: Sequence[int] = (0, 1, 2, 0, 2, 3)) -> list[Array]:
    """The two triangles of a quad with corners (4, 3)."""
    return [corners[[*way[:3]]], corners[[*way[3:]]]]


def flat_soup(seed: int) -> Scene:
    """Random parallelograms, each in a random way, and as many triangles among them; balls if the seed is odd."""
    rng = np.random.default_rng(seed)
    found = []
    for _ in range(12):
        a, b, d = rng.random((3, 3))
        found += halves(np.stack([a, b, b + d - a, d]), WAYS[rng.integers(len(WAYS))])
        found.append(rng.random((3, 3)))
    return made_of(found, balls=[Ball(rng.random(3).tolist(), 0.1) for _ in range(3 * (seed % 2))])


def apiece(s: Scene) -> Scene:
    """The same scene, whose facets are asked one by one."""
    sheets = Sheets(s.surfaces.maps, s.surfaces.offsets, 0, np.tile(np.arange(s.S + s.radii.size), (2, 1)))
    return replace(s, surfaces=replace(s.surfaces, sheets=sheets))


def changed(s: Scene, **parts: object) -> Scene:
    """The same scene with other sheets."""
    return replace(s, surfaces=replace(s.surfaces, sheets=replace(s.surfaces.sheets, **parts)))


def rays(n: int = 20_000) -> tuple[Array, Array]:
    """Starts and directions (3, n) through the unit cube."""
    return np.random.default_rng(2).random((3, n)), directions(3, n, 3)


def agree(a: Scene, b: Scene) -> bool:
    """Whether rays and segments find the same."""
    x, w = rays()
    (t, prim), (t_b, prim_b) = a.intersect(x, w), b.intersect(x, w)
    met = np.isfinite(t)
    assert 0.2 < met.mean() < 0.98
    assert len(np.unique(prim[met])) == a.S + a.radii.size
    same = (met == np.isfinite(t_b)) & (~met | (prim == prim_b))
    return bool(
        same.all() and np.allclose(t[met], t_b[met], rtol=1e-9) and (a.visible(x, x + w) == b.visible(x, x + w)).all()
    )


# ---------------------------------------------------------------- which facets go together


@pytest.mark.parametrize("way", WAYS)
def test_two_triangles_of_a_parallelogram_are_one_sheet_in_any_order_of_corners(way):
    found = made_of(halves(QUAD, way)).surfaces.sheets
    assert (found.P, found.boxes, found.prims.tolist()) == (1, 1, [[0], [1]])


def strangers() -> Iterator[tuple[str, list[Array]]]:
    """Pairs of triangles that are no parallelogram."""
    off = np.zeros((4, 3))
    off[2, 0] = 1e-9
    yield "a corner off", halves(QUAD + off)
    bent = np.zeros((4, 3))
    bent[3] = np.cross(*np.diff(QUAD[:3], axis=0)) * 1e-9
    yield "bent", halves(QUAD + bent)
    yield "a trapezoid", halves(np.array([[0, 0, 0], [2, 0, 0], [1, 1, 0], [0, 1, 0.0]]))
    yield "a kite", halves(np.array([[0, 0, 0], [1, -1, 0], [3, 0, 0], [1, 1, 0.0]]))
    yield "one and the same, from both sides", [QUAD[:3], QUAD[[0, 2, 1]]]
    yield "overlapping", [QUAD[[0, 1, 2]], QUAD[[0, 1, 3]]]
    yield "in one corner only", [QUAD[:3], 2 * QUAD[2] - QUAD[:3]]


@pytest.mark.parametrize("pair", [pytest.param(pair, id=name) for name, pair in strangers()])
def test_other_pairs_stay_two(pair):
    assert made_of(pair).surfaces.sheets.boxes == 0


def test_a_corner_off_by_rounding_does_not_matter():
    turned = QUAD @ np.linalg.qr(np.random.default_rng(1).random((3, 3)))[0]
    off = np.zeros((4, 3))
    off[3, 1] = FLUSH / 2
    assert made_of(halves(turned + off)).surfaces.sheets.boxes == 1


def strip(n: int) -> list[Array]:
    """n triangles, each of which fills a parallelogram with the next."""
    rail = np.array([[k / 2, k % 2, 0.0] for k in range(n + 2)])
    return [rail[k : k + 3] for k in range(n)]


@pytest.mark.parametrize("n", range(1, 8))
def test_no_facet_is_in_two_sheets_and_none_is_left_out(n):
    apart = [QUAD[:3] + 5, *strip(n), QUAD[:3] + 9, *halves(QUAD)]
    found = made_of(apart).surfaces.sheets
    assert found.boxes == n // 2 + 1
    assert sorted({*found.prims[0].tolist(), *found.prims[1].tolist()}) == [*range(n + 4)]
    assert (found.prims[0, found.boxes :] == found.prims[1, found.boxes :]).all()


def test_cornell_is_sixteen_rectangles():
    found = SCENES["cornell"]().scene.surfaces.sheets
    assert (found.P, found.boxes) == (16, 16)


@pytest.mark.parametrize(
    "space", [space for space in SPACES.values() if space.d != 3], ids=lambda space: f"d = {space.d}"
)
def test_only_in_space_two_simplices_fill_a_box(space):
    for s in (room(space), soup(space, 1)):
        assert (s.surfaces.sheets.boxes, s.surfaces.sheets.P) == (0, s.S)


# ---------------------------------------------------------------- what rays find


def test_sheets_are_met_and_hide_as_their_facets_apiece():
    for seed in range(4):
        s = flat_soup(seed)
        assert s.surfaces.sheets.boxes == 12
        assert agree(s, apiece(s))


def test_a_lamp_flush_in_a_wall_shines_and_the_wall_is_there_from_behind():
    lamp = QUAD.mean(axis=0) + 0.5 * (QUAD - QUAD.mean(axis=0))
    s = made_of([*halves(lamp), *halves(QUAD)], lamps=2)
    x, w = rays()
    _, prim = s.intersect(x, w)
    front = s.normals[:, :1].T @ w < 0
    met = np.isfinite(apiece(s).intersect(x, w)[0])
    assert {*prim[met & front[0]].tolist()} == {0, 1, 2, 3}
    assert {*prim[met & ~front[0]].tolist()} == {2, 3}
    assert agree(s, apiece(s))


def test_they_would_not_if_a_box_were_one_triangle_or_its_facets_changed_places():
    s = flat_soup(0)
    assert not agree(s, changed(s, boxes=0))
    assert not agree(s, changed(s, boxes=13))
    assert not agree(s, changed(s, prims=s.surfaces.sheets.prims[::-1]))


def test_the_facet_met_is_the_one_that_linear_systems_find():
    s = flat_soup(5)
    x, w = rays(4000)
    t, prim = s.intersect(x, w)
    every = crossings(s, x, w)
    met = np.isfinite(t)
    nearest = every.argmin(axis=0)
    assert (met == np.isfinite(every).any(axis=0)).all()
    assert (np.where(nearest < s.S, nearest, s.S + (nearest - s.S) // 2) == prim)[met].all()
    np.testing.assert_allclose(t[met], every.min(axis=0)[met], rtol=1e-9)


def test_no_ray_slips_through_the_diagonal_nor_past_the_rim_of_a_room():
    s = SCENES["furnace"]().scene
    corners = np.moveaxis(s.corners, -1, 0)
    share = np.random.default_rng(4).dirichlet((1, 1), 4000)
    k = np.random.default_rng(5).integers(s.S, size=4000)
    edge = np.random.default_rng(6).integers(3, size=4000)
    ends = corners[k, edge], corners[k, (edge + 1) % 3]
    on_edge = (share[:, :1] * ends[0] + share[:, 1:] * ends[1]).T
    x = corners.reshape(-1, 3).mean(axis=0)[:, None] + 0.1 * (np.random.default_rng(7).random((3, 4000)) - 0.5)
    w = on_edge - x
    assert np.isfinite(s.intersect(x, w / np.linalg.norm(w, axis=0))[0]).all()
