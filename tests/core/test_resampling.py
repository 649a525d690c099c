"""Laws of weighing and selecting: RIS is a case of GRIS, the weight of what is chosen, nulls."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from restir_ref.batch import Array, total
from restir_ref.integrals import Pixels, Reservoirs, target
from restir_ref.mis import WEIGHTS
from restir_ref.oracle.scenes import offset
from restir_ref.resampling import Candidate, Input, gris, select
from restir_ref.restir import initial, resample, shade, spatial
from tests.core.stubs import Always, Wrapped, live, same_bits
from toy1d import Line, two_pixels

pytestmark = pytest.mark.kernel

N = 600
every_weight = pytest.mark.parametrize("mis", WEIGHTS.values(), ids=WEIGHTS)


# ---------------------------------------------------------------- RIS is a case of GRIS


def plain_ris(x, p_hat, m, W, chance) -> Reservoirs:
    """w_i = p_hat(x_i) m_i W_i, choose s, W = sum w / p_hat(x_s); all (M, N).  [GRIS Eq. 1-2, 5-6]"""
    w = p_hat * (m * W)
    s, column = chance.choose(w), np.arange(w.shape[1])
    return Reservoirs(x[s, column], w.sum(axis=0) / p_hat[s, column], np.full(w.shape[1], len(x)))


def drawn(here, chances) -> tuple[Array, Array]:
    """Draws x with W = 1/p from the integrals' sampler, one per chance; (M, N) each."""
    draws = [next(iter(here.of.candidates(here.index, chance))) for chance in chances]
    x, W = (np.stack(each) for each in zip(*draws, strict=True))
    return x, W


def of_inputs(x, W, at, here, mis) -> Reservoirs:
    """A GRIS pass over inputs x_i, W_i of confidence 1 in the domains `at`."""
    inputs = [Input(Reservoirs(*each, np.ones(N)), there) for *each, there in zip(x, W, at, strict=True)]
    return gris(inputs, here, mis, live())


@pytest.mark.claims("GRIS-A02", "GRIS-F03", "COM-B13")
@every_weight
@pytest.mark.parametrize("M", [1, 2, 4])
def test_gris_of_canonical_inputs_is_ris_bit_by_bit(mis, M):
    here = Pixels(two_pixels(), np.arange(N))
    x, W = drawn(here, map(live, range(M)))
    p_hat = np.stack([target(here, each) for each in x])
    ris = plain_ris(x, p_hat, 1 / M, W, live())
    assert same_bits(of_inputs(x, W, [here] * M, here, mis), ris)
    by_candidates = resample(zip(x, W / M, strict=True), here, live())
    assert same_bits(replace(by_candidates, c=ris.c), ris)


@pytest.mark.claims("COM-B13")
@pytest.mark.parametrize("M", [1, 2, 4])
def test_initial_samples_are_ris_over_M_draws_bit_by_bit(M):
    here = Pixels(two_pixels(), np.arange(N))
    chance = live(9)
    x, W = drawn(here, [chance] * M)
    ris = plain_ris(x, np.stack([target(here, each) for each in x]), 1 / M, W, chance)
    assert same_bits(initial(here, live(9), M), replace(ris, c=np.ones(N)))


def ramps(M) -> list[Line]:
    """Integrals over [0, 1] of the densities p_k = 1 + a_k (2 x - 1), as proxies of samplers."""
    return [Line(lambda i, x, a=a: 1 + a * (2 * x - 1), np.zeros(2), np.ones(2)) for a in np.linspace(-1, 1, M)]


@pytest.mark.claims("GRIS-A02", "GRIS-F03", "COM-B13")
@pytest.mark.parametrize("M", [2, 3, 5])
def test_gris_of_inputs_whose_targets_are_their_densities_is_ris_with_the_balance_heuristic(M):
    here = Pixels(two_pixels(), np.arange(N))
    at = [Pixels(ramp, here.index) for ramp in ramps(M)]
    x = np.random.default_rng(7).random((M, N))
    p = [np.stack([target(there, each) for each in x]) for there in at]
    own = np.stack([p[i][i] for i in range(M)])
    p_hat = np.stack([target(here, each) for each in x])
    ris = plain_ris(x, p_hat, own / total(p), 1 / own, live())
    assert same_bits(of_inputs(x, 1 / own, at, here, WEIGHTS["talbot"]), ris)


OTHER_RIS = {
    "1/M twice": lambda x, p_hat, M, W: plain_ris(x, p_hat, 1 / M**2, W, live()),
    "no 1/M": lambda x, p_hat, M, W: plain_ris(x, p_hat, 1, W, live()),
    "other random numbers": lambda x, p_hat, M, W: plain_ris(x, p_hat, 1 / M, W, live(2)),
    "other order": lambda x, p_hat, M, W: plain_ris(x[::-1], p_hat[::-1], 1 / M, W, live()),
}


@pytest.mark.parametrize("ris", OTHER_RIS.values(), ids=OTHER_RIS)
def test_another_ris_is_noticed(ris):
    here = Pixels(two_pixels(), np.arange(N))
    x, W = drawn(here, map(live, range(4)))
    p_hat = np.stack([target(here, each) for each in x])
    assert not same_bits(of_inputs(x, W, [here] * 4, here, WEIGHTS["talbot"]), ris(x, p_hat, 4, W))


# ---------------------------------------------------------------- the weight of what is chosen


PLAIN = [Candidate(*np.random.default_rng(seed).uniform(0.1, 1, (3, 9))) for seed in range(4)]
CORRECTED = [replace(each, c_over_m=each.x + each.mW) for each in PLAIN]


def weight_error(X: Reservoirs, among: list[Candidate], s: int) -> float:
    """Largest distance of X from candidate s with W = (c_s/m_s) sum_i w_i / p_hat(x_s)."""
    c_over_m = 1.0 if among[s].c_over_m is None else among[s].c_over_m
    W = c_over_m * sum(each.p_hat * each.mW for each in among) / among[s].p_hat
    return float(max(abs(X.x - among[s].x).max(), abs(X.W / W - 1).max()))


@pytest.mark.claims("GRIS-E02")
@pytest.mark.parametrize("among", [PLAIN, CORRECTED], ids=["m", "c over m"])
@pytest.mark.parametrize("s", range(4))
def test_the_chosen_sample_carries_the_sum_of_weights_over_its_target(s, among):
    assert weight_error(select(iter(among), Always(s), np.ones(9)), among, s) < 1e-14


WRONG_WEIGHTS = {
    "divided by M again": lambda X: replace(X, W=X.W / 4),
    "its own weight": lambda X: replace(X, W=PLAIN[2].mW),
    "another sample's target": lambda X: replace(X, W=X.W * PLAIN[2].p_hat / PLAIN[0].p_hat),
    "another sample": lambda X: replace(X, x=PLAIN[0].x),
}


@pytest.mark.parametrize("wrong", WRONG_WEIGHTS.values(), ids=WRONG_WEIGHTS)
def test_a_wrong_weight_of_the_chosen_sample_is_noticed(wrong):
    assert weight_error(wrong(select(PLAIN, Always(2), np.ones(9))), PLAIN, 2) > 0.1


# ---------------------------------------------------------------- nulls


@dataclass(frozen=True, eq=False)
class DarkOnTheLeft(Wrapped):
    """p_hat = 0 below x = 1/2: half of all samples are null."""

    def target(self, index, x):
        return np.where(x < 0.5, 0, self.of.target(index, x))


def null_faults(X: Reservoirs, first: Array, null: Array, c: float) -> list[str]:
    """What is wrong with the null samples of a result, null (N,)."""
    answers = {
        "W is not 0": X.W[null] != 0,
        "not the first sample": X.x[null] != first[null],
        "W is not positive where there is a sample": X.W[~null] <= 0,
        "confidence lost": X.c != c,
    }
    return [fault for fault, wrong in answers.items() if np.any(wrong)]


@pytest.mark.claims("GRIS-E02")
@every_weight
def test_a_pass_over_nulls_is_a_null_that_keeps_its_confidence(mis):
    dark = DarkOnTheLeft(two_pixels())
    here = Pixels(dark, np.arange(N))
    X = initial(here, live())
    assert null_faults(X, X.x, X.x < 0.5, 1) == []
    there = offset(dark, here.index, 1)
    null = (X.x < 0.5) & (X.x[there.index] < 0.5)
    Y = spatial(X, here, [there], live(2), mis=mis)
    assert 0 < null.sum() < N
    assert null_faults(Y, X.x, null, 2) == []
    assert (shade(Y, here)[0, null] == 0).all()


@pytest.mark.parametrize("change", [{"W": np.ones(N)}, {"x": np.ones(N)}, {"W": np.zeros(N)}, {"c": np.zeros(N)}])
def test_a_null_with_a_weight_a_stranger_a_lost_sample_and_a_lost_confidence_are_noticed(change):
    X = initial(Pixels(DarkOnTheLeft(two_pixels()), np.arange(N)), live())
    assert len(null_faults(replace(X, **change), X.x, X.x < 0.5, 1)) == 1
