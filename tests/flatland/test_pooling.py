"""Rules about pairs with rare paths, on data whose truth is exact: how often they are wrong, and what they see."""

from collections.abc import Callable

import numpy as np
import pytest

from benchmarks.jobs import comparing, gradients, row_gradients
from benchmarks.jobs.comparing import Sums, Truth, spread, spread_by_chance
from benchmarks.jobs.job import Row
from benchmarks.jobs.pooling import among, pooled, pooled_by_chance
from restir_ref.batch import Array

R, K, PAIRS = 64, 40, 100
"""Images of a chunk, chunks, pairs: 2560 images."""

RARE, EVENT, SCATTER = 1 / 6000, 50.0, 0.08
"""How often an image holds a rare path, what that adds to a pair's difference, and the noise of all others.

Of a difference of .1 a twelfth is rare, as behind the posts of the occluders.
"""

ERROR = np.sqrt((SCATTER**2 + EVENT**2 * RARE) / (R * K))
"""The standard error of a pair."""


def experiment(seed: int, bias: Array | float = 0.0) -> Sums:
    """Chunks whose expectation is the bias, exactly: normal noise and a binomial number of rare paths.

    Squares are those of the events and of expected noise, which hardly varies.
    """
    rng = np.random.default_rng(seed)
    events = rng.binomial(R, RARE, (K, PAIRS))
    total = EVENT * (events - R * RARE) + SCATTER * np.sqrt(R) * rng.standard_normal((K, PAIRS))
    square = EVENT**2 * events.sum(axis=0) + R * K * ((EVENT * RARE) ** 2 + SCATTER**2)
    return Sums(np.zeros((R * K, 8)), total + R * np.asarray(bias), square)


NOTHING = Truth(np.zeros(PAIRS), np.zeros(PAIRS), 0.0)


def by_z(found: Sums) -> bool:
    """The rule of `judged`: every pair over its own standard error."""
    return spread(found, NOTHING) > spread_by_chance(found)


def by_pool(found: Sums) -> bool:
    """The rule of rows of gradients."""
    n = found.total.shape[1]
    return pooled(found, Truth(np.zeros(n), np.zeros(n), 0.0)) > pooled_by_chance(found)


def rate(says: Callable[[Sums], bool], bias: Array | float = 0.0, count: int = 40) -> float:
    """Share of experiments that a rule calls biased."""
    return float(np.mean([says(experiment(seed, bias)) for seed in range(count)]))


@pytest.fixture(autouse=True)
def few_flips(monkeypatch) -> None:
    """A tenth of the trials, in both rules: a stricter limit, of one in a thousand."""
    monkeypatch.setattr("benchmarks.jobs.pooling.FLIPS", 1000)
    monkeypatch.setattr(comparing, "FLIPS", 1000)


def test_pairs_with_rare_paths_are_called_biased_by_their_own_errors_and_not_by_pooled_ones() -> None:
    assert rate(by_z) > 0.9
    assert rate(by_pool, count=300) <= 0.01


def test_the_squared_pooled_error_is_one_in_the_mean_whatever_the_tails() -> None:
    """Of squared z-scores it is ten times as much."""
    S2, z2 = np.array(
        [(pooled(each, NOTHING) ** 2, spread(each, NOTHING) ** 2) for each in map(experiment, range(300))]
    ).T
    assert abs(S2.mean() - 1) < 4 * S2.std() / np.sqrt(300) < 0.05
    assert z2.mean() > 5


ALTERNATING = (-1.0) ** np.arange(PAIRS)
"""Biases that cancel in rows and blocks."""


def test_both_rules_see_a_bias_of_the_pairs_noise_that_cancels_in_the_mean() -> None:
    for says in (by_z, by_pool):
        assert rate(says, 1.2 * ERROR * ALTERNATING, count=20) > 0.9


def test_a_bias_of_one_pair_is_seen_when_it_is_twelve_of_the_pairs_errors_and_three_are_too_few() -> None:
    at = np.arange(PAIRS) == 3
    assert rate(by_pool, 12 * ERROR * at, count=20) > 0.9
    assert rate(by_pool, 3 * ERROR * at, count=20) < 0.1


def test_loud_pairs_hide_what_is_wrong_with_quiet_ones() -> None:
    """Why pairs of one kind are put together: the second half is four times as quiet, and off."""
    loud = np.where(np.arange(PAIRS) < 50, 4.0, 1.0)

    def says(these: Array) -> Callable[[Sums], bool]:
        return lambda found: by_pool(among(Sums(found.blocks, loud * found.total, loud**2 * found.square), these))

    bias = 1.5 * ERROR * ALTERNATING * (loud == 1)
    assert rate(says(loud > 0), bias, count=20) < 0.5
    assert rate(says(loud == 1), bias, count=20) > 0.9


def test_the_limit_knows_of_pairs_that_err_together() -> None:
    """A mistake: pairs taken for independent."""
    rng = np.random.default_rng(1)
    shared = rng.standard_normal((K, 1)) + 0.3 * rng.standard_normal((K, PAIRS))
    alone = 1.05 * rng.standard_normal((K, PAIRS))
    limits = [pooled_by_chance(Sums(np.zeros((K, 8)), each, each[0] ** 2)) for each in (shared, alone)]
    assert limits[0] > 2.5
    assert limits[1] < 1.4


def test_pooled_errors_are_sums_of_squares_with_the_truth_s_own_errors() -> None:
    """By hand: means 2 and 3, standard errors 1 and 2, truths 1 and 0, their errors 2 and 1."""
    squares = np.array([2 * (1 + 2**2), 2 * (4 + 3**2)])
    found = Sums(np.zeros((2, 8)), np.array([[4.0, 6.0]]), squares)
    assert (found.mean.tolist(), found.error.tolist()) == ([2, 3], [1, 2])
    truth = Truth(np.array([1.0, 0]), np.array([2.0, 1]), 0.0)
    assert pooled(found, truth) == pytest.approx(np.sqrt((1 + 9) / (5 + 5)))


def test_few_chunks_set_no_limit_and_pixels_can_be_left_out() -> None:
    found = experiment(1)
    some = np.arange(PAIRS) % 3 == 0
    assert pooled_by_chance(Sums(found.blocks, found.total[:15], found.square)) == np.inf
    assert np.isfinite(pooled_by_chance(Sums(found.blocks, found.total[:16], found.square)))
    for name in ("mean", "error"):
        assert getattr(among(found, some), name) == pytest.approx(getattr(found, name)[some], rel=1e-12)


def test_edges_of_rows_are_the_borders_of_their_scenes_and_stretches_are_what_is_not_beside_them() -> None:
    for scene, edges in {"checker": [63], "occluders": [32, 33, 58, 59]}.items():
        edge, stretches = row_gradients.kinds(scene)
        assert edge.tolist() == edges
        assert set(range(120)) - {e + k for e in edges for k in range(-4, 5)} == set(np.concatenate(stretches))
        assert all((np.diff(each) == 1).all() for each in stretches)
    assert [len(each) for each in stretches] == [28, 16, 56]


# ---------------------------------------------------------------- rows

CASE = "occluders", "path tracing", "frame 1"


def judged_row(monkeypatch, wrong: Array | float = 0.0, rare: float = 0.0) -> Row:
    """What the job says of 1024 noisy images about the true differences, off by `wrong`, with rare events in all.

    Noise is less between the posts.
    """
    for module in (gradients, row_gradients):
        monkeypatch.setattr(module, "CASES", {CASE: (16, 0.05)})
    rng, true = np.random.default_rng(1), gradients.true_probe(CASE[0]).mean
    noise, chunks = np.where(abs(np.arange(len(true)) - 45) < 12, 0.1, 0.3), []
    for params in row_gradients.chunks(1.0):
        events = rare * ((rng.random((R, len(true))) < RARE) - RARE)
        images = true + noise * (rng.standard_normal((R, len(true))) + events) + wrong
        chunks.append((params, gradients.summed(images, "dx")))
    (row,) = row_gradients.judge(chunks)
    return row


def numbers(row: Row) -> tuple[float, float, float]:
    """The z-spread, the pooled error and the largest |z| of edges over what is allowed, as the note tells them."""
    *_, spreads, pool, edges = row.note.split("; ")
    (a, b), (c, d) = ([float(each) for each in part.split()[1::2]] for part in (spreads, pool))
    return a / b, c / d, float(edges.split()[-1]) / 4


def test_rows_hold_without_bias_also_where_pairs_have_rare_paths(monkeypatch) -> None:
    plain, skewed = (judged_row(monkeypatch, rare=each) for each in (0.0, 200.0))
    assert plain.holds
    assert skewed.holds
    assert max(numbers(plain)) < 1 < numbers(skewed)[0]


PAIR = np.arange(gradients.PAIRS)


@pytest.mark.parametrize(
    ("wrong", "by"),
    [
        (0.1 * ((PAIR == 32) * 1.0 - (PAIR == 33)), "edges"),
        (0.03 * (-1.0) ** PAIR * (abs(PAIR - 90) < 20), "pooled"),
        (0.03 * (-1.0) ** PAIR * (abs(PAIR - 45.5) < 8), "pooled"),
        (0.1 * (abs(PAIR - 30) < 2), "row"),
    ],
    ids=["two edges that cancel", "bright pairs that cancel", "dark pairs that cancel", "pairs beside an edge"],
)
def test_rows_turn_red_by_edges_by_what_is_away_from_them_or_by_blocks(monkeypatch, wrong, by) -> None:
    row = judged_row(monkeypatch, wrong)
    assert not row.holds
    _, pool, edges = numbers(row)
    assert (pool > 1, edges > 1) == (by == "pooled", by == "edges")


def test_images_of_rows_are_not_those_that_the_rule_before_was_seen_to_fail_on() -> None:
    assert all(params["series"] == row_gradients.SERIES for params in row_gradients.chunks(0.01))
    before = {(p["scene"], p["method"], p["mode"]) for p in gradients.chunks(0.01)}
    assert before == {(p["scene"], p["method"], p["mode"]) for p in row_gradients.chunks(0.01)}
    for case, (count, eps) in gradients.CASES.items():
        assert row_gradients.CASES[case][0] >= count
        assert row_gradients.CASES[case][1] <= eps
