"""The enumeration knows in time how large it will be, and refuses programs that do not fit it."""

import numpy as np
import pytest

from restir_ref.batch import Array
from restir_ref.chance import Chance
from restir_ref.integrals import Reservoirs
from restir_ref.mis import WEIGHTS
from restir_ref.oracle import enumeration
from restir_ref.oracle.enumeration import outcomes, scattered
from restir_ref.oracle.scenes import Loop, reference_scene, spatial_loop, three_pixel_scene, two_frame_loop

LOOPS = {
    "three pixels, one pass": (spatial_loop(three_pixel_scene(), WEIGHTS["talbot"], 1), 3),
    "three pixels, two passes": (spatial_loop(three_pixel_scene(), WEIGHTS["1/Z"], 2), 3),
    "two frames": (two_frame_loop(reference_scene()), 2),
}


def leaves(loop: Loop, n: int, limit: int = enumeration.MOST_LEAVES) -> int:
    return sum(len(outcome.probability) for outcome in outcomes(loop, n, limit))


def estimate(loop: Loop, n: int) -> float:
    start = enumeration.Lanes([], np.ones(1, dtype=int))
    return enumeration._estimate(loop, [start], n)


@pytest.mark.parametrize("name", LOOPS)
def test_random_dives_estimate_the_number_of_leaves(name) -> None:
    """1000 dives with a relative standard deviation of at most 1.1 in these loops: 4 sigma is 0.14."""
    loop, n = LOOPS[name]
    assert estimate(loop, n) == pytest.approx(leaves(loop, n), rel=0.14)


def test_an_even_tree_is_estimated_exactly() -> None:
    assert estimate(even, 2) == leaves(even, 2) == 3**8


def even(index: Array, chance: Chance) -> list[Array]:
    return [chance.choose(np.ones((3, len(index)))) for _ in range(4)]


def test_a_lopsided_tree_is_not_mistaken_for_an_even_one() -> None:
    def lopsided(index: Array, chance: Chance) -> Array:
        """Only one option in three branches again, nine times."""
        alive = np.ones(len(index))
        for _ in range(9):
            alive = alive * (chance.choose(np.stack([np.ones(len(index)), alive, alive])) == 1)
        return alive

    assert leaves(lopsided, 1) == 2 * 9 + 1
    assert estimate(lopsided, 1) == pytest.approx(2 * 9 + 1, rel=0.5)


def test_the_limit_is_exact() -> None:
    assert leaves(even, 1, 81) == 81
    with pytest.raises(ValueError, match="at least 81 leaves, more than the limit of 80, and probably about 81 in all"):
        leaves(even, 1, 80)


def test_a_hopeless_enumeration_is_refused_before_it_is_made() -> None:
    largest: list[int] = []

    def watched(index: Array, chance: Chance) -> Reservoirs:
        largest.append(len(index))
        return spatial_loop(three_pixel_scene(), WEIGHTS["talbot"], 8)(index, chance)

    with pytest.raises(
        ValueError, match=r"would have about 1e\+12|would have about \d\.?\d*e\+1[123] leaves"
    ) as refused:
        leaves(watched, 3)
    assert "judging by its branching so far" in str(refused.value)
    assert max(largest) < 200_000


def test_more_leaves_than_a_float_can_count_are_refused() -> None:
    def wide(index: Array, chance: Chance) -> Array:
        return chance.choose(np.ones((8, len(index))))

    with pytest.raises(ValueError, match=r"at least 1e\+300 leaves"):
        leaves(wide, 400)


def test_weights_that_do_not_fit_the_columns_are_refused() -> None:
    for shape in ((4,), (4, 3), (2, 4, 1)):
        with pytest.raises(ValueError, match=r"weights are \(options, columns\)"):
            list(outcomes(lambda index, chance, shape=shape: chance.choose(np.ones(shape)), 4))


@pytest.mark.parametrize("bad", [-1.0, np.nan, np.inf])
def test_weights_that_are_no_weights_are_refused(bad) -> None:
    with pytest.raises(ValueError, match="a weight of choose"):
        list(outcomes(lambda index, chance: chance.choose(np.full((2, len(index)), bad)), 1))


def test_a_program_that_stops_asking_is_refused() -> None:
    def shrinking(index: Array, chance: Chance) -> Array:
        x = chance.choose(np.ones((2, len(index))))
        return x if len(index) > 2 else chance.choose(np.ones((2, len(index))))

    with pytest.raises(ValueError, match="number of calls must not depend on samples"):
        list(outcomes(shrinking, 1))


def test_scattered_numbers_are_uniform_and_independent_between_calls() -> None:
    """10 bins of 20 000 numbers: chi-square with 9 degrees of freedom, mean 9, sd 4.2; 5 sigma is 30."""
    u, v = (scattered(np.arange(20_000), call) for call in (1, 2))
    for numbers in (u, v, (u + v) % 1, (u - v) % 1):
        counts = np.histogram(numbers, bins=10, range=(0, 1))[0]
        assert ((counts - 2000) ** 2 / 2000).sum() < 30
