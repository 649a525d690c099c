"""A sample of confidence 0 counts for nothing: where only it can be, the integral is lost, but never in silence."""

from dataclasses import replace

import numpy as np
import pytest

from restir_ref.batch import Array
from restir_ref.chance import Chance
from restir_ref.integrals import Pixels, Reservoirs
from restir_ref.mis import ALL_CANONICAL, ANY, WEIGHTS, Weights
from restir_ref.oracle.cells import Frame, cells
from restir_ref.oracle.scenes import paired
from restir_ref.oracle.selected import selected
from restir_ref.resampling import Input, gris
from restir_ref.restir import initial
from tests.core.stubs import live

pytestmark = pytest.mark.kernel

NEEDING_NOBODY = {name: mis for name, mis in WEIGHTS.items() if mis.unbiased_for == ANY}


def mostly_own() -> Frame:
    """Pixel 0 has light in four cells of volume 1, pixel 1 in three of them."""
    f, pdf = np.array([[1.0] * 4, [1.0] * 3 + [0.0]]), np.array([[[1 / 4] * 4, [1 / 3] * 3 + [0.0]]])
    return Frame(cells(np.ones((2, 4)), f, pdf, paired(2, 4, {(0, 1): (0, 1, 2, -1)})), 2)


def with_confidences(own_c: float, other_c: float, mis: Weights) -> float:
    """E[f(Y) W_Y] of pixel 0 from its own sample and pixel 1's, of these confidences; the truth is 4."""
    frame = mostly_own()

    def loop(index: Array, chance: Chance) -> Reservoirs:
        at = [Pixels(frame, np.full(len(index), i)) for i in (0, 1)]
        own, other = (initial(each, chance) for each in at)
        inputs = [Input(replace(own, c=own_c * own.c), at[0]), Input(replace(other, c=other_c * other.c), at[1])]
        return gris(inputs, at[0], mis, chance)

    return float(selected(loop, frame.cells.v[:1]).W.sum())


@pytest.mark.claims("GRIS-A19")
@pytest.mark.parametrize("mis", NEEDING_NOBODY.values(), ids=NEEDING_NOBODY)
def test_where_only_a_sample_of_confidence_zero_can_come_from_is_not_lost_without_a_word(mis) -> None:
    assert with_confidences(1e-6, 1, mis) == pytest.approx(4, rel=1e-9)
    with pytest.raises(ValueError, match=r"^input 0 has confidence 0 in column \d+, .* a positive confidence"):
        with_confidences(0, 1, mis)


@pytest.mark.claims("GRIS-A19")
@pytest.mark.parametrize("mis", NEEDING_NOBODY.values(), ids=NEEDING_NOBODY)
def test_weights_that_promise_less_lose_it(mis) -> None:
    assert with_confidences(0, 1, replace(mis, unbiased_for=ALL_CANONICAL)) == pytest.approx(3)


@pytest.mark.parametrize("mis", NEEDING_NOBODY.values(), ids=NEEDING_NOBODY)
def test_nothing_is_lost_where_the_other_input_covers_all(mis) -> None:
    assert with_confidences(1, 0, mis) == pytest.approx(4)


@pytest.mark.parametrize("mis", NEEDING_NOBODY.values(), ids=NEEDING_NOBODY)
def test_an_input_that_is_not_there_loses_nothing_wherever_its_sample_is(mis) -> None:
    """Pixel 1 is dark in cell 3, where the sample of the missing input lies: W = 0 and c = 0, as `NOWHERE`."""
    here, one = Pixels(mostly_own(), np.array([1])), np.ones(1)
    inputs = [
        Input(Reservoirs(np.array([0]), one, one), here),
        Input(Reservoirs(np.array([3]), 0 * one, 0 * one), here),
    ]
    assert gris(inputs, here, mis, live()).W == 1
