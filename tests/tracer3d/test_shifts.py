"""Shifts in every scene in space return, replay to the bit, connect nothing near, and are the identity at home."""

from dataclasses import replace

import numpy as np
import pytest

from restir_ref.chance import Live
from restir_ref.transport import shifts as shifts_module
from restir_ref.transport.paths import Connectability
from restir_ref.transport.proofs.inversion import traced
from restir_ref.transport.proofs.judge import CHECKS, Effort, Judgement, judge
from restir_ref.transport.proofs.reading import extended_path
from restir_ref.transport.restir_pt import PathIntegrals
from restir_ref.transport.shifts import shift_path
from tests.tracer3d.views import RULES, film_shifts, tracer
from tests.transport.paths import REPLAY, Shifts, successful
from tests.transport.returns import differing, differing_by_replay, nearest_connections
from tracer3d import SCENES

N = 3000
every_scene = pytest.mark.parametrize("scene", SCENES)
every_rule = pytest.mark.parametrize("rule", RULES)
EDGE_CASES = 1e-3
"""Share of paths that floating point may decide differently there and back: grazing occlusion and corners."""


# ---------------------------------------------------------------- there and back


@pytest.mark.claims("GRIS-A09", world="tracer3d")
@every_rule
@every_scene
def test_a_shift_there_and_back_returns_the_path_with_inverse_jacobians(scene, rule) -> None:
    s = successful(film_shifts(SCENES[scene](), RULES[rule], N, seed=1))
    back, J = shift_path(s.t, s.y, s.i)
    returned = J > 0
    assert (~returned).mean() <= EDGE_CASES
    assert np.abs(s.J * J - 1)[returned].max(initial=0) < 1e-9
    assert np.abs(back.F - s.x.F)[:, returned].max(initial=0) <= 1e-9 * s.x.F.max()
    assert differing(back, replace(s.x, F=back.F, A=back.A)) == set()


def test_a_jacobian_of_the_wrong_way_does_not_undo_itself() -> None:
    s = successful(film_shifts(SCENES["cornell"](), RULES["reconnection"], N, seed=1))
    assert np.abs(s.J * s.J - 1)[s.x.c > 0].max() > 0.1


RETURNS, FRESH = ("there and back", "defined back", "inverse Jacobians"), "traced from scratch"


def returned(count: int) -> Judgement:
    """What the judge says of so many hybrid shifts of the glossy box, and of their offset paths traced anew."""
    of, checks = PathIntegrals(tracer("glossy_cornell")), {name: CHECKS[name] for name in (*RETURNS, FRESH)}
    return judge(of, Live(np.random.default_rng(2)), Effort(paths=count), checks=checks)


@pytest.mark.claims("GRIS-A11", world="tracer3d")
def test_all_of_100_000_hybrid_shifts_in_the_glossy_box_return() -> None:
    found = returned(100_000)
    assert found.green
    assert [found.findings[name].failed for name in RETURNS] == [0, 0, 0]
    assert found.findings["defined back"].tested > 50_000


def never(rule: Connectability, r_x, r_z, distance):
    """A mistake: the replayed prefix is not tested for an earlier connection."""
    return np.zeros(len(distance), dtype=bool)


@pytest.mark.claims("GRIS-A11", world="tracer3d")
def test_without_a_test_for_earlier_connections_their_offset_paths_connect_there(monkeypatch) -> None:
    """The record says that nothing connects, so that it returns; traced anew it does not."""
    right = shifts_module._step

    def unchecked(*args):
        original, shifts_module.connectable = shifts_module.connectable, never
        try:
            return right(*args)
        finally:
            shifts_module.connectable = original

    monkeypatch.setattr(shifts_module, "_step", unchecked)
    assert returned(20_000).red == (FRESH,)


# ---------------------------------------------------------------- replay


def replayed(scene: str) -> tuple[Shifts, object, np.ndarray]:
    """Shifts by pure replay, and the way back."""
    s = successful(film_shifts(SCENES[scene](), REPLAY, 10 * N, seed=5))
    return s, *shift_path(s.t, s.y, s.i)


@pytest.mark.claims("GRIS-A10", world="tracer3d")
@every_scene
def test_replay_back_is_bitwise_the_same_path(scene) -> None:
    s, back, J = replayed(scene)
    assert len(J) > 10
    assert (s.J == 1).all()
    assert (J == 1).all()
    assert differing_by_replay(s, back) == set()


@pytest.mark.claims("GRIS-A10", world="tracer3d")
def test_the_offset_path_and_one_from_numbers_in_single_precision_are_others() -> None:
    s, back, _ = replayed("glossy_cornell")
    rounded = replace(back, u=back.u.astype(np.float32).astype(float))
    assert {"u", "F", "x", "w"} <= differing_by_replay(s, rounded)
    base, offset = (extended_path(s.t, path.u, pixel, path.k, path.nee) for path, pixel in ((s.x, s.i), (s.y, s.j)))
    assert {"x", "w"} <= differing(base, offset)


# ---------------------------------------------------------------- distance


def nearest(scene: str, rule: Connectability) -> tuple[float, float]:
    """The shortest connection of all base paths, and of all offset paths."""
    return nearest_connections(successful(film_shifts(SCENES[scene](), rule, 10 * N, seed=4)))


@pytest.mark.claims("GRIS-A12", world="tracer3d")
@every_scene
def test_hybrid_connects_nothing_nearer_than_its_distance(scene) -> None:
    assert 0.01 <= RULES["hybrid"].distance / SCENES[scene]().scene.extent <= 0.05
    assert min(nearest(scene, RULES["hybrid"])) >= RULES["hybrid"].distance


@pytest.mark.claims("GRIS-A12", world="tracer3d")
@pytest.mark.parametrize(("scene", "d"), [("glass_ball", 0.05), ("crease", 0.05)])
def test_base_and_offset_paths_connect_nearer_than_a_distance_only_where_none_is_demanded(scene, d) -> None:
    assert min(nearest(scene, Connectability(0.2, d))) >= d
    assert max(nearest(scene, Connectability(0.2, 0.0))) < d


# ---------------------------------------------------------------- at home


@pytest.mark.claims("GRIS-A13", part="a path shifted into its own pixel", world="tracer3d")
@every_rule
@every_scene
def test_a_path_shifted_into_its_own_pixel_is_itself(scene, rule) -> None:
    s = film_shifts(SCENES[scene](), RULES[rule], N, seed=8)
    y, J = shift_path(s.t, s.x, s.i)
    assert (J == 0).mean() <= 5 * EDGE_CASES
    assert np.abs(J - 1)[J > 0].max() < 1e-9
    assert np.abs(y.F - s.x.F)[:, J > 0].max() <= 1e-9 * s.x.F.max()


def test_a_path_shifted_elsewhere_is_not() -> None:
    s = film_shifts(SCENES["cornell"](), RULES["reconnection"], N, seed=8)
    at_home = traced(s.t, s.x.u, s.i, s.x.k, s.x.nee)
    assert (np.abs(s.y.F - at_home.F).max(axis=0)[s.J > 0] > 1e-6 * s.x.F.max()).mean() > 0.5
    assert (np.abs(s.J - 1)[s.J > 0] > 1e-6).mean() > 0.3
