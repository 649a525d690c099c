"""Laws of probes in walls: they are told from those in a room with thin partitions, counted and named."""

import numpy as np
import pytest

from flatland2d.directions import MAPS
from flatland2d.scenes import setting
from restir_ref.transport.cache.grid import Grid, over
from restir_ref.transport.cache.volume import unlit
from restir_ref.transport.cache.walls import RAYS, batches, bundle, embedded_words, in_walls
from restir_ref.transport.scene import Ball, Facet, scene
from tests.transport.cache.worlds import WORLDS, middle
from tests.transport.rooms import MATTE, simplex, walls


@pytest.mark.parametrize("name", WORLDS)
def test_a_probe_in_a_ball_is_in_a_wall_and_one_beside_it_is_not(name):
    space, maps = WORLDS[name]
    g = middle(space.d, 0.2)
    solid = Ball(g.place(np.array([0]))[:, 0].tolist(), 0.05, 0)
    s = scene(space, [MATTE], walls(space.d, 0, (1.0,)), [solid])
    assert np.flatnonzero(in_walls(s, g, maps.depth)).tolist() == [0]


def test_probes_in_boxes_are_in_walls_and_no_others():
    s, g = setting("cornell").scene, over((0, 0), (1, 1), (16, 16))
    x, y = g.place(np.arange(g.P))
    expected = (x > 0.15) & (x < 0.4) & (y < 0.5) | (x > 0.62) & (x < 0.85) & (y < 0.28)
    np.testing.assert_array_equal(in_walls(s, g, MAPS.depth), expected)


def test_a_partition_one_facet_thick_has_no_inside():
    g = over((0, 0), (2, 1), (32, 16))
    assert not in_walls(setting("ajar").scene, g, MAPS.depth).any()


def test_a_probe_that_sees_nothing_at_all_is_in_no_wall():
    """A facet so small that it is between two directions of the map."""
    s = scene(WORLDS["plane"][0], [MATTE], [Facet(((5, 5), (5.001, 4.999)), 0, (1.0,))])
    alone = Grid((0.0, 0.0), (0.1, 0.1), (1, 1))
    assert not np.isfinite(s.intersect(np.zeros((2, 64)), MAPS.depth.centres())[0]).any()
    assert not in_walls(s, alone, MAPS.depth).any()


def test_probes_in_walls_are_counted_and_the_first_are_named():
    g = Grid((0, 0), (1, 1), (3, 4))
    assert embedded_words(g, np.zeros(12, dtype=bool)) == "0 of 12 probes are inside walls"
    assert embedded_words(g, np.arange(12) % 5 == 4) == "2 of 12 probes are inside walls, at nodes (1, 0), (2, 1)"
    assert embedded_words(g, np.ones(12, dtype=bool)).endswith("(1, 3), ..")


@pytest.mark.parametrize("name", WORLDS)
def test_a_volume_whose_probes_are_all_in_walls_is_refused(name):
    space, maps = WORLDS[name]
    solid = Ball(simplex(space.d).mean(axis=0).tolist(), 0.1, 0)
    s = scene(space, [MATTE], walls(space.d, 0, (1.0,)), [solid])
    n = 2**space.d
    with pytest.raises(
        ValueError, match=f"{n} of {n} probes are inside walls, at nodes .*: move the grid into the room"
    ):
        unlit(s, middle(space.d), maps)


def test_probes_in_walls_take_no_part():
    v = unlit(setting("cornell").scene, over((0, 0), (1, 1), (16, 16)), MAPS)
    assert (~v.active).sum() == 48
    assert v.frames == 0
    assert not v.E.any()


@pytest.mark.parametrize("rays", [1, 100, RAYS // 2, RAYS + 1])
def test_batches_hold_every_probe_once_and_few_rays(rays):
    g = Grid((0,), (1,), (10,))
    found = batches(g, rays)
    assert np.concatenate(found).tolist() == list(range(10))
    assert max(len(each) for each in found) * rays <= max(RAYS, rays)


def test_a_bundle_goes_probe_by_probe():
    x, w = bundle(Grid((0, 0), (1, 1), (2, 1)), np.array([0, 1]), np.array([[1.0, 0], [0, 1]]))
    np.testing.assert_array_equal(x, [[0, 0, 1, 1], [0, 0, 0, 0]])
    np.testing.assert_array_equal(w, [[1, 0, 1, 0], [0, 1, 0, 1]])
