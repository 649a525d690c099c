"""Laws of what the kernel says of itself: defaults, whom a weight is right for, what 1/Z selects by, densities."""

from dataclasses import replace

import numpy as np
import pytest

from restir_ref.integrals import Pixels, Reservoirs, p_hat_from, pdf, target
from restir_ref.mis import ALL_CANONICAL, ANY, CANONICAL_COVERS, WEIGHTS, Weights, talbot
from restir_ref.oracle.scenes import offset, three_pixel_scene
from restir_ref.resampling import Input, weigh
from restir_ref.restir import around, initial, reuse_all, spatial, temporal
from tests.core.inputs import Inputs, drawn, weights
from tests.core.stubs import live, same_bits
from toy1d import overlapping_supports

pytestmark = pytest.mark.kernel

HERE = Pixels(overlapping_supports(), np.arange(7 * 40))
NEAR = [offset(HERE.of, HERE.index, by) for by in (1, 2)]
X = initial(HERE, live())

# ---------------------------------------------------------------- defaults


def after_history(**options) -> Reservoirs:
    """New samples merged with two old ones of confidence 100."""
    return temporal(X, HERE, replace(X, c=100 * X.c), NEAR, live(2), **options)


def after_neighbours(**options) -> Reservoirs:
    return spatial(X, HERE, NEAR, live(2), **options)


def all_shifted(**options) -> Reservoirs:
    """As if the sums were weights."""
    return replace(X, W=reuse_all(X, HERE, NEAR, **options)[0])


CAPPED = {"mis": WEIGHTS["talbot"], "cap": 20}
DEFAULTS = [
    (after_history, CAPPED, [CAPPED | {"cap": 19}, CAPPED | {"cap": 21}, CAPPED | {"mis": WEIGHTS["defensive"]}]),
    (after_neighbours, {"mis": WEIGHTS["defensive"]}, [{"mis": WEIGHTS["talbot"]}, {"mis": WEIGHTS["pairwise"]}]),
    (all_shifted, {"mis": WEIGHTS["talbot"]}, [{"mis": WEIGHTS["defensive"]}, {"mis": WEIGHTS["pairwise"]}]),
]


@pytest.mark.parametrize(("a_pass", "said", "others"), DEFAULTS)
def test_history_is_capped_at_20_and_weighed_by_talbot_and_neighbours_defensively_unless_told(a_pass, said, others):
    assert same_bits(a_pass(), a_pass(**said))
    assert not any(same_bits(a_pass(), a_pass(**other)) for other in others)


# ---------------------------------------------------------------- promises


def dark(case: Inputs) -> Inputs:
    """The same inputs, whose canonical ones cannot realise the first half of all y."""
    q = case.q.copy()
    q[case.canonical, : q.shape[1] // 2] = 0
    return case._replace(q=q)


CASES = {ALL_CANONICAL: drawn(4, 4, 1, 200), CANONICAL_COVERS: drawn(4, 1, 1, 200), ANY: dark(drawn(4, 1, 1, 200))}
"""From few inputs to many: weights that are right for one line are right for those above."""


def right_for(mis: Weights) -> str:
    """The most inputs among which the contribution weights sum to one over those that can realise y."""
    kept = []
    for kind, case in CASES.items():
        realises = (case.q > 0) & (case.c > 0)
        sums = np.where(realises, weights(mis.c or mis.m, case), 0).sum(axis=0)
        kept += [kind] if abs(sums - realises.any(axis=0)).max() < 1e-12 else []
    assert kept == list(CASES)[: len(kept)]
    return kept[-1]


@pytest.mark.parametrize("mis", WEIGHTS.values(), ids=WEIGHTS)
def test_weights_promise_all_they_can_keep_and_no_more(mis):
    assert mis.unbiased_for == right_for(mis)


@pytest.mark.parametrize(
    ("name", "promise"), [("pairwise", ANY), ("pairwise", ALL_CANONICAL), ("talbot", ALL_CANONICAL)]
)
def test_promising_too_much_or_too_little_is_noticed(name, promise):
    wrong = replace(WEIGHTS[name], unbiased_for=promise)
    assert wrong.unbiased_for != right_for(wrong)


# ---------------------------------------------------------------- 1/Z


def test_one_over_Z_selects_as_constant_weights_do_and_corrects_W_by_M_over_Z():
    corrected, constant = (after_neighbours(mis=WEIGHTS[name]) for name in ("1/Z", "constant"))
    assert (corrected.x == constant.x).all()
    found = constant.W > 0
    assert set((corrected.W[found] / constant.W[found]).round(12)) == {1, 1.5, 3}


@pytest.mark.parametrize("name", ["talbot", "pairwise", "defensive"])
def test_other_weights_select_otherwise(name):
    assert (after_neighbours(mis=WEIGHTS[name]).x != after_neighbours(mis=WEIGHTS["constant"]).x).any()


# ---------------------------------------------------------------- known densities


def error_of_balance(proxy) -> float:
    """Largest relative distance of m_i W_i J_i from 1 / sum_j p_from_j(y), for raw samples of three pixels."""
    frame, chance = three_pixel_scene().now, live(3)
    here = Pixels(frame, np.arange(3 * 40))
    at = [here, *(offset(frame, here.index, by) for by in (1, 2))]
    ((x, W),) = frame.candidates(here.index, chance)
    raw = Reservoirs(x, W, np.ones(len(W)))
    inputs = [Input(raw, here), *around(raw, at[1:])]
    errors = []
    for y in weigh(inputs, here, Weights(talbot, proxy=proxy)):
        p = pdf(here, y.x) + sum(p_hat_from(j, y.x, here, pdf) for j in at[1:])
        errors += [abs(y.mW * p - 1)[y.mW > 0].max()]
    return float(max(errors))


def test_talbot_over_known_densities_weighs_raw_samples_by_one_over_their_sum():
    assert error_of_balance(pdf) < 1e-14


def test_talbot_over_targets_does_not():
    assert error_of_balance(target) > 0.1
