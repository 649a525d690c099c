"""The few vector operations there are; vectors are (d, N), scalars (N,)."""

import numpy as np

from restir_ref.batch import Array


def dot(a: Array, b: Array) -> Array:
    """a . b over the first axis, (N,)."""
    return np.asarray(np.einsum("dn,dn->n", a, b))


def norm(a: Array) -> Array:
    """|a|, (N,)."""
    return np.sqrt(dot(a, a))


def normalize(a: Array) -> Array:
    """a / |a|; a must not be 0."""
    return a / norm(a)


def reflect(w: Array, m: Array) -> Array:
    """w mirrored at the normal m: 2 (w . m) m - w."""
    return 2 * dot(w, m) * m - w
