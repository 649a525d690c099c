"""How fine the judge's checks are: what of two records is compared; small errors and those of rare paths."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pytest

from restir_ref.batch import Array, take
from restir_ref.chance import Live
from restir_ref.integrals import Pixels, Shifted
from restir_ref.transport.paths import RECONNECTION, Path, Tracer
from restir_ref.transport.proofs import judge as judging
from restir_ref.transport.proofs import shift_checks, shift_identity, shift_slopes
from restir_ref.transport.proofs.inversion import primary_sample
from restir_ref.transport.proofs.judge import CHECKS, Shifting, judge
from restir_ref.transport.proofs.shift_checks import DERIVATIVES, Case, Effort, Trial, offender, same_path
from restir_ref.transport.proofs.shift_slopes import EXTREMES, STRATA, evenly, finite_differences, spread, stratum
from restir_ref.transport.restir_pt import PathIntegrals
from restir_ref.transport.shifts import shift_path
from tests.transport.paths import HYBRID, shifts
from tests.transport.test_judge import SETTINGS, tracer

RETURN, DEFINED, INVERSE, TRACED, AGAIN, SLOPE, MEANS = CHECKS
FEW = Effort(paths=4000, jacobians=80)


def red(of: PathIntegrals, checks: tuple[str, ...], seed: int = 1, effort: Effort = FEW) -> set[str]:
    """Which of these checks fail."""
    chance = Live(np.random.default_rng(seed))
    return set(judge(of, chance, effort, checks={name: CHECKS[name] for name in checks}).red)


# ---------------------------------------------------------------- what is compared


def connected(c: int) -> tuple[Case, Path]:
    """Paths of the glossy box that reconnect at x_c."""
    s = shifts(SETTINGS["glossy_cornell"](), HYBRID, 3000, seed=41)
    x, of = take(s.x, np.flatnonzero(s.x.c == c)), PathIntegrals(s.t)
    return Case(of, FEW, primary_sample, Live(np.random.default_rng(1)), Trial(x, s.i, s.J, x, s.j, s.J, x, s.J)), x


def noticed(case: Case, x: Path, **changes: Array) -> bool:
    """Whether a record with these changes is told from x in every column."""
    errors = np.stack([each.error for each in same_path(case, replace(x, **changes), x)])
    return bool((errors.max(axis=0) > 1).all())


@pytest.mark.parametrize("c", [2, 3])
def test_all_numbers_before_the_reconnection_are_compared_and_none_behind(c) -> None:
    case, x = connected(c)
    t = case.of.tracer
    fresh = t.sensor.numbers + 2 * t.scene.space.d * (c - 2)
    assert len(x.k) > 20
    for row in range(t.D):
        u = x.u.copy()
        u[row] += 1e-6
        assert noticed(case, x, u=u) == (row < fresh)


CHANGES: dict[str, Callable[[Path], Array]] = {
    "k": lambda x: x.k + 1,
    "nee": lambda x: ~x.nee,
    "c": lambda x: x.c + 1,
    "prim": lambda x: x.prim + 1,
    "lobe_in": lambda x: 1 - x.lobe_in,
    "lobe_out": lambda x: 1 - x.lobe_out,
    "z": lambda x: x.z + 1e-8,
    "A": lambda x: x.A * 1.00001,
    "F": lambda x: x.F * 1.00001,
}


@pytest.mark.parametrize("name", CHANGES)
def test_a_record_that_differs_in_anything_is_another_path(name) -> None:
    case, x = connected(2)
    assert noticed(case, x, **{name: CHANGES[name](x)})
    assert not noticed(case, x)


# ---------------------------------------------------------------- small errors


def off_by(share: float) -> Callable[[Tracer, Path, Array], tuple[Path, Array]]:
    """The density A of offset paths off by a share, and with it J."""

    def shift(t: Tracer, x: Path, pixel: Array) -> tuple[Path, Array]:
        y, J = shift_path(t, x, pixel)
        return replace(y, A=y.A * (1 + share)), J * (1 + share)

    return shift


@pytest.mark.parametrize("share", [1e-3, -1e-3, 3e-5])
@pytest.mark.parametrize("setting", ["glossy_cornell", "crease"])
def test_a_density_error_of_a_thousandth_and_less_is_convicted(setting, share) -> None:
    of = Shifting(tracer(setting, HYBRID), off_by(share))
    assert red(of, (RETURN, INVERSE, TRACED, SLOPE)) == {RETURN, INVERSE, TRACED, SLOPE}


def test_with_coarser_tolerances_it_would_pass(monkeypatch) -> None:
    for name in ("POSITIONS", "DENSITIES"):
        monkeypatch.setattr(shift_checks, name, 1e-2)
    assert not red(Shifting(tracer("glossy_cornell", HYBRID), off_by(1e-3)), (RETURN, INVERSE, TRACED))


@dataclass(frozen=True, eq=False)
class DoublyDim(PathIntegrals):
    """J is doubled on the way to the right where hardly any light arrives: p_hat(y) J / p_hat(x) below `dim`."""

    dim: float

    def shift(self, x: Path, index: Array, to: Pixels) -> Shifted:
        y = super().shift(x, index, to)
        dim = to.of.target(to.index, y.x) * y.J < self.dim * self.target(index, x)
        return Shifted(y.x, np.where(dim & (index < to.index), 2 * y.J, y.J))


@pytest.mark.parametrize("dim", [1e-3, 1e-5, 1e-7])
def test_errors_of_paths_that_carry_hardly_any_light_are_convicted(dim) -> None:
    assert red(DoublyDim(tracer("frosted", RECONNECTION), dim), (INVERSE,)) == {INVERSE}


def test_a_judge_who_leaves_them_out_does_not_see_them(monkeypatch) -> None:
    monkeypatch.setattr(judging, "NOTHING", 1e-6)
    assert not red(DoublyDim(tracer("frosted", RECONNECTION), 1e-7), (INVERSE,))


# ---------------------------------------------------------------- whose Jacobians are measured


def trial_of(J: Array, k: Array) -> Trial:
    """Paths that have nothing but J and k."""
    zero = np.zeros(len(J), dtype=int)
    x = Path(zero[None], k, zero > 0, zero, zero[None], *[zero] * 3, zero[None], zero[None], zero, zero, zero[None])
    return Trial(x, zero, J, x, zero, J, x, J)


def test_the_extremes_of_j_all_its_strata_and_all_kinds_are_among_those_measured() -> None:
    rng = np.random.default_rng(1)
    J = np.exp(np.concatenate([rng.normal(0, 0.1, 5000), rng.uniform(-8, 8, 200)]))
    k = np.where(np.arange(5200) % 1000 == 0, 3, 1)
    of = trial_of(J, k)
    chosen = spread(of, 120)
    assert len(np.unique(chosen)) == len(chosen) == 120
    assert set(np.argsort(J)[:EXTREMES]) | set(np.argsort(J)[-EXTREMES:]) <= set(chosen)
    assert np.bincount(stratum(J)[chosen], minlength=STRATA).min() >= 6
    assert {0, 1000, 2000} <= set(chosen[k[chosen] == 3])


def test_evenly_from_all_kinds_alone_leaves_strata_out() -> None:
    J = np.exp(np.concatenate([np.zeros(5000), np.linspace(-8, 8, 33)]))
    assert len(np.unique(stratum(J)[evenly(np.zeros(5033, dtype=int), 120)])) == 1
    assert len(np.unique(stratum(J)[spread(trial_of(J, np.ones(5033, dtype=int)), 120)])) == STRATA


@pytest.mark.parametrize("J", [np.ones(5), np.ones(1), np.zeros(0), np.array([1e-300, 1e300])])
def test_few_paths_or_one_jacobian_are_no_trouble(J) -> None:
    found = spread(trial_of(J, np.ones(len(J), dtype=int)), 4)
    assert sorted(found) == sorted({*range(len(J))} if len(J) < 5 else {*found})
    assert len(found) == min(len(J), 4)


def test_kinds_that_differ_in_where_they_reconnect_are_told_apart() -> None:
    J, c = np.exp(np.random.default_rng(2).normal(0, 0.1, 5000)), np.where(np.arange(5000) % 1000 == 0, 2, 0)
    of = trial_of(J, np.ones(5000, dtype=int))
    chosen = spread(replace(of, x=replace(of.x, c=c)), 120)
    assert {0, 1000, 2000} <= set(chosen[c[chosen] == 2])


@pytest.mark.parametrize("low", [-5, 0, 3])
def test_strata_of_log_j_are_equally_wide_wherever_it_begins(low) -> None:
    J = np.exp(low + np.linspace(0, 2, 10 * STRATA, endpoint=False))
    assert np.bincount(stratum(J), minlength=STRATA).tolist() == pytest.approx([10] * STRATA, abs=1)


def test_two_steps_cancel_the_error_that_grows_with_their_square(monkeypatch) -> None:
    """What remains is of fourth order: a stretch that is off by a h^2 is measured right."""
    J = np.linspace(0.5, 2, 50)
    case = Case(None, FEW, primary_sample, Live(np.random.default_rng(1)), trial_of(J, np.ones(50, dtype=int)))
    off = DERIVATIVES / 10
    monkeypatch.setattr(shift_slopes, "stretch", lambda case, at, h: at.J * (1 + off * (h / case.effort.step) ** 2))
    found = finite_differences(case)
    assert (found.tested, found.failed) == (50, 0)
    assert found.worst < 1e-6
    monkeypatch.setattr(shift_slopes, "stretch", lambda case, at, h: at.J * (1 + off * h / case.effort.step))
    assert finite_differences(case).worst > 1e-3


def test_an_offender_says_what_was_found_and_what_was_expected() -> None:
    said = offender(trial_of(np.ones(3), np.ones(3, dtype=int)), 1, "J", 0.25, 4.0)
    assert (said.what, said.found, said.expected) == ("J", 0.25, 4.0)


def halved(t: Tracer, x: Path, pixel: Array) -> tuple[Path, Array]:
    y, J = shift_path(t, x, pixel)
    return y, J / 2


def doubled(t: Tracer, x: Path, pixel: Array) -> tuple[Path, Array]:
    y, J = shift_path(t, x, pixel)
    return y, 2 * J


@pytest.mark.parametrize("wrong", [halved, doubled])
def test_who_offends_the_means_is_a_path_shifted_to_another_pixel(wrong) -> None:
    of = Shifting(tracer("glossy_cornell", HYBRID), wrong)
    found = judge(of, Live(np.random.default_rng(1)), FEW, checks={MEANS: CHECKS[MEANS]}).findings[MEANS]
    assert found.offender.i != found.offender.j


@pytest.mark.parametrize(("pixels", "reach", "apart"), [(40, 7, 7), (3, 7, 2)])
def test_means_compare_pixels_as_far_apart_as_was_asked_for_and_there_are(pixels, reach, apart, monkeypatch) -> None:
    asked = []

    def noted(n: int, distance: Array, chance: Live) -> tuple[Array, Array]:
        asked.extend(np.unique(distance))
        return shift_checks.pairs(n, distance, chance)

    monkeypatch.setattr(shift_identity, "pairs", noted)
    t = tracer("glossy_cornell", HYBRID)
    of = PathIntegrals(replace(t, sensor=replace(t.sensor, n=pixels)))
    judge(of, Live(np.random.default_rng(1)), Effort(paths=500, reach=reach), checks={MEANS: CHECKS[MEANS]})
    assert asked == [apart]
