"""The inverses that the protocol does not ask for; those it asks for, and uniformity, are in tests/transport."""

from dataclasses import dataclass

import numpy as np
import pytest

from restir_ref.batch import Array
from restir_ref.transport.vectors import norm, normalize
from tests.transport.lobe_cases import integral, views
from tracer3d.space import SOLID, Solid

U = np.random.default_rng(1).random((2, 5000))


def inversion_faults(space: Solid) -> dict[str, float]:
    """How far each sampler's inverse is from it."""
    v = views(3, 5000, np.random.default_rng(2))
    return {
        "disk": abs(space.unball(space.ball(U)) - U).max(),
        "sphere": abs(space.unsphere(space.sphere(U)) - U).max(),
        "triangle": abs(space.unsimplex(space.simplex(U)) - U).max(),
        "visible normals": abs(space.unvisible(space.visible(U, v), v) - U).max(),
    }


@pytest.mark.claims("MCMC-A08", part="disks and visible normals", world="tracer3d")
def test_every_sampler_has_its_inverse():
    assert max(inversion_faults(SOLID).values()) < 1e-9


@dataclass(frozen=True)
class Unrooted(Solid):
    """Mistakes: roots left out, angles from the other axis, the squeeze forgotten."""

    def unsphere(self, w: Array) -> Array:
        return np.stack([(1 - w[2]) / 2, np.arctan2(w[0], w[1]) / (2 * np.pi) % 1])

    def unsimplex(self, b: Array) -> Array:
        root = b[0] + b[1]
        return np.stack([root, b[1] / root])

    def unball(self, x: Array) -> Array:
        return np.stack([np.hypot(*x), np.arctan2(x[1], x[0]) / (2 * np.pi) % 1])


def test_inverses_of_other_samplers_are_noticed():
    assert min(inversion_faults(Unrooted()).values()) > 0.1


def test_corners_and_poles_invert_to_numbers():
    assert np.isfinite(SOLID.unsimplex(np.zeros((2, 1)))).all()
    assert np.isfinite(SOLID.unsphere(np.array([[0.0], [0.0], [1.0]]))).all()
    assert np.isfinite(SOLID.unball(np.zeros((2, 1)))).all()


def visible_area(v: Array, density) -> float:
    """int of a density over all directions, by quadrature."""
    return integral(SOLID, density, v, 400)


@pytest.mark.parametrize("height", [0.0, 0.3, 1.0])
def test_the_density_of_visible_normals_integrates_to_one(height):
    """max(0, m.v) 2 / (pi (1 + v_z)) over the upper hemisphere."""
    v = np.array([[np.sqrt(1 - height**2)], [0.0], [height]])

    def density(m: Array) -> Array:
        return np.maximum((m * v).sum(axis=0), 0) * (m[2] >= 0) * 2 / (np.pi * (1 + height))

    assert visible_area(v, density) == pytest.approx(1, abs=2e-3)
    assert abs(visible_area(v, lambda m: density(m) * (1 + height) / 2) - 1) > 0.3 * (1 - height)


def test_microfacets_from_the_rim_of_the_disk_are_unit_vectors_too():
    """There 1 - x^2 - y^2 is 0 but for rounding, of either sign."""
    rng = np.random.default_rng(7)
    u = rng.random((2, 4000))
    u[rng.integers(2, size=4000), np.arange(4000)] = rng.integers(2, size=4000)
    v = normalize(rng.normal(size=(3, 4000)) * np.array([[1.0], [1.0], [0.3]]))
    v[2] = np.abs(v[2])
    x, y = SOLID.ball(u)
    rounding = 1 - x**2 - y**2
    assert (rounding < 0).any()
    assert np.abs(rounding).max() < 1e-15
    assert norm(SOLID.visible(u, v)) == pytest.approx(1, abs=1e-7)


def test_microfacets_at_the_ends_of_the_disk_come_back_though_they_stick_out_by_rounding():
    """x = 1 or -1 and y = 0, where 1 - x^2 is 0 but for rounding."""
    v = views(3, 4000, np.random.default_rng(8))
    u = np.stack([np.arange(4000) % 2, np.full(4000, 0.5)])
    m = SOLID.visible(u, v)
    assert ((m * m).sum(axis=0) > 1).any()
    assert SOLID.unvisible(m, v) == pytest.approx(u, abs=1e-6)


def test_the_middle_of_the_square_is_the_middle_of_the_disk():
    assert (SOLID.ball(np.full((2, 1), 0.5)) == 0).all()
    assert SOLID.unball(np.zeros((2, 1))) == pytest.approx(0.5, abs=1e-12)
