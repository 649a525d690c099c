"""One estimator in two measures: over directions p_hat, W and J are other numbers, their product and the image are not.

The twin in `direction_measure` evaluates whole paths from their vertices and knows nothing of records and suffixes.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np
import pytest

from flatland2d import SCENES
from restir_ref import Live, Pixels, initial, shade, spatial
from restir_ref.batch import Array, ratio
from restir_ref.loop import random_in_row
from restir_ref.transport.paths import Tracer, trace
from restir_ref.transport.proofs import direction_measure
from restir_ref.transport.proofs.direction_measure import (
    DirectionIntegrals,
    Walk,
    primary_jacobian,
    replay_jacobian,
    shift_walk,
    walk,
)
from restir_ref.transport.proofs.reading import ALL, DELTA, NONE, ExtendedPath, extended_path
from restir_ref.transport.rays import GRAZING
from restir_ref.transport.restir_pt import PathIntegrals
from tests.transport.furnished import FURNISHED, furnished_shifts
from tests.transport.lobe_cases import stretch
from tests.transport.paths import RULES, Shifts, shifts

every_scene = pytest.mark.parametrize("scene", SCENES)
every_rule = pytest.mark.parametrize("rule", RULES)
"""Hybrid, reconnection, and pure replay."""

MATTE = ["matte_cornell", "ajar", "nearly_closed", "crease", "occluders", "checker", "rack", "furnace", "many_lights"]
"""The scenes without any lobe but Lambert's."""


@dataclass(frozen=True)
class Both:
    """Base paths, offset paths and Jacobians in both measures: s in primary numbers, (x, y, J) in directions."""

    s: Shifts
    x: Walk
    y: Walk
    J: Array


def both(s: Shifts) -> Both:
    x = walk(s.t, extended_path(s.t, s.x.u, s.i, s.x.k, s.x.nee))
    return Both(s, x, *shift_walk(s.t, x, s.j))


@cache
def shifted(scene: str, rule: str, N: int = 1000, seed: int = 21) -> Both:
    return both(shifts(SCENES[scene](), RULES[rule], N, seed))


def lit(b: Both) -> Array:
    """Where both shifts are defined and the offset path carries light, not at a grazing angle."""
    return (b.s.J > 0) & (b.J > 0) & b.s.y.F.any(axis=0) & ~grazing(b, b.x.x.k + 1)


def grazing(b: Both, i: Array) -> Array:
    """Whether a path meets x_i at an angle that is 0 up to rounding: there cosines are clamped, see `GRAZING`."""
    k = np.arange(len(b.J))
    return np.minimum(b.x.of.cos[i, k], b.y.of.cos[i, k]) <= 10 * GRAZING


def weight_errors(b: Both, J_primary: Array) -> Array:
    """Relative difference of p_hat W J: F 1 J in primary numbers, (omega f) (1 / p) J in directions."""
    primary, directions = b.s.y.F.mean(axis=0) * J_primary, ratio(b.y.f.mean(axis=0), b.x.p) * b.J
    return np.abs(ratio(directions, primary) - 1)[lit(b)]


@pytest.mark.claims("GRIS-E54")
@every_rule
@every_scene
def test_selection_weights_are_the_same_in_both_measures(scene, rule) -> None:
    b = shifted(scene, rule)
    assert lit(b).sum() >= 10
    assert weight_errors(b, b.s.J).max() < 1e-10


@every_rule
@every_scene
def test_a_shift_that_carries_light_is_defined_in_both_measures_or_in_none(scene, rule) -> None:
    b = shifted(scene, rule)
    assert (b.x.c == b.s.x.c).all()
    bright = b.s.y.F.any(axis=0) | b.y.f.any(axis=0)
    assert ((b.J > 0) == (b.s.J > 0))[bright].all()


@pytest.mark.claims("GRIS-E54")
@every_rule
@every_scene
def test_the_chain_rule_turns_one_jacobian_into_the_other(scene, rule) -> None:
    b = shifted(scene, rule)
    J = primary_jacobian(b.s.t.scene.space.d, b.x, b.y)
    assert np.abs(ratio(J, b.s.J) - 1)[lit(b)].max() < 1e-10
    assert rule != "replay" or (np.abs(J - 1)[lit(b)] < 1e-10).all()


def without_second_ratio(b: Both) -> Array:
    """A mistake: the density of the direction leaving x_c counts as copied, like the direction."""
    k, c = np.arange(len(b.J)), b.x.c
    goes_on = (c > 0) & (c <= b.x.x.k) & (b.x.x.lobe[c, k] >= 0)
    return ratio(b.s.J, np.where(goes_on, ratio(b.y.of.p, b.x.of.p)[c, k], 1.0))


def without_lobe_shares(b: Both) -> Array:
    """A mistake: densities at the reconnection lack the probability of the lobe."""
    k, before = np.arange(len(b.J)), np.maximum(b.x.c - 1, 0)
    return ratio(b.s.J, np.where(b.x.c > 0, ratio(b.y.of.P, b.x.of.P)[before, k], 1.0))


def in_area(b: Both) -> Array:
    """A mistake: the Jacobian of directions where that of primary numbers belongs."""
    return b.J


CAUGHT = [
    ("glossy_cornell", "hybrid", without_second_ratio),
    ("glossy_cornell", "reconnection", without_second_ratio),
    ("cornell", "hybrid", without_second_ratio),
    ("matte_cornell", "reconnection", in_area),
    ("clear_coat", "replay", in_area),
]


@pytest.mark.claims("GRIS-E54")
@pytest.mark.parametrize(("scene", "rule", "wrong"), CAUGHT)
def test_selection_weights_see_a_wrong_density_ratio(scene, rule, wrong) -> None:
    b = shifted(scene, rule)
    assert (weight_errors(b, wrong(b)) > 1e-3).mean() > 0.01


@pytest.mark.claims("GRIS-E54")
@pytest.mark.parametrize("rule", ["hybrid", "reconnection"])
@pytest.mark.parametrize("scene", MATTE)
def test_lambert_s_second_ratio_is_one(scene, rule) -> None:
    """cos / C_d depends on the copied direction only: on these scenes nothing can notice the omission."""
    b = shifted(scene, rule)
    assert weight_errors(b, without_second_ratio(b)).max() < 1e-10


# ---------------------------------------------------------------- replay, by finite differences


def scattered(t: Tracer, u: Array, pixel: Array, i: int, numbers: Array) -> Array:
    """The direction that a BSDF sample takes at x_i if its own numbers (d-1, N) are replaced."""
    changed = u.copy()
    t.direction_numbers(changed, i)[:] = numbers
    return trace(t, changed, pixel).at[i - 1].w


def lighted(t: Tracer, u: Array, pixel: Array, i: int, numbers: Array) -> Array:
    """The direction that light sampling takes at x_i if the numbers (d-1, N) of the point are replaced."""
    changed = u.copy()
    t.light_numbers(changed, i)[1][:] = numbers
    return trace(t, changed, pixel).lights[i - 1][1]


def smooth(b: Both, i: int) -> Array:
    """Where both paths leave x_i in a direction, by the same lobe, and not by a delta lobe."""
    t, same = b.s.t, (b.x.x.lobe[i] != NONE) & (b.x.x.lobe[i] == b.y.x.lobe[i])
    same &= ~grazing(b, np.full(len(b.J), i + 1))
    return same & b.y.x.seen[: i + 1].all(axis=0) & ~delta(t, b.x.x, i) & ~delta(t, b.y.x, i)


def delta(t: Tracer, x: ExtendedPath, i: int) -> Array:
    """Whether a delta lobe leaves x_i."""
    table = t.scene.materials
    row = t.scene.material[x.prim[i]] * table.L + np.maximum(x.lobe[i], 0)
    return DELTA[table.kind[row]] & (x.lobe[i] >= 0)


def replay_errors(b: Both, i: int, J: Array) -> Array:
    """|finite difference / J - 1| of |dw_y / dw_x| at x_i with lobe and v held, away from the ends of its numbers."""
    t, found = b.s.t, []
    for turn, numbers, here in (
        (scattered, t.direction_numbers(b.s.x.u, i), b.x.x.lobe[i] >= 0),
        (lighted, t.light_numbers(b.s.x.u, i)[1], b.x.x.lobe[i] == ALL),
    ):
        columns = np.flatnonzero(smooth(b, i) & here & (np.abs(numbers - 0.5) < 0.499).all(axis=0))
        u, v = b.s.x.u[:, columns], numbers[:, columns]
        per_number = [
            stretch(lambda v, turn=turn, at=at, u=u: turn(t, u, at, i, v), v) for at in (b.s.i[columns], b.s.j[columns])
        ]
        found.append(np.abs(per_number[1] / per_number[0] / J[i, columns] - 1))
    return np.concatenate(found)


def of_the_lobe_alone(b: Both) -> Array:
    """p_x / p_y without the lobes' probabilities, which v takes."""
    return replay_jacobian(b.x.of, b.y.of) * ratio(b.y.of.P, b.x.of.P)


@pytest.mark.claims("GRIS-E53")
@every_scene
def test_replay_turns_directions_by_the_ratio_of_densities(scene) -> None:
    b = shifted(scene, "replay")
    errors = np.concatenate([replay_errors(b, i, of_the_lobe_alone(b)) for i in range(1, 4)])
    assert len(errors) > 10
    assert errors.max() < 1e-4


@pytest.mark.claims("GRIS-E53")
def test_finite_differences_see_the_ratio_inverted() -> None:
    b = shifted("glossy_cornell", "replay")
    assert np.quantile(replay_errors(b, 2, ratio(np.ones(()), of_the_lobe_alone(b))), 0.75) > 1e-3


# ---------------------------------------------------------------- whole images


def images(scene: str, rule: str, n: int = 32, replicas: int = 8) -> list[Array]:
    """Every column's estimate after one pass of spatial reuse, in primary numbers and over directions; chance alike."""
    setting = SCENES[scene]()
    t, found = Tracer(setting.scene, setting.pinhole(n, 900), setting.depth, RULES[rule]), []
    for of in (PathIntegrals(t), DirectionIntegrals(t)):
        here, chance = Pixels(of, np.arange(n * replicas)), Live(np.random.default_rng(22))
        X = initial(here, chance)
        found.append(shade(spatial(X, here, random_in_row(of, here.index, 3, 20, chance), chance), here))
    return found


def image_error(pair: list[Array]) -> float:
    """Largest relative difference of an estimate; one that is lit in one measure only counts as 1."""
    primary, directions = pair
    return float((np.abs(primary - directions) / np.maximum(primary, np.where(primary > 0, 0, 1))).max())


@pytest.mark.claims("GRIS-A14")
@every_rule
@pytest.mark.parametrize("scene", SCENES)
def test_restir_has_the_same_images_over_directions(scene, rule) -> None:
    assert image_error(images(scene, rule)) < 1e-9


def test_images_notice_a_density_without_the_lobe_s_probability(monkeypatch) -> None:
    monkeypatch.setattr(direction_measure, "density", lambda of: (of.p / of.P).prod(axis=0))
    assert image_error(images("clear_coat", "hybrid")) > 0.1


# ---------------------------------------------------------------- other dimensions


@cache
def elsewhere(name: str, rule: str) -> Both:
    return both(furnished_shifts(name, RULES[rule], 3000, 23))


@every_rule
@pytest.mark.parametrize("name", FURNISHED)
def test_selection_weights_are_the_same_in_both_measures_of_any_dimension(name, rule) -> None:
    b = elsewhere(name, rule)
    assert lit(b).sum() > 100
    assert weight_errors(b, b.s.J).max() < 1e-10


@pytest.mark.claims("GRIS-E54")
@pytest.mark.parametrize("name", ["plane", "solid"])
def test_selection_weights_see_a_density_without_the_lobe_s_probability(name) -> None:
    """Fresnel's term makes the shares of glass depend on the view."""
    b = elsewhere(name, "reconnection")
    assert (weight_errors(b, without_lobe_shares(b)) > 1e-2).sum() > 5
