"""The inverses that the protocol does not ask for; those it asks for, and uniformity, are in tests/transport."""

from dataclasses import dataclass

import numpy as np
import pytest

from restir_ref.batch import Array
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
