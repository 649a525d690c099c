"""Laws of what the notebooks show, without any notebook."""

import numpy as np
import pytest

from notebooks import line_up as lab
from notebooks import one_dimension as first
from notebooks import unbiased as second
from restir_ref import WEIGHTS, Pixels, Weights
from restir_ref.oracle.moments import variance
from restir_ref.oracle.zoo import BUGS, INEFFICIENT, exact_bias

# ---------------------------------------------------------------- from RIS to GRIS


@pytest.mark.parametrize("M", [1, 4, 16])
def test_the_mean_stays_and_the_spread_falls_with_the_candidates(M):
    mean, error, spread = first.spread(M)
    assert error < 0.01
    assert abs(mean - 1) < 4 * error
    assert spread * np.sqrt(M) == pytest.approx(first.spread(1)[2], rel=0.03)


@pytest.mark.parametrize("power", [1.0, 0.0, -1.0])
def test_shifts_return_j_to_the_power_asked_for(power):
    line, x = first.stretched(power), np.array([0.1, 0.5, 0.9])
    here, there = (Pixels(line, np.full(3, pixel)) for pixel in (0, 1))
    forth = line.shift(x, here.index, there)
    np.testing.assert_allclose(forth.x[:2], 2 * x[:2])
    np.testing.assert_allclose(forth.J, [2**power, 2**power, 0])


@pytest.mark.parametrize("mis", ["talbot", "pairwise", "defensive", "1/Z"])
def test_only_the_right_jacobian_is_unbiased(mis):
    mean, error = first.reuse(1.0, mis)
    assert np.all(error < 0.01)
    assert np.all(abs(mean - 1) < 4 * error)
    for power in (0.0, -1.0):
        mean, error = first.reuse(power, mis)
        assert np.all(abs(mean - 1) > 20 * error)


@pytest.mark.parametrize("mis", WEIGHTS)
def test_light_is_lost_by_constant_weights_alone(mis):
    lost = first.lost_energy(mis)
    assert lost > 0.2 if mis == "constant" else abs(lost) < 1e-12


def test_chains_without_a_cap_freeze_apart_and_are_right_together():
    free, capped = first.chains(np.inf, 200, 4000), first.chains(5.0, 200, 4000)
    for means in (free, capped):
        assert abs(means[-1].mean() - 1) < 4 * means[-1].std() / np.sqrt(4000) < 0.06
    assert free[-1].std() > 0.95 * free[50].std()
    assert capped[-1].std() < 0.6 * capped[50].std()


# ---------------------------------------------------------------- is it unbiased


@pytest.mark.parametrize("M", [1, 2, 3])
def test_all_outcomes_of_ris_have_probability_one_and_mean_four(M):
    *rows, last = second.leaves(M).rows
    assert sum(float(row[0]) for row in rows) == pytest.approx(1, abs=1e-3)
    assert float(last[-1]) == pytest.approx(4, abs=1e-11)


@pytest.mark.parametrize("mis", WEIGHTS)
@pytest.mark.parametrize("rounds", [0, 1, 2])
def test_moments_are_what_all_outcomes_say(mis, rounds):
    np.testing.assert_allclose(variance(second.moments(mis, rounds)), second.enumerated(mis, rounds), atol=1e-10)


def test_a_judge_knows_right_weights_from_wrong_ones():
    assert second.judge(WEIGHTS["talbot"], 3).startswith("Unbiased in every cell of 4 scenes")
    own_bonus = Weights(lambda i, q, c: WEIGHTS["talbot"].m(i, q, c) + 0.01 * (i == 0))
    assert second.judge(own_bonus, 3).startswith("Biased in 4 of 4 scenes")


def test_samples_agree_with_the_exact_bias_of_the_image():
    for name in ("null confidence 0", "one seed for two passes"):
        estimates = second.sampled(name)
        error = estimates.std(axis=0) / np.sqrt(len(estimates))
        assert np.all(error < 0.01)
        assert np.all(abs(estimates.mean(axis=0) - 1 - second.bias_of_image(name)) < 4 * error)


# ---------------------------------------------------------------- find the bug

RIGHT = {bug.right: bug for bug in [*BUGS.values(), *INEFFICIENT.values()]}


@pytest.mark.parametrize("experiment", lab.EXPERIMENTS)
def test_right_loops_are_exact_in_every_experiment(experiment):
    scenes = [(bug.right, lab.changed(bug.scene(), experiment)) for bug in RIGHT.values()]
    assert max(abs(exact_bias(right(scene), scene)).max() for right, scene in scenes) < 1e-12


NEEDS = {
    "Jacobian left out": "equal volumes",
    "inverted Jacobian": "equal volumes",
    "rejection not mirrored": "equal volumes",
    "history forgotten in the canonical weight": "history cut",
    "cap only in the denominator": "history cut",
}


@pytest.mark.parametrize("name", NEEDS)
def test_a_bias_vanishes_with_what_it_needs_and_only_then(name):
    bug = BUGS[name]
    found = {e: abs(exact_bias(bug.wrong(s), s)).max() for e in lab.EXPERIMENTS for s in [lab.changed(bug.scene(), e)]}
    assert found[NEEDS[name]] < 1e-12
    assert found["as it is"] > 0.1


def test_experiments_take_away_what_they_say():
    scene = BUGS["Jacobian left out"].scene()
    tables = {name: lab.changed(scene, name).now.cells for name in lab.EXPERIMENTS}
    own = np.eye(len(tables["as it is"].v), dtype=bool)
    assert np.all(tables["equal volumes"].v == 1)
    assert np.all(tables["no holes"].shifts >= 0)
    assert np.all(tables["nothing dark"].p_hat > 0)
    assert np.any(tables["as it is"].shifts < 0)
    assert np.any(tables["as it is"].p_hat == 0)
    assert np.all(tables["history cut"].shifts[:2, 2:] < 0)
    assert np.any(tables["history cut"].shifts[~own] >= 0)
    assert np.all(tables["neighbours cut"].shifts[0, 1] < 0)
    assert np.any(tables["neighbours cut"].shifts[0, 2] >= 0)


@pytest.mark.parametrize("number", range(20))
def test_a_line_up_is_the_same_for_all_and_holds_what_was_asked_for(number):
    suspects, again = lab.line_up(number, 3, 2, 1), lab.line_up(number, 3, 2, 1)
    truths = [lab.answer(each) for each in suspects.values()]
    assert truths == [lab.answer(each) for each in again.values()]
    assert sum(lab.NOTHING in truth for truth in truths) == 1
    assert sum(any(f": {name}." in truth for name in INEFFICIENT) for truth in truths) == 2
    assert len(suspects) == 6


def test_line_ups_differ():
    assert len({str([lab.answer(each) for each in lab.line_up(k).values()]) for k in range(10)}) == 10


@pytest.mark.parametrize("number", range(5))
def test_exactly_the_guilty_are_biased(number):
    for suspect in lab.line_up(number).values():
        guilty = any(f": {name}." in lab.answer(suspect) for name in BUGS)
        assert (abs(lab.bias(suspect)).max() > lab.ROUNDING) == guilty


def test_everybody_in_the_zoo_can_be_a_suspect():
    everybody = lab.line_up(0, len(BUGS), 0, 0) if len(BUGS) <= 26 else lab.line_up(0, 26, 0, 0)
    assert len(everybody) == min(26, len(BUGS))
    assert len(set(lab.names())) == 1 + len(BUGS) + len(INEFFICIENT)


def test_an_accusation_says_yes_for_the_truth_only():
    for suspect in lab.line_up(1).values():
        yes = [name for name in lab.names() if "Yes" in lab.accuse(suspect, name)]
        assert len(yes) == 1
        assert f": {yes[0]}." in lab.answer(suspect)
    with pytest.raises(ValueError, match="there is no 'gremlins'"):
        lab.accuse(suspect, "gremlins")


def test_a_suspect_does_not_give_itself_away():
    for suspect in lab.line_up(1).values():
        said = f"{suspect!r} {suspect} {lab.hint(suspect)}"
        assert not [name for name in lab.names() if name in said]


def test_checks_find_nothing_in_the_innocent():
    innocent = {a: s for a, s in lab.line_up(1).items() if lab.NOTHING in lab.answer(s)}
    assert all(not any(cells) for _, *cells in lab.checks(innocent).rows)
    assert any(any(cells) for _, *cells in lab.checks(lab.line_up(1)).rows)
