"""The reconnection Jacobian in directions, |cos_y / cos_x| (r_x / r_y)^(d-1), by finite differences.  [GRIS Eq. 52]

The rays that are turned meet walls and a ball in d = 2, 3 and 4; the Jacobian is the code's own, once as
`direction_measure` has it, once as J = A(y) / A(x) of `shifts` brought to directions by dw = du / p.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np
import pytest

import tracer3d
from flatland2d import SCENES
from restir_ref.batch import Array, ratio, take
from restir_ref.integrals import Pixels, Shifted
from restir_ref.transport.paths import RECONNECTION
from restir_ref.transport.proofs.direction_measure import Walk, reconnection_jacobian, shift_walk, walk
from restir_ref.transport.proofs.reading import extended_path
from restir_ref.transport.proofs.zoo import WRONG_SHIFTS
from restir_ref.transport.proofs.zoo.ends import both_ends
from restir_ref.transport.proofs.zoo.shifts import left_out
from restir_ref.transport.restir_pt import PathIntegrals
from restir_ref.transport.vectors import norm, normalize
from tests.tracer3d.views import film_shifts
from tests.transport.furnished import furnished_shifts
from tests.transport.paths import RULES, Shifts, shifts, successful
from tests.transport.spaces import SPACES

BOXES = ["glossy_cornell", "glass_ball"]
"""Scenes of tracer3d besides the rooms."""
every_dimension = pytest.mark.parametrize("name", [*SPACES, *BOXES])

CONFIGURATIONS = 200
STEP = 1e-4
"""How far x_c moves, in units of the shorter connection and of the smaller cosine."""
GRAZED = 0.01
"""Cosines below which so short a step is lost in rounding; random ones in the rooms are above .06."""


@dataclass(frozen=True)
class Reconnected:
    """Pairs of paths that share x_c, in both measures, and |dw_y / dw_x| by turning the ray from x_(c-1)."""

    s: Shifts
    x: Walk
    y: Walk
    measured: Array


@cache
def reconnected(name: str) -> Reconnected:
    """The first random configurations whose connection stands and does not graze, on one primitive as the ray turns."""
    if name in BOXES:
        s = film_shifts(tracer3d.SCENES[name](), RECONNECTION, 20_000, seed=31)
    else:
        s = furnished_shifts(name, RECONNECTION, 4000, seed=31)
    s = columns(s, np.flatnonzero((s.x.c > 0) & (s.J > 0) & (s.i != s.j) & s.x.F.any(axis=0)))
    x = walk(s.t, extended_path(s.t, s.x.u, s.i, s.x.k, s.x.nee))
    y, J = shift_walk(s.t, x, s.j)
    measured, same = turned(s, x, y)
    kept = np.flatnonzero(same & (J > 0))[:CONFIGURATIONS]
    return Reconnected(columns(s, kept), take(x, kept), take(y, kept), measured[kept])


def columns(s: Shifts, k: Array) -> Shifts:
    return Shifts(s.t, take(s.x, k), s.i[k], take(s.y, k), s.j[k], s.J[k])


def turned(s: Shifts, x: Walk, y: Walk) -> tuple[Array, Array]:
    """|det dw_y / dw_x| (N,) in tangents of both directions, and where every turned ray met x_c's primitive."""
    n = np.arange(len(x.c))
    at_x, at_y, z = (each[c, :, n].T for each, c in ((x.x.x, x.c - 1), (y.x.x, x.c - 1), (x.x.x, x.c)))
    r_x, r_y, w = norm(z - at_x), norm(z - at_y), normalize(z - at_x)
    cosines = np.minimum(x.of.cos[x.c, n], y.of.cos[x.c, n])
    h = STEP * np.minimum(r_x, r_y) / r_x * cosines**2
    across_x, across_y = tangents(w), tangents(normalize(z - at_y))
    d, same = len(z), cosines > GRAZED
    matrix = np.empty((len(n), d - 1, d - 1))
    for k in range(d - 1):
        ends = []
        for sign in (1, -1):
            ray = normalize(w + sign * h * across_x[k])
            t, prim = s.t.scene.intersect(at_x, ray)
            same &= prim == x.x.prim[x.c, n]
            ends.append(normalize(at_x + np.where(same, t, r_x) * ray - at_y))
        matrix[:, :, k] = np.einsum("kdn,dn->nk", across_y, (ends[0] - ends[1]) / (2 * h))
    return np.abs(np.linalg.det(matrix)), same


def tangents(w: Array) -> Array:
    """d - 1 orthonormal directions across each w (d, N), (d-1, d, N)."""
    return np.moveaxis(np.linalg.svd(w.T[:, None])[2][:, 1:], 0, -1)


def at_connection(J: Array, c: Array) -> Array:
    """The entries of (K, N) that belong to the connections."""
    return J[c, np.arange(len(c))]


def in_directions(r: Reconnected, J: Array) -> Array:
    """dw_y / dw_x = du_y / du_x times p_x / p_y from x_(c-1) on, for du = p dw on either side.  [GRIS Eq. 54]"""
    on = np.arange(len(r.x.x.x))[:, None] >= r.x.c - 1
    p_x, p_y = (np.where(on, each.of.p, 1).prod(axis=0) for each in (r.x, r.y))
    return np.asarray(J * ratio(p_x, p_y))


JACOBIANS: dict[str, Callable[[Reconnected], Array]] = {
    "over directions": lambda r: at_connection(reconnection_jacobian(r.s.t.scene.space.d, r.x.of, r.y.of), r.x.c),
    "of the shift": lambda r: in_directions(r, r.s.J),
}


def errors(name: str, J: Callable[[Reconnected], Array]) -> Array:
    """|J / finite difference - 1|, one per configuration."""
    r = reconnected(name)
    assert len(r.measured) == CONFIGURATIONS
    return np.abs(J(r) / r.measured - 1)


@pytest.mark.parametrize("name", ["plane", "solid"])
def test_configurations_reconnect_on_flat_walls_and_on_a_round_ball(name) -> None:
    r = reconnected(name)
    assert set(at_connection(r.x.x.prim, r.x.c) >= r.s.t.scene.S) == {False, True}


@pytest.mark.claims("GRIS-E52")
@pytest.mark.claims("GRIS-E52", world="tracer3d")
@every_dimension
@pytest.mark.parametrize("J", JACOBIANS)
def test_the_reconnection_jacobian_is_that_of_finite_differences(J, name) -> None:
    assert errors(name, JACOBIANS[J]).max() < 1e-5


def wrong_shift(bug: str) -> Callable[[Reconnected], Array]:
    """The Jacobian of a wrong shift of the same paths."""

    def J(r: Reconnected) -> Array:
        of = WRONG_SHIFTS[bug].wrong(r.s.t)
        assert isinstance(of, PathIntegrals)
        return in_directions(r, of.shift(r.s.x, r.s.i, Pixels(of, r.s.j)).J)

    return J


WRONG: dict[str, Callable[[Reconnected], Array]] = {
    "power d over directions": lambda r: at_connection(
        reconnection_jacobian(r.s.t.scene.space.d + 1, r.x.of, r.y.of), r.x.c
    ),
    "x and y swapped over directions": lambda r: at_connection(
        reconnection_jacobian(r.s.t.scene.space.d, r.y.of, r.x.of), r.x.c
    ),
    "another power in the shift": wrong_shift("distance to the power of another dimension"),
    "inverted shift": wrong_shift("inverted path Jacobian"),
    "distances swapped in the shift": wrong_shift("distances swapped"),
}
"""Among them r^2 in flatland."""


@pytest.mark.claims("GRIS-E52")
@pytest.mark.claims("GRIS-E52", world="tracer3d")
@every_dimension
@pytest.mark.parametrize("mistake", WRONG)
def test_a_wrong_power_of_the_distance_or_swapped_ends_are_caught(mistake, name) -> None:
    assert np.median(errors(name, WRONG[mistake])) > 1e-3


@pytest.mark.parametrize("scene", ["glossy_cornell", "clear_coat"])
def test_the_ends_that_the_zoo_falsifies_give_the_jacobian_itself(scene):
    s = successful(shifts(SCENES[scene](), RULES["hybrid"], 3000, seed=51))
    of = PathIntegrals(s.t)
    columns, x, y = both_ends(of, s.x, s.i, Shifted(s.y, s.J), Pixels(of, s.j))
    assert len(columns) > 100
    np.testing.assert_allclose(left_out(2, x, y), 1 / s.J[columns], rtol=1e-6)
