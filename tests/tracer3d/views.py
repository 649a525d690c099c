"""What the laws of this world are stated with: tracers of its scenes, images of replicas, pinholes at one point."""

import numpy as np

from restir_ref.batch import Array, take
from restir_ref.transport.paths import RECONNECTION, Connectability, Tracer, radiance, trace
from restir_ref.transport.proofs.inversion import traced
from restir_ref.transport.scene import Scene
from restir_ref.transport.shifts import shift_path
from tests.transport.paths import Shifts
from tracer3d import SCENES, Pinhole
from tracer3d.scenes import Setting

HYBRID = Connectability(0.2, 0.02)
RULES = {"hybrid": HYBRID, "reconnection": RECONNECTION}

AT_A_POINT = 1e-7
"""Tangent of half a field of view that is a point."""


def tracer(scene: str, rule: Connectability = HYBRID, size: int = 32) -> Tracer:
    """The scene's inset, size x size pixels."""
    setting = SCENES[scene]()
    return Tracer(setting.scene, setting.pinhole(size, size), setting.depth, rule)


def directed(eye: Array, towards: Array) -> Pinhole:
    """One pixel that sees one point."""
    up = (
        (0.0, 0.0, -1.0)
        if abs(towards[1] - eye[1]) > 0.99 * np.linalg.norm(np.subtract(towards, eye))
        else (0.0, 1.0, 0.0)
    )
    return Pinhole(tuple(eye), tuple(towards), 1, 1, AT_A_POINT, film=(1, 1), up=up)


def mean_and_error(x: Array) -> tuple[float, float]:
    """Mean and its standard error, (N,)."""
    return float(x.mean()), float(x.std(ddof=1) / np.sqrt(len(x)))


def seen(s: Scene, eye: Array, towards: Array, n: int, depth: int = 1, seed: int = 1) -> Array:
    """n estimates of the light (C, n) that reaches `eye` from the point `towards`."""
    t = Tracer(s, directed(eye, towards), depth, RECONNECTION)
    return radiance(trace(t, np.random.default_rng(seed).random((t.D, n)), np.zeros(n, dtype=int)))


def film_shifts(of: Setting, rule: Connectability, N: int, seed: int) -> Shifts:
    """Random leaves of random pixels of the whole film and their shifts to any others; only those with light."""
    t, rng = Tracer(of.scene, of.view(64, 36), of.depth, rule), np.random.default_rng(seed)
    i, j = rng.integers(t.sensor.n, size=(2, N))
    x = traced(t, rng.random((t.D, N)), i, rng.integers(1, of.depth + 1, N), rng.random(N) < 0.5)
    lit = np.flatnonzero(x.F.any(axis=0))
    x, i, j = take((x, i, j), lit)
    y, J = shift_path(t, x, j)
    return Shifts(t, x, i, y, j, J)
