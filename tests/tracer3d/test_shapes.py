"""Shapes are closed and face the right way: the volume their triangles enclose, signed by fronts, is known."""

from dataclasses import replace

import numpy as np
import pytest

from restir_ref.transport.scene import Facet
from tracer3d.shapes import FLAT, block, box, joined, lamp, quad, raised, rectangle, room, turned, walls

BASE = rectangle((0.2, 0.1), (0.5, 0.7), 0.3)


def volume(facets: list[Facet]) -> float:
    """sum det(corners) / 6: the volume that fronts face away from, minus the one that they face.  [Gauss]"""
    return float(sum(np.linalg.det(np.array(each.corners)) for each in facets) / 6)


def area(facets: list[Facet]) -> float:
    """Sum of areas."""
    corners = np.array([each.corners for each in facets])
    return float(
        np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum() / 2
    )


def test_boxes_face_outwards_and_rooms_inwards():
    assert volume(box(BASE, 0.4, 0)) == pytest.approx(0.3 * 0.6 * 0.4, rel=1e-12)
    assert volume(box(turned(BASE, 33), 0.4, 0)) == pytest.approx(0.3 * 0.6 * 0.4, rel=1e-12)
    assert volume(room(0, 2.0)) == pytest.approx(-2.0, rel=1e-12)
    assert area(room(0)) == pytest.approx(6, rel=1e-12)


def test_one_triangle_that_faces_the_other_way_is_noticed():
    first, *rest = box(BASE, 0.4, 0)
    turned_round = replace(first, corners=first.corners[::-1])
    assert abs(volume([turned_round, *rest]) - 0.3 * 0.6 * 0.4) > 1e-3


def test_a_block_is_a_box_without_bottom():
    assert area(box(BASE, 0.4, 0)) - area(block(BASE, 0.4, 0)) == pytest.approx(0.3 * 0.6, rel=1e-12)
    assert len(block(BASE, 0.4, 0)) == 10


def test_turning_is_counterclockwise_seen_from_above_about_the_middle():
    x = np.array(turned(BASE, 90))
    assert x.mean(axis=0) == pytest.approx(np.array(BASE).mean(axis=0), rel=1e-12)
    from_middle, before = x - x.mean(axis=0), np.array(BASE) - np.array(BASE).mean(axis=0)
    # Seen from above, x to the right and z towards the viewer, (1, 0) turns into (0, -1).
    assert from_middle[:, 2] == pytest.approx(-before[:, 0], abs=1e-12)
    assert from_middle[:, 0] == pytest.approx(before[:, 2], abs=1e-12)


def test_the_walls_of_a_room_are_where_they_are_said_to_be():
    floor, ceiling, left, front, right, back = (np.array(each) for each in walls(2.0))
    for corners, axis, place in (
        (floor, 1, 0),
        (ceiling, 1, 1),
        (left, 0, 0),
        (right, 0, 2),
        (front, 2, 1),
        (back, 2, 0),
    ):
        assert (corners[:, axis] == place).all()


def test_lamps_shine_down_in_white():
    for facet in lamp((0, 0), (1, 2), 0.9, 5.0):
        a, b, c = np.array(facet.corners)
        assert np.cross(b - a, c - a)[1] < 0
        assert facet.emission == (5.0, 5.0, 5.0)


def test_raised_corners_are_higher_up():
    assert np.array(raised(BASE, 0.2)) - np.array(BASE) == pytest.approx(np.tile([0, 0.2, 0], (4, 1)))


def test_quads_that_are_not_flat_are_refused():
    bent = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 1e-3)]
    with pytest.raises(ValueError, match=r"in one plane, but are \[\[0.0, 0.0, 0.0\]"):
        quad(bent, 0)
    with pytest.raises(ValueError, match="in one plane"):
        joined([bent], 0)
    assert len(quad([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 1e-12)], 0)) == 2


@pytest.mark.parametrize("far", [1, 2, 3])
def test_how_flat_a_quad_must_be_goes_by_its_farthest_corner_whichever_that_is(far):
    """The fourth corner may be as high above the plane of the others as FLAT times the quad's size."""
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    corners[far] *= 1000
    corners[3, 2] = 0.5 * FLAT * 1000
    assert len(quad(corners.tolist(), 0)) == 2
    corners[3, 2] = 2 * FLAT * 1000
    with pytest.raises(ValueError, match="in one plane"):
        quad(corners.tolist(), 0)
