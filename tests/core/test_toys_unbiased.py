"""Initial samples and spatial reuse on continuous toys are unbiased to 2%, by sampling."""

import numpy as np
import pytest
from scipy.special import erf, erfinv

from restir_ref.batch import Array
from restir_ref.integrals import Pixels
from restir_ref.mis import ALL_CANONICAL, WEIGHTS
from restir_ref.oracle.scenes import offset
from restir_ref.restir import initial, reuse_all, spatial
from tests.core.lines import LINES, Inverted, Slack, bent, made, truth
from tests.core.stubs import live
from toy1d import overlapping_supports

REPLICAS = 10_000
SEEN = ("overlapping_supports", "bent")
PROMISING = {name: mis for name, mis in WEIGHTS.items() if mis.unbiased_for != ALL_CANONICAL}


def reuse(line, mis) -> tuple[Array, Array]:
    """f W and W after spatial reuse from all other pixels, (7, replicas) each."""
    here = Pixels(line, np.arange(7 * REPLICAS))
    X = spatial(initial(here, live()), here, [offset(line, here.index, by) for by in range(1, 7)], live(2), mis=mis)
    return by_pixel(line.target(here.index, X.x) * X.W), by_pixel(X.W)


def first_samples(line) -> tuple[Array, Array]:
    """f W and W of initial samples."""
    here = Pixels(line, np.arange(7 * REPLICAS))
    X = initial(here, live())
    return by_pixel(line.target(here.index, X.x) * X.W), by_pixel(X.W)


def sum_of_all(line, mis) -> Array:
    """The sum over all shifted samples instead of a selection."""
    here = Pixels(line, np.arange(7 * REPLICAS))
    return by_pixel(
        reuse_all(initial(here, live()), here, [offset(line, here.index, by) for by in range(1, 7)], mis=mis)
    )


def by_pixel(values: Array) -> Array:
    return values.reshape(REPLICAS, 7).T


PASSES = {"initial": first_samples, **{name: lambda line, mis=mis: reuse(line, mis) for name, mis in PROMISING.items()}}
SUMS = {name: lambda line, mis=mis: (sum_of_all(line, mis),) for name, mis in PROMISING.items()}
CHECKS = len(SEEN) * 7 * (2 * len(PASSES) + len(SUMS))
Z = float(np.sqrt(2) * erfinv(erf(4 / np.sqrt(2)) ** (1 / CHECKS)))
"""|z| that all checks of this module together exceed as rarely as one check exceeds 4.  [Sidak]"""


def truths(name: str) -> tuple[Array, Array]:
    """int f, and int over supp f of 1: without the second, wrong selections would not be seen."""
    line = LINES[name]()
    return truth(name), line.high - line.low


def verdicts(name, estimates) -> set[str]:
    """Per pixel and integrand: unbiased to 2%, biased by more than 1% at z >= 8, or unclear; 1e-12 for rounding."""
    found = set()
    for values, expected in zip(estimates, truths(name), strict=False):
        error = values.std(axis=1, ddof=1) / np.sqrt(REPLICAS)
        bias = values.mean(axis=1) - expected
        biased = (abs(bias) >= 8 * error) & (abs(bias) > 0.01 * expected)
        unbiased = (abs(bias) <= Z * error + 1e-12 * expected) & (error <= 0.02 * expected)
        found |= set(np.where(biased, "biased", np.where(unbiased, "unbiased", "unclear")).tolist())
    return found


@pytest.mark.parametrize("name", SEEN)
@pytest.mark.parametrize("a_pass", PASSES.values(), ids=PASSES)
def test_initial_samples_and_spatial_reuse_are_unbiased_to_2_percent(name, a_pass):
    assert verdicts(name, a_pass(LINES[name]())) == {"unbiased"}


@pytest.mark.parametrize("name", SEEN)
@pytest.mark.parametrize("a_sum", SUMS.values(), ids=SUMS)
def test_the_sum_over_all_shifted_samples_is_unbiased_to_2_percent(name, a_sum):
    assert verdicts(name, a_sum(LINES[name]())) == {"unbiased"}


def test_constant_weights_over_unequal_supports_are_biased():
    line = overlapping_supports()
    assert "biased" in verdicts("overlapping_supports", reuse(line, WEIGHTS["constant"]))
    assert "biased" in verdicts("overlapping_supports", [sum_of_all(line, WEIGHTS["constant"])])


@pytest.mark.parametrize("kind", [Slack, Inverted])
def test_wrong_jacobians_bias_spatial_reuse(kind):
    assert "biased" in verdicts("bent", reuse(made(kind, bent()), WEIGHTS["talbot"]))


def test_too_few_samples_decide_nothing():
    values = np.random.default_rng(5).exponential(truth("bent")[:, None], (7, REPLICAS))
    few = np.where(np.arange(REPLICAS) % 10, 0, 10 * values)
    assert verdicts("bent", [values]) == {"unbiased"}
    assert verdicts("bent", [few]) == {"unclear"}
