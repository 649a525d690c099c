"""The judge acquits our shifts, in d = 2, 3 and 4, and convicts planted bugs; which check sees which is pinned."""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
import pytest

from flatland2d import PLANE, SCENES
from flatland2d.scenes import LAMP, Setting, chain, matte, room
from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.integrals import Pixels, Shifted
from restir_ref.transport.materials import Layer, Material
from restir_ref.transport.paths import REPLAY, Connectability, Path, Tracer
from restir_ref.transport.proofs import shift_slopes
from restir_ref.transport.proofs.copies import COPIES, Copying, unit_stretch
from restir_ref.transport.proofs.inversion import traced
from restir_ref.transport.proofs.judge import CHECKS, Judgement, Shifting, judge, report
from restir_ref.transport.proofs.shift_checks import FEWEST, Effort
from restir_ref.transport.proofs.zoo import WRONG_SHIFTS
from restir_ref.transport.restir_pt import PathIntegrals
from restir_ref.transport.scene import Ball, scene
from restir_ref.transport.shifts import shift_path
from tests.transport.furnished import FURNISHED, Places
from tests.transport.paths import HYBRID, RULES
from tests.transport.rooms import simplex, walls
from tests.transport.spaces import SPACES

BRIEF, THOROUGH = Effort(paths=5000, jacobians=80), Effort()


def frosted() -> Setting:
    """A disc of rough glass: lobes that are chosen by angle, and refraction that may be total."""
    layers = [Layer("rough reflection", (1.0,), 0.15), Layer("rough transmission", (1.0,), 0.15)]
    facets = [*room(0), *chain(LAMP, 0, 8.0)]
    s = scene(PLANE, [matte(0.6), Material(layers)], facets, [Ball((0.5, 0.25), 0.14, 1)])
    return Setting(s, (0.12, 0.45), (0.6, 0.0))


SETTINGS = {
    **{name: SCENES[name] for name in ("glossy_cornell", "glass_disc", "clear_coat", "crease")},
    "frosted": frosted,
}


def tracer(setting: str, rule: Connectability) -> Tracer:
    """The whole film."""
    s = SETTINGS.get(setting, SCENES.get(setting))()
    return Tracer(s.scene, s.pinhole(1920, 0), s.depth, rule)


def furnished(space: str, rule: Connectability) -> Tracer:
    """A coloured room with a ball of glass, in any dimension, seen from places beside each other."""
    d, where = SPACES[space].d, SPACES[space]
    facets = [replace(f, emission=(1.0, 2.0, 3.0) if n % 2 else ()) for n, f in enumerate(walls(d))]
    ball = Ball((simplex(d).mean(axis=0) + 0.1).tolist(), 0.07, 1)
    return Tracer(scene(where, FURNISHED[space], facets, [ball]), Places(where), 3, rule)


SHIFTS: Mapping[str, Callable[[Callable[[Connectability], Tracer]], PathIntegrals]] = {
    **{rule: lambda t, rule=rule: PathIntegrals(t(RULES[rule])) for rule in RULES},
    **{f"{name} copy": lambda t, name=name: Copying(t(HYBRID), COPIES[name]) for name in COPIES},
}
ALONE = {name: lambda t, name=name: Copying(t(REPLAY), COPIES[name]) for name in COPIES}
"""Reconnection, replay and hybrid; copies up to the connections of the hybrid shift; and copies that never connect."""


def judged(of: PathIntegrals, effort: Effort = BRIEF) -> Judgement:
    return judge(of, Live(np.random.default_rng(1)), effort)


@pytest.mark.claims("GRIS-A09", "GRIS-A21", "GRIS-E35", "GRIS-E52", "GRIS-E54")
@pytest.mark.parametrize("setting", SETTINGS)
@pytest.mark.parametrize("shift", SHIFTS)
def test_every_shift_of_ours_is_acquitted(shift, setting):
    found = judged(SHIFTS[shift](lambda rule: tracer(setting, rule)))
    assert found.green, report(found)


@pytest.mark.claims("GRIS-A21")
@pytest.mark.parametrize("space", ["frosted", "solid", "hyper"])
@pytest.mark.parametrize("copy", ALONE)
def test_copies_to_the_end_are_acquitted_in_any_dimension(copy, space):
    found = judged(ALONE[copy](lambda rule: furnished(space, rule) if space in SPACES else tracer(space, rule)))
    assert found.green, report(found)


@pytest.mark.claims("GRIS-A09", part="a room of triangles", world="tracer3d")
@pytest.mark.parametrize("rule", ["hybrid", "reconnection"])
@pytest.mark.parametrize("space", ["solid", "hyper"])
def test_so_is_reconnecting(space, rule):
    found = judged(PathIntegrals(furnished(space, RULES[rule])))
    assert found.green, report(found)


@pytest.mark.claims("GRIS-A11")
def test_all_of_100_000_hybrid_shifts_in_the_glossy_box_return():
    checks = {name: CHECKS[name] for name in ("there and back", "defined back", "inverse Jacobians")}
    of, chance = PathIntegrals(tracer("glossy_cornell", HYBRID)), Live(np.random.default_rng(2))
    found = judge(of, chance, Effort(paths=100_000), checks=checks).findings
    assert [each.failed for each in found.values()] == [0, 0, 0]
    assert found["defined back"].tested > 90_000


# The twins: what is convicted, and by which checks.

RETURN, DEFINED, INVERSE, TRACED, AGAIN, SLOPE, MEANS = CHECKS

CONVICTED = {
    "geometric Jacobian left out": ("frosted", "reconnection", {SLOPE, MEANS}),
    "inverted path Jacobian": ("frosted", "reconnection", {SLOPE, MEANS}),
    "distance to the power of another dimension": ("crease", "hybrid", {SLOPE}),
    "distances swapped": ("crease", "hybrid", {SLOPE, MEANS}),
    "cosines left out of the Jacobian": ("crease", "hybrid", {SLOPE, MEANS}),
    "lobe probability left out of the Jacobian": ("frosted", "reconnection", {SLOPE}),
    "second density ratio left out": ("frosted", "reconnection", {SLOPE, MEANS}),
    "light density of the base path kept": ("glossy_cornell", "hybrid", {RETURN, TRACED}),
    "MIS weight of the base path kept": ("glossy_cornell", "hybrid", {RETURN, TRACED}),
    "BSDF beyond the connection kept": ("glossy_cornell", "hybrid", {RETURN, TRACED, MEANS}),
    "no test for an earlier connection": ("frosted", "hybrid", {TRACED, AGAIN}),
    "connection tested for the base path only": ("frosted", "hybrid", {TRACED, AGAIN}),
    "connection through walls": ("glossy_cornell", "hybrid", {TRACED, AGAIN}),
    "large Jacobians refused one way": ("glossy_cornell", "hybrid", {DEFINED, MEANS}),
}
"""Bug -> scene, rule, and the checks that turn red: no more and no less."""


@pytest.mark.claims("GRIS-A11", "GRIS-C18", "GRIS-E35", "GRIS-E52", "GRIS-E54")
@pytest.mark.parametrize("bug", CONVICTED)
def test_a_planted_bug_is_convicted_by_the_checks_that_can_see_it(bug):
    scene_name, rule, checks = CONVICTED[bug]
    found = judged(WRONG_SHIFTS[bug].wrong(tracer(scene_name, RULES[rule])), THOROUGH)
    assert set(found.red) == checks


def test_every_wrong_shift_of_the_zoo_is_tried():
    assert set(WRONG_SHIFTS) <= set(CONVICTED)


@dataclass(frozen=True, eq=False)
class Forgetful(PathIntegrals):
    """Shifts what the numbers of a path would give in its own pixel, which after a reconnection is another path."""

    def shift(self, x: Path, index: Array, to: Pixels) -> Shifted:
        return super().shift(traced(self.tracer, x.u, index % self.n, x.k, x.nee), index, to)


@dataclass(frozen=True, eq=False)
class Unrecorded(Copying):
    """Copies, and leaves the base path's numbers in the record."""

    def shift(self, x: Path, index: Array, to: Pixels) -> Shifted:
        y = super().shift(x, index, to)
        return Shifted(replace(y.x, u=x.u), y.J)


def unrecorded(t: Tracer) -> Copying:
    """In the scenes below half vectors are copied at the first vertices."""
    return Unrecorded(t, COPIES["half vector"])


def taken_for_a_direction(t: Tracer) -> Copying:
    """The Jacobian d omega_m / d omega_i of the half vector is left out."""
    return Copying(t, replace(COPIES["half vector"], stretch=unit_stretch))


def test_numbers_replayed_after_a_reconnection_are_convicted():
    found = judged(Forgetful(tracer("glossy_cornell", HYBRID)), THOROUGH)
    assert set(found.red) == {RETURN, DEFINED, INVERSE, AGAIN, MEANS}


@pytest.mark.claims("GRIS-A21")
def test_copied_decisions_whose_numbers_are_not_recorded_are_convicted():
    found = judged(unrecorded(tracer("frosted", HYBRID)), THOROUGH)
    assert {RETURN, DEFINED, INVERSE, TRACED, AGAIN} <= set(found.red)


@pytest.mark.claims("GRIS-A21")
def test_half_vectors_taken_for_directions_are_convicted_but_for_mirrors_in_flatland():
    """There d omega = 2 dm on both sides."""
    assert SLOPE in judged(taken_for_a_direction(furnished("solid", REPLAY))).red
    assert SLOPE in judged(taken_for_a_direction(tracer("frosted", REPLAY))).red
    assert judged(taken_for_a_direction(tracer("glossy_cornell", REPLAY))).green


# Mistakes that few paths show.


def clamped(t: Tracer, x: Path, pixel: Array) -> tuple[Path, Array]:
    """J clamped to [.1, 10] both ways, so that J_ij J_ji = 1."""
    y, J = shift_path(t, x, pixel)
    return y, np.where(J > 0, np.clip(J, 0.1, 10), 0)


def clamped_close(t: Tracer, x: Path, pixel: Array) -> tuple[Path, Array]:
    """The same to [.5, 2]."""
    y, J = shift_path(t, x, pixel)
    return y, np.where(J > 0, np.clip(J, 0.5, 2), 0)


def test_a_limit_that_no_jacobian_of_the_scene_meets_is_not_seen_and_the_range_is_said():
    """In `nearly_closed` none is above 10 or below 0.1."""
    found = dim(20_000, lambda t: Shifting(t, clamped)).findings[SLOPE]
    assert found.answer == "green"
    low, high = map(float, re.findall(r"have it from ([\d.e-]+) to ([\d.e-]+)", found.where)[0])
    assert 0.1 < low < high < 10
    assert "limits beyond show in other scenes only" in found.where


@pytest.mark.claims("GRIS-A11")
@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("setting", ["glossy_cornell", "crease"])
def test_jacobians_clamped_both_ways_are_convicted_though_hardly_any_path_shows_it(setting, seed):
    t = tracer(setting, HYBRID)
    found = judge(Shifting(t, clamped), Live(np.random.default_rng(seed)), checks={SLOPE: CHECKS[SLOPE]})
    assert found.red == (SLOPE,)
    assert found.findings[SLOPE].where.startswith("J tested from 0.1 to ")
    assert re.search(r", 0\.1 in \d+ of them: a limit\?", found.findings[SLOPE].where)


def test_a_right_jacobian_is_not_taken_for_a_limit():
    found = judge(PathIntegrals(tracer("glossy_cornell", HYBRID)), Live(np.random.default_rng(1)), BRIEF)
    assert "a limit?" not in report(found)


def test_paths_taken_evenly_from_all_kinds_do_not_show_it(monkeypatch):
    monkeypatch.setattr(shift_slopes, "EXTREMES", 0)
    monkeypatch.setattr(shift_slopes, "stratum", lambda J: np.zeros(len(J), dtype=int))
    t = tracer("crease", HYBRID)
    assert judge(Shifting(t, clamped), Live(np.random.default_rng(1)), checks={SLOPE: CHECKS[SLOPE]}).green


def test_the_report_says_which_jacobians_were_tested():
    of, chance = PathIntegrals(tracer("glossy_cornell", HYBRID)), Live(np.random.default_rng(1))
    text = report(judge(of, chance, THOROUGH, checks={SLOPE: CHECKS[SLOPE]}))
    (low, high), (least, most) = (map(float, each) for each in re.findall(r"from ([\d.e-]+) to ([\d.e-]+)", text))
    assert least <= low < 0.001
    assert 5 < high <= most


# Light that is replayed from a cache.


def replayed(t: Tracer, x: Path, pixel: Array) -> tuple[Path, Array]:
    """The offset path carries the light that was stored with the base path; all else is right."""
    y, J = shift_path(t, x, pixel)
    return replace(y, F=np.where(J > 0, x.F, 0)), J


@pytest.mark.claims("GRIS-A11")
@pytest.mark.parametrize("setting", ["glossy_cornell", "crease"])
def test_light_replayed_from_a_cache_is_convicted_by_tracing_and_not_by_its_jacobian(setting):
    """There and back it returns, F and all; J is that of the shift."""
    found = judged(Shifting(tracer(setting, HYBRID), replayed), THOROUGH)
    assert {TRACED, AGAIN} <= set(found.red)
    assert {RETURN, DEFINED, INVERSE, SLOPE} & set(found.red) == set()
    worst = found.findings[TRACED].offender
    assert worst.what == "p_hat"
    text = report(found)
    assert text.startswith(f"WRONG: {TRACED}, {AGAIN}")
    assert f"p_hat: found {worst.found:.9g}, expected {worst.expected:.9g}" in text


def test_light_traced_anew_is_acquitted():
    """Twin: the same shift, which keeps the F of the offset path."""
    found = judged(Shifting(tracer("glossy_cornell", HYBRID), shift_path), THOROUGH)
    assert found.green, report(found)


# Refusals, and a stranger's function.


def half_of_them(x: Path, i: Array, j: Array) -> Array:
    """A hash of what the shift keeps, the film number, and of both pixels whichever comes first."""
    return (97 * x.u[0] + 0.618 * (i + j) + 0.414 * np.abs(i - j)) % 1 < 0.5


def refusing(allowed: Callable[[Path, Array, Array], Array]) -> type[PathIntegrals]:
    """Integrals whose shift is undefined where it is not allowed."""

    class Refusing(PathIntegrals):
        def shift(self, x: Path, index: Array, to: Pixels) -> Shifted:
            y = super().shift(x, index, to)
            return Shifted(y.x, y.J * allowed(x, index, to.index))

    return Refusing


@pytest.mark.claims("GRIS-C18")
def test_what_is_refused_both_ways_is_acquitted_and_what_is_refused_one_way_is_not():
    t, upwards = tracer("clear_coat", HYBRID), lambda x, i, j: half_of_them(x, i, j) | (i < j)
    assert judged(refusing(half_of_them)(t), THOROUGH).green
    assert set(judged(refusing(upwards)(t), THOROUGH).red) == {DEFINED, MEANS}


def test_a_function_of_tracer_path_and_pixel_can_be_plugged_in():
    t = tracer("clear_coat", HYBRID)
    own, theirs = judged(PathIntegrals(t)), judged(Shifting(t, shift_path))
    assert theirs.findings == own.findings
    assert theirs.green


def test_primary_samples_can_be_supplied():
    of, chance = PathIntegrals(tracer("clear_coat", HYBRID)), Live(np.random.default_rng(1))
    found = judge(of, chance, BRIEF, numbers=lambda tx, x, i, ty, y, j: x.u)
    assert {TRACED, SLOPE} <= set(found.red)


# Reports.


def test_a_report_names_the_law_and_the_path_that_breaks_it():
    of = WRONG_SHIFTS["inverted path Jacobian"].wrong(tracer("frosted", HYBRID))
    found = judged(of)
    worst = found.findings[SLOPE].offender
    y = of.shift(worst.x, worst.i, Pixels(of, worst.j))
    assert y.J == worst.J == worst.found
    text = report(found)
    assert f"RED       {SLOPE}: J = |det du^y / du^x|" in text
    assert f"pixel {worst.i[0]} -> {worst.j[0]}, k = {worst.x.k[0]}" in text
    assert f"found {worst.found:.9g}, expected {worst.expected:.9g}" in text
    assert all(name in text for name in ("x_1  (", "y_1  (", "roughness", *CHECKS))


# Three answers.


def dim(paths: int, of: Callable[[Tracer], PathIntegrals] = PathIntegrals) -> Judgement:
    """A shift in a room that hardly any light reaches."""
    return judged(of(tracer("nearly_closed", HYBRID)), Effort(paths=paths, jacobians=40))


def test_too_few_paths_acquit_nobody_and_accuse_nobody():
    found = dim(50)
    assert (found.red, found.undecided, found.green, found.status) == ((), tuple(CHECKS), False, 3)
    assert report(found).startswith("UNDECIDED: there and back, ")


def test_what_is_undecided_says_what_it_takes_and_that_suffices():
    found = dim(20_000)
    assert (found.red, found.undecided) == ((), (MEANS,))
    (paths,) = re.findall(r"Effort\(paths=([\d_]+)\)", found.findings[MEANS].needs)
    assert int(paths) > 20_000
    assert dim(int(paths)).green
    assert f"needs more: {found.findings[MEANS].needs}" in " ".join(report(found).split())


def test_a_wrong_shift_is_red_also_where_other_checks_are_undecided():
    found = dim(20_000, lambda t: Shifting(t, clamped_close))
    assert (found.red, found.undecided, found.status) == ((SLOPE,), (MEANS,), 1)
    assert report(found).startswith(f"WRONG: {SLOPE}\n")


def test_a_right_shift_is_green_and_says_so_first():
    found = judged(PathIntegrals(tracer("clear_coat", HYBRID)))
    assert (found.green, found.status) == (True, 0)
    assert report(found).startswith("right, as far as it was tested\n")


def test_a_few_that_fail_are_red_though_too_few_to_acquit():
    found = dim(150, lambda t: Shifting(t, lambda t, x, pixel: (x, np.full(len(pixel), 2.0))))
    assert found.findings[INVERSE].tested < FEWEST
    assert INVERSE in found.red


@pytest.mark.parametrize(
    ("step", "said"), [(0.2, "another step, such as Effort(step=0.02)"), (1e-5, "")], ids=["coarse", "fine"]
)
def test_differences_that_depend_on_their_step_are_undecided(step, said):
    of, effort = PathIntegrals(tracer("frosted", RULES["reconnection"])), replace(BRIEF, step=step)
    found = judge(of, Live(np.random.default_rng(1)), effort, checks={SLOPE: CHECKS[SLOPE]}).findings[SLOPE]
    assert found.undecided == bool(said)
    assert said in found.needs
    assert "paths have it from" in found.where


def test_what_cannot_be_judged_is_said():
    t = tracer("clear_coat", HYBRID)
    one = replace(t, sensor=SCENES["clear_coat"]().pinhole(1))
    with pytest.raises(ValueError, match="two pixels"):
        judged(PathIntegrals(one))
    with pytest.raises(ValueError, match="Jacobian J"):
        judged(Shifting(t, lambda t, x, pixel: (x, np.full(len(pixel), -1.0))))
