"""Laws of pictures of probes: what is drawn has the sizes and places of what is known."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure

from flatland2d.directions import MAPS
from flatland2d.probe_pictures import SHOWN, around, depth_picture, leaks, volume_picture
from flatland2d.probe_rooms import PROBE_ROOMS, lamp_beside_probe, open_room, probes, sunlit
from restir_ref.transport.cache.converge import converge
from restir_ref.transport.cache.leaks import leaked
from restir_ref.transport.cache.update import Updating
from restir_ref.transport.cache.volume import Volume, unlit
from tests.transport.cache.worlds import live


def lit(setting, per_unit: float = 4) -> Volume:
    """A volume of the room, roughly converged."""
    v = unlit(setting.scene, probes(setting, per_unit), MAPS)
    return converge(v, setting.scene, Updating(attenuation=0), live(1), tolerance=0.1)


def drawn(kind: type, *draw) -> list:
    """What a picture holds of one kind of artist, and its words."""
    picture, *arguments = draw
    ax = Figure().subplots()
    picture(ax, *arguments)
    return [artist for artist in ax.collections if type(artist) is kind], ax.get_legend_handles_labels()[1]


@pytest.mark.parametrize("name", PROBE_ROOMS)
def test_every_probe_that_takes_part_has_a_lobe_and_the_largest_nearly_meets_its_neighbours(name):
    setting = PROBE_ROOMS[name]()
    v = lit(setting)
    (lobes, *_), words = drawn(PolyCollection, volume_picture, setting, v)
    corners = np.stack([path.vertices[:-1] for path in lobes.get_paths()])
    assert len(corners) == v.active.sum()
    r = np.linalg.norm(corners - v.grid.place(np.flatnonzero(v.active)).T[:, None], axis=-1)
    assert r.max() == pytest.approx(SHOWN * v.grid.spacing[0])
    np.testing.assert_allclose(r / r.max(), v.E[0, v.active] / v.E.max(), atol=1e-9)
    assert {"irradiance", "leaks, 1 % of E or more", "eye"} <= set(words)
    assert ("inside a wall" in words) == (not v.active.all())


def test_depth_is_drawn_where_the_walls_are():
    setting, probe = open_room(), [5, 10]
    v = lit(setting)
    lines, words = drawn(LineCollection, depth_picture, setting, v, probe)
    mean, less, more = (np.stack(found.get_segments()) for found in lines[:3])
    np.testing.assert_allclose(mean[:, :-1], around(v, np.array(probe), v.r[0], v.maps.depth.centres()))
    np.testing.assert_allclose(mean[:, 0], mean[:, -1])
    np.testing.assert_allclose((less + more) / 2, mean)
    assert "mean distance" in words


def test_what_leaks_in_a_room_without_light_is_all_that_is_told_beside_the_sun():
    """On the sunlit wall at its upper end; nothing leaks far from it, and no more than is told anywhere."""
    setting = sunlit(lamp=0.0)
    v = lit(setting, 8)
    x, share = leaks(v, setting)
    assert share.max() <= 1 + 1e-12
    corner = (x[0] < 0.02) & (x[1] > 0.97)
    assert corner.any()
    assert share[corner].max() > 0.9
    assert share.min() == 0


def test_nothing_leaks_where_every_probe_sees_every_point():
    setting = lamp_beside_probe()
    v = lit(setting)
    x = np.array([[0.7, 0.8], [0.0, 0.0]])
    n = np.array([[0.0, 0.0], [1.0, 1.0]])
    assert not leaked(v, setting.scene, x, n, 0 * n).any()


def test_a_leak_is_the_part_of_an_answer_that_unseen_probes_give():
    """Without the probes beyond the wall the rest is left: both parts, weighted anew, are the answer."""
    setting = sunlit()
    v = lit(setting, 8)
    x, n = np.array([[0.0] * 5, [0.1, 0.3, 0.5, 0.7, 0.9]]), np.repeat([[1.0], [0.0]], 5, axis=1)
    inside = v.grid.place(np.arange(v.grid.P))[0] > 0
    beyond, within = (replace(v, E=v.E * part[:, None]) for part in (~inside, inside))
    np.testing.assert_allclose(leaked(v, setting.scene, x, n, 0 * n), beyond.irradiance(x, n, n, 0 * n), rtol=1e-12)
    assert (leaked(v, setting.scene, x, n, 0 * n) > within.irradiance(x, n, n, 0 * n)).all()
