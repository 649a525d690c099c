"""Embree answers as brute force does: paths, visibility, edges, balls, facets in one place; and who is refused."""

import sys
from dataclasses import dataclass, replace
from functools import cache
from importlib.util import find_spec

import numpy as np
import pytest

from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.transport.paths import Tracer, radiance, trace
from restir_ref.transport.proofs.judge import judge, report
from restir_ref.transport.proofs.shift_checks import Effort
from restir_ref.transport.restir_pt import PathIntegrals
from restir_ref.transport.scene import Facet, Scene, scene
from restir_ref.transport.vectors import normalize
from tests.tracer3d.views import HYBRID
from tracer3d import SCENES, embree
from tracer3d.cli import main
from tracer3d.embree import DOUBT, MET, OWN, Embree, with_embree
from tracer3d.render import BESIDE, Job, blank, render
from tracer3d.scenes import grey, lamp, matte, room
from tracer3d.space import SOLID

installed = pytest.mark.skipif(find_spec("embreex") is None, reason="needs the extra embree")


@cache
def both(name: str) -> tuple[Scene, Scene]:
    """A scene by brute force and by Embree."""
    plain = SCENES[name]().scene
    return plain, with_embree(plain)


def light(s: Scene, name: str, n: int = 8000) -> Array:
    """Light of the same n paths (C, n) through all of the view."""
    at = SCENES[name]()
    t = Tracer(s, at.view(32, 32), at.depth, HYBRID)
    return radiance(trace(t, np.random.default_rng(1).random((t.D, n)), np.arange(n) % t.sensor.n))


def unequal(ours: Array, theirs: Array) -> float:
    """The share of columns in which more than rounding differs."""
    return float((~np.isclose(ours, theirs, rtol=1e-9, atol=1e-12)).any(axis=0).mean())


@dataclass(frozen=True, eq=False)
class Hasty(Embree):
    """A mistake: what x lies on counts."""

    def _met(self, prim: Array, x: Array, w: Array) -> tuple[Array, Array, Array]:
        what, near, descent = super()._met(prim, x, w)
        return np.where(what == OWN, MET, what), near, descent


# ---------------------------------------------------------------- the same paths


@installed
@pytest.mark.parametrize("name", SCENES)
def test_paths_are_those_of_brute_force_but_for_one_in_a_thousand_at_most(name):
    plain, fast = (light(s, name) for s in both(name))
    assert unequal(fast, plain) <= 1e-3
    assert abs(fast.mean() / plain.mean() - 1) < 0.02


@installed
def test_rays_that_meet_what_they_leave_are_noticed():
    plain, fast = both("cornell")
    wrong = replace(fast, surfaces=Hasty(**vars(fast.surfaces)))
    assert unequal(light(wrong, "cornell"), light(plain, "cornell")) > 2e-3


@installed
@pytest.mark.parametrize("name", ["cornell", "glass_ball"])
def test_the_judge_of_shifts_acquits_what_asks_embree(name):
    at, (_, fast) = SCENES[name](), both(name)
    of = PathIntegrals(Tracer(fast, at.pinhole(32, 32), at.depth, HYBRID))
    found = judge(of, Live(np.random.default_rng(1)), Effort(paths=3000, jacobians=20))
    assert found.green, report(found)


def pictures(intersect: str) -> Array:
    """Two frames of ReSTIR PT, (C, rows, columns)."""
    job = Job("cornell", "restir-pt", size=(24, 24), crop=(928, 668), intersect=intersect)
    *_, last = render(job, lambda k: Live(np.random.default_rng(k)), 2, blank(job), job.compiled())
    return last.mean


@installed
def test_restir_pt_by_embree_has_the_pixels_of_brute_force():
    plain, fast = pictures("brute"), pictures("embree")
    assert unequal(fast.reshape(3, -1), plain.reshape(3, -1)) < 0.01
    assert abs(fast.mean() / plain.mean() - 1) < 0.02


# ---------------------------------------------------------------- edges, ends, and what lies in one place


def past_an_edge(n: int = 4000, within: float = 1e-6) -> tuple[Array, Array]:
    """Ends of segments that pass the door's edge (x = 1, z = .56) of Ajar3 so near, (3, n) each."""
    rng = np.random.default_rng(2)
    edge = np.stack([np.ones(n), rng.uniform(0.1, 0.8, n), 0.56 + rng.uniform(-within, within, n)])
    x = np.stack([rng.uniform(0.1, 0.9, n), rng.uniform(0.1, 0.9, n), rng.uniform(0.1, 0.9, n)])
    return x, edge + rng.uniform(0.2, 0.8, n) * (edge - x)


def one_sided(s: Scene) -> int:
    """Segments that are clear from one end and hidden from the other."""
    x, y = past_an_edge()
    return int((s.visible(x, y) != s.visible(y, x)).sum())


@installed
def test_visibility_is_the_same_from_both_ends():
    assert one_sided(both("ajar")[1]) == 0


@installed
def test_what_passes_an_edge_nearer_than_float32_can_tell_is_never_hidden_where_brute_force_sees():
    """What float32 meets is judged in float64; what it misses, beyond the edge or not, is not met."""
    plain, fast = both("ajar")
    x, y = past_an_edge(within=1e-8)
    clear = plain.visible(x, y)
    assert 0.3 < clear.mean() < 0.7
    assert fast.visible(x, y)[clear].all()
    assert not fast.visible(x, y).all()


@installed
def test_if_ends_are_not_ordered_it_is_not(monkeypatch):
    monkeypatch.setattr(embree, "ordered", lambda x, y: (x, y))
    assert one_sided(both("ajar")[1]) > 0


@installed
def test_of_two_ends_the_lesser_is_first_by_the_first_coordinate_that_differs():
    x, y = np.array([[0.0, 1, 2], [1, 1, 1], [1, 1, 1]]).T, np.array([[1.0, 0, 0], [1, 0, 2], [1, 1, 1]]).T
    a, b = embree.ordered(x, y)
    assert a.T.tolist() == [[0, 1, 2], [1, 0, 2], [1, 1, 1]]
    assert b.T.tolist() == [[1, 0, 0], [1, 1, 1], [1, 1, 1]]


def tessellated(m: int = 40) -> Scene:
    """A closed room whose floor is a rolling field of 2 m^2 triangles."""
    x, z = np.meshgrid(*[np.linspace(0, 1, m + 1)] * 2, indexing="ij")
    v = np.stack([x, 0.2 + 0.1 * np.sin(9 * x) * np.cos(7 * z), z], axis=-1)
    a, b, c, d = v[:-1, :-1], v[1:, :-1], v[1:, 1:], v[:-1, 1:]
    corners = np.concatenate([np.stack(each, axis=2).reshape(-1, 3, 3) for each in ((a, d, c), (a, c, b))])
    facets = [*room(0), *lamp((0.3, 0.3), (0.7, 0.7), 0.99, 8.0), *(Facet(each) for each in corners.tolist())]
    return scene(SOLID, [matte(grey(0.5))], facets)


def at_edges(s: Scene, n: int = 4000) -> tuple[Array, Array]:
    """Points above the field, and directions to edges and corners of its triangles, a few of them 1e-7 beside these."""
    rng = np.random.default_rng(3)
    x = np.stack([rng.uniform(0.1, 0.9, n), rng.uniform(0.5, 0.9, n), rng.uniform(0.1, 0.9, n)])
    facet = 14 + rng.integers(0, s.S - 14, n)
    corner, other = (s.corners[k][:, facet] for k in (0, 1))
    beside = rng.choice([0, 0, 1e-7], n) * rng.normal(size=(3, n))
    return x, normalize(corner + rng.choice([0, 0.3], n) * (other - corner) + beside - x)


SILHOUETTES = 20
"""Of 4000 rays at edges, those that in float32 pass by the crest of a hill and meet what is behind it."""


def elsewhere(s: Scene, fast: Scene) -> tuple[int, int]:
    """Rays at edges that leave the closed room, and those that meet something at another distance."""
    x, w = at_edges(s)
    (t, _), (t_fast, _) = s.intersect(x, w), fast.intersect(x, w)
    met = np.isfinite(t_fast)
    return int((~met).sum()), int((~np.isclose(t_fast[met], t[met], rtol=1e-9)).sum())


@dataclass(frozen=True, eq=False)
class Trusting(Embree):
    """A mistake: what Embree finds is met, whatever float64 says."""

    def _met(self, prim: Array, x: Array, w: Array) -> tuple[Array, Array, Array]:
        what, near, descent = super()._met(prim, x, w)
        return np.where(what == DOUBT, MET, what), near, descent


@installed
def test_rays_at_edges_and_corners_of_a_mesh_meet_what_brute_force_meets():
    s = tessellated()
    fast = with_embree(s)
    left, far = elsewhere(s, fast)
    assert left == 0
    assert far <= SILHOUETTES


@installed
def test_if_float64_were_not_asked_more_of_them_would_meet_something_else():
    s = tessellated()
    fast = with_embree(s)
    _, far = elsewhere(s, replace(fast, surfaces=Trusting(**vars(fast.surfaces))))
    assert far > SILHOUETTES


@installed
@pytest.mark.parametrize("size", [2.0**-12, 1.0, 2.0**12])
def test_walls_beside_the_eye_are_met_and_hide_whatever_the_size_of_the_scene(size):
    """In a corner, .05 to .5 % of the room from its walls: what is overlooked is a share of the extent, and less."""
    facets = [replace(each, corners=(size * np.array(each.corners)).tolist()) for each in room(0, emission=grey(1.0))]
    s, rng = scene(SOLID, [matte(grey(0.5))], facets), np.random.default_rng(5)
    fast, x, w = with_embree(s), size * rng.uniform(5e-4, 5e-3, (3, 2000)), normalize(-rng.random((3, 2000)))
    (t, prim), (t_fast, prim_fast) = s.intersect(x, w), fast.intersect(x, w)
    assert t_fast == pytest.approx(t, rel=1e-9)
    assert (prim_fast == prim).all()
    assert fast.visible(x, x + 0.9 * t * w).all()
    assert not fast.visible(x, x + 1.1 * t * w).any()


@installed
def test_what_stands_a_millionth_of_the_extent_away_is_not_overlooked():
    """START is half of that."""
    s, rng, h = scene(SOLID, [matte(grey(0.5))], room(0, emission=grey(1.0))), np.random.default_rng(8), 0.9 * 2.0**-20
    fast, axis, far = with_embree(s), np.repeat(np.arange(3), 200), np.tile([0, 1], 300)
    x, w, column = rng.uniform(0.1, 0.9, (3, 600)), np.zeros((3, 600)), np.arange(600)
    x[axis, column], w[axis, column] = np.where(far, 1 - h, h), np.where(far, 1.0, -1.0)
    assert s.extent == 1
    assert fast.intersect(x, w)[0] == pytest.approx(h, rel=1e-6)
    assert not fast.visible(x, x + 0.5 * w).any()


@installed
def test_rays_that_meet_nothing_name_a_facet_that_is_there_all_the_same():
    s = scene(SOLID, [matte(grey(0.5))], room(0, emission=grey(1.0)))
    x = np.random.default_rng(9).uniform(2, 3, (3, 100))
    for each in (s, with_embree(s)):
        t, prim = each.intersect(x, normalize(x))
        assert (t == np.inf).all()
        assert ((prim >= 0) & (prim < s.S)).all()


def test_the_time_of_a_frame_grows_with_the_surfaces_by_brute_force_and_not_by_embree(monkeypatch):
    monkeypatch.setattr("tracer3d.render.embree", lambda: None)
    surfaces = len(SCENES["cornell"]().scene.material)
    brute, fast = (Job("cornell", "path", intersect=each).hours() for each in ("brute", "embree"))
    assert brute / fast == pytest.approx((surfaces + BESIDE) / BESIDE, rel=1e-12)


@installed
def test_rays_along_the_wall_that_they_leave_meet_what_brute_force_meets():
    """They never rise above it, in float32 or in float64."""
    plain, fast = both("matte_cornell")
    rng = np.random.default_rng(6)
    x, w = rng.uniform(0.01, 0.99, (2, 3, 500))
    x[1], w = 0.0, normalize((w - 0.5) * np.array([[1.0], [0.0], [1.0]]))
    t, prim = fast.intersect(x, w)
    assert t == pytest.approx(plain.intersect(x, w)[0], rel=1e-9)
    assert (prim == plain.intersect(x, w)[1]).all()
    assert (fast.visible(x, x + 0.5 * w) == plain.visible(x, x + 0.5 * w)).all()


@installed
@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_lamp_flush_in_a_wall_is_met_from_its_front_only(way):
    s = scene(SOLID, [matte(grey(0.5))], [*room(0), *lamp((0.3, 0.3), (0.7, 0.7), 1.0, 8.0)])
    rng = np.random.default_rng(4)
    x = np.stack([rng.uniform(0.4, 0.6, 500), np.full(500, 1 - 0.5 * way), rng.uniform(0.4, 0.6, 500)])
    w = np.repeat([[0.0], [way], [0.0]], 500, axis=1)
    (_, prim), (_, prim_fast) = s.intersect(x, w), with_embree(s).intersect(x, w)
    assert (prim_fast == prim).all()
    assert (s.emission.take(prim, axis=-1).any(axis=0) == (way > 0)).all()


# ---------------------------------------------------------------- who is refused


def test_without_the_extra_it_is_named(monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "embreex.rtcore_scene", None)
    assert main(["render", "cornell", "--intersect", "embree"]) == 2
    assert "this needs the package embreex: install restir-ref with its extra 'embree'" in capsys.readouterr().err


def test_an_unknown_way_to_intersect_is_refused_with_the_nearest(capsys):
    assert main(["render", "cornell", "--intersect", "embre"]) == 2
    assert "there is no way to intersect 'embre': did you mean 'embree'?" in capsys.readouterr().err


def test_brute_force_refuses_large_scenes_with_the_time_and_names_the_extra(monkeypatch):
    monkeypatch.setattr("tracer3d.render.SURFACES", 31)
    with pytest.raises(
        ValueError, match=r"cornell has 32 triangles and spheres, .* at most 31: a frame would take about"
    ):
        Job("cornell", "path")
    with pytest.raises(ValueError, match=r"about 0.00054 hours. Install restir-ref with its extra 'embree'"):
        Job("cornell", "path", depth=2, size=(512, 512))


@installed
def test_embree_does_not_refuse_them(monkeypatch):
    monkeypatch.setattr("tracer3d.render.SURFACES", 31)
    assert isinstance(Job("cornell", "path", intersect="embree").compiled().surfaces, Embree)


@installed
def test_what_is_no_longer_asked_by_its_matrices_is_refused():
    with pytest.raises(TypeError, match="but its surfaces are Embree"):
        with_embree(both("cornell")[1])
