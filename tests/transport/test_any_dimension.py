"""The transport knows no dimension: nothing in its source asks for one, and one code is right in d = 2, 3 and 4."""

import ast
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

from restir_ref.batch import Array
from restir_ref.transport import materials, paths
from restir_ref.transport.lobes import LOBES
from restir_ref.transport.materials import Layer, Material
from restir_ref.transport.paths import RECONNECTION, Tracer, first_hit, radiance, scatter, trace
from restir_ref.transport.scene import Ball, scene
from restir_ref.transport.space import Space
from tests.checkout import ROOT, modules, plant
from tests.core.test_any_dimension import asks_for_a_dimension, names
from tests.transport.furnished import FURNISHED, furnished_shifts
from tests.transport.rooms import room, simplex, walls
from tests.transport.spaces import SPACES


def asks(node: ast.AST) -> bool:
    """A comparison with `d`, or a choice or a lookup by it."""
    if isinstance(node, ast.Subscript):
        return names(node.slice) == "d" and isinstance(node.value, ast.Dict | ast.List | ast.Tuple)
    if isinstance(node, ast.Match):
        return names(node.subject) == "d"
    return asks_for_a_dimension(node)


def questions(root: Path) -> Iterator[str]:
    """Where the transport asks which dimension it is in."""
    for module in modules(root, ["restir_ref/transport"]):
        yield from (f"{module.name}:{node.lineno}" for node in ast.walk(module.tree) if asks(node))


@pytest.mark.claims("COM-A06")
def test_the_transport_does_not_ask_for_the_dimension():
    assert list(questions(ROOT)) == []
    assert len(list(modules(ROOT, ["restir_ref/transport"]))) > 8


@pytest.mark.parametrize(
    "line",
    ["y = 1 if d == 2 else 3", "z = space.d > 2", "if s.space.d != 3: ...", "J = [1, 2][space.d]", "C = {2: 2.0}[d]"],
)
def test_a_question_for_the_dimension_is_noticed(tmp_path, line):
    assert len(list(questions(plant(tmp_path, "restir_ref/transport/a.py", line)))) == 1
    plant(tmp_path, "restir_ref/transport/a.py", "g = r ** (space.d - 1)\nh = x[d:]\nk = corners.shape[1:] + (d, d)")
    assert list(questions(tmp_path)) == []


@dataclass(frozen=True)
class Point:
    """A sensor of one pixel: a place that takes radiance from all directions, weight 1."""

    space: Space
    n: int = 1

    @property
    def numbers(self) -> int:
        return self.space.d - 1

    def ray(self, pixel: Array, u: Array) -> tuple[Array, Array, Array]:
        place = simplex(self.space.d).mean(axis=0)[:, None].repeat(len(pixel), axis=1)
        return place, self.space.sphere(u), np.ones(len(pixel))


def furnace_z(space: Space, n: int = 20_000, depth: int = 3, albedo: float = 0.6) -> float:
    """z of the radiance in a closed room of walls that emit 1: sum of albedo^k, k <= depth; error at most 0.3 %."""
    t = Tracer(room(space, albedo), Point(space), depth, RECONNECTION)
    L = radiance(trace(t, np.random.default_rng(1).random((t.D, n)), np.zeros(n, dtype=int)))[0]
    truth, error = sum(albedo**k for k in range(depth + 1)), L.std() / np.sqrt(n)
    assert error < 0.003 * truth
    return float((L.mean() - truth) / error)


@pytest.mark.claims("COM-A06")
@pytest.mark.claims("COM-B01", part="a furnace of triangles", world="tracer3d")
@pytest.mark.parametrize("space", SPACES.values(), ids=SPACES)
def test_a_furnace_is_evenly_bright_in_any_dimension(space):
    assert abs(furnace_z(space)) < 4


@pytest.mark.parametrize("space", [SPACES["plane"], SPACES["hyper"]], ids=["plane", "hyper"])
def test_the_furnace_notices_the_geometry_of_3d_elsewhere(space, monkeypatch):
    monkeypatch.setattr(paths, "light_pdf", lambda s, v, r: s.pdf_area[v.prim] * v.front * r**2 / v.o[-1])
    assert abs(furnace_z(space)) > 8


def behind_glass(space: Space, eta: float, n: int = 2000, depth: int = 40) -> Array:
    """Radiance beside a glass ball in a room of black walls that emit 1, path by path."""
    layers = [Layer(f"glass {way}", (1.0,), 0.0) for way in ("reflection", "transmission")]
    black = Material([Layer("lambert", (0.0,))])
    ball = Ball((simplex(space.d).mean(axis=0) + 0.1).tolist(), 0.07, 1)
    s = scene(space, [black, Material(layers, eta)], walls(space.d, 0, (1.0,)), [ball])
    t = Tracer(s, Point(space), depth, RECONNECTION)
    tree = trace(t, np.random.default_rng(2).random((t.D, n)), np.zeros(n, dtype=int))
    assert (tree.x[0].prim == s.S).sum() > 10
    return radiance(tree)[0]


@pytest.mark.parametrize("eta", [1.5, 1 / 1.5])
@pytest.mark.parametrize("space", SPACES.values(), ids=SPACES)
def test_glass_in_a_furnace_cannot_be_seen(space, eta):
    """Every path carries exactly 1, unless it is still inside the glass in the end."""
    L = behind_glass(space, eta)
    assert np.isin(L.round(12), [0, 1]).all()
    assert L.mean() > 0.998


def test_glass_whose_choice_of_lobe_is_not_paid_for_is_seen(monkeypatch):
    wrong = replace(LOBES["glass transmission"], weight=LOBES["mirror"].weight)
    monkeypatch.setattr(materials, "LOBES", {**LOBES, "glass transmission": wrong})
    assert not np.isin(behind_glass(SPACES["plane"], 1.5).round(12), [0, 1]).all()


@pytest.mark.parametrize("name", FURNISHED)
def test_a_ray_leaves_in_the_direction_that_its_lobe_has_drawn(name):
    s = furnished_shifts(name, RECONNECTION, 500, seed=5)
    t, space, table = s.t, s.t.scene.space, s.t.scene.materials
    v, _, _ = first_hit(t, s.x.u, s.i)
    at = scatter(t, v, s.x.u, 1)
    drawn = materials.sample_lobe(table, space, v, at.lobe, t.direction_numbers(s.x.u, 1))
    kept = drawn[-1] != 0
    assert kept.sum() > 100
    np.testing.assert_allclose(space.to_local(v.n, at.w)[:, kept], drawn[:, kept], atol=1e-12)
