"""Frames and samplers: every sampler is onto its target with constant stretch, so uniform, and has its inverse."""

from dataclasses import dataclass
from math import factorial

import numpy as np
import pytest

from flatland2d.space import Plane
from restir_ref.transport.space import ball_volume, sphere_area
from tests.transport.lobe_cases import facing, stretch, views
from tests.transport.spaces import SEEING, SPACES
from tracer3d.space import Solid

every_space = pytest.mark.parametrize("name", SPACES)
every_seeing_space = pytest.mark.parametrize("name", SEEING)


def numbers(space, n=2000, seed=1):
    return np.random.default_rng(seed).random((space.d - 1, n))


def directions(space, n=2000, seed=2):
    w = np.random.default_rng(seed).normal(size=(space.d, n))
    return np.concatenate([w / np.linalg.norm(w, axis=0), np.eye(space.d), -np.eye(space.d)], axis=1)


@every_space
def test_frames_are_orthonormal_and_end_in_the_normal(name):
    space, n = SPACES[name], directions(SPACES[name])
    axes = np.stack([space.to_world(n, np.repeat(e[:, None], n.shape[1], axis=1)) for e in np.eye(space.d)])
    gram = np.einsum("adn,bdn->nab", axes, axes)
    assert np.abs(gram - np.eye(space.d)).max() < 1e-14
    assert np.abs(axes[-1] - n).max() < 1e-14


@every_space
def test_to_world_is_the_inverse_of_to_local(name):
    space, n = SPACES[name], directions(SPACES[name])
    w = n[:, ::-1]
    assert np.abs(space.to_world(n, space.to_local(n, w)) - w).max() < 1e-14
    assert np.abs(space.to_local(n, space.to_world(n, w)) - w).max() < 1e-14


def test_the_plane_s_frame_is_normal_and_the_normal_turned_clockwise():
    n = np.array([[0.6], [0.8]])
    assert np.allclose(SPACES["plane"].to_local(n, np.array([[0.8], [-0.6]])), [[1], [0]])


# ---------------------------------------------------------------- samplers


def ball_faults(space) -> dict[str, float]:
    """Distance of `ball` from uniform on the unit ball, and of `unball` from its inverse."""
    u = numbers(space)
    x = space.ball(u)
    return {
        "inside": max(np.linalg.norm(x, axis=0).max() - 1, 0),
        "stretch": np.abs(stretch(space.ball, u, 1e-6) / ball_volume(space.d) - 1).max(),
        "inverse": np.abs(space.unball(x) - u).max(),
    }


@every_space
def test_the_ball_is_sampled_uniformly_and_inverted(name):
    faults = ball_faults(SPACES[name])
    assert faults["inside"] < 1e-15
    assert faults["stretch"] < 1e-4
    assert faults["inverse"] < 1e-12


@every_space
def test_the_sphere_is_sampled_uniformly(name):
    space, u = SPACES[name], numbers(SPACES[name])
    assert np.abs(np.linalg.norm(space.sphere(u), axis=0) - 1).max() < 1e-15
    assert np.abs(stretch(space.sphere, u, 1e-6) / sphere_area(space.d) - 1).max() < 1e-4
    assert np.abs(space.sphere(numbers(space, 100_000)).mean(axis=1)).max() < 4 / np.sqrt(100_000 * space.d)


@every_space
def test_simplices_are_sampled_uniformly(name):
    space, u = SPACES[name], numbers(SPACES[name])
    b = space.simplex(u)
    assert b.min() >= 0
    assert b.sum(axis=0).max() <= 1
    assert np.abs(stretch(space.simplex, u, 1e-6) * factorial(space.d - 1) - 1).max() < 1e-4
    assert np.abs(space.simplex(numbers(space, 100_000)).mean(axis=1) - 1 / space.d).max() < 2 / np.sqrt(100_000)


def visible_faults(space) -> dict[str, float]:
    """Distance of `visible` from density max(0, m.v) 2 / (C_d (1 + v_z)) on the upper hemisphere, and its inverse."""
    u, v = numbers(space), views(space.d, 2000, np.random.default_rng(3))
    m = space.visible(u, v)
    density = facing(m, v) * 2 / (ball_volume(space.d) * (1 + v[-1]))
    return {
        "length": np.abs(np.linalg.norm(m, axis=0) - 1).max(),
        "below": max(-m[-1].min(), 0),
        "stretch": np.abs(stretch(lambda u: space.visible(u, v), u, 1e-6) * density - 1).max(),
        "inverse": np.abs(space.unvisible(m, v) - u).max(),
    }


@every_seeing_space
def test_visible_normals_of_the_hemisphere_are_sampled_by_their_projected_area_and_inverted(name):
    faults = visible_faults(SEEING[name])
    assert faults["length"] < 1e-14
    assert faults["below"] < 1e-14
    assert faults["stretch"] < 1e-4
    assert faults["inverse"] < 1e-12


@every_seeing_space
def test_visible_normals_hold_at_the_zenith_and_at_the_rim(name):
    space = SEEING[name]
    u = numbers(space)
    for v in (np.eye(space.d)[-1], np.eye(space.d)[0], -np.eye(space.d)[0]):
        view = np.repeat(v[:, None], u.shape[1], axis=1)
        m = space.visible(u, view)
        assert m[-1].min() > -1e-15
        assert (m * view).sum(axis=0).min() >= 0
        assert np.abs(space.unvisible(m, view) - u).max() < 1e-12


# ---------------------------------------------------------------- twins


class PolarDisk(Solid):
    """A mistake: radius u, without the root."""

    def ball(self, u):
        return u[0] * np.stack([np.cos(2 * np.pi * u[1]), np.sin(2 * np.pi * u[1])])


@dataclass(frozen=True)
class WholeRange(Plane):
    """A mistake: t uniform on [-1, 1], as if v saw the whole circle."""

    def _range(self, v):
        return -np.ones(v.shape[-1]), np.ones(v.shape[-1])


@dataclass(frozen=True)
class OneSided(Plane):
    """A mistake: the range of views from the right for views from the left, too."""

    def _range(self, v):
        return -np.ones(v.shape[-1]), v[1]


def test_a_ball_that_is_not_uniform_is_noticed():
    assert ball_faults(PolarDisk())["stretch"] > 0.5


@pytest.mark.parametrize("wrong", [WholeRange, OneSided])
def test_normals_that_are_not_visible_are_noticed(wrong):
    assert visible_faults(wrong())["below"] > 0.1
