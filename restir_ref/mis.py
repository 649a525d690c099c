"""Resampling MIS weights m_i(y) and contribution MIS weights c_i(y).  [GRIS 5.6, 6.2]

Each weight is a pure function of its input's number i, of densities q(j) = p_hat_from_j(y) that
are only shifted when asked for, and of the confidences.  Everywhere 0/0 = 0.

# erratum: [GRIS 6.2] has confidences enter by multiplying p_hat and p_hat_from by c inside Eq. 37-38.
# That is unbiased, but c_i is then not c_i identical copies (equal domains do not give c_i / C).
# Here it is: |R| becomes C_R, M - |R| becomes C_N, and every term of a sum counts c_j times.
# erratum: Eq. 37 is 0/0 where all inputs are canonical; its limit is c_i / C.

`WEIGHTS` is the public family; tests, figures and the oracle iterate over it.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType

import numpy as np

from restir_ref.batch import Array, ratio, total
from restir_ref.integrals import Proxy, target

Density = Callable[[int], Array]


@dataclass(frozen=True)
class Confidences:
    """Confidences c[j] of all inputs, each (N,), and which of the inputs are canonical.

    Engines count in bytes, whose sums and products wrap: what is read from here is a float, or exact.
    """

    c: Sequence[Array]
    canonical: Sequence[int]

    def __getitem__(self, j: int) -> Array:
        return self._numbers[j]

    def __len__(self) -> int:
        return len(self.c)

    @cached_property
    def _numbers(self) -> Sequence[Array]:
        return [each.astype(np.result_type(each, float), copy=False) for each in self.c]

    @cached_property
    def others(self) -> Sequence[int]:
        """The inputs that are not canonical."""
        return [j for j in range(len(self)) if j not in self.canonical]

    @cached_property
    def C(self) -> Array:
        """Confidence of all inputs together."""
        return total(self._numbers)

    @cached_property
    def C_R(self) -> Array:
        """Confidence of the canonical inputs; without confidences this is |R|."""
        return total([self[j] for j in self.canonical])

    @cached_property
    def C_N(self) -> Array:
        """Confidence of the others; without confidences this is M - |R|."""
        return total([self[j] for j in self.others])


Mis = Callable[[int, Density, Confidences], Array]


def constant(i: int, q: Density, c: Confidences) -> Array:
    """m_i = c_i / C: 1/M without confidences.  Right only where every input can realise every y."""
    return ratio(c[i], c.C)


def one_over_z(i: int, q: Density, c: Confidences) -> Array:
    """1{q_i > 0} c_i / Z, Z = sum_j c_j 1{q_j > 0}: the contribution weight of [Bitterli 2020].  [GRIS Eq. 17]"""
    realises = [c[j] * (q(j) > 0) for j in range(len(c))]
    return ratio(realises[i], total(realises))


def talbot(i: int, q: Density, c: Confidences) -> Array:
    """m_i = c_i q_i / sum_j c_j q_j, the balance heuristic over proxy densities.  [GRIS Eq. 36]"""
    shares = [c[j] * q(j) for j in range(len(c))]
    return ratio(shares[i], total(shares))


def pairwise(i: int, q: Density, c: Confidences) -> Array:
    """Uniform pairwise MIS with D_j = C_R p_hat + C_N q_j.  [GRIS Eq. 37]

    others:     m_i = c_i q_i / D_i
    canonical:  m_i = (c_i / C_N) sum_j c_j p_hat / D_j,  and c_i / C where there are no others.
    """
    if i not in c.canonical:
        return ratio(c[i] * q(i), _pair(i, q, c))
    if not c.others:
        return constant(i, q, c)
    return np.where(c.C_N > 0, ratio(c[i] * _canonical_share(q, c), c.C_N), constant(i, q, c))


def defensive(i: int, q: Density, c: Confidences) -> Array:
    """Defensive pairwise MIS: canonical samples never get less than c_i / C.  [GRIS Eq. 38]

    others:     m_i = (C_N / C) c_i q_i / D_i
    canonical:  m_i = (c_i / C) (1 + sum_j c_j p_hat / D_j)
    """
    if i not in c.canonical:
        return ratio(c.C_N * c[i] * q(i), c.C * _pair(i, q, c))
    if not c.others:
        return constant(i, q, c)
    return ratio(c[i] * (1 + _canonical_share(q, c)), c.C)


def _pair(j: int, q: Density, c: Confidences) -> Array:
    """D_j = C_R p_hat + C_N q_j."""
    return np.asarray(c.C_R * q(c.canonical[0]) + c.C_N * q(j))


def _canonical_share(q: Density, c: Confidences) -> Array:
    """sum_j c_j p_hat / D_j over the inputs that are not canonical."""
    p_hat = q(c.canonical[0])
    return total([ratio(c[j] * p_hat, _pair(j, q, c)) for j in c.others])


ANY = "inputs that cover supp p_hat, those of confidence 0 not counted"
CANONICAL_COVERS = "inputs with a canonical one that covers supp p_hat"
ALL_CANONICAL = "inputs that can all realise the same samples"


@dataclass(frozen=True)
class Weights:
    """Resampling weights m_i with the contribution weights c_i that go with them.  [GRIS Eq. 16-21]

    `c` is None where c_i = m_i.  `unbiased_for` says for which inputs the pair is exactly unbiased:
    what only a sample of confidence 0 could realise is lost, as if its input were not there.
    `proxy` is the density that q compares: p_hat, or `pdf` where all inputs have known densities
    [GRIS 5.6, tractable PDFs].
    """

    m: Mis
    c: Mis | None = None
    unbiased_for: str = ANY
    proxy: Proxy = target


WEIGHTS: Mapping[str, Weights] = MappingProxyType(
    {
        "talbot": Weights(talbot),
        "pairwise": Weights(pairwise, unbiased_for=CANONICAL_COVERS),
        "defensive": Weights(defensive, unbiased_for=CANONICAL_COVERS),
        "1/Z": Weights(constant, one_over_z),
        "constant": Weights(constant, unbiased_for=ALL_CANONICAL),
    }
)
