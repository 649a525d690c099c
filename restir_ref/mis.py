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

    >>> import numpy as np
    >>> from restir_ref.mis import Confidences
    >>> c = Confidences([np.array([1]), np.array([20]), np.array([4])], canonical=[0])
    >>> len(c), c.C, c.C_R, c.C_N
    (3, array([25.]), array([1.]), array([24.]))
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
    """m_i = c_i / C: 1/M without confidences.  Right only where every input can realise every y.

    >>> import numpy as np
    >>> from restir_ref.mis import Confidences, constant
    >>> constant(1, lambda j: np.ones(1), Confidences([np.array([1]), np.array([3])], canonical=[0]))
    array([0.75])
    """
    return ratio(c[i], c.C)


def one_over_z(i: int, q: Density, c: Confidences) -> Array:
    """1{q_i > 0} c_i / Z, Z = sum_j c_j 1{q_j > 0}: the contribution weight of [Bitterli 2020].  [GRIS Eq. 17]

    >>> import numpy as np
    >>> from restir_ref.mis import Confidences, one_over_z
    >>> q = [np.array([0.5, 0.5]), np.array([2.0, 0.0])]
    >>> c = Confidences([np.ones(2), np.ones(2)], canonical=[0])
    >>> one_over_z(0, lambda j: q[j], c)  # the second input cannot make the second sample
    array([0.5, 1. ])
    """
    realises = [c[j] * (q(j) > 0) for j in range(len(c))]
    return ratio(realises[i], total(realises))


def talbot(i: int, q: Density, c: Confidences) -> Array:
    """m_i = c_i q_i / sum_j c_j q_j, the balance heuristic over proxy densities.  [GRIS Eq. 36]

    >>> import numpy as np
    >>> from restir_ref.mis import Confidences, talbot
    >>> q = [np.array([0.5, 0.5]), np.array([1.5, 0.0])]
    >>> c = Confidences([np.ones(2), np.ones(2)], canonical=[0])
    >>> [talbot(i, lambda j: q[j], c) for i in (0, 1)]
    [array([0.25, 1.  ]), array([0.75, 0.  ])]
    """
    shares = [c[j] * q(j) for j in range(len(c))]
    return ratio(shares[i], total(shares))


def pairwise(i: int, q: Density, c: Confidences) -> Array:
    """Uniform pairwise MIS with D_j = C_R p_hat + C_N q_j.  [GRIS Eq. 37]

    others:     m_i = c_i q_i / D_i
    canonical:  m_i = (c_i / C_N) sum_j c_j p_hat / D_j,  and c_i / C where there are no others.

    >>> import numpy as np
    >>> from restir_ref.mis import Confidences, pairwise
    >>> q = [np.array([1.0]), np.array([1.0]), np.array([0.0])]
    >>> c = Confidences([np.ones(1)] * 3, canonical=[0])
    >>> [pairwise(i, lambda j: q[j], c).round(3) for i in range(3)]
    [array([0.667]), array([0.333]), array([0.])]
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

    >>> import numpy as np
    >>> from restir_ref.mis import Confidences, defensive
    >>> q = [np.array([1.0]), np.array([1e9]), np.array([1e9])]
    >>> c = Confidences([np.ones(1)] * 3, canonical=[0])
    >>> defensive(0, lambda j: q[j], c).round(3)  # never below c_0 / C
    array([0.333])
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

    >>> from restir_ref import WEIGHTS
    >>> for name, weights in WEIGHTS.items():
    ...     print(f"{name:<9} for {weights.unbiased_for}")
    talbot    for inputs that cover supp p_hat, those of confidence 0 not counted
    pairwise  for inputs with a canonical one that covers supp p_hat
    defensive for inputs with a canonical one that covers supp p_hat
    1/Z       for inputs that cover supp p_hat, those of confidence 0 not counted
    constant  for inputs that can all realise the same samples
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
