"""What the laws of lobes are stated with: surfaces, directions, quadrature, and the stretch of a map."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from restir_ref.batch import Array
from restir_ref.transport.lobes import LOBES, Lobe
from restir_ref.transport.space import Space
from restir_ref.transport.vectors import dot
from tests.transport.spaces import SEEING, SPACES


@dataclass(frozen=True)
class Plain:
    """A surface whose numbers are given."""

    alpha: Array
    eta: Array


def plain(alpha: float = 0.3, eta: float = 1.5) -> Plain:
    return Plain(np.array([alpha]), np.array([eta]))


CONTINUOUS = {name: lobe for name, lobe in LOBES.items() if not lobe.delta}
DELTA = {name: lobe for name, lobe in LOBES.items() if lobe.delta}
CASES = [(space, name) for name in CONTINUOUS for space in (SPACES if name == "lambert" else SEEING)]
"""Every lobe with a density, in every dimension that can sample it."""

SURFACES = [plain(alpha, eta) for alpha in (0.0225, 0.15, 0.5, 1.0) for eta in (1.5, 1 / 1.5)]


@dataclass(frozen=True)
class Samples:
    """Views o, numbers u and the directions i sampled from them; none is lost."""

    space: Space
    s: Plain
    o: Array
    u: Array
    i: Array


def samples(lobe: Lobe, space: Space, s: Plain, n: int, seed: int) -> Samples:
    """At most n samples from random views."""
    rng = np.random.default_rng(seed)
    o, u = views(space.d, n, rng), rng.random((space.d - 1, n))
    i = lobe.sample(space, s, o, u)
    kept = np.flatnonzero(i[-1])
    return Samples(space, s, o[:, kept], u[:, kept], i[:, kept])


def views(d: int, n: int, rng: np.random.Generator) -> Array:
    """Uniform directions (d, n) above the surface."""
    w = rng.normal(size=(d, n))
    w[-1] = np.abs(w[-1])
    return w / np.linalg.norm(w, axis=0)


def tilted(d: int, cos: float, n: int = 1) -> Array:
    """n equal directions (d, n) with this cosine."""
    flat = np.linspace(1, 2, d - 1)
    w = np.append(flat / np.linalg.norm(flat) * np.sqrt(1 - cos**2), cos)
    return np.repeat(w[:, None], n, axis=1)


def stretch(f: Callable[[Array], Array], u: Array, h: float = 1e-7) -> Array:
    """sqrt(det J^T J) of f from (k, N) to (d, N), by central differences: the size of f's image per size of u."""
    columns = [(f(u + h * e[:, None]) - f(u - h * e[:, None])) / (2 * h) for e in np.eye(len(u))]
    return np.sqrt(np.linalg.det(np.einsum("adn,bdn->nab", columns, columns)))


def grid(k: int, n: int) -> Array:
    """Midpoints of n^k equal cells of the unit cube, (k, n^k)."""
    axis = (np.arange(n) + 0.5) / n
    return np.stack([each.reshape(-1) for each in np.meshgrid(*[axis] * k, indexing="ij")])


def integral(space: Space, f: Callable[[Array], Array], about: Array, n: int, reach: float = np.pi) -> float:
    """int f over directions within `reach` of a direction (d, 1), by midpoints that are dense about it; d = 2 or 3."""
    s = (np.arange(n) + 0.5) / n
    angle, size = reach * s**3, 3 * reach * s**2 / n
    turns = np.array([-1.0, 1.0]) if space.d == 2 else np.arange(n) / n * 2 * np.pi
    angle, turn = (each.reshape(-1) for each in np.meshgrid(angle, turns, indexing="ij"))
    if space.d == 2:
        local, weight = np.stack([turn * np.sin(angle), np.cos(angle)]), 1.0
    else:
        local = np.stack([np.sin(angle) * np.cos(turn), np.sin(angle) * np.sin(turn), np.cos(angle)])
        weight = np.sin(angle) * 2 * np.pi / n
    w = space.to_world(np.repeat(about, len(angle), axis=1), local)
    return float((f(w) * weight * np.repeat(size, len(turns))).sum())


def spread(o: Array, w: Array) -> Array:
    """o (d, 1) beside every direction of w."""
    return np.repeat(o, w.shape[-1], axis=1)


def facing(o: Array, m: Array) -> Array:
    """max(0, o.m)."""
    return np.maximum(dot(o, m), 0)
