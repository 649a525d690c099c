"""Bug reports from the world end in the right answer: where to look first, and what the bias needs."""

from functools import cache

import numpy as np
import pytest

from restir_ref.audit import EstimatorReport, audit_estimator
from restir_ref.audit import estimator as module
from restir_ref.audit.changes import CHANGES
from restir_ref.audit.estimator import FEW_TO_RERUN
from restir_ref.batch import ratio
from restir_ref.integrals import Pixels, Reservoirs
from restir_ref.mis import WEIGHTS
from restir_ref.oracle.scenes import random_scene, spatial_loop
from restir_ref.restir import initial
from tests.audit.reports import REPORTS, TECHNIQUES, THREE, TWO, balance, streamed, techniques

every_report = pytest.mark.parametrize("name", REPORTS)


@cache
def answer(name: str) -> EstimatorReport:
    report = REPORTS[name]
    return audit_estimator(report.estimator, report.scene)


@every_report
def test_a_reported_bug_is_biased_and_the_answer_begins_where_it_is(name) -> None:
    said = answer(name)
    assert not said.unbiased
    assert said.look_at[0].startswith(REPORTS[name].look_first), said


@every_report
def test_a_reported_bug_needs_what_it_needs(name) -> None:
    said = answer(name)
    assert set(REPORTS[name].needs) <= set(said.needs)
    assert set(REPORTS[name].stays) <= set(said.stays)


TABLES = {
    "dim surfaces drift to black": "small targets cut off",
    "the sky twice as bright on rough surfaces": "both techniques added in full",
    "half of the light is missing": "partner never sampled",
    "everything a little too dark": "everything faded",
    "the first light too bright, the others too dark": "sampler one entry off",
}


@pytest.mark.parametrize("name", TABLES)
def test_what_the_zoo_has_exactly_is_named(name) -> None:
    assert TABLES[name] in [each.bug for each in answer(name).lookalikes]


@every_report
def test_the_answer_stands_before_the_numbers(name) -> None:
    first, second, *_ = str(answer(name)).splitlines()
    assert first.startswith("BIASED: ")
    assert second.startswith(f"look first at {REPORTS[name].look_first[:10]}")
    assert max(map(len, str(answer(name)).splitlines())) <= 120


@every_report
def test_no_bug_of_the_zoo_is_named_but_for_the_same_table_or_the_same_needs(name) -> None:
    text = str(answer(name))
    assert "likeness" not in text
    assert ("exactly this table" in text) == bool(answer(name).lookalikes)


# ---------------------------------------------------------------- the scenes are put back


@pytest.mark.parametrize("scene", [TWO, THREE, TECHNIQUES], ids=["two", "three", "techniques"])
def test_changed_scenes_are_scenes_and_are_put_back(scene) -> None:
    tables, n = scene.now.cells, scene.now.n
    before = {name: np.array(values) for name, values in vars(tables).items() if values is not None}
    for change in CHANGES.values():
        other = change.tables(tables, n)
        np.testing.assert_allclose((other.pdf * other.v).sum(axis=-1), 1)
        i, j, x = np.nonzero(other.shifts >= 0)
        assert (other.shifts[j, i, other.shifts[i, j, x]] == x).all()
    audit_estimator(techniques(lambda t, p, x: 0.5 + 0 * p[0]), TECHNIQUES)
    assert all((vars(tables)[name] == values).all() for name, values in before.items())


def test_an_estimator_that_fails_on_other_scenes_is_audited_on_its_own_and_the_scene_is_put_back() -> None:
    def failing(index, chance):
        if TWO.now.cells.v[0, 1] != 0.5:
            raise RuntimeError("the scene has changed")
        X = initial(Pixels(TWO.now, index), chance)
        return Reservoirs(X.x, 2 * X.W, X.c)

    report = audit_estimator(failing, TWO)
    assert report.worst[2] == pytest.approx(1)
    assert "equal volumes" not in (*report.needs, *report.stays)
    assert TWO.now.cells.v[0, 1] == 0.5


# ---------------------------------------------------------------- unbiased, but


def test_reuse_that_does_nothing_is_said_to_do_nothing() -> None:
    """A depth test against a clamped depth refuses every neighbour."""

    def inert(index, chance):
        X = initial(Pixels(TWO.now, index), chance, M=2)
        similar = abs(min(90_000.0, 65_504.0) - 90_000.0) < 9_000
        chance.choose(np.stack([np.ones(len(index)), np.full(len(index), float(similar))]))
        return X

    report = audit_estimator(inert, TWO)
    assert (report.unbiased, report.reused) == (True, False)
    assert str(report).startswith("unbiased in every cell, and nothing is reused")
    assert "every neighbour is refused" in str(report)


def test_reuse_that_works_is_not_said_to_do_nothing() -> None:
    report = audit_estimator(spatial_loop(TWO, WEIGHTS["talbot"], 1), TWO)
    assert report.reused
    assert "nothing is reused" not in str(report)


def test_the_variance_is_exact_and_that_of_new_samples_is_one() -> None:
    alone = audit_estimator(lambda index, chance: initial(Pixels(TWO.now, index), chance), TWO)
    np.testing.assert_allclose(alone.variance, 1)
    halved = audit_estimator(lambda index, chance: initial(Pixels(TWO.now, index), chance, M=2), TWO)
    np.testing.assert_allclose(halved.variance, 0.5)


def test_weights_of_two_measures_alike_are_unbiased_and_noisier() -> None:
    """Both sides compare an area with an angle: the weights still sum to 1."""

    def mixed(t, p, x):
        return balance(t, p * np.array([np.ones(len(x)), np.array([5.0, 0.2, 9.0])[x]]), x)

    report = audit_estimator(techniques(mixed), TECHNIQUES)
    assert report.unbiased
    assert report.variance.max() > 1.1
    assert "noisier than new samples alone" in str(report).splitlines()[0]


# ---------------------------------------------------------------- nobody right is accused

RIGHT = {
    "talbot": lambda scene: spatial_loop(scene, WEIGHTS["talbot"], 1),
    "defensive": lambda scene: spatial_loop(scene, WEIGHTS["defensive"], 1),
    "1/Z": lambda scene: spatial_loop(scene, WEIGHTS["1/Z"], 1),
    "two candidates": lambda scene: lambda index, chance: initial(Pixels(scene.now, index), chance, M=2),
}


@pytest.mark.parametrize("name", RIGHT)
@pytest.mark.parametrize("seed", range(5))
def test_no_right_estimator_is_accused(name, seed) -> None:
    scene = random_scene(TWO if seed % 2 else THREE, rng=np.random.default_rng(seed))
    report = audit_estimator(RIGHT[name](scene), scene)
    assert report.unbiased
    assert not report.look_at


def test_right_techniques_and_right_streams_are_unbiased() -> None:
    assert audit_estimator(techniques(balance), TECHNIQUES).unbiased
    assert audit_estimator(streamed(lambda w, total, first: ratio(w, total)), TWO).unbiased


def test_estimators_with_many_outcomes_are_not_run_again_and_say_so(monkeypatch) -> None:
    monkeypatch.setattr(module, "FEW_TO_RERUN", 10)
    report = audit_estimator(REPORTS["everything a little too dark"].estimator, TWO)
    assert FEW_TO_RERUN > 10
    assert "more than 10 outcomes: not run again on changed scenes" in str(report)
    assert (report.needs, report.stays) == ((), ())
    assert "no other pixel" not in str(report)
