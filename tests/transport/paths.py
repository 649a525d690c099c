"""Paths of chosen leaves, and re-tracing from scratch: what the laws of shifts are stated with."""

from dataclasses import dataclass

import numpy as np

from flatland2d.scenes import Setting
from restir_ref.batch import Array, take
from restir_ref.transport.paths import RECONNECTION, REPLAY, Connectability, Path, Tracer
from restir_ref.transport.proofs.inversion import primary_sample, traced
from restir_ref.transport.shifts import shift_path

HYBRID = Connectability(0.2, 0.02)
RULES = {"hybrid": HYBRID, "reconnection": RECONNECTION, "replay": REPLAY}


@dataclass(frozen=True)
class Shifts:
    """Base paths x of pixels i, and their offset paths y in pixels j with Jacobians J."""

    t: Tracer
    x: Path
    i: Array
    y: Path
    j: Array
    J: Array


def shifts(setting: Setting, rule: Connectability, N: int, seed: int, reach: int = 20, change=lambda t: t) -> Shifts:
    """Random leaves of random pixels of the full film and their shifts to pixels nearby; only those with light."""
    rng = np.random.default_rng(seed)
    t = change(Tracer(setting.scene, setting.pinhole(1920, 0), setting.depth, rule))
    i = rng.integers(reach, 1920 - reach, N)
    j = i + rng.integers(1, reach + 1, N) * rng.choice([-1, 1], N)
    k = rng.integers(1, setting.depth + 1, N)
    x = traced(t, rng.random((t.D, N)), i, k, rng.random(N) < 0.5)
    lit = np.flatnonzero(x.F.any(axis=0))
    x, i, j = take(x, lit), i[lit], j[lit]
    y, J = shift_path(t, x, j)
    return Shifts(t, x, i, y, j, J)


def successful(s: Shifts) -> Shifts:
    """The columns whose shift is defined and carries light."""
    columns = np.flatnonzero((s.J > 0) & s.y.F.any(axis=0))
    return Shifts(s.t, take(s.x, columns), s.i[columns], take(s.y, columns), s.j[columns], s.J[columns])


def retraced(s: Shifts) -> tuple[Array, Path]:
    """u^y, and the path that tracing it from scratch finds."""
    u = primary_sample(s.t, s.x, s.i, s.t, s.y, s.j)
    return u, traced(s.t, u, s.j, s.x.k, s.x.nee)


def finite_difference_jacobian(s: Shifts, h: float = 1e-6) -> tuple[Array, Array]:
    """|det du^y / du^x| by central differences, and the columns in which no discrete choice changed."""
    D, N = s.x.u.shape
    matrix, same = np.zeros((N, D, D)), np.ones(N, dtype=bool)
    for k in range(D):
        ends = []
        for sign in (1, -1):
            u = s.x.u.copy()
            u[k] += sign * h
            x = traced(s.t, u, s.i, s.x.k, s.x.nee)
            y, J = shift_path(s.t, x, s.j)
            same &= (J > 0) & (x.c == s.x.c) & (x.prim == s.x.prim)
            same &= (x.lobe_in == s.x.lobe_in) & (x.lobe_out == s.x.lobe_out) & (u[k] > 0) & (u[k] < 1)
            ends.append(primary_sample(s.t, x, s.i, s.t, y, s.j))
        matrix[:, :, k] = (ends[0] - ends[1]).T / (2 * h)
    return np.abs(np.linalg.det(matrix)), same
