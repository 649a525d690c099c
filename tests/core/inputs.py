"""Random inputs of a pass as its MIS weights see them: densities, confidences, and who is canonical."""

from collections.abc import Callable, Sequence
from fractions import Fraction
from typing import NamedTuple

import numpy as np
from hypothesis import strategies as st

from restir_ref.batch import Array
from restir_ref.mis import ALL_CANONICAL, ANY, CANONICAL_COVERS, Confidences, Mis


class Inputs(NamedTuple):
    """q[i] = p_hat_from_i(y) (M, N) at N places y, confidences c (M, N), and the canonical inputs."""

    q: Array
    c: Array
    canonical: Sequence[int]

    @property
    def M(self) -> int:
        return len(self.q)

    @property
    def others(self) -> Sequence[int]:
        return [i for i in range(self.M) if i not in self.canonical]

    @property
    def p_hat(self) -> Array:
        """p_hat(y), which is the density of every canonical input."""
        return self.q[self.canonical[0]]


fractions: Callable[[Array], Array] = np.vectorize(Fraction, otypes=[object])


def exactly(inputs: Inputs) -> Inputs:
    """The same inputs in rational numbers."""
    return Inputs(fractions(inputs.q), fractions(inputs.c), inputs.canonical)


def weights(m: Mis, inputs: Inputs) -> Array:
    """m_i(y) of all inputs, (M, N)."""
    c = Confidences(list(inputs.c), inputs.canonical)
    return np.stack(np.broadcast_arrays(*(m(i, inputs.q.__getitem__, c) for i in range(inputs.M))))


def drawn(M: int, R: int, seed: int, columns: int) -> Inputs:
    """Densities over 6 decades with 20% zeros, R canonical ones with p_hat > 0, confidences over 3 decades.

    One input in ten that is not canonical has confidence 0: it is not there.
    """
    rng = np.random.default_rng(seed)
    q = 10.0 ** rng.uniform(-3, 3, (M, columns)) * (rng.random((M, columns)) >= 0.2)
    c = 10.0 ** rng.uniform(-1, 2, (M, columns))
    canonical = sorted(rng.permutation(M)[:R].tolist())
    q[canonical] = 10.0 ** rng.uniform(-3, 3, columns)
    others = [i for i in range(M) if i not in canonical]
    c[others] *= rng.random((len(others), columns)) >= 0.1
    return Inputs(q, c, canonical)


@st.composite
def inputs(draw: st.DrawFn, promise: str = CANONICAL_COVERS, columns: int = 200) -> Inputs:
    """Inputs for which weights of this promise are right."""
    M = draw(st.integers(2, 9))
    fewest = {ANY: 0, CANONICAL_COVERS: 1, ALL_CANONICAL: M}[promise]
    R = draw(st.integers(fewest, M))
    return drawn(M, R, draw(st.integers(0, 2**32 - 1)), columns)


@st.composite
def mixed(draw: st.DrawFn, columns: int = 3) -> Inputs:
    """Inputs of which some are canonical and some are not."""
    M = draw(st.integers(2, 9))
    R = draw(st.integers(1, M - 1))
    return drawn(M, R, draw(st.integers(0, 2**32 - 1)), columns)
