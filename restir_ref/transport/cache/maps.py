"""Functions of direction as tables of texels: what a world hands in, for only it knows how to divide its directions."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from restir_ref.batch import Array, total
from restir_ref.chance import Chance


class Directions(Protocol):
    """K texels on the sphere of directions, and linear interpolation between them."""

    @property
    def K(self) -> int:
        """Number of texels."""

    def centres(self) -> Array:
        """Unit directions (d, K) for which texels hold values."""

    def fetch(self, w: Array) -> tuple[Array, Array]:
        """The J texels next to unit directions w (d, N), and their weights, which sum to 1; (J, N) each.

        Any texels will do where w = 0.
        """


@dataclass(frozen=True)
class Maps:
    """How a world divides directions: for irradiance, for depth, and into rays.

    rays(R, chance) gives R unit directions (d, R), as even as the world can, as a whole uniformly turned.
    """

    irradiance: Directions
    depth: Directions
    rays: Callable[[int, Chance], Array]


def fetched(values: Array, probe: Array, index: Array, weight: Array) -> Array:
    """sum_j weight_j values[probe, index_j]: values (C, P, K), probe (N,), index and weight (J, N) -> (C, N)."""
    flat, K = values.reshape(len(values), -1), values.shape[-1]
    return total([w * flat.take(probe * K + k, axis=-1) for k, w in zip(index, weight, strict=True)])


def gathering(maps: Directions, w: Array, exponent: int) -> tuple[Array, Array]:
    """max(0, n.w)^exponent over its sum, for texels n and rays w (d, R): (R, K); whether the sum is positive, (K,).

    Sums over even rays with these weights are integrals over the lobe around n, divided by the lobe's own.
    """
    weight = np.maximum(w.T @ maps.centres(), 0) ** exponent
    whole = weight.sum(axis=0)
    return weight / np.where(whole > 0, whole, 1), whole > 0
