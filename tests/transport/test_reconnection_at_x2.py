"""The literal reconnection shift: it connects to x_2, or leaves the path alone, and never replays."""

from dataclasses import replace

import numpy as np

from flatland2d import SCENES
from restir_ref import Pixels
from restir_ref.batch import Array
from restir_ref.transport.inversion import traced
from restir_ref.transport.paths import RECONNECTION
from restir_ref.transport.restir_pt import ReconnectionAtX2
from tests.transport.paths import Shifts, shifts


def glass(change=lambda t: t) -> Shifts:
    return shifts(SCENES["glass_disc"](), RECONNECTION, 20_000, seed=5, change=change)


def literal(s: Shifts) -> Array:
    """Its Jacobians of the same paths, (N,)."""
    of = ReconnectionAtX2(s.t)
    return of.shift(s.x, s.i, Pixels(of, s.j)).J


def test_it_refuses_what_only_replay_could_shift_and_else_is_the_reconnection_shift() -> None:
    s = glass()
    J, kept = literal(s), (s.x.c == 2) | ((s.x.k == 1) & s.x.nee)
    assert s.J[~kept].any()
    assert not J[~kept].any()
    assert J[kept].any()
    assert (J == s.J)[kept].all()


def test_light_seen_directly_is_shared() -> None:
    t = replace(glass().t, sensor=SCENES["cornell"]().pinhole(32), scene=SCENES["cornell"]().scene)
    of, pixel = ReconnectionAtX2(t), np.arange(32)
    x = traced(t, np.random.default_rng(1).random((t.D, 32)), pixel, np.zeros(32, dtype=int), np.zeros(32, dtype=bool))
    assert (of.shift(x, pixel, Pixels(of, pixel ^ 1)).J == 1).all()
