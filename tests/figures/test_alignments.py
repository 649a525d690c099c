"""Rooms and grids of what probes leak: walls as thick as said, grids inside the room, leaks that are leaks."""

import numpy as np
import pytest

from figures.claims import criteria
from figures.claims.figure import Claim
from figures.ddgi import ddgir_f03
from figures.ddgi.ddgir_f05 import ALONG, OFF, ROOMS, UNMOVED
from figures.experiments.alignments import (
    ROOMS as KINDS,
)
from figures.experiments.alignments import (
    Room,
    displaced,
    error,
    excess,
    panels,
    points,
    room,
    scattered_twice,
    shifted,
)
from figures.experiments.volumes import view
from flatland2d.directions import MAPS
from flatland2d.probe_rooms import couch, probes, sunlit, sunlit_slabs, wedge_of_slab
from flatland2d.scenes import crease
from restir_ref.chance import Live
from restir_ref.transport.cache.grid import Grid
from restir_ref.transport.cache.walls import in_walls

SMALL = {"pixels": 12, "rays": 16, "tolerance": 0.1}
THICKNESS = 0.05


def test_a_gap_of_three_hundredths_and_walls_of_none_are_the_rooms_of_before():
    for new, old in (
        (couch(0.03), crease()),
        (wedge_of_slab(30.0, 0.0), view("FS4, 30 degrees").setting),
        (sunlit_slabs(0.0), sunlit()),
    ):
        np.testing.assert_allclose(np.stack(new.scene.corners), np.stack(old.scene.corners), atol=1e-15)


@pytest.mark.parametrize("kind", KINDS)
def test_grids_stay_on_the_map_and_in_the_middle_are_those_of_probes(kind):
    setting = room(Room(kind, THICKNESS)).setting
    assert shifted(setting, 8, np.array([0.5, 0.5])) == probes(setting, 8)
    for u in (1e-6, 1 - 1e-6):
        g = shifted(setting, 8, np.array([u, u]))
        at = g.place(np.arange(g.P))
        assert (at > np.array(setting.low)[:, None]).all()
        assert (at < np.array(setting.high)[:, None]).all()


@pytest.mark.parametrize(
    ("setting", "inside", "outside"),
    [
        (sunlit_slabs(THICKNESS), (-THICKNESS / 2, 0.5), (-1.5 * THICKNESS, 0.5)),
        (wedge_of_slab(30.0, THICKNESS), (0.2, 0.2 * 0.57735 + THICKNESS / 2), (0.2, 0.2 * 0.57735 + 1.5 * THICKNESS)),
    ],
    ids=["slabs", "wedge"],
)
def test_probes_inside_a_slab_take_no_part_and_those_beyond_it_do(setting, inside, outside):
    for place, solid in ((inside, True), (outside, False)):
        one = Grid(tuple(float(x) for x in place), (1.0, 1.0), (1, 1))
        assert in_walls(setting.scene, one, MAPS.depth).tolist() == [solid]


def test_walls_let_no_light_in_however_thick():
    """True light of the corner is the same behind a facet and behind a slab; the slab's own back has the sun."""
    u = np.full(8, 0.5)
    thin, thick = (scattered_twice(Room("sun", size), points(Room("sun", size), u)) for size in (0.0, THICKNESS))
    np.testing.assert_allclose(thick, thin, rtol=2e-3)
    p, B = panels(Room("sun", THICKNESS))
    sunny = (p.a[0] < -1e-6) & (p.b[0] < -1e-6) & (p.a[0] > -0.4)
    assert B[sunny].max() > 20 * thin.max()


def test_only_what_is_too_bright_is_excess():
    truth, inside = np.ones((1, 4)), np.array([[1, 1, 1, 0]])
    told = np.array([[1.5, 0.5, 1.0, 9.0]])
    np.testing.assert_allclose(excess(told, truth, inside), [0.5 / 3])
    np.testing.assert_allclose(error(told, truth, inside), [1 / 3])
    np.testing.assert_allclose(error(told, truth), [9 / 4])


@pytest.mark.claims("DDGIR-F05", part="moved through a surface")
@pytest.mark.parametrize("name", ROOMS)
def test_along_the_path_nothing_is_moved_through_a_surface_and_nothing_is_caused(name):
    kind, thickness = ROOMS[name]
    a = displaced(Room(kind, thickness / 8), 8, SMALL, Live(np.random.default_rng(3)))
    for way in (ALONG, UNMOVED):
        assert a[f"{way} through"] == 0
        assert not a[f"{way} caused"].any()
    assert a[f"{OFF} through"] > 0
    assert a[f"{OFF} caused"].sum() > 0


@pytest.mark.parametrize("name", ROOMS)
def test_what_is_caused_is_a_part_of_what_leaks_and_that_of_all_that_is_told(name):
    kind, thickness = ROOMS[name]
    a = displaced(Room(kind, thickness / 8), 8, SMALL, Live(np.random.default_rng(4)))
    for way in (OFF, ALONG, UNMOVED):
        caused, leak, told = (a[f"{way} {what}"] for what in ("caused", "leak", "all"))
        assert (caused <= leak + 1e-12).all()
        assert (leak <= told + 1e-12).all()


@pytest.mark.parametrize(("grids", "judged"), [(15, False), (16, True)])
def test_leaks_are_judged_from_sixteen_grids_on(monkeypatch, grids, judged):
    for name in ("controls", "sharper", "missed"):
        monkeypatch.setattr(ddgir_f03, name, lambda a: [])
    monkeypatch.setattr(ddgir_f03, "of_gap", lambda a, gap: [Claim("DDGIR-F03", criteria.below(0.5, 1), f"{gap}")])
    found = ddgir_f03.check({f"gap {ddgir_f03.SHOWN:g} primary": np.zeros((grids, 4))})
    assert [claim.outcome is not None for claim in found] == [judged] * len(ddgir_f03.GAPS)
    assert all(claim.outcome or claim.reason for claim in found)
