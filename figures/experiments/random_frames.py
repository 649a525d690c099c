"""Random finite scenes with everything that could break a bound: zeros, holes, decades of volumes and densities."""

import numpy as np

from restir_ref.batch import Array
from restir_ref.oracle.cells import Frame, cells
from restir_ref.oracle.scenes import paired


def random_frame(n: int, K: int, rng: np.random.Generator) -> Frame:
    """n pixels of K cells, one technique each; volumes, densities, targets and f / p_hat spread over decades.

    A fifth of the densities, targets and integrands is 0, a quarter of the shifts undefined.
    """

    def decades(size: float) -> Array:
        return np.asarray(10.0 ** rng.uniform(-size, size, (n, K)))

    def with_zeros(values: Array) -> Array:
        zero = rng.random((n, K)) < 0.2
        zero[:, 0] = False
        return np.where(zero, 0.0, values)

    v, pdf, p_hat = decades(1), with_zeros(decades(1)), with_zeros(decades(1.5))
    f = p_hat * with_zeros(decades(rng.random())) * (pdf > 0)
    pdf = pdf / (pdf * v).sum(axis=-1, keepdims=True)
    maps = {(i, j): partial_injection(K, rng) for j in range(n) for i in range(j)}
    return Frame(cells(v, f, pdf[None], paired(n, K, maps), p_hat), n)


def partial_injection(K: int, rng: np.random.Generator) -> list[int]:
    """T(x), or -1 for a quarter of the cells; (K,)."""
    return [int(y) for y in np.where(rng.random(K) < 0.25, -1, rng.permutation(K))]
