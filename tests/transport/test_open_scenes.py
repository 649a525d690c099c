"""Scenes without walls all around, mirrors for lamps and glossy lobes listed first: no shift takes them for granted."""

from types import SimpleNamespace

import numpy as np
import pytest

from flatland2d import PLANE, Pinhole
from flatland2d.scenes import Setting, chain
from restir_ref.transport.materials import Layer, Material
from restir_ref.transport.paths import Tracer, trace
from restir_ref.transport.proofs.reading import extended_path, factors, first_connectable
from restir_ref.transport.record import record
from restir_ref.transport.scene import scene as compiled
from restir_ref.transport.shifts import shift_path
from tests.transport.paths import HYBRID, RULES, retraced, shifts, successful

GLOSS, BASE = Layer("ggx", (0.4,), 0.1, weight=0.5), Layer("lambert", (0.4,), weight=0.5)
MIRROR = Material([Layer("mirror", (0.5,))])


def roofless() -> Setting:
    """No ceiling, a mirror for a lamp in mid-air, and the glossy lobe of the walls first."""
    facets = [*chain([(0, 1), (0, 0), (1, 0), (1, 1)], 0), *chain([(0.65, 0.5), (0.45, 0.5)], 1, 8.0)]
    return Setting(compiled(PLANE, [Material([GLOSS, BASE]), MIRROR], facets), (0.1, 0.45), (1.0, 0.45))


def pavilion() -> SimpleNamespace:
    """No walls, a mirror that shines for a ceiling, and a floor whose first lobe is glossy on its left half only.

    No Setting: those want walls, which maps of fluence look at sideways.
    """
    floor = [*chain([(0, 0), (0.5, 0)], 0), *chain([(0.5, 0), (1, 0)], 1)]
    materials = [Material([GLOSS, BASE]), Material([BASE, GLOSS]), MIRROR]
    s = compiled(PLANE, materials, [*floor, *chain([(1, 1), (0, 1)], 2, 1.0)])
    return SimpleNamespace(scene=s, depth=3, pinhole=lambda n, first: Pinhole((0.5, 0.8), (0.5, 0.0), n, first=first))


OPEN = {"roofless": roofless, "pavilion": pavilion}
every_rule = pytest.mark.parametrize("rule", RULES)
every_scene = pytest.mark.parametrize("scene", OPEN)


@every_rule
@every_scene
def test_a_path_shifted_into_its_own_pixel_is_itself(scene, rule) -> None:
    s = shifts(OPEN[scene](), RULES[rule], 6000, seed=1)
    y, J = shift_path(s.t, s.x, s.i)
    assert np.abs(J - 1).max() < 1e-9
    assert np.abs(y.F / s.x.F - 1).max() < 1e-9


@every_rule
@every_scene
def test_offset_paths_of_pixels_far_away_are_found_by_tracing_them(scene, rule) -> None:
    s = successful(shifts(OPEN[scene](), RULES[rule], 6000, seed=1, reach=900))
    _, y = retraced(s)
    assert len(s.J) > 100
    assert (y.c == s.y.c).all()
    assert np.abs(y.F / s.y.F - 1).max() < 1e-7


@pytest.mark.parametrize(("k", "nee"), [(2, True), (3, True), (3, False)])
def test_records_and_readings_of_a_path_agree_where_it_reconnects(k, nee) -> None:
    N, rng, setting = 6000, np.random.default_rng(1), roofless()
    t, pixel = Tracer(setting.scene, setting.pinhole(1920, 0), 3, HYBRID), np.arange(N) % 1920
    u, K, by_light = rng.random((t.D, N)), np.full(N, k), np.full(N, nee)
    x = extended_path(t, u, pixel, K, by_light)
    recorded = record(t, trace(t, u, pixel), K, by_light, np.zeros((1, N))).c
    seen = x.seen[:k].all(axis=0)
    assert len(set(recorded[seen])) > 1
    assert (first_connectable(t, x, factors(t, x)) == recorded)[seen].all()
