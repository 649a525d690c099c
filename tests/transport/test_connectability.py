"""The one predicate of connections, what shifts connect, and rays that leave the scene."""

import numpy as np
import pytest

from flatland2d import PLANE, SCENES
from restir_ref.batch import take
from restir_ref.transport.materials import Layer, Material
from restir_ref.transport.paths import RECONNECTION, REPLAY, Connectability, Tracer, connectable, leaves, trace
from restir_ref.transport.proofs.inversion import connection
from restir_ref.transport.rays import GRAZING, arrive
from restir_ref.transport.scene import Facet, scene
from tests.transport.paths import HYBRID, RULES, shifts


def connects(rule: Connectability, r_x: float, r_z: float, distance: float) -> bool:
    return bool(connectable(rule, np.array([r_x]), np.array([r_z]), np.array([distance]))[0])


@pytest.mark.claims("GRIS-A12")
def test_thresholds_themselves_connect_and_anything_less_does_not() -> None:
    r, d = HYBRID.roughness, HYBRID.distance
    assert connects(HYBRID, r, r, d)
    for less in ((np.nextafter(r, 0), r, d), (r, np.nextafter(r, 0), d), (r, r, np.nextafter(d, 0))):
        assert not connects(HYBRID, *less)


@pytest.mark.claims("GRIS-A12")
@pytest.mark.parametrize("rule", [HYBRID, RECONNECTION, REPLAY], ids=["hybrid", "reconnection", "replay"])
def test_the_verdict_is_the_same_from_either_end_and_never_for_delta_lobes(rule) -> None:
    r_x, r_z, distance = np.random.default_rng(1).random((3, 1000)) * [[0.4], [0.4], [0.04]]
    assert (connectable(rule, r_x, r_z, distance) == connectable(rule, r_z, r_x, distance)).all()
    assert not connectable(rule, 0 * r_x, r_z, distance).any()
    assert not connectable(REPLAY, r_x, r_z, distance).any()


@pytest.mark.parametrize("rule", ["hybrid", "reconnection"])
def test_no_shift_connects_along_a_surface(rule) -> None:
    s = shifts(SCENES["cornell"](), RULES[rule], 20_000, seed=3, reach=400)
    met = np.flatnonzero((s.J > 0) & (s.x.c > 0))
    at = connection(s.t, take(s.y, met), s.j[met])
    cosines = s.t.scene.space.to_local(at.v.n, at.w)[1], at.z.o[1]
    assert len(met) > 1000
    assert np.abs(cosines).min() > GRAZING


class Down:
    """One pixel at (x, 1) that looks down, or up."""

    n, numbers = 1, 1

    def __init__(self, up: float) -> None:
        self.up = up

    def ray(self, pixel, u):
        x = np.stack([4 * u[0] - 2, np.ones(len(pixel))])
        return x, np.stack([np.zeros(len(pixel)), np.full(len(pixel), self.up)]), np.ones(len(pixel))


def outdoors(up: float) -> Tracer:
    """A lamp, primitive 0, over a floor, and nothing else."""
    facets = [Facet(((0.2, 2.0), (-0.2, 2.0)), 0, (5.0,)), Facet(((-2.0, 0.0), (2.0, 0.0)))]
    return Tracer(scene(PLANE, [Material([Layer("lambert", (0.5,))])], facets), Down(up), 2, RECONNECTION)


def test_what_leaves_the_scene_carries_nothing_though_primitive_0_is_a_lamp() -> None:
    u = np.random.default_rng(2).random((outdoors(1).D, 4000))
    for t in (outdoors(1.0), outdoors(-1.0)):
        tree = trace(t, u, np.zeros(4000, dtype=int))
        start, w, _ = t.sensor.ray(np.zeros(4000), u[:1])
        _, _, met = arrive(t.scene, start, w)
        assert 0.05 < met.mean() < 1.01
        assert not any(F[:, ~met].any() for _, _, F in leaves(tree))
        _, _, again = arrive(t.scene, tree.x[0].x, tree.at[0].w)
        behind = [F for k, nee, F in leaves(tree) if k > 1 or (k == 1 and not nee)]
        assert not any(F[:, met & ~again].any() for F in behind)


def test_a_lamp_seen_directly_is_as_bright_as_it_is() -> None:
    u = np.random.default_rng(3).random((outdoors(1).D, 4000))
    first = next(F for _, _, F in leaves(trace(outdoors(1.0), u, np.zeros(4000, dtype=int))))
    lit = np.abs(4 * u[0] - 2) < 0.2
    assert (first[0] == 5.0 * lit).all()
