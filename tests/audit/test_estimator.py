"""A stranger's estimator is unbiased, or biased in a cell by so much and like some bug, or cannot be audited."""

from dataclasses import FrozenInstanceError
from types import SimpleNamespace

import numpy as np
import pytest

from restir_ref.audit import CannotAudit, audit_estimator, estimator, rehearsal
from restir_ref.audit.engines import ENGINES
from restir_ref.audit.estimator import TOLERANCE
from restir_ref.audit.known import known_signatures
from restir_ref.audit.likeness import lookalikes
from restir_ref.integrals import Pixels, Reservoirs
from restir_ref.mis import ALL_CANONICAL, WEIGHTS, Confidences
from restir_ref.oracle.cells import Frame, cells
from restir_ref.oracle.scenes import (
    Scene,
    normalised,
    paired,
    reference_scene,
    spatial_loop,
    three_pixel_scene,
    two_frame_loop,
)
from restir_ref.oracle.zoo import BUGS, INEFFICIENT, exact_bias
from restir_ref.restir import initial
from tests.audit.strangers import SCENE, UNAUDITABLE, one_over_M, returning, right

UNBIASED = {**{name: mis for name, mis in WEIGHTS.items() if mis.unbiased_for != ALL_CANONICAL}, **ENGINES}


def test_a_right_estimator_written_by_hand_is_unbiased() -> None:
    report = audit_estimator(right, SCENE)
    assert report.unbiased
    assert abs(report.bias).max() < 1e-14
    assert report.lookalikes == ()
    assert str(report).startswith("unbiased in every cell")


@pytest.mark.parametrize("mis", UNBIASED.values(), ids=UNBIASED)
@pytest.mark.parametrize("scene", [reference_scene(), three_pixel_scene()], ids=["two pixels", "three pixels"])
def test_every_promising_weight_passes_the_audit(mis, scene) -> None:
    assert audit_estimator(spatial_loop(scene, mis, 2), scene).unbiased


@pytest.mark.parametrize("mis", ENGINES.values(), ids=ENGINES)
def test_the_weights_of_engines_are_unbiased_over_two_frames(mis) -> None:
    for cap in (1, np.inf):
        assert audit_estimator(two_frame_loop(SCENE, mis, mis, cap), SCENE).unbiased


@pytest.mark.parametrize("bug", INEFFICIENT.values(), ids=INEFFICIENT)
def test_what_is_only_inefficient_passes_the_audit(bug) -> None:
    scene = bug.scene()
    assert audit_estimator(bug.wrong(scene), scene).unbiased


def test_a_planted_bug_is_told_with_pixel_cell_sign_and_name() -> None:
    report = audit_estimator(one_over_M, SCENE)
    assert not report.unbiased
    np.testing.assert_allclose(report.bias, [[0, 0, 0, -0.5], [-0.5, 0, 0, -0.5]], atol=1e-14)
    np.testing.assert_allclose(report.mean, [-0.2, -0.25])
    assert report.worst == (0, 3, pytest.approx(-0.5))
    assert "1/M over unequal supports" in [each.bug for each in report.lookalikes]
    for words in ("-50.00% in cell 3 of pixel 0", "exact over 34 outcomes", '"1/M over unequal supports"'):
        assert words in str(report)


def test_every_bug_of_the_zoo_that_shows_on_a_scene_is_recognised_by_its_signature() -> None:
    biases = {name: exact_bias(bug.wrong(SCENE), SCENE) for name, bug in BUGS.items()}
    shown = {name: bias for name, bias in biases.items() if abs(bias).max() > TOLERANCE}
    known = known_signatures(SCENE, TOLERANCE)
    named = {name: [each.bug for each in lookalikes(bias, known, TOLERANCE)] for name, bias in shown.items()}
    assert len(shown) > 30
    assert [name for name, bugs in named.items() if name not in bugs] == []


def test_no_other_bug_has_the_signature_of_a_missing_jacobian() -> None:
    bias = exact_bias(BUGS["Jacobian left out"].wrong(SCENE), SCENE)
    named = lookalikes(bias, known_signatures(SCENE, TOLERANCE), TOLERANCE)
    assert [each.bug for each in named] == ["Jacobian left out"]


def test_a_bias_like_no_bug_is_said_to_be_like_none() -> None:
    report = audit_estimator(
        returning(lambda X: Reservoirs(X.x, X.W * (1 + 0.3 * (X.x == 2) - 0.1 * (X.x == 0)), X.c)), SCENE
    )
    assert report.lookalikes == ()
    assert report.worst[1:] == (2, pytest.approx(0.3))


def test_a_bias_outside_of_the_support_is_found() -> None:
    """Weight on a cell of zero target integrates what no f on the support can see."""

    def unselected(index, chance):
        ((x, W),) = SCENE.now.candidates(index, chance)
        return Reservoirs(x, W, np.ones(len(index)))

    report = audit_estimator(unselected, SCENE)
    assert report.bias[0, 2] == pytest.approx(0 if SCENE.support[0, 2] else 1)
    np.testing.assert_allclose(report.mean, 0, atol=1e-14)
    assert not report.unbiased
    assert "(  +1.00)" in str(report)


def test_a_bias_that_the_mean_does_not_show_is_found() -> None:
    def swapped_light(index, chance):
        X = initial(Pixels(SCENE.now, index), chance)
        f = SCENE.now.target(index, X.x) * SCENE.v[index % 2, X.x]
        lit = np.where(X.x == 0, 0.1, np.where(X.x == 3, -0.1, 0))
        return Reservoirs(X.x, X.W * (1 + np.where(f > 0, lit / np.where(f > 0, f, 1), 0)), X.c)

    report = audit_estimator(swapped_light, SCENE)
    np.testing.assert_allclose(report.mean, 0, atol=1e-14)
    assert abs(report.worst[2]) > 0.01


def dark_target() -> Scene:
    """One pixel, three cells, and a target of 0 in the last one, where f is 4."""
    v, f = np.ones((1, 3)), np.array([[1.0, 3.0, 4.0]])
    known = cells(v, f, normalised(np.ones((1, 3)), v), paired(1, 3, {}), p_hat=f * [1, 1, 0])
    return Scene([Frame(known, 1)])


def test_the_mean_is_that_of_the_integrand_where_the_target_sees_it() -> None:
    scene = dark_target()
    report = audit_estimator(lambda index, chance: initial(Pixels(scene.now, index), chance), scene)
    assert report.unbiased
    np.testing.assert_allclose(report.mean, 0, atol=1e-14)


def test_what_an_estimator_finds_beyond_its_target_is_a_bias_of_the_mean(monkeypatch) -> None:
    """8 for 4: the mean counts f in all cells."""
    monkeypatch.setattr(estimator, "known_signatures", lambda scene, tolerance: ())
    scene = dark_target()

    def unselected(index, chance):
        ((x, W),) = scene.now.candidates(index, chance)
        return Reservoirs(x, W, np.ones(len(index)))

    np.testing.assert_allclose(audit_estimator(unselected, scene).mean, 1)


@pytest.mark.parametrize("name", UNAUDITABLE)
def test_what_cannot_be_audited_is_refused_with_the_reason_and_the_remedy(name) -> None:
    stranger, reason, remedy = UNAUDITABLE[name]
    with pytest.raises(CannotAudit) as refused:
        audit_estimator(stranger, SCENE)
    assert reason in str(refused.value)
    assert remedy in str(refused.value)


def test_too_many_leaves_are_refused_with_an_estimate() -> None:
    with pytest.raises(ValueError, match=r"more than the limit of 1000, and probably about \d"):
        audit_estimator(spatial_loop(three_pixel_scene(), WEIGHTS["talbot"], 3), three_pixel_scene(), most_leaves=1000)


def test_a_report_cannot_be_changed() -> None:
    with pytest.raises(FrozenInstanceError):
        audit_estimator(right, SCENE).leaves = 0  # type: ignore[misc]


def test_a_result_without_weights_is_refused_before_its_samples_are_looked_at() -> None:
    with pytest.raises(CannotAudit, match="without samples x and weights W"):
        rehearsal.checked(SimpleNamespace(x=np.zeros(2, dtype=int)), 2, 3)


def test_two_runs_have_the_same_weights_only_if_all_calls_have() -> None:
    def take(*asked):
        return rehearsal.Take([np.array(each) for each in asked], np.zeros(1), np.zeros(1))

    assert rehearsal._same_weights(take([1, 2], [3]), take([1, 2], [3]))
    assert not rehearsal._same_weights(take([1, 2], [3]), take([1, 2], [4]))
    assert not rehearsal._same_weights(take([1, 2]), take([1, 2], [3]))


@pytest.mark.parametrize("name", ENGINES)
def test_where_nobody_has_confidence_an_engine_s_weights_are_zero_without_a_warning(name) -> None:
    q, c = np.array([[1.0, 2.0], [3.0, 0.5]]), Confidences([np.zeros(2)] * 2, [0])
    assert all((np.asarray(ENGINES[name].m(i, q.__getitem__, c)) == 0).all() for i in range(2))
