"""What one can hold against a loop: means, Definition 4.1, variance, bounds, sums of weights, shifts, counts.

Every check gives one signed number, exact up to rounding, and a verdict.  The first four look at what
the loop returns, the fifth at its confidences, and the others inside, at single passes and shifts (`probe`).
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType

import numpy as np

from restir_ref.batch import Array, ratio
from restir_ref.oracle.enumeration import outcomes
from restir_ref.oracle.laws import bias_per_cell
from restir_ref.oracle.scenes import Loop, Parts, Scene
from restir_ref.oracle.zoo import probe

OUTSIDE = 4
"""So many checks, the first ones, look at samples and weights that come out, and at nothing else."""

TOLERANCE = 1e-9
"""Rounding, generously: anything larger was caught."""


@dataclass(frozen=True)
class Statistics:
    """E[W 1{X=x}] and E[W^2 1{X=x}] (n, K), the least and the largest confidence (n,)."""

    first: Array
    second: Array
    least: Array
    largest: Array

    def variance(self, f: Array) -> Array:
        """Var[f(Y) W] of every pixel (n,), f (n, K)."""
        mean = (f * self.first).sum(axis=-1)
        return np.asarray((f**2 * self.second).sum(axis=-1) - mean**2)


def statistics(loop: Loop, scene: Scene) -> Statistics:
    """The moments of a loop, enumerated."""
    n = len(scene.v)
    first, second = np.zeros(scene.v.shape), np.zeros(scene.v.shape)
    c: list[Array] = []
    for outcome in outcomes(loop, n):
        X, p = outcome.result, outcome.per_column(n)
        where = (np.arange(len(p)) % n, X.x)
        np.add.at(first, where, p * X.W)
        np.add.at(second, where, p * X.W**2)
        c += [X.c.reshape(-1, n).min(axis=0), X.c.reshape(-1, n).max(axis=0)]
    return Statistics(first, second, np.min(c, axis=0), np.max(c, axis=0))


@dataclass(frozen=True, eq=False)
class Case:
    """A suspect, the right loop beside it, and the scene they run on."""

    suspect: Parts
    right: Parts
    scene: Scene

    @cached_property
    def found(self) -> Statistics:
        """What the suspect does."""
        return statistics(self.suspect(self.scene), self.scene)

    @cached_property
    def expected(self) -> Statistics:
        """What the right loop does."""
        return statistics(self.right(self.scene), self.scene)


Check = Callable[[Case], float]
"""A signed number that is 0 for the right loop."""


@dataclass(frozen=True)
class Found:
    """What a check found: a signed number, and whether it gives the suspect away."""

    value: float
    caught: bool


def examine(suspect: Parts, right: Parts, scene: Scene) -> Mapping[str, Found]:
    """What every check finds in a suspect, by name."""
    case = Case(suspect, right, scene)
    values = {name: check(case) for name, check in CHECKS.items()}
    return {name: Found(value, abs(value) > TOLERANCE) for name, value in values.items()}


def largest(values: Array) -> float:
    """The value of largest magnitude, with its sign: the first one of those that differ by rounding."""
    flat = np.append(np.ravel(values), 0.0)
    return float(flat[np.abs(flat).round(12).argmax()])


def worst_cell(case: Case) -> float:
    """E[W 1{X=x}] / v(x) minus 1 on the support, for all f at once.  [GRIS Def. 4.1]"""
    return largest(bias_per_cell(case.found.first, case.scene.v, case.scene.support))


def worst_mean(case: Case, f: Array) -> float:
    """E[f(Y) W] / int f - 1 of the worst pixel."""
    truth = np.where(case.scene.support, f * case.scene.v, 0).sum(axis=-1)
    return largest(ratio((f * case.found.first).sum(axis=-1), truth) - (truth > 0))


def mean_of_target(case: Case) -> float:
    """E[p_hat(Y) W]: the image.  After one pass it is E[sum w], whatever was selected."""
    return worst_mean(case, case.scene.p_hat)


def mean_of_one(case: Case) -> float:
    """E[W] on the support: f = 1, which nothing in the selection aims at."""
    return worst_mean(case, np.where(case.scene.support, 1.0, 0.0))


def more_variance(case: Case) -> float:
    """Var[p_hat(Y) W] over that of the right loop, summed over pixels, minus 1."""
    p_hat = case.scene.p_hat
    return float(case.found.variance(p_hat).sum() / case.expected.variance(p_hat).sum() - 1)


def spread_of_confidence(case: Case) -> float:
    """(max c - min c) / max c over all outcomes: confidence must not depend on samples.  [GRIS 6.2]"""
    return largest(1 - ratio(case.found.least, case.found.largest))


def inside(look: Callable[[probe.Stage], Array]) -> Callable[[Case], Array]:
    """Something about all passes and shifts of the suspect."""
    return lambda case: np.concatenate([look(each) for each in probe.stages(case.suspect, case.scene)])


def over_the_bound(case: Case) -> float:
    """max w_i C_R / (c_i C_i) - 1, where positive: no input may weigh more than its share.  [GRIS Eq. 39, Thm. A.4]"""
    return max(0.0, float(inside(probe.bounds)(case).max()) - 1)


def sum_of_weights(case: Case) -> float:
    """sum_i m_i(y) - 1: what W_Y becomes if everybody who can offers the same y.  [GRIS Eq. 20]"""
    return largest(inside(probe.partition)(case) - 1)


def frequencies(case: Case) -> float:
    """P(s) - w_s / sum_j w_j for given inputs.  [GRIS 3.1]"""
    return largest(inside(probe.frequencies)(case))


def way_back(case: Case) -> float:
    """J of the way forth times J of the way back, minus 1; -1 where there is no way back.  [GRIS Def. 4.2]"""
    return largest(inside(probe.round_trips)(case) - 1)


def slope(case: Case) -> float:
    """J / |dT/dx| - 1, where |dT/dx| is the ratio of volumes, as finite differences would measure.  [GRIS Eq. 7]"""
    return largest(inside(probe.slopes)(case) - 1)


CHECKS: Mapping[str, Check] = MappingProxyType(
    {
        "Definition 4.1 per cell": worst_cell,
        "mean with f = 1": mean_of_one,
        "mean with f = p_hat": mean_of_target,
        "variance against the right loop": more_variance,
        "confidence independent of samples": spread_of_confidence,
        "weight bound (Theorem A.4)": over_the_bound,
        "MIS partition of unity": sum_of_weights,
        "selected index frequencies": frequencies,
        "shift round trip": way_back,
        "Jacobian by differences": slope,
    }
)
