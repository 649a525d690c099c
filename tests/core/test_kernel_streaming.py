"""Laws of streaming beside selecting at once: the same weight for the same choice, nulls, nothing to choose from."""

from dataclasses import replace

import numpy as np
import pytest

from restir_ref.integrals import Pixels
from restir_ref.mis import WEIGHTS
from restir_ref.oracle.scenes import offset
from restir_ref.resampling import Candidate, Input, select, weigh
from restir_ref.restir import around, initial
from restir_ref.streaming import select_streaming
from tests.core.stubs import Always, live
from toy1d import overlapping_supports

pytestmark = pytest.mark.kernel

HERE = Pixels(overlapping_supports(), np.arange(7 * 40))
X = initial(HERE, live())
NEAR = [offset(HERE.of, HERE.index, by) for by in (1, 2)]
SELECTORS = {"select": select, "select_streaming": select_streaming}


def candidates(mis) -> list[Candidate]:
    """What a pass over three pixels chooses from."""
    return list(weigh([Input(X, HERE), *around(X, NEAR)], HERE, mis))


def distance(streamed: list[Candidate], at_once: list[Candidate], answer: int) -> float:
    """Largest relative difference of W where streaming and `select` keep the first (0) or the last (1) candidate."""
    Y = select_streaming(iter(streamed), Always(answer), X.c)
    Z = select(at_once, Always(answer * (len(at_once) - 1)), X.c)
    assert (Y.x == Z.x).all()
    assert (Y.c == Z.c).all()
    return float(abs(Y.W - Z.W).max() / Z.W.max())


@pytest.mark.parametrize("mis", WEIGHTS.values(), ids=WEIGHTS)
@pytest.mark.parametrize("answer", [0, 1])
def test_what_streaming_keeps_weighs_as_much_as_if_selected_at_once(mis, answer):
    assert distance(candidates(mis), candidates(mis), answer) < 1e-14


@pytest.mark.parametrize("answer", [0, 1])
def test_a_forgotten_correction_is_noticed(answer):
    right = candidates(WEIGHTS["1/Z"])
    assert distance([replace(each, c_over_m=None) for each in right], right, answer) > 0.1


@pytest.mark.parametrize("selector", SELECTORS.values(), ids=SELECTORS)
def test_where_all_targets_are_zero_the_first_candidate_is_kept_with_weight_zero(selector):
    dark = [replace(each, p_hat=0 * each.p_hat) for each in candidates(WEIGHTS["1/Z"])]
    Y = selector(dark, live(), X.c)
    assert (Y.x == dark[0].x).all()
    assert (Y.W == 0).all()
    assert (Y.c == X.c).all()


@pytest.mark.parametrize("selector", SELECTORS.values(), ids=SELECTORS)
def test_nothing_to_choose_from_is_refused_with_a_remedy(selector):
    with pytest.raises(ValueError, match=r"M = 0.*: yield one from candidates\(\), or pass an input"):
        selector([], live(), X.c)
