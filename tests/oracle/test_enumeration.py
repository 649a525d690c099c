"""Enumerations that grow too long stop in time: at the limit, or where branching so far promises twice of it."""

import numpy as np
import pytest

from restir_ref.oracle import enumeration
from restir_ref.oracle.enumeration import outcomes


@pytest.fixture
def one_by_one(monkeypatch):
    """Every lane is a batch of its own, and two dives estimate what is below it."""
    monkeypatch.setattr(enumeration, "LANES_AT_ONCE", 1)
    monkeypatch.setattr(enumeration, "DIVES", 2)


def leaves_before_refusal(program, limit: int, match: str) -> int:
    found: list = []
    with pytest.raises(ValueError, match=match):
        found.extend(outcomes(program, 1, most_leaves=limit))
    return sum(len(outcome.probability) for outcome in found)


def ten_coins(index, chance) -> None:
    for _ in range(10):
        chance.choose(np.ones((2, len(index))))


def walked(depth: int) -> list[str]:
    """What a walk through a binary tree meets, depth first."""
    return ["split", *walked(depth - 1), *walked(depth - 1)] if depth else ["leaf"]


@pytest.mark.parametrize("limit", [1, 2, 3, 100, 1000, 1023])
def test_an_enumeration_stops_at_the_split_after_which_leaves_and_open_lanes_exceed_the_limit(
    one_by_one, limit
) -> None:
    """A split adds one to what is open or finished, which is one at first."""
    steps = walked(10)
    split = [at for at, what in enumerate(steps) if what == "split"][limit - 1]
    found = leaves_before_refusal(ten_coins, limit, f"at least {limit + 1} leaves, more than the limit of {limit}")
    assert found == steps[:split].count("leaf")


def test_as_many_leaves_as_the_limit_are_enumerated(one_by_one) -> None:
    assert len(list(outcomes(ten_coins, 1, most_leaves=1024))) == 1024


def branches(*options: tuple[int, int]):
    """A choice of a branch, then of the branch's first number of options, then of its second; the last comes first."""

    def program(index, chance) -> None:
        branch = chance.choose(np.ones((len(options), len(index))))
        for count in np.transpose(options):
            chance.choose(np.where(np.arange(max(count))[:, None] < count[branch], 1, 0))

    return program


PROMISED, REACHED = "would have about 2e[+]03 leaves", "at least 10.. leaves"


@pytest.mark.parametrize(
    ("first", "second", "match"),
    [
        (191, (201, 9), PROMISED),  # 191 + 201 * 9 + 1 = 2001
        (190, (201, 9), REACHED),  # 2000, which is not beyond
        (192, (200, 20), REACHED),  # 4193, but a split into 200 asks for no estimate
    ],
)
def test_leaves_found_and_promised_by_open_lanes_are_refused_beyond_twice_the_limit(
    one_by_one, first, second, match
) -> None:
    found = leaves_before_refusal(branches((1, 1), second, (first, 1)), 1000, match)
    assert (found == first) == (match == PROMISED)


def test_an_estimate_within_twice_the_limit_stops_nothing_that_is_at_the_limit(one_by_one) -> None:
    assert len(list(outcomes(branches((201, 1)), 1, most_leaves=201))) == 201


def test_an_enumeration_that_is_refused_at_once_says_how_many_leaves_there_will_be(one_by_one) -> None:
    """30 + 7 * 10 are found or promised when 30 + 7 exceed 36."""
    leaves_before_refusal(branches((7, 10), (30, 1)), 36, r"at least 37 leaves, .* probably about 1e\+02 in all")


def test_dives_estimate_the_leaves_of_unequal_branches_without_bias() -> None:
    """Half of the dives go into either branch."""
    estimate = enumeration._estimate(branches((2, 3), (8, 5)), [enumeration.Lanes([], np.ones(1))], 1)
    assert estimate == pytest.approx(2 * 3 + 8 * 5, rel=0.1)


@pytest.mark.parametrize(("n", "count"), [(64, r"1.844674e\+19"), (2000, r"1e\+300")])
def test_more_combinations_than_integers_or_floats_hold_are_refused(one_by_one, n, count) -> None:
    with pytest.raises(ValueError, match=f"at least {count} leaves"):
        list(outcomes(ten_coins, n))


def test_a_program_that_asks_less_than_before_is_refused() -> None:
    runs = []

    def forgetful(index, chance):
        runs.append(index)
        chance.choose(np.ones((2, len(index))))
        if len(runs) < 3:
            chance.choose(np.ones((2, len(index))))

    with pytest.raises(ValueError, match=r"after 2 calls of choose\(\) were answered the program made only 1"):
        list(outcomes(forgetful, 1))


def splitmix(column: int, call: int) -> float:
    """Its 53 high bits, in integers of any size.  [Steele, Lea, Flood 2014]"""
    z = (column * 0x9E3779B97F4A7C15 + call * 0xD1B54A32D192ED03) % 2**64
    z = (z ^ z >> 30) * 0xBF58476D1CE4E5B9 % 2**64
    z = (z ^ z >> 27) * 0x94D049BB133111EB % 2**64
    return ((z ^ z >> 31) >> 11) * 2.0**-53


@pytest.mark.parametrize("call", [0, 1, 7, 1000])
def test_scattered_numbers_are_those_of_splitmix(call) -> None:
    column = np.arange(50) * 977
    assert enumeration.scattered(column, call).tolist() == [splitmix(int(each), call) for each in column]
