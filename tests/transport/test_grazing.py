"""No NaN, infinity or warning: from grazing angles, corners and shared end points, on base and offset paths."""

from dataclasses import dataclass

import numpy as np
import pytest

from flatland2d import SCENES
from flatland2d.scenes import LAMP, PLANE, Layer, Material, Setting, block, chain, room
from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.integrals import Pixels
from restir_ref.restir import initial, shade, spatial, temporal
from restir_ref.transport import rays
from restir_ref.transport.paths import Path, Tracer
from restir_ref.transport.proofs.inversion import traced
from restir_ref.transport.restir_pt import PathIntegrals
from restir_ref.transport.scene import Ball, Scene, scene
from restir_ref.transport.shifts import shift_path
from restir_ref.transport.vectors import norm
from tests.transport.paths import RULES

N = 660
LAST = 1 - 2.0**-53
SPECIAL = np.array([0, 2.0**-60, 2.0**-53, 0.25, 0.5, 0.75, LAST])
"""Numbers at which directions are along the surface or its normal, and points in the corners of lights."""


def specially(rng: np.random.Generator, shape: tuple[int, ...], share: float) -> Array:
    """Uniform numbers, a share of them replaced by special ones."""
    return np.where(rng.random(shape) < share, rng.choice(SPECIAL, shape), rng.random(shape))


@dataclass(frozen=True)
class Special(Live):
    """Chance that likes special numbers; every other column has nothing else."""

    def uniform(self, shape: tuple[int, ...]) -> Array:
        return specially(self.rng, shape, np.where(np.arange(shape[-1]) % 2, 1.0, 0.3))


@dataclass(frozen=True)
class Corners:
    """A sensor in the corners of the scene and half-way between two, that looks exactly, or nearly, at others."""

    ends: Array
    n: int = 4096
    numbers: int = 1

    def ray(self, pixel: Array, u: Array) -> tuple[Array, Array, Array]:
        E = self.ends.shape[-1]
        a, b = self.ends.take(pixel % E, axis=-1), self.ends.take((7 * pixel + pixel // E + 1) % E, axis=-1)
        start = np.where(pixel % 3 == 0, (a + self.ends.take((pixel + 1) % E, axis=-1)) / 2, a)
        to = b - start + (u[0] - 0.5) * np.where(pixel % 5 == 0, 1e-9, 0)
        return start, np.where(norm(to) > 0, to / np.maximum(norm(to), 1e-300), [[1.0], [0.0]]), np.ones(len(pixel))


def corners_of(s: Scene) -> Corners:
    """All end points, and the centres and rightmost and lowest points of circles."""
    right, down = s.radii.T * [[1], [0]], s.radii.T * [[0], [-1]]
    return Corners(np.concatenate([*s.corners, s.centres, s.centres + right, s.centres + down], axis=1))


def showroom(roughness: float) -> Setting:
    """Every lobe there is, on boxes that share corners and circles that touch them."""

    def glass(kind: str, eta: float) -> Material:
        return Material(
            [Layer(f"{kind}reflection", (1.0,), roughness), Layer(f"{kind}transmission", (1.0,), roughness)], eta
        )

    coated = Material([Layer("lambert", (0.4,)), Layer("ggx", (0.3,), roughness), Layer("mirror", (0.3,))])
    materials = [glass("rough ", 1.5), glass("glass ", 1.5), glass("rough ", 0.7), coated]
    boxes = [*block((0.15, 0), (0.4, 0.5), 0), *block((0.6, 0), (0.85, 0.28), 1), *block((0.4, 0.5), (0.5, 0.6), 2)]
    balls = [Ball((0.5, 0.2), 0.1, 0), Ball((0.5, 0.4), 0.1, 1), Ball((0.2, 0.8), 0.2, 2)]
    return Setting(scene(PLANE, materials, [*room(3), *boxes, *chain(LAMP, 3, 8.0)], balls), (0.5, 0.7), (0.45, 0.2), 5)


PLACES = {
    **SCENES,
    "all lobes": lambda: showroom(0.3),
    "sharp lobes": lambda: showroom(0.01),
    "all but mirrors": lambda: showroom(1e-8),
}


def sensors(setting: Setting) -> tuple:
    return setting.pinhole(1920, 0), setting.fluence(16, 16), corners_of(setting.scene)


def sound(x: Path) -> bool:
    """All numbers of a path are finite, and what it carries is not negative."""
    return all(np.isfinite(part).all() for part in (x.z, x.out, x.S, x.p_light, x.A, x.F)) and (x.F >= 0).all()


def shifted_there_and_back(setting: Setting, rule: str, sensor, seed: int = 1) -> tuple[int, int]:
    """Leaves of special samples and their shifts, all sound; how many carry light, and are shifted with it."""
    rng, t = np.random.default_rng(seed), Tracer(setting.scene, sensor, setting.depth, RULES[rule])
    u = specially(rng, (t.D, N), rng.choice([1.0, 0.5, 0.1], N))
    i, k = rng.integers(0, sensor.n, N), rng.integers(0, setting.depth + 1, N)
    j = np.clip(i + rng.integers(-20, 21, N), 0, sensor.n - 1)
    x = traced(t, u, i, k, (rng.random(N) < 0.5) & (k > 0))
    y, J = shift_path(t, x, j)
    back, J_back = shift_path(t, y, i)
    assert sound(x)
    assert sound(y)
    assert sound(back)
    assert (np.isfinite(J * J_back) & (J >= 0)).all()
    return int(x.F.any(axis=0).sum()), int((y.F.any(axis=0) & x.F.any(axis=0) & (i != j)).sum())


@pytest.mark.parametrize("rule", RULES)
@pytest.mark.parametrize("place", PLACES)
def test_paths_along_walls_and_through_corners_are_numbers_and_so_are_their_shifts(place, rule) -> None:
    setting = PLACES[place]()
    with np.errstate(all="raise"):
        found = [shifted_there_and_back(setting, rule, sensor) for sensor in sensors(setting)]
    assert min(np.sum(found, axis=0)) > 5


@pytest.mark.parametrize("rule", RULES)
@pytest.mark.parametrize("place", PLACES)
def test_reuse_of_such_paths_is_numbers(place, rule) -> None:
    setting, chance, index = PLACES[place](), Special(np.random.default_rng(2)), np.arange(256)
    of = PathIntegrals(Tracer(setting.scene, corners_of(setting.scene), setting.depth, RULES[rule]))
    here, near, far = Pixels(of, index), Pixels(of, (index + 1) % 256), Pixels(of, (13 * index + 5) % 256)
    with np.errstate(all="raise"):
        X = initial(here, chance)
        Y = spatial(temporal(X, here, X, [near], chance), here, [near, far], chance)
        L = shade(Y, here)
    assert np.isfinite(L).all()
    assert L.max() > 0


def test_without_a_least_cosine_there_are_warnings(monkeypatch) -> None:
    monkeypatch.setattr(rays, "GRAZING", 0.0)
    setting = SCENES["furnace"]()
    with np.errstate(all="raise"), pytest.raises(FloatingPointError, match="in divide"):
        shifted_there_and_back(setting, "reconnection", corners_of(setting.scene))
