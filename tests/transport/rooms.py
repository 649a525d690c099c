"""Scenes in any dimension, and rays against them by solving one linear system per ray and facet."""

import numpy as np

from restir_ref.batch import Array
from restir_ref.transport.materials import Layer, Material
from restir_ref.transport.scene import Ball, Facet, Scene, scene
from restir_ref.transport.space import Space

MATTE = Material([Layer("lambert", (0.5,))])


def facing_inwards(corners: Array, centre: Array) -> Array:
    """The corners (d, d) in an order whose front, det(edges, normal) > 0, looks at the centre."""
    edges = corners[1:] - corners[0]
    if np.linalg.det(np.concatenate([edges, (centre - corners[0])[None]])) < 0:
        corners = corners[[1, 0, *range(2, len(corners))]]
    return corners


def simplex(d: int) -> Array:
    """d + 1 corners (d + 1, d) of a lopsided simplex."""
    return np.concatenate([np.eye(d) * np.linspace(1, 1.7, d), [np.full(d, -0.2)]])


def walls(d: int, material: int = 0, emission: tuple[float, ...] = ()) -> list[Facet]:
    """The d + 1 facets of the simplex, fronts inside."""
    V = simplex(d)
    sides = [facing_inwards(np.delete(V, k, axis=0), V.mean(axis=0)) for k in range(d + 1)]
    return [Facet(side.tolist(), material, emission) for side in sides]


def room(space: Space, albedo: float = 0.5, emission: float = 1.0) -> Scene:
    """A closed room whose walls all emit."""
    return scene(space, [Material([Layer("lambert", (albedo,))])], walls(space.d, 0, (emission,)))


def soup(space: Space, seed: int, facets: int = 40, balls: int = 5) -> Scene:
    """Random facets and balls in the unit cube; the first facet emits."""
    rng = np.random.default_rng(seed)
    corners = rng.random((facets, space.d, space.d))
    lit = [Facet(each.tolist(), 0, (1.0,) if k == 0 else ()) for k, each in enumerate(corners)]
    round_ones = [
        Ball(c.tolist(), r) for c, r in zip(rng.random((balls, space.d)), 0.02 + 0.1 * rng.random(balls), strict=True)
    ]
    return scene(space, [MATTE], lit, round_ones)


def inside(scene: Scene, n: int, seed: int) -> Array:
    """Points (d, n) of the simplex that is a room."""
    d = scene.space.d
    return simplex(d).T @ np.random.default_rng(seed).dirichlet(np.ones(d + 1), n).T


def directions(d: int, n: int, seed: int) -> Array:
    """Uniform directions (d, n)."""
    w = np.random.default_rng(seed).normal(size=(d, n))
    return w / np.linalg.norm(w, axis=0)


def crossings(s: Scene, x: Array, w: Array) -> Array:
    """Every t > 1e-9 at which x + t w meets a primitive, inf elsewhere; (S + 2 B, n), balls twice: enter, leave."""
    v = np.moveaxis(s.corners, -1, 0)  # (S, corner, coordinate)
    edges = np.swapaxes(v[:, 1:] - v[:, :1], 1, 2)
    n, S, d = x.shape[1], s.S, s.space.d
    A = np.concatenate(
        [np.broadcast_to(edges, (n, S, d, d - 1)), np.broadcast_to(-w.T[:, None, :, None], (n, S, d, 1))], axis=3
    )
    solution = np.linalg.solve(A, (x.T[:, None] - v[None, :, 0])[..., None])[..., 0]  # (n, S, d)
    b, t = solution[..., :-1], solution[..., -1]
    facets = np.where((b >= 0).all(axis=-1) & (b.sum(axis=-1) <= 1) & (t > 1e-9), t, np.inf).T
    balls = [root for k in range(s.radii.size) for root in quadratic(x - s.centres[:, k : k + 1], w, s.radii[k, 0])]
    return np.concatenate([facets, np.reshape(balls, (-1, n))])


def quadratic(p: Array, w: Array, r: float) -> list[Array]:
    """Both positive roots of |p + t w|^2 = r^2, inf where there is none."""
    half, c = (p * w).sum(axis=0), (p * p).sum(axis=0) - r**2
    root = np.sqrt(np.where(half**2 > c, half**2 - c, np.nan))
    return [np.where(t > 1e-9, t, np.inf) for t in (-half - root, -half + root)]
