"""The literal reconnection shift: it connects to x_2, or leaves the path alone, and never replays."""

import numpy as np

from flatland2d import SCENES
from restir_ref import Pixels
from restir_ref.batch import Array
from restir_ref.transport.paths import RECONNECTION, Tracer
from restir_ref.transport.proofs.inversion import traced
from restir_ref.transport.restir_pt import ReconnectionAtX2
from tests.transport.paths import Shifts, shifts


def literal(s: Shifts) -> Array:
    """Its Jacobians of the same paths, (N,)."""
    of = ReconnectionAtX2(s.t)
    return of.shift(s.x, s.i, Pixels(of, s.j)).J


def test_it_refuses_what_only_replay_could_shift_and_else_is_the_reconnection_shift() -> None:
    s = shifts(SCENES["glass_disc"](), RECONNECTION, 20_000, seed=5)
    J, kept = literal(s), (s.x.c == 2) | ((s.x.k == 1) & s.x.nee)
    assert s.J[~kept].any()
    assert not J[~kept].any()
    assert J[kept].any()
    assert (J == s.J)[kept].all()


def test_light_seen_directly_is_shared() -> None:
    setting, pixel = SCENES["cornell"](), np.arange(32)
    t = Tracer(setting.scene, setting.pinhole(32), setting.depth, RECONNECTION)
    of = ReconnectionAtX2(t)
    x = traced(t, np.random.default_rng(1).random((t.D, 32)), pixel, np.zeros(32, dtype=int), np.zeros(32, dtype=bool))
    assert (of.shift(x, pixel, Pixels(of, pixel ^ 1)).J == 1).all()
