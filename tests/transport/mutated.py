"""Reservoirs whose paths have a history of reuse, and what the laws of mutations are stated with."""

from dataclasses import dataclass, fields

import numpy as np

from flatland2d import SCENES
from restir_ref.batch import Array, ratio, take
from restir_ref.chance import Live
from restir_ref.integrals import Pixels, Reservoirs
from restir_ref.loop import random_in_row
from restir_ref.restir import initial, spatial
from restir_ref.transport.mutations import ByNumbers, FarPath, TwoRays, far_record
from restir_ref.transport.paths import Path, Tracer, leaves, trace
from restir_ref.transport.proofs.reading import ExtendedPath, Factors, contribution, extended_path, factors
from restir_ref.transport.rays import vertex
from restir_ref.transport.record import record, record_from
from restir_ref.transport.retracing import direction_number, own_numbers
from restir_ref.transport.vectors import normalize
from tests.transport.paths import RULES

PIXELS = 128
STEP = ByNumbers(0.1)
"""Long steps: paths change, and many are rejected."""


def tracer(scene: str, rule: str = "hybrid") -> Tracer:
    setting = SCENES[scene]()
    return Tracer(setting.scene, setting.pinhole(PIXELS), setting.depth, RULES[rule])


def reused(of, replicas: int, seed: int, trees: int = 4) -> tuple[Reservoirs, Pixels]:
    """Reservoirs after spatial reuse, of as many images."""
    here, chance = Pixels(of, np.arange(replicas * of.n)), Live(np.random.default_rng(seed))
    X = initial(here, chance, trees)
    return spatial(X, here, random_in_row(of, here.index, 3, 20, chance), chance), here


@dataclass(frozen=True)
class Moves:
    """Paths x of pixels i, proposals x' that are valid and carry light, and T."""

    t: Tracer
    i: Array
    x: FarPath
    x_new: FarPath
    T: Array


def moves(of: TwoRays, X: Reservoirs, here: Pixels, seed: int) -> Moves:
    """One proposal of every reservoir."""
    x_new, T = of.propose(here.index, X.x, Live(np.random.default_rng(seed)))
    valid = np.flatnonzero((T > 0) & x_new.F.any(axis=0))
    return Moves(of.tracer, here.index[valid] % of.n, take(X.x, valid), take(x_new, valid), T[valid])


def steep(m: Moves, least: float = 1e-3) -> Array:
    """Which moves are away from grazing angles and from vertices in one place, where digits are lost; (N,) bool."""
    found = np.ones(len(m.T), dtype=bool)
    for x in (m.x, m.x_new):
        _, of = factored(m.t, own(m.t, x, m.i), m.i, x)
        found &= (of.cos.min(axis=0) > least) & (of.r.min(axis=0) > least)
    return found


def own(t: Tracer, x: Path, i: Array, seed: int = 9) -> Array:
    """The primary samples of their own pixels."""
    return own_numbers(t, x, i, Live(np.random.default_rng(seed)))


def retraced_far(t: Tracer, u: Array, i: Array, x: Path) -> tuple[FarPath, Path]:
    """The leaf of x traced from u: its record, and its record as if x_(c+1) were to be reconnected to."""
    tree = trace(t, u, i)
    F = np.zeros((t.scene.C, len(i)))
    for k, nee, value in leaves(tree):
        F = np.where((x.k == k) & (x.nee == nee), value, F)
    near = record(t, tree, x.k, x.nee, F)
    far = record_from(t, tree, (x.k, x.nee), np.clip(near.c + 1, 2, t.depth + 1), F)
    return far_record(t, tree, (x.k, x.nee), F), far


def retraced_acceptance(m: Moves) -> Array:
    """p_hat(x') / p_hat(x) T from densities of paths traced from scratch, none of which `mutations` has computed."""
    (a, far_a), (b, far_b) = (retraced_far(m.t, own(m.t, x, m.i), m.i, x) for x in (m.x, m.x_new))
    joined = (m.x.c <= m.x.k) & ~(m.x.nee & (m.x.c == m.x.k))
    return b.F.mean(axis=0) / a.F.mean(axis=0) * np.where(joined, ratio(far_b.A, far_a.A), 1)


def factored(t: Tracer, u: Array, i: Array, x: Path) -> tuple[ExtendedPath, Factors]:
    """The path traced from u, factor by factor."""
    path = extended_path(t, u, i, x.k, x.nee)
    return path, factors(t, path)


def over_areas(m: Moves) -> Array:
    """a = [p_hat(y') / q(y_i')] / [p_hat(y) / q(y_i)] with p_hat and q = p_rho g over areas.  [MCMC 4.1, 5.2.3]"""
    d, found = m.t.scene.space.d, []
    for x in (m.x, m.x_new):
        path, of = factored(m.t, own(m.t, x, m.i), m.i, x)
        g = of.cos / of.r ** (d - 1)
        columns = np.arange(len(x.k))
        q = of.p[x.c - 1, columns] * g[x.c, columns]
        found.append((contribution(path, of).mean(axis=0) * g[1:].prod(axis=0)) / q)
    return found[1] / found[0]


def same_fields(a: Path, b: Path, names=None) -> float:
    """The largest difference of two records, u left out, relative to 1 + |b|."""
    kept = names or [each.name for each in fields(Path) if each.name != "u"]
    pairs = [(np.asarray(getattr(a, name), float), np.asarray(getattr(b, name), float)) for name in kept]
    return max(float((np.abs(one - other) / (1 + np.abs(other))).max(initial=0)) for one, other in pairs)


def measured_ratio(m: Moves, h: float = 1e-6) -> Array:
    """|du' / du| of the numbers u of the direction from x_c to x_(c+1), as x_(c+1) moves over its facet and x_c rests.

    By central differences of inverted directions; columns must be joined to x_(c+1), on a facet.
    """
    s = m.t.scene
    first, *others = (corner.take(m.x.far_prim, axis=-1) for corner in s.corners)
    edges = [other - first for other in others]
    found = []
    for x in (m.x, m.x_new):
        z = vertex(s, x.z, x.prim, -normalize(x.z - start(m, x)))
        sides = [[normalize(x.far_z + by * edge - z.x) for by in (h, -h)] for edge in edges]
        ends = [[direction_number(m.t, z, x.lobe_out, w) for w in pair] for pair in sides]
        matrix = np.stack([(one - other) / (2 * h) for one, other in ends])
        found.append(np.abs(np.linalg.det(np.moveaxis(matrix, -1, 0))))
    return found[1] / found[0]


def start(m: Moves, x: Path) -> Array:
    """x_(c-1), (d, N)."""
    path = extended_path(m.t, own(m.t, x, m.i), m.i, x.k, x.nee)
    return np.stack([path.x[c - 1, :, n] for n, c in enumerate(x.c.tolist())]).T
