"""MIS weights that engines use beside those of the papers; unbiased as well, and known to the audit of dumps.

ReSTIR PT is the code that came with [GRIS].  Its pairwise weights, and those of RTXDI, multiply every
target by its confidence *inside* Eq. 37-38 and count neighbours k = M - |R| outside: the literal
reading of [GRIS 6.2].  The sum of the weights is one all the same, but an input of confidence 2 is
not two inputs any more.
"""

from collections.abc import Callable, Mapping
from types import MappingProxyType

import numpy as np

from restir_ref.batch import Array, ratio, total
from restir_ref.mis import CANONICAL_COVERS, WEIGHTS, Confidences, Density, Mis, Weights, constant, talbot


def asked_pairwise(k: float) -> Mis:
    """Uniform pairwise MIS whose D_j = C_R p_hat + k c_j q_j counts the k neighbours that were *asked for*.

    Of them n are there, and n divides: others m_i = (k / n) c_i q_i / D_i, canonical m_i = (c_i / n) sum_j p_hat / D_j.
    """

    def m(i: int, q: Density, c: Confidences) -> Array:
        n = len(c.others)
        if i not in c.canonical:
            return np.asarray(k / n * ratio(c[i] * q(i), _pair(i, q, c, k)))
        return np.asarray(c[i] * _share(q, c, k) / n) if n else constant(i, q, c)

    return m


def asked_defensive(k: float, divisor: float | None = None) -> Mis:
    """Defensive pairwise MIS that counts the k neighbours asked for in D_j and divides by n + 1, n those accepted.

    It is unbiased; with the divisor k + 1 it is not.
    """

    def m(i: int, q: Density, c: Confidences) -> Array:
        n = len(c.others)
        by = n + 1 if divisor is None else divisor
        if i not in c.canonical:
            return np.asarray(k / by * ratio(c[i] * q(i), _pair(i, q, c, k)))
        return np.asarray((ratio(c[i], c.C_R) + c[i] * _share(q, c, k)) / by) if n else constant(i, q, c)

    return m


def counted_pairwise(i: int, q: Density, c: Confidences) -> Array:
    """Uniform pairwise MIS with D_j = C_R p_hat + k c_j q_j.  [GRIS Eq. 37, 6.2 literally]

    others:     m_i = c_i q_i / D_i
    canonical:  m_i = (c_i / k) sum_j p_hat / D_j,  and c_i / C where there are no others.
    """
    if i not in c.canonical:
        return ratio(c[i] * q(i), _pair(i, q, c, len(c.others)))
    if not c.others:
        return constant(i, q, c)
    return np.asarray(c[i] * _share(q, c, len(c.others)) / len(c.others))


def counted_defensive(i: int, q: Density, c: Confidences) -> Array:
    """Defensive pairwise MIS with D_j = C_R p_hat + k c_j q_j.  [GRIS Eq. 38, 6.2 literally]

    others:     m_i = k / (k + 1) c_i q_i / D_i
    canonical:  m_i = 1 / (k + 1) (c_i / C_R + c_i sum_j p_hat / D_j)
    """
    k = len(c.others)
    if i not in c.canonical:
        return np.asarray(k / (k + 1) * counted_pairwise(i, q, c))
    if not c.others:
        return constant(i, q, c)
    return np.asarray((ratio(c[i], c.C_R) + c[i] * _share(q, c, k)) / (k + 1))


def _pair(j: int, q: Density, c: Confidences, k: float) -> Array:
    """D_j = C_R p_hat + k c_j q_j."""
    return np.asarray(c.C_R * q(c.canonical[0]) + k * c[j] * q(j))


def _share(q: Density, c: Confidences, k: float) -> Array:
    """sum_j p_hat / D_j over the inputs that are not canonical."""
    p_hat = q(c.canonical[0])
    return total([ratio(p_hat, _pair(j, q, c, k)) for j in c.others])


ENGINES: Mapping[str, Weights] = MappingProxyType(
    {
        "constant, talbot": Weights(constant, talbot),
        "counted pairwise": Weights(counted_pairwise, unbiased_for=CANONICAL_COVERS),
        "counted defensive": Weights(counted_defensive, unbiased_for=CANONICAL_COVERS),
    }
)
"""By name: selected by confidence and corrected to Talbot (RTXDI basic and ray traced, ReSTIR PT constant),
RTXDI pairwise, ReSTIR PT pairwise; the last one with one canonical input."""

KNOWN: Mapping[str, Weights] = MappingProxyType({**WEIGHTS, **ENGINES})
"""Weights a dump can name."""

ASKED: Mapping[str, Callable[[float], Mis]] = MappingProxyType(
    {"counted pairwise": asked_pairwise, "counted defensive": asked_defensive}
)
"""Weights that can count the neighbours asked for: k of a dump."""
