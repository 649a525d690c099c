"""Compiled scenes: affine maps, sizes, and what is refused, with the offending value in the message."""

from dataclasses import replace
from math import factorial

import numpy as np
import pytest

from flatland2d import PLANE, Pinhole
from flatland2d.scenes import LAMP, boxes, chain, mixed
from flatland2d.scenes import room as square
from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.transport import scene as scenes
from restir_ref.transport.intersection import CLEARANCE
from restir_ref.transport.materials import Layer, Material
from restir_ref.transport.paths import Tracer, radiance, trace
from restir_ref.transport.proofs.judge import judge, report
from restir_ref.transport.proofs.shift_checks import Effort
from restir_ref.transport.restir_pt import PathIntegrals
from restir_ref.transport.scene import FAR, Ball, Facet, scene
from restir_ref.transport.sheets import EDGE
from tests.transport.paths import HYBRID
from tests.transport.rooms import MATTE, soup, walls
from tests.transport.spaces import SPACES

every_space = pytest.mark.parametrize("space", SPACES.values(), ids=SPACES)


@every_space
def test_the_maps_give_a_facet_s_corners_unit_coordinates_and_height_zero(space):
    s, d = soup(space, 1), space.d
    at = np.einsum("fsk,cks->fcs", s.surfaces.maps.reshape(d, s.S, d), s.corners) + s.surfaces.offsets.reshape(
        d, 1, s.S
    )
    unit = np.concatenate(
        [np.zeros((d, 1)), np.eye(d)[:, : d - 1]], axis=1
    )  # one column per corner, the last row heights
    assert np.abs(at - unit[:, :, None]).max() < 1e-10


@every_space
def test_heights_are_distances_from_the_plane(space):
    s, x = soup(space, 1), np.random.default_rng(2).random((space.d, 100))
    heights = (s.surfaces.maps @ x + s.surfaces.offsets)[-s.S :]
    expected = np.einsum("ds,dsn->sn", s.normals, x[:, None] - s.corners[0][:, :, None])
    assert np.abs(heights - expected).max() < 1e-12


def test_facets_are_larger_by_edge():
    s = scene(SPACES["plane"], [MATTE], [Facet(((0, 0), (2, 0)), 0, (1.0,))])
    assert s.surfaces.offsets[0, 0] == pytest.approx(EDGE, rel=1e-9)


@every_space
def test_a_size_is_the_gram_determinant_s_root_over_a_factorial(space):
    """pdf_area of the one light is 1 / size."""
    s = soup(space, 3)
    edges = s.corners[1:, :, 0] - s.corners[0, :, 0]
    size = np.sqrt(np.linalg.det(edges @ edges.T)) / factorial(space.d - 1)
    assert s.lights.pdf_area == pytest.approx([1 / size])
    assert s.pdf_area[0] == s.lights.pdf_area[0]
    assert (s.pdf_area[1:] == 0).all()


@every_space
@pytest.mark.parametrize("k", [1e-3, 1e3])
def test_a_scene_moved_and_scaled_has_the_same_normals_and_lights(space, k):
    right = [replace(facet, emission=(1.0,)) for facet in walls(space.d)]
    moved = [replace(facet, corners=(k * np.array(facet.corners) + 7 * k).tolist()) for facet in right]
    a, b = scene(space, [MATTE], right), scene(space, [MATTE], moved)
    assert np.allclose(a.normals, b.normals, atol=1e-12)
    assert np.allclose(a.lights.upto, b.lights.upto)
    assert np.allclose(a.pdf_area, b.pdf_area * k ** (space.d - 1))


def cornell_at(at: tuple[float, float]) -> Tracer:
    """The glossy box, turned, with its left floor corner at a place."""
    turn = np.array([[np.cos(0.3), -np.sin(0.3)], [np.sin(0.3), np.cos(0.3)]])
    there = lambda x: tuple((turn @ np.array(x) + at).tolist())  # noqa: E731
    facets = [*square(0), *boxes(1), *chain(LAMP, 0, 8.0)]
    moved = [replace(facet, corners=[there(corner) for corner in facet.corners]) for facet in facets]
    s = scene(PLANE, [mixed(0.5, 0.5, 0.2), mixed(0.3, 0.15, 0.5)], moved)
    return Tracer(s, Pinhole(there((0.5, 0.7)), there((0.45, 0.2)), 1920, film=1920), 3, HYBRID)


def image(t: Tracer) -> Array:
    pixel = np.arange(1920 * 2) % 1920
    return radiance(trace(t, np.random.default_rng(4).random((t.D, len(pixel))), pixel))


PLACES = ((100.0, -70.0), (-0.9 * FAR, 0.6 * FAR))


@pytest.mark.parametrize("at", PLACES)
def test_a_moved_scene_renders_the_same_and_its_shifts_are_right(at):
    t, there = cornell_at((0.0, 0.0)), cornell_at(at)
    unlike = np.abs(image(there) - image(t)) > 1e-4 * image(t)
    assert unlike.mean() < 1e-3  # rays that pass an edge by less than the rounding of places
    assert image(there).mean() == pytest.approx(image(t).mean(), rel=1e-4)
    found = judge(PathIntegrals(there), Live(np.random.default_rng(1)), Effort(paths=5000, jacobians=80))
    assert found.green, report(found)


def test_a_scene_beyond_the_limit_is_refused_where_its_shifts_would_be_wrong(monkeypatch):
    far = (30 * FAR, 20 * FAR)
    with pytest.raises(ValueError, match=r"coordinates up to 300001, more than 10000 times that.*Move it"):
        cornell_at(far)
    monkeypatch.setattr(scenes, "FAR", np.inf)
    t = cornell_at(far)
    assert "inverse Jacobians" in judge(PathIntegrals(t), Live(np.random.default_rng(1)), Effort(paths=5000)).red


@every_space
@pytest.mark.parametrize("at", [0.0, 100.0, -0.9 * FAR])
def test_rounding_is_as_small_a_share_of_the_clearance_wherever_a_scene_stands(space, at):
    moved = [replace(f, corners=(np.array(f.corners) + at).tolist(), emission=(1.0,)) for f in walls(space.d)]
    s, b = scene(space, [MATTE], moved), np.random.default_rng(5).dirichlet(np.ones(space.d), 1000)
    for k in range(s.S):
        height = np.abs(s.surfaces.maps[-s.S :][k] @ (s.corners[..., k].T @ b.T) + s.surfaces.offsets[-s.S :][k])
        assert height.max() < 2e-5 * CLEARANCE * s.extent


@every_space
def test_arrays_are_as_good_as_lists(space):
    lists = [replace(facet, emission=(1.0, 2.0) if k else ()) for k, facet in enumerate(walls(space.d))]
    arrays = [Facet(np.array(facet.corners), 0, np.array(facet.emission)) for facet in lists]
    dark = [replace(facet, emission=np.zeros(2)) if not len(facet.emission) else facet for facet in arrays]
    paint, ball = Material([Layer("lambert", np.array([0.5, 0.3]))]), Ball(np.zeros(space.d), np.array(0.1))
    a = scene(space, [paint], lists, [replace(ball, centre=(0.0,) * space.d)])
    for other in (arrays, dark):
        b = scene(space, np.array([paint], dtype=object), other, [ball])
        assert all(np.array_equal(getattr(a, name), getattr(b, name)) for name in ("corners", "emission", "pdf_area"))


# ---------------------------------------------------------------- mistakes of users

LIGHT = Facet(((0, 0), (1, 0)), 0, (1.0,))
PLAIN = Facet(((0, 1), (1, 1)))
BLUE = Material([Layer("lambert", (0.1, 0.2, 0.3))])
BAD = {
    "the scene has no light": ([PLAIN], []),
    "give at least one facet a positive emission": ([replace(LIGHT, emission=(0.0,))], []),
    "facet 1 is degenerate: its corners are [[0.5, 0.5], [0.5, 0.5]]": ([LIGHT, Facet(((0.5, 0.5), (0.5, 0.5)))], []),
    "there is no material 1: the scene has 1": ([LIGHT, replace(PLAIN, material=1)], []),
    "there is no material -1": ([LIGHT, replace(PLAIN, material=-1)], []),
    "there is no material 2": ([LIGHT], [Ball((0, 0), 1.0, 2)]),
    "emission must be 1 finite numbers >= 0, or () for none, but is (-1.0,)": (
        [LIGHT, replace(PLAIN, emission=(-1.0,))],
        [],
    ),
    "but is (nan,)": ([LIGHT, replace(PLAIN, emission=(np.nan,))], []),
    "but is (inf,)": ([LIGHT, replace(PLAIN, emission=(np.inf,))], []),
    "but is (0.0, 0.0)": ([LIGHT, replace(PLAIN, emission=(0.0, 0.0))], []),
    "the lights have [1, 3] channels": ([LIGHT, replace(PLAIN, emission=(1.0, 1.0, 1.0))], []),
    "a facet needs 2 corners of 2 finite coordinates each": ([LIGHT, Facet(((0, 0), (1, 0), (1, 1)))], []),
    "needs 2 corners of 2 finite": ([LIGHT, Facet(((0, 0, 0), (1, 0, 0)))], []),
    "2 corners of 2": ([LIGHT, Facet(((0, 0), (1, np.nan)))], []),
    "of 2 finite coordinates each": ([LIGHT, Facet(((0, 0), (1, np.inf)))], []),
    "radius=0": ([LIGHT], [Ball((0, 0), 0)]),
    "radius=-1": ([LIGHT], [Ball((0, 0), -1)]),
    "radius=nan": ([LIGHT], [Ball((0, 0), np.nan)]),
    "radius=inf": ([LIGHT], [Ball((0, 0), np.inf)]),
    "needs a centre of 2 finite coordinates": ([LIGHT], [Ball((0, 0, 0), 1)]),
    "a positive, finite radius": ([LIGHT], [Ball((0, np.nan), 1)]),
}


@pytest.mark.parametrize("said", BAD)
def test_a_scene_that_cannot_be_is_refused_with_its_value(said):
    with pytest.raises(ValueError) as error:  # noqa: PT011
        scene(SPACES["plane"], [MATTE], *BAD[said])
    assert said in str(error.value)


def test_the_light_s_channels_and_the_colours_must_agree():
    with pytest.raises(ValueError, match="per channel of the lights' emission, here 1"):
        scene(SPACES["plane"], [BLUE], [LIGHT])


def test_a_sliver_is_refused_at_any_scale():
    space = SPACES["solid"]
    for k in (1e-6, 1.0, 1e6):
        sliver, triangle = (
            k * np.array([[0, 0, 0], [1, 0, 0], [2, 1e-12, 0]]),
            k * np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]]),
        )
        assert scene(space, [MATTE], [Facet(triangle.tolist(), 0, (1.0,))]).S == 1
        with pytest.raises(ValueError, match="facet 0 is degenerate"):
            scene(space, [MATTE], [Facet(sliver.tolist(), 0, (1.0,))])
