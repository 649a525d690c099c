"""MIS weights that engines use beside those of the papers; unbiased as well, and known to the audit of dumps.

ReSTIR PT is the code that came with [GRIS].  Its pairwise weights, and those of RTXDI, multiply every
target by its confidence *inside* Eq. 37-38 and count neighbours k = M - |R| outside: the literal
reading of [GRIS 6.2].  The sum of the weights is one all the same, but an input of confidence 2 is
not two inputs any more.
"""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from restir_ref.batch import Array, ratio, total
from restir_ref.mis import CANONICAL_COVERS, WEIGHTS, Confidences, Density, Weights, constant, talbot


def counted_pairwise(i: int, q: Density, c: Confidences) -> Array:
    """Uniform pairwise MIS with D_j = C_R p_hat + k c_j q_j.  [GRIS Eq. 37, 6.2 literally]

    others:     m_i = c_i q_i / D_i
    canonical:  m_i = (c_i / k) sum_j p_hat / D_j,  and c_i / C where there are no others.
    """
    if i not in c.canonical:
        return ratio(c[i] * q(i), _pair(i, q, c))
    if not c.others:
        return constant(i, q, c)
    return np.asarray(c[i] * _share(q, c) / len(c.others))


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
    return np.asarray((ratio(c[i], c.C_R) + c[i] * _share(q, c)) / (k + 1))


def _pair(j: int, q: Density, c: Confidences) -> Array:
    """D_j = C_R p_hat + k c_j q_j."""
    return np.asarray(c.C_R * q(c.canonical[0]) + len(c.others) * c[j] * q(j))


def _share(q: Density, c: Confidences) -> Array:
    """sum_j p_hat / D_j over the inputs that are not canonical."""
    p_hat = q(c.canonical[0])
    return total([ratio(p_hat, _pair(j, q, c)) for j in c.others])


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
