"""What the witness is told of a scene: each glass its own index, lamps by power, all of it around the origin."""

from itertools import permutations

import numpy as np
import pytest

from restir_ref.transport.materials import Layer, Material
from restir_ref.transport.scene import Ball, Scene, scene
from tracer3d.scenes import grey, matte, setting
from tracer3d.shapes import lamp, room
from tracer3d.space import SOLID
from tracer3d.witness import ENLARGED, exported, material, mitsuba


@pytest.fixture(scope="module")
def mi():
    pytest.importorskip("mitsuba", reason="Mitsuba 3 is not installed: pip install -e '.[reference]'")
    return mitsuba("scalar_rgb")


def glass(eta: float, roughness: float = 0.0) -> Material:
    kind = "rough" if roughness else "glass"
    return Material([Layer(f"{kind} {way}", grey(1.0), roughness) for way in ("reflection", "transmission")], eta)


def holding(*materials: Material) -> Scene:
    """A room that holds a ball of each of the materials, 1, 2, ..; its walls are matte."""
    balls = [Ball((0.2 + 0.3 * k, 0.3, 0.4), 0.1, k + 1) for k in range(len(materials))]
    return scene(SOLID, [matte(grey(0.5)), *materials], room(0, emission=grey(1.0)), balls)


@pytest.mark.parametrize("etas", [*permutations((1.2, 1.5, 1.8))])
def test_every_glass_is_exported_with_its_own_index_of_refraction(etas):
    s = holding(*(glass(eta) for eta in etas))
    assert [material(s, 1 + k)["int_ior"] for k in range(3)] == pytest.approx(etas, rel=1e-12)


def test_clear_glass_is_exported_without_a_roughness_and_frosted_glass_with_its_square():
    clear, frosted = (material(holding(glass(1.5, roughness)), 1) for roughness in (0.0, 0.4))
    assert (clear["type"], frosted["type"]) == ("dielectric", "roughdielectric")
    assert "alpha" not in clear
    assert frosted["alpha"] == pytest.approx(0.4**2, rel=1e-12)


def lit_by(*lamps) -> Scene:
    return scene(SOLID, [matte(grey(0.5))], [*room(0), *(facet for each in lamps for facet in each)])


def powers(mi, s: Scene) -> list[float]:
    """How likely Mitsuba is to choose each lamp, over the least likely one."""
    loaded = mi.load_dict(exported(mi, s, setting("cornell").pinhole(4, 4), 2))
    weights = [float(each.sampling_weight()) for each in loaded.emitters()]
    return [each / min(weights) for each in weights]


def test_mitsuba_chooses_lamps_by_radiance_times_area(mi):
    small = lamp((0.1, 0.1), (0.2, 0.3), 0.9, 3.0)
    assert powers(mi, lit_by(small, lamp((0.5, 0.5), (0.6, 0.9), 0.8, 3.3))) == pytest.approx([1.0, 2.2], rel=1e-5)
    assert powers(mi, lit_by(small, lamp((0.5, 0.5), (0.9, 0.8), 0.8, 2.0))) == pytest.approx([1.0, 4.0], rel=1e-5)


def test_what_is_exported_is_as_far_to_one_side_of_the_origin_as_to_the_other_and_enlarged(mi):
    at = setting("ajar")
    found = exported(mi, at.scene, at.pinhole(4, 4), 2)
    parts = [np.array(mi.traverse(each)["vertex_positions"]) for name, each in found.items() if "facets" in name]
    points = np.concatenate(parts).reshape(-1, 3)
    assert points.max(axis=0) == pytest.approx(-points.min(axis=0), rel=1e-5)
    corners = at.scene.corners
    assert np.ptp(points, axis=0) == pytest.approx(ENLARGED * np.ptp(corners, axis=(0, 2)), rel=1e-5)
