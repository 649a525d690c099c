"""Shifts first of all: round trips, re-tracing from scratch, and finite differences, on every scene.

Image means are nearly blind to wrong Jacobians, for reuse is nearly symmetric; these laws are not.
"""

from dataclasses import replace

import numpy as np
import pytest

from flatland2d import PLANE, SCENES
from flatland2d.scenes import CORNELL_VIEW, LAMP, Setting, boxes, chain, room
from restir_ref.batch import take
from restir_ref.transport import shifts as shifts_module
from restir_ref.transport.materials import Layer, Material, evaluate_lobe
from restir_ref.transport.paths import Connectability
from restir_ref.transport.proofs.inversion import connection, primary_sample, traced
from restir_ref.transport.proofs.reading import extended_path
from restir_ref.transport.scene import scene
from restir_ref.transport.shifts import shift_path
from restir_ref.transport.vectors import norm
from tests.transport.furnished import FURNISHED, furnished_shifts
from tests.transport.paths import HYBRID, RULES, finite_difference_jacobian, retraced, shifts, successful
from tests.transport.returns import differing, differing_by_replay, nearest_connections

N = 1500
every_scene = pytest.mark.parametrize("scene", SCENES)
every_rule = pytest.mark.parametrize("rule", RULES)

FAR = ["glossy_cornell", "clear_coat"]
near_and_far = pytest.mark.parametrize(
    ("scene", "reach"),
    [*(pytest.param(s, 20, id=s) for s in SCENES), *(pytest.param(s, 400, id=f"{s}-far") for s in FAR)],
)
"""Pixels nearby, and others that often see another material, whose own random lobe would be another one."""

EDGE_CASES = 1e-3
"""Share of paths that floating point may decide differently there and back: grazing occlusion and corners."""


@pytest.mark.claims("GRIS-A09", "GRIS-A11", "GRIS-E35")
@every_rule
@every_scene
def test_a_shift_there_and_back_returns_the_path_with_inverse_jacobians(scene, rule) -> None:
    s = successful(shifts(SCENES[scene](), RULES[rule], N, seed=1))
    back, J = shift_path(s.t, s.y, s.i)
    returned = J > 0
    assert (~returned).mean() <= EDGE_CASES
    assert np.abs(s.J * J - 1)[returned].max(initial=0) < 1e-9
    assert np.abs(back.F / s.x.F - 1)[:, returned].max(initial=0) < 1e-9
    assert np.abs(back.A / s.x.A - 1)[returned].max(initial=0) < 1e-9
    assert differing(back, replace(s.x, F=back.F, A=back.A)) == set()


def lit(s):
    """The columns whose base path carries light: lost samples have no numbers to return to."""
    columns = np.flatnonzero(s.x.F.any(axis=0))
    return type(s)(s.t, take(s.x, columns), s.i[columns], take(s.y, columns), s.j[columns], s.J[columns])


def return_errors(s, y, pixel) -> tuple[np.ndarray, np.ndarray]:
    """How far T(y) in `pixel` is from x where it is defined: in primary numbers, and at the vertices they lead to.

    y is a path of its own, traced from u^y: nothing is left in its record of how it was found.
    """
    back, J = shift_path(s.t, y, pixel)
    u = primary_sample(s.t, y, s.j, s.t, back, pixel)
    base, again = (extended_path(s.t, *each, s.x.k, s.x.nee).x for each in ((s.x.u, s.i), (u, pixel)))
    errors = np.abs(u - s.x.u).max(axis=0), np.nan_to_num(np.abs(again - base)).max(axis=(0, 1))
    return errors[0][J > 0], errors[1][J > 0]


@pytest.mark.claims("GRIS-A09", "GRIS-A11")
@every_rule
@every_scene
def test_the_offset_path_traced_from_scratch_shifts_back_to_the_base_path_s_numbers_and_vertices(scene, rule) -> None:
    s = successful(shifts(SCENES[scene](), RULES[rule], N, seed=1))
    _, y = retraced(s)
    for errors in return_errors(s, y, s.i):
        assert len(errors) >= (1 - EDGE_CASES) * len(s.J)
        assert errors.max() < 1e-9


@pytest.mark.claims("GRIS-A09")
@pytest.mark.claims("GRIS-A09", part="a room of triangles", world="tracer3d")
@every_rule
@pytest.mark.parametrize("name", FURNISHED)
def test_it_does_so_in_rooms_of_any_dimension(name, rule) -> None:
    s = lit(successful(furnished_shifts(name, RULES[rule], 4000, seed=10)))
    _, y = retraced(s)
    for errors in return_errors(s, y, s.i):
        assert len(errors) >= (1 - EDGE_CASES) * len(s.J) > 500
        assert errors.max() < 1e-9


@pytest.mark.claims("GRIS-A09")
def test_an_offset_path_in_single_precision_or_shifted_to_another_pixel_does_not_return_the_base_path() -> None:
    s = successful(shifts(SCENES["cornell"](), RULES["reconnection"], N, seed=1))
    u, y = retraced(s)
    rounded = traced(s.t, u.astype(np.float32).astype(float), s.j, s.x.k, s.x.nee)
    for errors in return_errors(s, rounded, s.i):
        assert np.median(errors) > 1e-9
    _, apart = return_errors(s, y, s.i + 1)
    assert np.median(apart) > 1e-9


@pytest.mark.claims("GRIS-A11")
@pytest.mark.claims("GRIS-A17", part="stored numbers find the path")
@pytest.mark.parametrize("rule", ["hybrid", "reconnection"])
@near_and_far
def test_tracing_the_offset_path_from_scratch_finds_the_same_path(scene, reach, rule) -> None:
    s = successful(shifts(SCENES[scene](), RULES[rule], N, seed=2, reach=reach))
    _, y = retraced(s)
    same = np.abs(y.F / s.y.F - 1).max(axis=0) < 1e-9
    assert (~same).mean() <= EDGE_CASES
    assert (y.c == s.y.c)[same].all()
    assert np.abs(y.A / s.y.A - 1)[same].max(initial=0) < 1e-9


@pytest.mark.claims("GRIS-E53", "GRIS-E54")
@pytest.mark.parametrize("rule", ["hybrid", "reconnection"])
@every_scene
def test_the_jacobian_is_that_of_finite_differences(scene, rule) -> None:
    s = successful(shifts(SCENES[scene](), RULES[rule], 400, seed=3))
    error = jacobian_errors(s, s.J)
    assert np.median(error) < 1e-8
    assert np.quantile(error, 0.97) < 1e-5


def jacobian_errors(s, J) -> np.ndarray:
    """|finite difference / J - 1| of the first 150 paths, where no discrete choice changed."""
    few = np.arange(min(150, len(s.J)))
    part = type(s)(s.t, take(s.x, few), s.i[few], take(s.y, few), s.j[few], s.J[few])
    measured, same = finite_difference_jacobian(part)
    assert same.mean() > 0.3
    return np.abs(measured / J[few] - 1)[same]


def nearest(scene, rule, count=N) -> tuple[float, float]:
    """The shortest connection of all base paths, and of all offset paths."""
    return nearest_connections(successful(shifts(SCENES[scene](), rule, count, seed=4)))


@pytest.mark.claims("GRIS-A12")
@every_scene
def test_hybrid_connects_nothing_nearer_than_its_distance(scene) -> None:
    assert 0.01 <= HYBRID.distance / SCENES[scene]().scene.extent <= 0.05
    assert min(nearest(scene, HYBRID)) >= HYBRID.distance


NEAR = [("glossy_cornell", 0.02), ("crease", 0.05)]
"""Distances, in a scene of size 1, below which connections exist: the gap below the furniture of the crease is .03."""


@pytest.mark.claims("GRIS-A12")
@pytest.mark.parametrize(("scene", "d"), NEAR)
def test_base_and_offset_paths_connect_nearer_than_a_distance_only_where_none_is_demanded(scene, d) -> None:
    demanded, not_demanded = (Connectability(0.2, each) for each in (d, 0.0))
    assert min(nearest(scene, demanded, 8 * N)) >= d
    assert max(nearest(scene, not_demanded, 8 * N)) < d


def replayed(scene) -> tuple:
    """Shifts by pure replay, and the way back."""
    s = successful(shifts(SCENES[scene](), RULES["replay"], N, seed=5))
    return s, *shift_path(s.t, s.y, s.i)


@pytest.mark.claims("GRIS-A10")
@every_scene
def test_replay_back_is_bitwise_the_same_path(scene) -> None:
    s, back, J = replayed(scene)
    assert (s.J == 1).all()
    assert (J == 1).all()
    assert differing_by_replay(s, back) == set()


@pytest.mark.claims("GRIS-A10")
def test_replay_from_numbers_in_single_precision_is_another_path() -> None:
    s, back, _ = replayed("glossy_cornell")
    rounded = replace(back, u=back.u.astype(np.float32).astype(float))
    assert {"u", "F", "x", "w"} <= differing_by_replay(s, rounded)


@pytest.mark.claims("GRIS-A10")
def test_the_offset_path_is_another_one() -> None:
    s, _, _ = replayed("glossy_cornell")
    assert (s.y.F != s.x.F).mean() > 0.9
    base, offset = (extended_path(s.t, path.u, pixel, path.k, path.nee) for path, pixel in ((s.x, s.i), (s.y, s.j)))
    assert {"x", "w"} <= differing(base, offset)


# The twins: planted bugs, and which law sees them.


def reconnected(s):
    """The columns that reconnect at a vertex from which a BSDF sample goes on."""
    columns = np.flatnonzero((s.x.c > 0) & (s.x.c < s.x.k))
    return type(s)(s.t, take(s.x, columns), s.i[columns], take(s.y, columns), s.j[columns], s.J[columns])


def ends(s):
    """Distance, lobe probability and density of the outgoing direction at both paths' connections."""
    found = []
    for path, pixel in ((s.x, s.i), (s.y, s.j)):
        c = connection(s.t, path, pixel)
        columns = np.arange(len(pixel))
        local = s.t.scene.space.to_local(c.z.n, path.out)
        _, p_out = evaluate_lobe(s.t.scene.materials, s.t.scene.space, c.z, path.lobe_out, local)
        r, P = norm(path.z - c.v.x), c.P_in[path.lobe_in, columns]
        through = (path.c <= path.k) & ~(path.nee & (path.c == path.k))
        found.append((r, P, np.where(through, c.P_out[path.lobe_out, columns] * p_out, 1.0)))
    return found


PLANTED = {
    "r^2 in flatland": lambda x, y: x[0] / y[0],
    "J inverted in r": lambda x, y: (y[0] / x[0]) ** 2,
    "second density ratio dropped": lambda x, y: x[2] / y[2],
}


@pytest.mark.claims("GRIS-E52", "GRIS-E54")
@pytest.mark.parametrize("bug", PLANTED)
def test_finite_differences_see_a_planted_jacobian_bug_and_round_trips_do_not(bug) -> None:
    s = reconnected(successful(shifts(SCENES["glossy_cornell"](), RULES["reconnection"], 1500, seed=6)))
    x, y = ends(s)
    factor = PLANTED[bug](x, y)
    error = jacobian_errors(s, s.J * factor)
    assert np.quantile(error, 0.75) > 1e-4
    _, J_back = shift_path(s.t, s.y, s.i)
    product = (s.J * factor) * (J_back / factor)  # the bug is its own inverse on the way back
    assert np.abs(product - 1)[J_back > 0].max() < 1e-9


def never(rule, r_x, r_z, distance):
    """A mistake: the replayed prefix is not tested for an earlier connection."""
    return np.zeros(len(distance), dtype=bool)


@pytest.mark.claims("GRIS-A11")
def test_retracing_sees_a_missing_test_for_earlier_connections(monkeypatch) -> None:
    right = shifts_module._step
    monkeypatch.setattr(shifts_module, "_step", with_predicate(right, never))
    s = successful(shifts(SCENES["glossy_cornell"](), HYBRID, 12_000, seed=7))
    monkeypatch.undo()
    _, y = retraced(s)
    assert (y.c != s.y.c).mean() > EDGE_CASES


def with_predicate(step, predicate):
    def changed(*args):
        original, shifts_module.connectable = shifts_module.connectable, predicate
        try:
            return step(*args)
        finally:
            shifts_module.connectable = original

    return changed


def contrary() -> Setting:
    """A room whose first lobe is the glossy one, and whose lamp is a mirror: what is judged by the wrong lobe shows."""
    walls = Material([Layer("ggx", (0.4,), 0.1, weight=0.4), Layer("lambert", (0.5,), weight=0.6)])
    facets = [*room(0), *boxes(0), *chain(LAMP, 1, 8.0)]
    return Setting(scene(PLANE, [walls, Material([Layer("mirror", (0.5,))])], facets), *CORNELL_VIEW)


@pytest.mark.claims("GRIS-A13")
@every_rule
@pytest.mark.parametrize("scene", ["contrary", *SCENES])
def test_a_path_shifted_into_its_own_pixel_is_itself(scene, rule) -> None:
    setting = contrary() if scene == "contrary" else SCENES[scene]()
    s = shifts(setting, RULES[rule], 600, seed=8)
    y, J = shift_path(s.t, s.x, s.i)
    assert (J == 0).mean() <= 5 * EDGE_CASES
    assert np.abs(J - 1)[J > 0].max() < 1e-9
    assert np.abs(y.F / s.x.F - 1)[:, J > 0].max() < 1e-6


def composed(s, step, through=shift_path) -> np.ndarray:
    """Columns in which T_hr T_qh x and T_qr x, r = h + step, are not one path with one J, of those that are in h."""
    r = (s.j + step) % s.t.sensor.n
    (two, onward), (one, J) = through(s.t, s.y, r), through(s.t, s.x, r)
    same = np.isclose(two.F, one.F, rtol=1e-6, atol=0).all(axis=0) & np.isclose(s.J * onward, J, rtol=1e-6, atol=0)
    return ((J > 0) != (onward > 0)) | (J > 0) & ~same


@pytest.mark.claims("GPT-A05", part="images of a sample compose")
@every_rule
@every_scene
def test_two_shifts_one_after_the_other_are_the_shift_to_where_they_end(scene, rule) -> None:
    s = successful(shifts(SCENES[scene](), RULES[rule], N, seed=11))
    assert composed(s, 3).mean() <= EDGE_CASES


@pytest.mark.claims("GPT-A05", part="images of a sample compose", world="tracer3d")
@every_rule
@pytest.mark.parametrize("name", FURNISHED)
def test_two_shifts_are_one_in_rooms_of_any_dimension(name, rule) -> None:
    s = successful(furnished_shifts(name, RULES[rule], 4000, seed=12))
    assert composed(s, 1).mean() <= EDGE_CASES


def test_shifts_that_are_bounded_on_both_sides_do_not_compose() -> None:
    def careful(t, x, pixel):
        y, J = shift_path(t, x, pixel)
        return y, np.where((J >= 0.5) & (J <= 2), J, 0)

    s = furnished_shifts("solid", RULES["hybrid"], 4000, seed=12)
    s = successful(replace(s, J=np.where((s.J >= 0.5) & (s.J <= 2), s.J, 0)))
    assert composed(s, 1, careful).mean() > 10 * EDGE_CASES


@pytest.mark.claims("GRIS-A13")
@pytest.mark.parametrize("rule", ["hybrid", "reconnection"])
def test_glossy_first_lobes_and_mirror_lamps_are_retraced_alike(rule) -> None:
    s = successful(shifts(contrary(), RULES[rule], 12_000, seed=9))
    _, y = retraced(s)
    assert ((y.c != s.y.c) | (np.abs(y.F / s.y.F - 1).max(axis=0) > 1e-7)).mean() <= EDGE_CASES
    kinds = {(int(c - k), bool(nee)) for c, k, nee in zip(s.x.c, s.x.k, s.x.nee, strict=True) if c}
    assert {(1, False), (0, True), (0, False)} <= kinds
